//! Treelets: the upper part of a subtree, still on chip (P3 §4.3).

use super::Placement;
use crate::node::{Bvh2Node, NodeIndex, Quantization};

/// Nodes on the longest way down a treelet.
pub(super) const MAX_TREELET_DEPTH: u8 = 4;

/// Where a node goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// Behind all that were written before.
    Next,
    /// Where it is now.
    At(NodeIndex),
}

/// A node that is still on chip.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HeldNode {
    pub(super) node: Bvh2Node,
    pub(super) place: Place,
    pub(super) below: [Below; 2],
}

/// What is under a held node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Below {
    Leaf,
    /// A node of the same treelet.
    Held,
    /// A node in memory, in this context.
    Written(Placement),
}

impl HeldNode {
    /// Something to fill storage with.
    pub const EMPTY: Self =
        Self { node: Bvh2Node::EMPTY, place: Place::Next, below: [Below::Leaf; 2] };
}

/// The most nodes of a treelet, and one place in front that stays empty.
const TREELET: usize = 1 << MAX_TREELET_DEPTH;

/// A treelet and the context of each of its nodes. The children of the node in place `s`, counted from
/// 1, are in `2s` and `2s + 1`. A place without a context has no node, whatever is in it.
#[derive(Debug)]
pub(super) struct Treelet {
    pub nodes: [HeldNode; TREELET],
    pub contexts: [Option<Placement>; TREELET],
}

impl Treelet {
    pub const EMPTY: Self = Self { nodes: [HeldNode::EMPTY; TREELET], contexts: [None; TREELET] };

    /// Makes room for another one. Its nodes are found from the root down, so nothing else is cleared:
    /// on a soft core that took longer than to encode them.
    pub fn clear(&mut self) {
        self.contexts = [None; TREELET];
    }

    /// Puts a held treelet under the root, as its child number `side`.
    pub fn add(&mut self, side: usize, slots: &[HeldNode]) {
        for (at, node) in (1usize..).zip(slots) {
            // The same place in its layer, a layer down; the layers of child 1 begin in the middle.
            let layer = 1 << at.ilog2();
            if let Some(place) = self.nodes.get_mut(at + layer * (1 + side)) {
                *place = *node;
            }
        }
    }

    /// Finds all contexts from the root's, or gives `None` for a box that leaves its parent.
    pub fn place(&mut self, root: Placement, quantization: &Quantization) -> Option<()> {
        self.contexts[1] = Some(root);
        for at in 1..TREELET / 2 {
            let Some(context) = self.contexts[at] else { continue };
            let HeldNode { node, below, .. } = &self.nodes[at];
            for (side, (child, below)) in node.children.iter().zip(below).enumerate() {
                if *below == Below::Held {
                    let (_, cells) = context.encode(&child.bounds, child.child, quantization)?;
                    self.contexts[2 * at + side] = Some(context.child(&cells, quantization));
                }
            }
        }
        Some(())
    }
}
