//! Builds and compressions, measured.

use std::time::{Duration, Instant};

use heapless::Vec as FixedVec;
use xylem_core::compress::{HeldNode, OpenWide, compress_top_down};
use xylem_core::emit::Cell;
use xylem_core::error::{BuildError, ConfigError};
use xylem_core::geom::Triangle;
use xylem_core::mem::{Bus, ByteAddr};
use xylem_core::node::{NodeFormat, Tree};
use xylem_core::pipeline::{self, BuildConfig, TreeStorage};
use xylem_core::probe::Probe;
use xylem_core::quality::{self, Malformed, Quality};
use xylem_core::sort::{HeapEntry, InputFormat, Item, Queue, Workspace};
use xylem_core::toplevel::{TopLevel, TopNode, TopStorage};
use xylem_core::traverse::Scene;

use super::watch::BuildWatch;
use super::{ClockedRun, Layout};
use crate::bus::{FlatMemory, MEMORIES, MemoryError, MemoryTiming, Metered, StageClock, Traffic};
use crate::machine::compressor::CompressorEvents;
use crate::machine::config::MachineConfig;
use crate::machine::mergetree::MachineError;
use crate::machine::toplevel::TopEvents;

/// What to build.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuildOptions {
    /// The builder's configuration; with a compression in it, nodes are compressed as they come.
    pub config: BuildConfig,
    /// The format that is traced in the end: that of the builder, or quantized by a separate pass from
    /// the top down.
    pub format: NodeFormat,
    /// The memory whose time is modelled.
    pub memory: MemoryTiming,
    /// The machine that builds on the clock, with its `build` ignored for `config`; none for the
    /// function alone.
    pub machine: Option<MachineConfig>,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            config: BuildConfig::default(),
            format: NodeFormat::Bvh2,
            memory: MEMORIES[1],
            machine: None,
        }
    }
}

/// A finished build with everything that was measured.
#[derive(Debug)]
pub struct BuildRun {
    /// Memory with all regions.
    pub memory: FlatMemory,
    /// Where things are in it.
    pub layout: Layout,
    /// The tree in the requested format and the triangles.
    pub scene: Scene,
    /// The tree of 64-byte nodes (the same one if that was requested), if there was one.
    pub exact: Option<Scene>,
    /// Traffic by stage and region.
    pub traffic: Traffic,
    /// What the top-level builder did.
    pub top: TopEvents,
    /// What the streaming compressor did.
    pub compressor: CompressorEvents,
    /// How long the host took for building and compressing, measured; with a machine, how long it
    /// simulated.
    pub host_time: Duration,
    /// The clock's side of it, if a machine built.
    pub clocked: Option<ClockedRun>,
}

/// Why a run stopped.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RunError {
    /// The scene needs more memory than addresses reach.
    #[error("scene needs {0} bytes of memory; addresses reach 4294967295. Use a smaller scene")]
    TooLarge(u64),
    /// The core reported an error.
    #[error("{0}")]
    Build(#[from] BuildError<MemoryError>),
    /// The machine reported an error.
    #[error("{0}")]
    Machine(#[from] MachineError),
    /// The tree is not well formed; a defect.
    #[error("the tree is not well formed: {0:?} (a defect of the builder)")]
    Malformed(Malformed<MemoryError>),
}

/// Loads the triangles into fresh memory, builds their tree, and compresses it if asked to.
///
/// # Errors
/// [`RunError`], where the scene is too large or the core refuses it.
pub fn build(triangles: &[Triangle], options: &BuildOptions) -> Result<BuildRun, RunError> {
    if let Some(machine) = &options.machine {
        return clocked(triangles, options, machine);
    }
    let (memory, layout) = load(triangles, &options.config)?;
    let mut buffers = Buffers::new(&options.config);
    let stage = StageClock::default();
    let mut bus = Metered::new(memory, &stage, &layout.named(), options.memory);
    let start = Instant::now();
    let count = triangles.len() as u32;
    let mut watch = BuildWatch::new(&stage);
    let (tree, exact) = job(&mut bus, &layout, options, count, &mut buffers, &mut watch)?;
    let host_time = start.elapsed();
    let (top, compressor) = (watch.top, watch.compressor);
    let traffic = bus.traffic();
    let scene = |tree| Scene { tree, triangles: layout.triangles, triangle_count: count };
    let (scene, exact) = (scene(tree), exact.map(scene));
    let memory = bus.into_inner();
    let clocked = None;
    Ok(BuildRun { memory, layout, scene, exact, traffic, top, compressor, host_time, clocked })
}

/// The same on the clock.
fn clocked(
    triangles: &[Triangle],
    options: &BuildOptions,
    machine: &MachineConfig,
) -> Result<BuildRun, RunError> {
    let machine = MachineConfig { build: options.config, ..*machine };
    machine.check().map_err(MachineError::from)?;
    let (mut memory, layout) = load(triangles, &machine.runs())?;
    let count = triangles.len() as u32;
    let clocked = super::clocked::run(
        &machine,
        &mut memory,
        &layout,
        count,
        options.format,
        &options.memory,
    )?;
    let tree = clocked.machine.tree;
    let scene = Scene { tree, triangles: layout.triangles, triangle_count: count };
    let exact = clocked.exact.map(|tree| Scene { tree, ..scene });
    let (traffic, host_time) = (clocked.machine.traffic.clone(), clocked.host_time);
    let (top, compressor) = (clocked.machine.top, clocked.machine.compressor);
    let clocked = Some(clocked);
    Ok(BuildRun { memory, layout, scene, exact, traffic, top, compressor, host_time, clocked })
}

/// Places triangles, and boxes if they are the input, in memory just large enough.
///
/// # Errors
/// [`RunError::TooLarge`].
pub fn load(
    triangles: &[Triangle],
    config: &BuildConfig,
) -> Result<(FlatMemory, Layout), RunError> {
    let count = u32::try_from(triangles.len()).map_err(|_| RunError::TooLarge(u64::MAX))?;
    let layout = Layout::new(config, count).map_err(RunError::TooLarge)?;
    let mut memory = FlatMemory::new(layout.size as usize);
    let mut put = |addr: u32, bytes: &[u8]| {
        memory.bytes_mut()[addr as usize..addr as usize + bytes.len()].copy_from_slice(bytes);
    };
    for (i, triangle) in triangles.iter().enumerate() {
        put(layout.triangles.base.0 + (i * Triangle::BYTES) as u32, &triangle.to_bytes());
        if config.input == InputFormat::Box32 {
            let bounds = triangle.bounds();
            let mut record = [0; 32];
            let corners = bounds.min.to_array().into_iter().chain(bounds.max.to_array());
            for (four, c) in record.chunks_exact_mut(4).zip(corners) {
                four.copy_from_slice(&c.to_le_bytes());
            }
            record[24..28].copy_from_slice(&(i as u32).to_le_bytes());
            put(layout.build.primitives.base.0 + i as u32 * 32, &record);
        }
    }
    Ok((memory, layout))
}

/// Builds and compresses on any bus; returns the tree in the requested format and, if there is one,
/// that of 64-byte nodes.
///
/// # Errors
/// [`BuildError`].
pub fn job<B: Bus, P: Probe>(
    bus: &mut B,
    layout: &Layout,
    options: &BuildOptions,
    count: u32,
    buffers: &mut Buffers,
    probe: &mut P,
) -> Result<(Tree, Option<Tree>), BuildError<B::Error>> {
    let (mut workspace, mut storage) = buffers.parts();
    let (config, regions) = (&options.config, &layout.build);
    let built =
        pipeline::build_with(bus, config, regions, count, &mut workspace, &mut storage, probe)?;
    match (built.format, options.format) {
        (NodeFormat::Bvh2, NodeFormat::Quantized(quantization)) => {
            let target = layout.quantized_nodes;
            let tree = compress_top_down(bus, &built, target, &quantization, probe)?;
            Ok((tree, Some(built)))
        }
        (NodeFormat::Bvh2, NodeFormat::Bvh2) => Ok((built, Some(built))),
        // The pass from the root down is no part of the core for shared planes; a build that wants them
        // streams them.
        (NodeFormat::Bvh2, NodeFormat::Shared(_)) => Err(ConfigError::Sharing.into()),
        (NodeFormat::Bvh2, NodeFormat::Wide(_)) => Err(ConfigError::Collapse.into()),
        (NodeFormat::Quantized(_) | NodeFormat::Shared(_) | NodeFormat::Wide(_), _) => {
            Ok((built, None))
        }
    }
}

/// The widest merge that the host has room for.
const MAX_WIDTH: usize = 1 << 14;

/// The builder's on-chip storage, on the host's heap.
#[derive(Debug)]
pub struct Buffers {
    items: Vec<Item>,
    queues: Box<FixedVec<Queue, MAX_WIDTH>>,
    heap: Box<FixedVec<HeapEntry, MAX_WIDTH>>,
    cells: Vec<Cell>,
    top_nodes: Vec<TopNode>,
    held: Vec<HeldNode>,
    open: Vec<OpenWide>,
}

impl Buffers {
    /// Storage for a configuration.
    pub fn new(config: &BuildConfig) -> Self {
        let cells = match config.top_level {
            TopLevel::None => 0,
            _ => config.cells.capacity as usize,
        };
        Self {
            items: vec![Item::ZERO; config.sort.capacity as usize],
            queues: Box::default(),
            heap: Box::default(),
            cells: vec![Cell::EMPTY; cells],
            top_nodes: vec![TopNode::EMPTY; cells],
            held: vec![HeldNode::EMPTY; config.compression.map_or(0, |c| c.held_nodes())],
            open: vec![OpenWide::EMPTY; if config.collapse { OpenWide::STACK } else { 0 }],
        }
    }

    /// The sorter's storage as the core wants it.
    pub fn workspace(&mut self) -> Workspace<'_> {
        self.parts().0
    }

    /// All storage: the sorter's and that of what follows it.
    pub fn parts(&mut self) -> (Workspace<'_>, TreeStorage<'_>) {
        let Self { items, queues, heap, cells, top_nodes, held, open } = self;
        let workspace = Workspace { items, queues: &mut **queues, heap: &mut **heap };
        let top = TopStorage { cells, nodes: top_nodes };
        (workspace, TreeStorage { top, held, open })
    }
}

impl BuildRun {
    /// Checks the tree and measures its quality.
    ///
    /// # Errors
    /// [`RunError::Malformed`].
    pub fn check(&self) -> Result<Quality, RunError> {
        check(&self.memory, &self.scene)
    }

    /// Bytes of one region as they are now.
    pub fn bytes_at(&self, base: ByteAddr, len: u64) -> &[u8] {
        &self.memory.bytes()[base.0 as usize..base.0 as usize + len as usize]
    }

    /// Modelled cycles of the whole build, rounded.
    pub fn cycles(&self) -> u64 {
        self.traffic.total().millicycles.div_ceil(1000)
    }
}

/// Checks a tree in memory and measures its quality.
///
/// # Errors
/// [`RunError::Malformed`].
pub fn check(memory: &FlatMemory, scene: &Scene) -> Result<Quality, RunError> {
    let mut seen = vec![0; scene.triangle_count.div_ceil(32) as usize];
    quality::check(&mut memory.snapshot(), scene, &mut seen).map_err(RunError::Malformed)
}
