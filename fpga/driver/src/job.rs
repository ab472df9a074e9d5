//! What the accelerator can be asked to do, and the checks before it is asked.

use xylem_core::mem::Region;
use xylem_core::node::{
    Child, Coordinates, LeafEntry, NodeFormat, NodeIndex, Quantization, Subtree, Tree,
};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildRegions;
use xylem_core::sort::{InputFormat, RecordFormat};
use xylem_core::traverse::Query;
use xylem_regs::{self as regs, JobFormat, JobKind, JobLimits, RegionId, Register};

use crate::config::{ConfigError, check_regions, require, within};
use crate::device::Capabilities;

/// Build a tree over primitives in memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BuildJob {
    /// Where everything is. `runs_b` may be empty where one merge pass is enough, `nodes` where
    /// the tree is compressed as it is built.
    pub regions: BuildRegions,
    /// How many primitives there are, at least 1.
    pub count: u32,
    /// What the primitives region consists of.
    pub input: InputFormat,
    /// What the runs consist of.
    pub record: RecordFormat,
    /// How many bits the sort key has.
    pub morton: MortonWidth,
    /// The largest leaf, in primitives.
    pub max_leaf_size: u32,
    /// How to compress the tree as it is built, or `None` for two-box nodes.
    pub compressed: Option<Compression>,
}

/// How and where to write quantized nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Compression {
    /// Where the quantized nodes go.
    pub target: Region,
    /// What their coordinates are relative to.
    pub coordinates: Coordinates,
    /// Layers of nodes that are held on chip while they may still change; 1 is none beyond the
    /// node at hand. A build takes that of the capabilities only; a compression top-down holds none.
    pub treelet_depth: u8,
}

/// Compress a tree of two-box nodes top-down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CompressJob {
    /// The tree, which stays as it is.
    pub tree: Tree,
    /// How and where.
    pub compression: Compression,
}

/// Trace rays through a tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TraceJob {
    /// The tree, in any format.
    pub tree: Tree,
    /// The 40-byte triangles that its leaves refer to.
    pub triangles: Region,
    /// How many triangles there are.
    pub triangle_count: u32,
    /// The rays, `capabilities().trace.ray_bytes()` bytes each.
    pub rays: Region,
    /// Where the hit records go, `capabilities().trace.hit_bytes()` bytes each.
    pub hits: Region,
    /// How many rays there are, at least 1.
    pub ray_count: u32,
    /// What is asked of each ray.
    pub query: Query,
}

/// The register values of a job that passed every check.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setup {
    pub kind: JobKind,
    /// By [`RegionId`]; an unused region is empty, so that the accelerator refuses it.
    pub regions: [Region; RegionId::ALL.len()],
    pub primitives: u32,
    pub rays: u32,
    pub nodes: u32,
    pub entries: u32,
    pub format: JobFormat,
    pub limits: JobLimits,
    pub root: Option<Subtree>,
}

impl Setup {
    fn new(kind: JobKind) -> Self {
        Self {
            kind,
            regions: [Region::default(); RegionId::ALL.len()],
            primitives: 0,
            rays: 0,
            nodes: 0,
            entries: 0,
            format: JobFormat::RESET,
            limits: JobLimits::RESET,
            root: None,
        }
    }

    /// A job over an existing tree; `None` is the tree of no primitives.
    fn over(kind: JobKind, tree: &Tree) -> Result<Self, ConfigError> {
        require(tree.root.is_some(), ConfigError::Empty { what: "tree" })?;
        let (nodes, entries) = (tree.node_count, tree.entry_count);
        Ok(Self { nodes, entries, root: tree.root, ..Self::new(kind) })
    }

    fn place(&mut self, id: RegionId, region: Region) {
        self.regions[id as usize] = region;
    }
}

impl BuildJob {
    /// How many merge passes precede the last one, for a scratchpad of `capacity` records that
    /// merges `width` runs at once.
    fn further_passes(&self, capacity: u32, width: u32) -> u32 {
        let mut runs = self.count.div_ceil(capacity.max(1));
        let mut passes = 0;
        while width > 1 && runs > width {
            runs = runs.div_ceil(width);
            passes += 1;
        }
        passes
    }

    pub(crate) fn setup(&self, can: &Capabilities) -> Result<Setup, ConfigError> {
        let features = can.features;
        supported(features.build(), "building")?;
        let input = match self.input {
            InputFormat::Box32 => (regs::InputFormat::Aabb, features.input_aabb()),
            InputFormat::Triangle40 => (regs::InputFormat::Triangle, features.input_triangle()),
        };
        supported(input.1, "this input format")?;
        let record = match self.record {
            RecordFormat::Box32 => (regs::RecordFormat::Box32, features.record_box32()),
            RecordFormat::Pair8 => (regs::RecordFormat::Pair8, features.record_pair8()),
            RecordFormat::Packed22 => (regs::RecordFormat::Packed22, features.record_packed22()),
        };
        supported(record.1, "this record format")?;
        require(self.count > 0, ConfigError::Empty { what: "primitive list" })?;
        within("max_leaf_size", self.max_leaf_size, 1..=can.merge.leaf_size().into())?;
        within("morton bits", self.morton.bits(), 1..=can.geometry.morton_bits().into())?;
        let wide_pair = self.record == RecordFormat::Pair8 && self.morton == MortonWidth::Bits63;
        require(!wide_pair, ConfigError::PairCode)?;

        let kind =
            if self.compressed.is_some() { JobKind::BuildCompressed } else { JobKind::Build };
        let mut setup = Setup::new(kind);
        setup.primitives = self.count;
        setup.format = setup.format.with_input(input.0).with_record(record.0);
        setup.limits = setup
            .limits
            .with_morton_bits(self.morton.bits() as u8)
            .with_leaf_size(self.max_leaf_size as u8);

        let regions = &self.regions;
        let run_bytes = bytes(self.count, self.record.bytes());
        let leaf_bytes = bytes(self.count, LeafEntry::BYTES as u32);
        setup.place(RegionId::Primitives, regions.primitives);
        setup.place(RegionId::RunsA, regions.runs_a);
        setup.place(RegionId::LeafTable, regions.leaf_table);
        let mut needed = [None; RegionId::ALL.len()];
        needed[RegionId::Primitives as usize] = Some(bytes(self.count, self.input.bytes()));
        needed[RegionId::RunsA as usize] = Some(run_bytes);
        needed[RegionId::LeafTable as usize] = Some(leaf_bytes);
        if self.further_passes(can.sort.scratch_records(), can.merge.width().into()) > 0 {
            setup.place(RegionId::RunsB, regions.runs_b);
            needed[RegionId::RunsB as usize] = Some(run_bytes);
        }
        match &self.compressed {
            // How many nodes there will be is known only when the tree is there, so any size will
            // do; the accelerator reports a region that runs full.
            None => {
                setup.place(RegionId::Nodes, regions.nodes);
                needed[RegionId::Nodes as usize] = Some(1);
            }
            Some(compression) => {
                supported(features.build_compressed(), "compressing while it builds")?;
                let depth = can.geometry.treelet_depth().into();
                within("treelet_depth", compression.treelet_depth.into(), depth..=depth)?;
                compression.add_to(&mut setup, can)?;
                needed[RegionId::Quantized as usize] = Some(1);
            }
        }
        check_regions(&setup.regions, &needed)?;
        Ok(setup)
    }

    /// The tree that the accelerator described after this job.
    pub(crate) fn tree(&self, root: Subtree, node_count: u32, leaf_count: u32) -> Tree {
        let (format, nodes) = match &self.compressed {
            None => (NodeFormat::Bvh2, self.regions.nodes),
            Some(compression) => (compression.format(), compression.target),
        };
        Tree {
            format,
            root: Some(root),
            node_count,
            leaf_count,
            entry_count: self.count,
            nodes,
            leaf_table: self.regions.leaf_table,
        }
    }
}

impl Compression {
    /// The format of the nodes: the accelerator's width of coordinates, 6 bits.
    const fn format(&self) -> NodeFormat {
        let coordinates = self.coordinates;
        NodeFormat::Quantized(Quantization { coordinates, ..Quantization::RELATIVE })
    }

    fn add_to(&self, setup: &mut Setup, can: &Capabilities) -> Result<(), ConfigError> {
        setup.format = setup.format.with_coords(coordinates(self.coordinates, can)?);
        setup.limits = setup.limits.with_treelet_depth(self.treelet_depth);
        setup.place(RegionId::Quantized, self.target);
        Ok(())
    }
}

impl CompressJob {
    /// The tree that is there once the job is done: quantized nodes have the indices of the nodes
    /// that they came from, and share the leaf table.
    pub const fn tree(&self) -> Tree {
        let Compression { target, .. } = self.compression;
        Tree { format: self.compression.format(), nodes: target, ..self.tree }
    }

    pub(crate) fn setup(&self, can: &Capabilities) -> Result<Setup, ConfigError> {
        supported(can.features.compress(), "compressing a tree")?;
        let mut setup = Setup::over(JobKind::Compress, &self.tree)?;
        self.compression.add_to(&mut setup, can)?;
        require(self.tree.format == NodeFormat::Bvh2, ConfigError::AlreadyCompressed)?;
        // A tree of one leaf has no nodes and needs no compression.
        require(self.tree.node_count > 0, ConfigError::Empty { what: "list of nodes" })?;
        let count = self.tree.node_count;
        setup.place(RegionId::Nodes, self.tree.nodes);
        let mut needed = [None; RegionId::ALL.len()];
        needed[RegionId::Nodes as usize] = Some(bytes(count, NodeFormat::Bvh2.bytes()));
        needed[RegionId::Quantized as usize] =
            Some(bytes(count, Quantization::RELATIVE.node_bytes()));
        check_regions(&setup.regions, &needed)?;
        Ok(setup)
    }
}

impl TraceJob {
    /// The most rays, triangles, nodes or leaf table entries: with more, addresses might not fit 32 bits.
    pub const MAX_COUNT: u32 = (1 << 26) - 1;

    pub(crate) fn setup(&self, can: &Capabilities) -> Result<Setup, ConfigError> {
        supported(can.features.trace(), "tracing")?;
        let mut setup = Setup::over(JobKind::Trace, &self.tree)?;
        require(self.ray_count > 0, ConfigError::Empty { what: "ray list" })?;
        require(self.triangle_count > 0, ConfigError::Empty { what: "triangle list" })?;
        for (parameter, count) in [
            ("ray_count", self.ray_count),
            ("triangle_count", self.triangle_count),
            ("node_count", self.tree.node_count),
            ("entry_count", self.tree.entry_count),
        ] {
            within(parameter, count, 0..=TraceJob::MAX_COUNT)?;
        }
        let (node, present) = match self.tree.format {
            NodeFormat::Bvh2 => (regs::NodeFormat::Bvh2, can.features.node_bvh2()),
            NodeFormat::Quantized(_) => (regs::NodeFormat::Cbvh, can.features.node_cbvh()),
            NodeFormat::Wide(_) | NodeFormat::Shared(_) => (regs::NodeFormat::Cbvh, false),
        };
        supported(present, "tracing this node format")?;
        let coords = match self.tree.format {
            NodeFormat::Bvh2 | NodeFormat::Wide(_) | NodeFormat::Shared(_) => {
                regs::CoordMode::Relative
            }
            NodeFormat::Quantized(quantization) => {
                let Quantization { coordinates: which, .. } = quantization;
                let plain = Quantization { coordinates: which, ..Quantization::RELATIVE };
                supported(quantization == plain, "this width or minimum scale of coordinates")?;
                coordinates(which, can)?
            }
        };
        let query = match self.query {
            Query::Closest => regs::Query::Closest,
            Query::Any => regs::Query::Any,
        };
        setup.primitives = self.triangle_count;
        setup.rays = self.ray_count;
        setup.format = setup.format.with_node(node).with_coords(coords).with_query(query);

        let id = match node {
            regs::NodeFormat::Bvh2 => RegionId::Nodes,
            regs::NodeFormat::Cbvh => RegionId::Quantized,
        };
        let mut needed = [None; RegionId::ALL.len()];
        let mut use_region = |id, region, size| {
            setup.place(id, region);
            needed[id as usize] = Some(size);
        };
        let tree = &self.tree;
        if tree.node_count > 0 {
            use_region(id, tree.nodes, bytes(tree.node_count, tree.format.bytes()));
        }
        let (triangle, entry) = (InputFormat::Triangle40.bytes(), LeafEntry::BYTES as u32);
        use_region(RegionId::LeafTable, tree.leaf_table, bytes(tree.entry_count, entry));
        use_region(RegionId::Primitives, self.triangles, bytes(self.triangle_count, triangle));
        use_region(RegionId::Rays, self.rays, bytes(self.ray_count, can.trace.ray_bytes().into()));
        use_region(RegionId::Hits, self.hits, bytes(self.ray_count, can.trace.hit_bytes().into()));
        check_regions(&setup.regions, &needed)?;
        Ok(setup)
    }
}

/// A root pointer as its two registers hold it: an index, and a leaf size or 0.
pub(crate) fn pointer_words(child: Child) -> (u32, u8) {
    match child {
        Child::Inner(NodeIndex(index)) => (index, 0),
        Child::Leaf { first, count } => (first, u8::try_from(count).unwrap_or(u8::MAX)),
    }
}

/// What [`pointer_words`] holds.
pub(crate) fn pointer(index: u32, leaf_size: u8) -> Child {
    match leaf_size {
        0 => Child::Inner(NodeIndex(index)),
        count => Child::Leaf { first: index, count: count.into() },
    }
}

fn coordinates(which: Coordinates, can: &Capabilities) -> Result<regs::CoordMode, ConfigError> {
    let (mode, present) = match which {
        Coordinates::Relative => (regs::CoordMode::Relative, can.features.coords_relative()),
        Coordinates::Modulo => (regs::CoordMode::Modulo, can.features.coords_modulo()),
    };
    supported(present, "these coordinates")?;
    Ok(mode)
}

fn supported(present: bool, what: &'static str) -> Result<(), ConfigError> {
    require(present, ConfigError::Unsupported { what })
}

fn bytes(count: u32, record: u32) -> u64 {
    u64::from(count) * u64::from(record)
}
