//! Byte formats of trees in external memory.
//!
//! Each format has a file with its bit table, a borrowed view over bytes and an owned
//! representation. Building and traversing meet only here.
//!
//! A tree is an array of nodes in the order of their completion, children before parents, so that
//! the root is the last one; and a [leaf table](LeafEntry), where a leaf is a run of entries that
//! ends with a marked one. The [`Tree`] descriptor, which stays on chip, holds the root.

mod bvh2;
mod leaf;
mod quantized;
mod shared;
mod wide;

pub use bvh2::{Bvh2Node, Bvh2View};
pub use leaf::LeafEntry;
pub use quantized::{Coordinates, Quantization, QuantizedChild, QuantizedPair, QuantizedView};
pub use shared::{Grids, Link, Plane, SharedNode, SharedWords, Sharing};
pub use wide::{WideNode, WideView};

use crate::geom::Aabb;
use crate::mem::Region;

/// The index of a node in its region.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NodeIndex(pub u32);

/// What a child pointer names.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Child {
    /// Another node.
    Inner(NodeIndex),
    /// A run of the leaf table.
    Leaf {
        /// Its first entry.
        first: u32,
        /// How many entries it has, or [`Child::TO_MARK`] where the format does not say.
        count: u32,
    },
}

impl Child {
    /// The count of a leaf that extends to the marked entry.
    pub const TO_MARK: u32 = u32::MAX;

    /// The index of the node or of the first entry, and the count, 0 for a node.
    #[inline]
    pub(crate) const fn words(self) -> (u32, u32) {
        // Two matches, so that the first takes no branch.
        let index = match self {
            Self::Inner(NodeIndex(index)) => index,
            Self::Leaf { first, .. } => first,
        };
        let count = match self {
            Self::Inner(_) => 0,
            Self::Leaf { count, .. } => count,
        };
        (index, count)
    }
}

/// A finished part of a tree: its exact box and a pointer to it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Subtree {
    /// The smallest box around its primitives.
    pub bounds: Aabb,
    /// Where it is.
    pub child: Child,
}

impl Subtree {
    /// Something to fill storage with.
    pub(crate) const EMPTY: Self =
        Self { bounds: Aabb::EMPTY, child: Child::Leaf { first: 0, count: 0 } };
}

/// The largest leaf, in primitives: the leaf size field has 8 bits.
pub const MAX_LEAF_SIZE: u32 = 255;

/// The byte format of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NodeFormat {
    /// 64 bytes, two exact boxes: [`Bvh2Node`].
    #[default]
    Bvh2,
    /// 16 or 20 bytes, two quantized boxes: [`QuantizedPair`].
    Quantized(Quantization),
    /// 32 or 40 bytes, up to four quantized boxes: [`WideNode`].
    Wide(Quantization),
    /// Words of 8 bytes: [`SharedNode`].
    Shared(Sharing),
}

impl NodeFormat {
    /// Bytes of a node, or of a word of a shared-plane node.
    pub const fn bytes(self) -> u32 {
        match self {
            Self::Bvh2 => Bvh2Node::BYTES as u32,
            Self::Quantized(quantization) => quantization.node_bytes(),
            Self::Wide(quantization) => quantization.wide_bytes(),
            Self::Shared(_) => SharedNode::WORD_BYTES,
        }
    }
}

/// The descriptor of a tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tree {
    /// The byte format of the nodes.
    pub format: NodeFormat,
    /// The root, or `None` for the tree of no primitives. A tree of one leaf has no nodes.
    pub root: Option<Subtree>,
    /// How many nodes there are; of shared-plane nodes, how many words.
    pub node_count: u32,
    /// How many leaves there are.
    pub leaf_count: u32,
    /// How many leaf table entries there are: the number of primitives.
    pub entry_count: u32,
    /// Where the nodes are.
    pub nodes: Region,
    /// Where the leaf table is.
    pub leaf_table: Region,
}

impl Tree {
    /// The tree of no primitives, with room for one in `nodes` and `leaf_table`.
    pub const fn empty(format: NodeFormat, nodes: Region, leaf_table: Region) -> Self {
        Self { format, root: None, node_count: 0, leaf_count: 0, entry_count: 0, nodes, leaf_table }
    }
}
