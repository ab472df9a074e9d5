//! The SAH cost of a tree, measured while its nodes pass.

use crate::node::{Child, MAX_LEAF_SIZE, Subtree};
use crate::quality::{Quality, SahCost};

/// Adds up the SAH cost of a tree from its exact nodes, in any order and in one pass.
///
/// The sums have 128 bits: a half area has at most 50, a leaf 8 more for its size, and there are fewer
/// than 2³¹ nodes, so 90 are used. In hardware these are the multipliers for three areas a node, 24 by 24
/// bits, and two accumulators beside the node's write port.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct CostMeter {
    inner_area: u128,
    leaf_area: u128,
}

impl CostMeter {
    /// The meter before the first node.
    pub const fn new() -> Self {
        Self { inner_area: 0, leaf_area: 0 }
    }

    /// Takes a node in by its children: its own box, which is that around theirs, and its leaves.
    #[inline]
    pub fn node(&mut self, [first, second]: [&Subtree; 2]) {
        self.inner_area += u128::from(first.bounds.union(&second.bounds).half_area());
        self.leaf(first);
        self.leaf(second);
    }

    #[inline]
    fn leaf(&mut self, subtree: &Subtree) {
        if let Child::Leaf { count, .. } = subtree.child {
            let count = u64::from(count.min(MAX_LEAF_SIZE));
            self.leaf_area += u128::from(subtree.bounds.half_area() * count);
        }
    }

    /// The cost of the tree with this root, of which all nodes have been taken in; see
    /// [`Quality::sah_cost`]. A root that is a leaf needs none.
    pub fn cost(&self, root: &Subtree) -> SahCost {
        let mut whole = *self;
        whole.leaf(root);
        let Self { inner_area, leaf_area } = whole;
        let root_area = root.bounds.half_area();
        Quality { root_area, inner_area, leaf_area, ..Quality::default() }.sah_cost()
    }
}
