//! Whole builds: primitives in, tree out.

mod nodes;
mod ploc;
mod stream;
mod tree;

pub use self::stream::TreeStream;
use self::tree::MAX_JOINED;
use crate::compress::{Compression, HeldNode, OpenWide};
use crate::emit::{CellConfig, EmitterKind};
use crate::error::{BuildError, ConfigError, RegionName};
use crate::mem::{BurstWriter, Bus, Region};
use crate::node::{Grids, LeafEntry, MAX_LEAF_SIZE, NodeFormat, Sharing, Tree};
use crate::num::{Grid, MortonCoder, MortonWidth};
use crate::probe::{Probe, Stage};
use crate::sort::{
    InputFormat, Item, MultiMerge, PrimitiveDecoder, PrimitiveReader, RecordFormat, SortConfig,
    Workspace, partial_sort,
};
use crate::toplevel::{TopLevel, TopStorage};

/// What to build and how.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BuildConfig {
    /// The grid that the input lies on.
    pub grid: Grid,
    /// How many bits the sort key has.
    pub morton: MortonWidth,
    /// What the input region consists of.
    pub input: InputFormat,
    /// The shape of the sorter.
    pub sort: SortConfig,
    /// The largest leaf, in primitives, 1 to 255. Only primitives with equal codes share a leaf.
    pub max_leaf_size: u32,
    /// Neighbouring leaves are joined up to this many primitives, at most 16, where a leaf costs no
    /// more than a node over two; 0 leaves every leaf as it is.
    pub join_leaves: u32,
    /// Bytes of a burst of the node and leaf table writers.
    pub write_burst: u32,
    /// Which tree is made of the sorted primitives.
    pub emitter: EmitterKind,
    /// How the top of the tree is built.
    pub top_level: TopLevel,
    /// With a top level, what it is built over.
    pub cells: CellConfig,
    /// How nodes are compressed on their way to memory; without it they have 64 bytes.
    pub compression: Option<Compression>,
    /// Whether nodes are collapsed to up to four children as they are compressed.
    pub collapse: bool,
    /// How shared-plane nodes are made of them instead, as they come.
    pub sharing: Option<Sharing>,
}

/// What is kept on chip of a tree under construction, beside the sorter's [`Workspace`].
#[derive(Debug)]
pub struct TreeStorage<'a> {
    /// For a top level.
    pub top: TopStorage<'a>,
    /// For treelets: [`Compression::held_nodes`].
    pub held: &'a mut [HeldNode],
    /// For wide nodes: [`OpenWide::STACK`].
    pub open: &'a mut [OpenWide],
}

impl TreeStorage<'_> {
    /// No storage: no top level can be built, and no treelets be held.
    pub const fn none() -> Self {
        Self { top: TopStorage::none(), held: &mut [], open: &mut [] }
    }

    /// Checks that the storage suffices for a configuration.
    ///
    /// # Errors
    /// [`ConfigError`] naming what does not fit.
    pub fn check(&self, config: &BuildConfig) -> Result<(), ConfigError> {
        config.top_level.check_storage(&config.cells, &self.top)?;
        match &config.compression {
            Some(_) if config.collapse => {
                let enough = self.open.len() >= OpenWide::STACK;
                if enough { Ok(()) } else { Err(ConfigError::Compression) }
            }
            Some(compression) if compression.held_nodes() > self.held.len() => {
                Err(ConfigError::Compression)
            }
            _ => Ok(()),
        }
    }
}

impl Default for BuildConfig {
    /// P2's: 30-bit codes, 32-byte boxes in and between, `M` = 8192, `B` = 16, bursts of 512 bytes.
    fn default() -> Self {
        Self {
            grid: Grid::DEFAULT,
            morton: MortonWidth::Bits30,
            input: InputFormat::Box32,
            sort: SortConfig::PAPER,
            max_leaf_size: MAX_LEAF_SIZE,
            join_leaves: 0,
            write_burst: 512,
            emitter: EmitterKind::Lbvh,
            top_level: TopLevel::None,
            cells: CellConfig::default(),
            compression: None,
            collapse: false,
            sharing: None,
        }
    }
}

/// Where a build finds and puts things.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct BuildRegions {
    /// The input, see [`InputFormat`].
    pub primitives: Region,
    /// The sorted runs of the partial sort and of every second merge pass.
    pub runs_a: Region,
    /// The runs of the other passes; may be empty where one pass is enough.
    pub runs_b: Region,
    /// The nodes, 64 bytes each or what the quantized format has.
    pub nodes: Region,
    /// The leaf table, 4 bytes a primitive.
    pub leaf_table: Region,
}

impl BuildConfig {
    /// How many primitives one merge pass can bring in order: `M² / 2B`, or `M² / B` with
    /// forecasting.
    pub const fn one_pass_capacity(&self) -> u64 {
        self.sort.capacity as u64 * self.sort.width() as u64
    }

    /// How many bytes the run regions A and B must have for `count` primitives: runs, and lists of
    /// clusters where the emitter makes them.
    pub const fn run_bytes(&self, count: u32) -> [u64; 2] {
        let runs = count as u64 * self.sort.record.bytes() as u64;
        let passes = self.further_passes(count);
        let mut bytes = [runs, if passes > 0 { runs } else { 0 }];
        if let EmitterKind::Ploc(_) = self.emitter {
            // The last merge reads from one region, so the other one is free.
            let lists = &mut bytes[1 - passes as usize % 2];
            let needed = ploc::list_bytes(count);
            *lists = if needed > *lists { needed } else { *lists };
        }
        bytes
    }

    /// How many merge passes must write runs back before one merge can take them all.
    pub const fn further_passes(&self, count: u32) -> u32 {
        let (capacity, width) = (self.sort.capacity, self.sort.width());
        if width < 2 {
            // No sorter; refused before anything is built.
            return 0;
        }
        let (mut runs, mut passes) = (count.div_ceil(capacity), 0);
        while runs > width {
            runs = runs.div_ceil(width);
            passes += 1;
        }
        passes
    }

    /// The format of the nodes.
    pub const fn format(&self) -> NodeFormat {
        match (&self.compression, self.sharing) {
            (Some(compression), _) if self.collapse => NodeFormat::Wide(compression.quantization),
            (Some(compression), _) => NodeFormat::Quantized(compression.quantization),
            (None, Some(sharing)) => NodeFormat::Shared(sharing),
            (None, None) => NodeFormat::Bvh2,
        }
    }

    /// What computes codes.
    pub const fn coder(&self) -> MortonCoder {
        MortonCoder::new(self.grid, self.morton)
    }

    /// What decodes input records.
    pub fn decoder(&self) -> PrimitiveDecoder {
        PrimitiveDecoder {
            format: self.input,
            grid: self.grid,
            coder: self.coder(),
            by_position: self.sort.record == RecordFormat::Pair8,
        }
    }

    /// Checks all parameters but those that depend on the storage.
    ///
    /// # Errors
    /// [`ConfigError`] naming the parameter.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.sort.check()?;
        if self.max_leaf_size == 0 || self.max_leaf_size > MAX_LEAF_SIZE {
            return Err(ConfigError::LeafSize);
        }
        if self.join_leaves as usize > MAX_JOINED {
            return Err(ConfigError::JoinedLeaf);
        }
        if self.sort.record == RecordFormat::Pair8 && self.morton == MortonWidth::Bits63 {
            return Err(ConfigError::PairCode);
        }
        if let Some(compression) = &self.compression {
            compression.check()?;
        }
        // A node that is collapsed must find its children on chip.
        let depth_first = self.emitter == EmitterKind::Lbvh && self.top_level == TopLevel::None;
        if self.collapse && !(depth_first && self.compression.is_some()) {
            return Err(ConfigError::Collapse);
        }
        if let Some(sharing) = &self.sharing {
            sharing.check()?;
            // Nodes must come depth first, and a parent must find its grid in its own bytes.
            if !depth_first || self.compression.is_some() || sharing.grids != Grids::Stored {
                return Err(ConfigError::Sharing);
            }
        }
        match &self.emitter {
            EmitterKind::Lbvh => Ok(()),
            // The clusters are no cells of the Morton order.
            EmitterKind::Ploc(_) if self.top_level != TopLevel::None => Err(ConfigError::TopLevel),
            EmitterKind::Ploc(_) if self.join_leaves > 0 => Err(ConfigError::JoinedLeaf),
            // Its nodes do not come in the order of a depth-first walk.
            EmitterKind::Ploc(_) if self.compression.is_some_and(|c| c.treelet_depth > 1) => {
                Err(ConfigError::Compression)
            }
            EmitterKind::Ploc(ploc) => ploc.check(),
        }
    }
}

impl BuildRegions {
    /// Checks the regions whose size follows from the number of primitives.
    ///
    /// # Errors
    /// [`BuildError::RegionFull`] naming the region, or [`BuildError::PointerOverflow`] for more
    /// primitives than references can name.
    pub fn check<E>(&self, config: &BuildConfig, count: u32) -> Result<(), BuildError<E>> {
        let bytes = |bytes: u32| u64::from(count) * u64::from(bytes);
        let [runs_a, runs_b] = config.run_bytes(count);
        for (region, name, needed) in [
            (self.primitives, RegionName::Primitives, bytes(config.input.bytes())),
            (self.runs_a, RegionName::RunsA, runs_a),
            (self.runs_b, RegionName::RunsB, runs_b),
            (self.leaf_table, RegionName::LeafTable, bytes(LeafEntry::BYTES as u32)),
        ] {
            if needed > u64::from(region.size) {
                let available = region.size;
                return Err(BuildError::RegionFull { region: name, needed, available });
            }
        }
        // References have 31 bits, so positions must.
        if count >> 31 == 0 { Ok(()) } else { Err(BuildError::PointerOverflow) }
    }
}

/// Builds a tree over `count` primitives: partial sort, multi-merge, and hierarchy
/// emission straight from the merge's last pass (P2 §4–5).
///
/// The tree depends on the primitives, [`BuildConfig::morton`], [`BuildConfig::emitter`] and
/// [`BuildConfig::max_leaf_size`] only; the other parameters change the traffic.
///
/// # Errors
/// [`BuildError`]. Regions whose size follows from `count` are checked before anything is written;
/// the node region may run full while nodes are written, and those that fit are then there.
pub fn build<B: Bus, P: Probe>(
    bus: &mut B,
    config: &BuildConfig,
    regions: &BuildRegions,
    count: u32,
    workspace: &mut Workspace<'_>,
    probe: &mut P,
) -> Result<Tree, BuildError<B::Error>> {
    build_with(bus, config, regions, count, workspace, &mut TreeStorage::none(), probe)
}

/// As [`build`], with storage for what else the configuration asks for: a builder of the top of the
/// tree ([`BuildConfig::top_level`], P2 §5.6), or treelets of the compressor
/// ([`BuildConfig::compression`], P3 §4.3).
///
/// With a top level the tree depends on [`BuildConfig::cells`] too.
///
/// # Errors
/// As [`build`].
pub fn build_with<B: Bus, P: Probe>(
    bus: &mut B,
    config: &BuildConfig,
    regions: &BuildRegions,
    count: u32,
    workspace: &mut Workspace<'_>,
    storage: &mut TreeStorage<'_>,
    probe: &mut P,
) -> Result<Tree, BuildError<B::Error>> {
    config.check()?;
    config.sort.check_storage(workspace)?;
    storage.check(config)?;
    let (capacity, width) = (config.sort.capacity, config.sort.width());
    let passes = config.further_passes(count);
    regions.check(config, count)?;

    let pairs = config.sort.record == RecordFormat::Pair8;
    let coder = config.coder();
    let reader = PrimitiveReader { region: regions.primitives, count, decoder: config.decoder() };
    partial_sort(bus, &config.sort, workspace, &reader, regions.runs_a, probe)?;

    let mut source = (regions.runs_a, RegionName::RunsA);
    let mut target = (regions.runs_b, RegionName::RunsB);
    let mut run = capacity;
    for _ in 0..passes {
        merge_pass(bus, &config.sort, workspace, (source, target), coder, (count, run), probe)?;
        core::mem::swap(&mut source, &mut target);
        run = run.saturating_mul(width);
    }

    let mut merge = MultiMerge::over_runs(
        bus,
        &config.sort,
        workspace,
        source.0,
        source.1,
        coder,
        0..count,
        run,
        {
            probe.stage(Stage::Merge);
            &mut *probe
        },
    )?;
    let boxes = pairs.then_some(&reader);
    let mut tree = TreeStream::new(config, regions, target, count, storage, probe);
    let mut item = Item::ZERO;
    while merge.next(bus, &mut item, probe)? {
        if let Some(reader) = boxes {
            reader.read(bus, Stage::Merge, item.reference, core::slice::from_mut(&mut item))?;
            // The code was sorted by; it is the same as the one just computed.
        }
        tree.accept(bus, &item, probe)?;
    }
    // The merge is over, so its scratchpad is free.
    let scratchpad = workspace.items.get_mut(..capacity as usize).unwrap_or_default();
    tree.finish(bus, scratchpad, probe)
}

/// Merges groups of runs from one region into longer runs in the other.
fn merge_pass<B: Bus, P: Probe>(
    bus: &mut B,
    config: &SortConfig,
    workspace: &mut Workspace<'_>,
    (source, target): ((Region, RegionName), (Region, RegionName)),
    coder: MortonCoder,
    (count, run): (u32, u32),
    probe: &mut P,
) -> Result<(), BuildError<B::Error>> {
    probe.stage(Stage::Merge);
    let burst = (config.burst * config.record.bytes()) as usize;
    let mut writer = BurstWriter::new(target.0, target.1, Stage::Merge, burst);
    let group = run.saturating_mul(config.width());
    let mut first = 0;
    while first < count {
        let end = count.min(first.saturating_add(group));
        let mut merge = MultiMerge::over_runs(
            bus,
            config,
            workspace,
            source.0,
            source.1,
            coder,
            first..end,
            run,
            probe,
        )?;
        let mut item = Item::ZERO;
        while merge.next(bus, &mut item, probe)? {
            config.record.push(&item, bus, &mut writer)?;
        }
        first = end;
    }
    writer.flush(bus)
}
