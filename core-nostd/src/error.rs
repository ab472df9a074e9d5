//! Why a build, a refit or a compression could not be done.

use core::fmt;

use crate::geom::PrimIndex;
use crate::mem::ByteAddr;
use crate::probe::Stage;

/// The regions of external memory that a job uses.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RegionName {
    /// The input primitives.
    Primitives,
    /// The sorted runs of the partial sort and of every second merge pass.
    RunsA,
    /// The merged runs of the other passes.
    RunsB,
    /// The 64-byte nodes.
    Nodes,
    /// The leaf table.
    LeafTable,
    /// The quantized nodes.
    QuantizedNodes,
    /// The triangles that rays are tested against.
    Triangles,
}

impl RegionName {
    /// The region's name in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Primitives => "primitives",
            Self::RunsA => "runs A",
            Self::RunsB => "runs B",
            Self::Nodes => "nodes",
            Self::LeafTable => "leaf table",
            Self::QuantizedNodes => "quantized nodes",
            Self::Triangles => "triangles",
        }
    }
}

impl fmt::Display for RegionName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Which parameter of a configuration is wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The scratchpad capacity `M` is not a power of two of at least four bursts.
    Capacity,
    /// The burst `B` is not a power of two of at most 32 records.
    Burst,
    /// The workspace is smaller than the capacity or the merge width asks for.
    Workspace,
    /// 8-byte pairs hold 30-bit codes only.
    PairCode,
    /// The largest leaf is not 1 to 255 primitives.
    LeafSize,
    /// The search radius of the clustering emitter is not 1 to 16.
    Radius,
    /// The chain of the clustering emitter is not 1 to 8 sweeps.
    Chain,
    /// Leaves are to be joined to more than 16 primitives.
    JoinedLeaf,
    /// The top-level builder has no storage, or its treelets are not 3 to 16 leaves.
    TopLevel,
    /// Quantized coordinates are not 4 to 8 bits wide, or the minimum scale is above 15.
    Quantization,
    /// Treelets are not 1 to 4 nodes deep, deeper than 1 behind the clustering emitter, or without
    /// storage; the estimate's margin is above 3, or held lines are not 2 to 64.
    Compression,
    /// Shared-plane nodes are asked for with a margin above 5 or a flatness above 31, without stored
    /// grids, behind an emitter that is not depth first, or below a top level.
    Sharing,
    /// Shared-plane nodes cannot be refitted, as their sizes change with their boxes, nor can nodes of four
    /// children.
    RefitFormat,
    /// Nodes are to be collapsed to four children without compression, or behind an emitter that is not depth
    /// first, or below a top level.
    Collapse,
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Capacity => "capacity M must be a power of two and at least 4 bursts",
            Self::Burst => "burst B must be a power of two from 1 to 32",
            Self::Workspace => "workspace is smaller than capacity M or merge width M/2B",
            Self::PairCode => "8-byte pairs hold 30-bit Morton codes; use a wider record for 63",
            Self::LeafSize => "leaf size must be from 1 to 255",
            Self::Radius => "search radius must be from 1 to 16 clusters",
            Self::Chain => "chain must be from 1 to 8 sweeps",
            Self::JoinedLeaf => "leaves can be joined up to 16 primitives, and not by the clustering emitter",
            Self::TopLevel => {
                "a top-level build needs cells of the lbvh emitter, storage for them, and treelets of \
                 3 to 16 leaves"
            }
            Self::Quantization => {
                "quantized coordinates must have 4 to 8 bits, and the minimum scale be at most 15"
            }
            Self::Compression => {
                "treelets must be 1 to 4 deep, with storage for them (1 with the clustering emitter), the \
                 margin be at most 3, and held lines be 2 to 64"
            }
            Self::RefitFormat => {
                "nodes of 64 bytes and quantized pairs are refitted; build other trees anew"
            }
            Self::Collapse => {
                "nodes of four children are quantized and streamed, by the LBVH emitter without a top level"
            }
            Self::Sharing => {
                "shared-plane nodes are streamed by the LBVH emitter without a top level, and with \
                 stored grids; the margin must be at most 5 and the flatness at most 31"
            }
        })
    }
}

impl core::error::Error for ConfigError {}

/// Why a build, a refit or a compression stopped. What had been written before stays in memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BuildError<E> {
    /// The configuration cannot work, whatever the input.
    Config(ConfigError),
    /// The bus failed.
    Bus {
        /// The stage under way.
        stage: Stage,
        /// First byte of the failed burst.
        addr: ByteAddr,
        /// What the bus said.
        error: E,
    },
    /// A region is too small.
    RegionFull {
        /// Which one.
        region: RegionName,
        /// Bytes that the job needs at least.
        needed: u64,
        /// Bytes that the region has.
        available: u32,
    },
    /// A primitive's box is inverted or off the grid, or its reference has 32 bits.
    InvalidPrimitive {
        /// Its position in the input.
        index: PrimIndex,
    },
    /// More nodes or leaf table entries than a pointer of the node format can name.
    PointerOverflow,
    /// A node read back from memory is not one that the builder writes.
    CorruptNode {
        /// Its index.
        index: u32,
    },
    /// A leaf read back from memory is not one that the builder writes, or names a primitive that
    /// there is not.
    CorruptLeaf {
        /// The leaf table entry.
        entry: u32,
    },
    /// A cluster read back from a list in memory is not one that the emitter writes.
    CorruptCluster {
        /// Its index in the list.
        index: u32,
    },
    /// Sorted records came back from memory in another order.
    Unsorted,
    /// An internal bound was exceeded; this is a defect of the core.
    Internal,
}

impl<E> BuildError<E> {
    /// The same error of another bus.
    pub fn map_bus<F>(self, map: impl FnOnce(E) -> F) -> BuildError<F> {
        match self {
            Self::Config(error) => BuildError::Config(error),
            Self::Bus { stage, addr, error } => BuildError::Bus { stage, addr, error: map(error) },
            Self::RegionFull { region, needed, available } => {
                BuildError::RegionFull { region, needed, available }
            }
            Self::InvalidPrimitive { index } => BuildError::InvalidPrimitive { index },
            Self::PointerOverflow => BuildError::PointerOverflow,
            Self::CorruptNode { index } => BuildError::CorruptNode { index },
            Self::CorruptLeaf { entry } => BuildError::CorruptLeaf { entry },
            Self::CorruptCluster { index } => BuildError::CorruptCluster { index },
            Self::Unsorted => BuildError::Unsorted,
            Self::Internal => BuildError::Internal,
        }
    }
}

impl<E: fmt::Debug> fmt::Display for BuildError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Config(error) => write!(f, "{error}"),
            Self::Bus { stage, addr, error } => {
                write!(f, "bus error at {addr} during {stage:?}: {error:?}")
            }
            Self::RegionFull { region, needed, available } => write!(
                f,
                "region `{region}` is too small: {needed} bytes needed, {available} available"
            ),
            Self::InvalidPrimitive { index } => {
                write!(f, "primitive {} has an inverted or off-grid box", index.0)
            }
            Self::PointerOverflow => f.write_str("more nodes than the format's pointers can name"),
            Self::CorruptNode { index } => write!(f, "node {index} in memory is corrupt"),
            Self::CorruptLeaf { entry } => {
                write!(f, "leaf table entry {entry} in memory is corrupt")
            }
            Self::CorruptCluster { index } => write!(f, "cluster {index} in memory is corrupt"),
            Self::Unsorted => f.write_str("sorted records came back from memory in another order"),
            Self::Internal => f.write_str("an internal bound was exceeded (a defect of the core)"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for BuildError<E> {}

impl<E> From<ConfigError> for BuildError<E> {
    fn from(error: ConfigError) -> Self {
        Self::Config(error)
    }
}
