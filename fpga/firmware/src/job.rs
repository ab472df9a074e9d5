//! The work itself, the same on every machine.

use core::fmt;

use xylem_core::compress::compress_top_down;
use xylem_core::emit::Cell;
use xylem_core::error::BuildError;
use xylem_core::geom::{Ray, RayError};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::pipeline::{self, BuildConfig, TreeStorage};
use xylem_core::probe::{Probe, Stage};
use xylem_core::sort::{InputFormat, SortBuffers, Workspace};
use xylem_core::toplevel::{TopNode, TopStorage};
use xylem_core::traverse::{self, Hit, Scene, TraceError};

use crate::blob::{Blob, BlobError, Header};
use crate::digest;
use crate::layout::Layout;
use crate::report::{OutputDigest, Report, STAGES};

/// The most cells that the top of a tree can be built over here: as many as the sorter has records,
/// which is P2's proportion.
pub const MAX_CELLS: usize = 2048;

/// The builder's on-chip storage, 300 KB: for the sorter 2048 records and merges of 256 runs, for
/// the top of the tree [`MAX_CELLS`] and as many nodes.
#[derive(Debug)]
pub struct Buffers {
    sort: SortBuffers<2048, 256>,
    cells: [Cell; MAX_CELLS],
    top_nodes: [TopNode; MAX_CELLS],
}

impl Buffers {
    /// Empty buffers.
    pub const fn new() -> Self {
        Self {
            sort: SortBuffers::new(),
            cells: [Cell::EMPTY; MAX_CELLS],
            top_nodes: [TopNode::EMPTY; MAX_CELLS],
        }
    }

    /// The buffers as the builder wants them.
    fn parts(&mut self) -> (Workspace<'_>, TreeStorage<'_>) {
        let Self { sort, cells, top_nodes } = self;
        let top = TopStorage { cells, nodes: top_nodes };
        (sort.workspace(), TreeStorage { top, held: &mut [] })
    }
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

/// A cycle counter.
pub trait Clock {
    /// Cycles since some fixed moment.
    fn cycles(&mut self) -> u64;
}

/// The clock of a machine without one: it stands still, and every stage takes 0 cycles.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    fn cycles(&mut self) -> u64 {
        0
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
    /// The tree could not be built or compressed.
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

/// Builds, compresses and traces the scene blob at the start of `memory`, and digests every output.
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
) -> Result<Report, JobError<B::Error>> {
    let blob = Blob::parse(bus, memory).map_err(JobError::Blob)?;
    let config = build_config(&blob.header);
    let (workspace, top) = &mut buffers.parts();
    // The layout divides by these.
    let checked = config.sort.check().and_then(|()| config.sort.check_storage(workspace));
    checked.map_err(|error| JobError::Build(error.into()))?;
    let layout = Layout::new(&blob, &config)
        .map_err(|needed| JobError::WorkSpace { needed, size: blob.work.size })?;
    let count = blob.header.triangles;
    let mut stages = StageCycles::new(clock);

    let built =
        pipeline::build_with(bus, &config, &layout.build, count, workspace, top, &mut stages);
    let exact = built.map_err(JobError::Build)?;
    stages.stage(Stage::Compress);
    let quantization = match blob.header.format {
        // The blob's header has no name for shared planes.
        NodeFormat::Bvh2 | NodeFormat::Shared(_) => Quantization::RELATIVE,
        NodeFormat::Quantized(quantization) => quantization,
    };
    let quantized =
        compress_top_down(bus, &exact, layout.quantized_nodes, &quantization, &mut stages)
            .map_err(JobError::Build)?;

    stages.stage(Stage::Trace);
    let tree = if blob.header.format == NodeFormat::Bvh2 { exact } else { quantized };
    let scene = Scene { tree, triangles: blob.triangles, triangle_count: count };
    let hits = trace(bus, &blob, &scene, layout.hits)?;

    let mut report = Report {
        primitives: count,
        leaves: exact.leaf_count,
        nodes: exact.node_count,
        cells: stages.cells,
        rays: blob.header.rays,
        hits,
        cycles: stages.finish(),
        ..Report::default()
    };
    for (output, region) in report.outputs.iter_mut().zip(layout.outputs(&exact)) {
        let crc = digest::of_region(bus, region).map_err(JobError::Bus)?;
        *output = OutputDigest { bytes: region.size, crc };
    }
    Ok(report)
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

/// Traces all rays of the blob and writes their hit records; returns how many hit.
fn trace<B: Bus>(
    bus: &mut B,
    blob: &Blob,
    scene: &Scene,
    hits: Region,
) -> Result<u32, JobError<B::Error>> {
    let mut count = 0;
    for index in 0..blob.header.rays {
        // Both regions were made for this many records.
        let (Some(from), Some(to)) =
            (blob.rays.record(index, Ray::BYTES as u32), hits.record(index, Hit::BYTES as u32))
        else {
            break;
        };
        let mut bytes = [0; Ray::BYTES];
        bus.read(from, &mut bytes).map_err(JobError::Bus)?;
        let ray = Ray::from_bytes(&bytes).map_err(|error| JobError::Ray { index, error })?;
        let hit = traverse::trace(bus, scene, &ray, blob.header.query, &mut ())
            .map_err(|error| JobError::Trace { index, error })?;
        count += u32::from(hit.is_some());
        bus.write(to, &Hit::to_bytes(hit.as_ref())).map_err(JobError::Bus)?;
    }
    Ok(count)
}

/// Adds up the cycles of each stage as stages begin and resume, and counts cells.
///
/// Every change of stage reads the clock, which takes its own few cycles (some 60 on PicoRV32);
/// they count for the stages around it. Merging and emission alternate with every primitive.
struct StageCycles<'a, C> {
    clock: &'a mut C,
    since: u64,
    current: Option<Stage>,
    cycles: [u64; STAGES.len()],
    cells: u32,
}

impl<'a, C: Clock> StageCycles<'a, C> {
    fn new(clock: &'a mut C) -> Self {
        let since = clock.cycles();
        Self { clock, since, current: None, cycles: [0; STAGES.len()], cells: 0 }
    }

    /// Ends the stage under way.
    fn lap(&mut self) {
        let now = self.clock.cycles();
        let slot = self.current.and_then(|stage| STAGES.iter().position(|s| *s == stage));
        if let Some(cycles) = slot.and_then(|slot| self.cycles.get_mut(slot)) {
            *cycles += now.wrapping_sub(self.since);
        }
        self.since = now;
    }

    fn finish(mut self) -> [u64; STAGES.len()] {
        self.lap();
        self.cycles
    }
}

impl<C: Clock> Probe for StageCycles<'_, C> {
    fn stage(&mut self, stage: Stage) {
        self.lap();
        self.current = Some(stage);
    }

    fn top_cell(&mut self) {
        self.cells += 1;
    }

    fn top_coarsen(&mut self, cells: usize) {
        // They come out anew, and fewer.
        self.cells = self.cells.saturating_sub(cells as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Ticks(u64);

    impl Clock for Ticks {
        fn cycles(&mut self) -> u64 {
            self.0 += 10;
            self.0
        }
    }

    #[test]
    fn cycles_are_filed_by_stage_and_time_before_the_first_is_nobody_s() {
        let mut clock = Ticks(0);
        let mut stages = StageCycles::new(&mut clock);
        for stage in [Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::Merge, Stage::Trace] {
            stages.stage(stage);
        }
        assert_eq!(stages.finish(), [10, 20, 10, 0, 0, 10]);
    }
}
