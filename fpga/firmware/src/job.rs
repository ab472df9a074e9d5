//! The work itself, the same on every machine.

use core::fmt;

use xylem_core::compress::{Compression, Compressor, HeldNode, Place, compress_top_down};
use xylem_core::emit::Cell;
use xylem_core::error::BuildError;
use xylem_core::geom::{Ray, RayError};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{Bvh2Node, Bvh2View, NodeFormat, NodeIndex, Quantization, Tree};
use xylem_core::pipeline::{self, BuildConfig, BuildRegions, TreeStorage};
use xylem_core::probe::{Probe, Stage};
use xylem_core::sort::{InputFormat, SortBuffers, Workspace};
use xylem_core::toplevel::{TopNode, TopStorage};
use xylem_core::traverse::{self, Hit, Scene, TraceError};

use crate::animation::{self, FrameReport};
use crate::blob::{Blob, BlobError, Header};
use crate::digest;
use crate::layout::Layout;
use crate::report::{OUTPUTS, OutputDigest, Report};
use crate::stages::StageCycles;
pub use crate::stages::{Clock, NoClock};

/// The most cells that the top of a tree can be built over here: as many as the sorter has records,
/// which is P2's proportion.
pub const MAX_CELLS: usize = 2048;

/// The builder's on-chip storage, 300 KB: for the sorter 2048 records and merges of 256 runs, for
/// the top of the tree [`MAX_CELLS`] and as many nodes, for the compressor treelets of
/// [`Header::MAX_TREELET_DEPTH`].
#[derive(Debug)]
pub struct Buffers {
    sort: SortBuffers<2048, 256>,
    cells: [Cell; MAX_CELLS],
    top_nodes: [TopNode; MAX_CELLS],
    held: [HeldNode; HELD],
}

/// What the streaming compressor holds of the deepest treelets.
const HELD: usize =
    Compression { treelet_depth: Header::MAX_TREELET_DEPTH, ..Compression::DEFAULT }.held_nodes();

impl Buffers {
    /// Empty buffers.
    pub const fn new() -> Self {
        Self {
            sort: SortBuffers::new(),
            cells: [Cell::EMPTY; MAX_CELLS],
            top_nodes: [TopNode::EMPTY; MAX_CELLS],
            held: [HeldNode::EMPTY; HELD],
        }
    }

    /// The buffers as the builder wants them.
    fn parts(&mut self) -> (Workspace<'_>, TreeStorage<'_>) {
        let Self { sort, cells, top_nodes, .. } = self;
        let top = TopStorage { cells, nodes: top_nodes };
        (sort.workspace(), TreeStorage { top, held: &mut [], open: &mut [] })
    }
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

/// Why the job stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
#[non_exhaustive]
pub enum JobError<E> {
    /// Memory holds no usable scene.
    Blob(BlobError<E>),
    /// The memory behind the blob is too small for what the job writes.
    WorkSpace {
        /// Bytes that are needed, at most `u32::MAX`.
        needed: u32,
        /// Bytes that there are.
        size: u32,
    },
    /// The tree could not be built, refitted or compressed.
    Build(BuildError<E>),
    /// A ray record is not a ray.
    Ray {
        /// Its position in the blob.
        index: u32,
        /// What is wrong with it.
        error: RayError,
    },
    /// A ray could not be traced.
    Trace {
        /// Its position in the blob.
        index: u32,
        /// Why.
        error: TraceError<E>,
    },
    /// The bus failed outside building and tracing.
    Bus(E),
}

impl<E: fmt::Debug> fmt::Display for JobError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Blob(error) => write!(f, "{error}"),
            Self::WorkSpace { needed, size } => write!(
                f,
                "{needed} bytes are needed behind the scene, memory has {size}; use a smaller scene"
            ),
            Self::Build(error) => write!(f, "{error}"),
            Self::Ray { index, error } => write!(f, "ray {index} of the scene blob: {error}"),
            Self::Trace { index, error } => write!(f, "ray {index}: {error}"),
            Self::Bus(error) => write!(f, "bus error: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for JobError<E> {}

/// What a run of the job leaves: the report, and what is where in memory.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Finished {
    /// The report.
    pub report: Report,
    /// The scene.
    pub blob: Blob,
    /// Where the outputs are.
    pub layout: Layout,
    /// The tree of 64-byte nodes; of an animation, the last.
    pub exact: Tree,
    /// The tree that rays were traced through.
    pub traced: Tree,
}

/// Builds, compresses and traces the scene blob at the start of `memory`, and digests every output. If
/// the scene is animated, does it frame by frame, see [`animation`], and tells
/// `observer` of each.
///
/// Outputs go to the memory behind the blob, see [`Layout`], and stay there.
///
/// # Errors
/// [`JobError`]; outputs of earlier stages are in memory then.
pub fn run<B: Bus, C: Clock>(
    bus: &mut B,
    memory: Region,
    buffers: &mut Buffers,
    clock: &mut C,
    observer: &mut impl FnMut(&FrameReport),
) -> Result<Finished, JobError<B::Error>> {
    let plan = Plan::new(bus, memory, buffers)?;
    let mut stages = StageCycles::new(clock);
    if let Some(animation) = plan.blob.header.animation {
        return animation::run(bus, &plan, &animation, buffers, &mut stages, observer);
    }
    let exact = plan.build(bus, plan.blob.triangles, buffers, &mut stages)?;
    let quantized = plan.compress(bus, &exact, buffers, &mut stages)?;
    let tree = if plan.blob.header.format == NodeFormat::Bvh2 { exact } else { quantized };
    let hits = plan.trace(bus, &tree, plan.blob.triangles, &mut stages)?;
    let cycles = stages.take();
    let outputs = plan.digest(bus, plan.layout.outputs(&exact))?;
    let report = Report { hits, cycles, outputs, ..plan.report(&exact, stages.cells) };
    Ok(plan.finished(report, exact, tree))
}

/// What is to be done, and where.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    pub blob: Blob,
    pub layout: Layout,
    config: BuildConfig,
}

impl Plan {
    fn new<B: Bus>(
        bus: &mut B,
        memory: Region,
        buffers: &mut Buffers,
    ) -> Result<Self, JobError<B::Error>> {
        let blob = Blob::parse(bus, memory).map_err(JobError::Blob)?;
        let config = build_config(&blob.header);
        let (workspace, _) = buffers.parts();
        // The layout divides by these.
        let checked = config.sort.check().and_then(|()| config.sort.check_storage(&workspace));
        checked.map_err(|error| JobError::Build(error.into()))?;
        let layout = Layout::new(&blob, &config)
            .map_err(|needed| JobError::WorkSpace { needed, size: blob.work.size })?;
        Ok(Self { blob, layout, config })
    }

    /// Builds the tree of 64-byte nodes over `triangles`.
    pub fn build<B: Bus, C: Clock>(
        &self,
        bus: &mut B,
        triangles: Region,
        buffers: &mut Buffers,
        stages: &mut StageCycles<'_, C>,
    ) -> Result<Tree, JobError<B::Error>> {
        let (workspace, top) = &mut buffers.parts();
        let regions = BuildRegions { primitives: triangles, ..self.layout.build };
        let count = self.blob.header.triangles;
        stages.cells = 0;
        pipeline::build_with(bus, &self.config, &regions, count, workspace, top, stages)
            .map_err(JobError::Build)
    }

    /// Writes the quantized nodes of a tree.
    pub fn compress<B: Bus, C: Clock>(
        &self,
        bus: &mut B,
        exact: &Tree,
        buffers: &mut Buffers,
        stages: &mut StageCycles<'_, C>,
    ) -> Result<Tree, JobError<B::Error>> {
        stages.stage(Stage::Compress);
        let quantization = match self.blob.header.format {
            NodeFormat::Quantized(quantization) => quantization,
            // The blob's header has no name for shared planes.
            NodeFormat::Bvh2 | NodeFormat::Wide(_) | NodeFormat::Shared(_) => {
                Quantization::RELATIVE
            }
        };
        let target = self.layout.quantized_nodes;
        match self.blob.header.treelet_depth {
            0 => compress_top_down(bus, exact, target, &quantization, stages),
            treelet_depth => {
                let compression =
                    Compression { quantization, treelet_depth, ..Compression::DEFAULT };
                compress_as_emitted(bus, exact, target, compression, &mut buffers.held)
            }
        }
        .map_err(JobError::Build)
    }

    /// Traces all rays of the blob and writes their hit records; returns how many hit.
    pub fn trace<B: Bus, C: Clock>(
        &self,
        bus: &mut B,
        tree: &Tree,
        triangles: Region,
        stages: &mut StageCycles<'_, C>,
    ) -> Result<u32, JobError<B::Error>> {
        stages.stage(Stage::Trace);
        let Header { triangles: triangle_count, rays, query, .. } = self.blob.header;
        let scene = Scene { tree: *tree, triangles, triangle_count };
        let mut count = 0;
        for index in 0..rays {
            // Both regions were made for this many records.
            let (Some(from), Some(to)) = (
                self.blob.rays.record(index, Ray::BYTES as u32),
                self.layout.hits.record(index, Hit::BYTES as u32),
            ) else {
                break;
            };
            let mut bytes = [0; Ray::BYTES];
            bus.read(from, &mut bytes).map_err(JobError::Bus)?;
            let ray = Ray::from_bytes(&bytes).map_err(|error| JobError::Ray { index, error })?;
            let hit = traverse::trace(bus, &scene, &ray, query, &mut ())
                .map_err(|error| JobError::Trace { index, error })?;
            count += u32::from(hit.is_some());
            bus.write(to, &Hit::to_bytes(hit.as_ref())).map_err(JobError::Bus)?;
        }
        Ok(count)
    }

    /// Digests the outputs where they are.
    pub fn digest<B: Bus>(
        &self,
        bus: &mut B,
        regions: [Region; OUTPUTS.len()],
    ) -> Result<[OutputDigest; OUTPUTS.len()], JobError<B::Error>> {
        let mut outputs = [OutputDigest::default(); OUTPUTS.len()];
        for (output, region) in outputs.iter_mut().zip(regions) {
            let crc = digest::of_region(bus, region).map_err(JobError::Bus)?;
            *output = OutputDigest { bytes: region.size, crc };
        }
        Ok(outputs)
    }

    /// What there is at the end.
    pub fn finished(&self, report: Report, exact: Tree, traced: Tree) -> Finished {
        Finished { report, blob: self.blob, layout: self.layout, exact, traced }
    }

    /// A report with the counts of a tree.
    pub fn report(&self, tree: &Tree, cells: u32) -> Report {
        Report {
            primitives: self.blob.header.triangles,
            leaves: tree.leaf_count,
            nodes: tree.node_count,
            cells,
            rays: self.blob.header.rays,
            ..Report::default()
        }
    }
}

/// Writes the quantized nodes that a build would write which compresses what it emits: nodes are in memory
/// in the order in which they were emitted.
fn compress_as_emitted<B: Bus>(
    bus: &mut B,
    exact: &Tree,
    target: Region,
    compression: Compression,
    held: &mut [HeldNode],
) -> Result<Tree, BuildError<B::Error>> {
    compression.check()?;
    let mut compressor = Compressor::new(compression, target, held);
    for index in 0..exact.node_count {
        let corrupt = BuildError::CorruptNode { index };
        let addr = exact.nodes.record(index, Bvh2Node::BYTES as u32).ok_or(corrupt)?;
        let mut bytes = [0; Bvh2Node::BYTES];
        let stage = Stage::Compress;
        bus.read(addr, &mut bytes).map_err(|error| BuildError::Bus { stage, addr, error })?;
        let node = Bvh2View::new(&bytes).to_repr().ok_or(corrupt)?;
        compressor.accept(bus, &node, NodeIndex(index), Place::Next, &mut ())?;
    }
    compressor.finish(bus, exact.root.as_ref(), &mut ())?;
    let format = NodeFormat::Quantized(compression.quantization);
    Ok(Tree { format, nodes: target, ..*exact })
}

/// The builder's configuration that a blob asks for.
fn build_config(header: &Header) -> BuildConfig {
    BuildConfig {
        grid: header.grid,
        morton: header.morton,
        input: InputFormat::Triangle40,
        sort: header.sort,
        max_leaf_size: header.max_leaf_size,
        join_leaves: header.join_leaves,
        top_level: header.top_level,
        cells: header.cells,
        ..BuildConfig::default()
    }
}
