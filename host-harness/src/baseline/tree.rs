//! A tree on the host.

use xylem_core::geom::Aabb;
use xylem_core::node::{Bvh2Node, Child, NodeIndex, Subtree};
use xylem_core::quality::{Quality, SahCost};

/// A tree on the host, in the core's terms: children come before parents, and a leaf is a range of
/// [`HostTree::primitives`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct HostTree {
    /// The inner nodes, the root last.
    pub nodes: Vec<Bvh2Node>,
    /// The primitives in the order of the leaves.
    pub primitives: Vec<u32>,
    /// The root, or `None` for the tree of no primitives.
    pub root: Option<Subtree>,
}

/// Where the ranges of a tree under construction are cut.
///
/// A tree of `n` primitives has at most one cut between two neighbours, so the cut in front of
/// position `i` is entry `i`, and a subtree owns the entries inside its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cut {
    /// Where the left part is cut, or [`Cut::NONE`] if it is a leaf.
    pub left: u32,
    /// The same of the right part.
    pub right: u32,
}

impl Cut {
    /// In place of a position: not cut.
    pub const NONE: u32 = u32::MAX;
    /// A range both of whose parts are leaves.
    pub const LEAVES: Self = Self { left: Self::NONE, right: Self::NONE };
}

/// A subtree still to be assembled.
enum Task {
    Range { first: u32, end: u32, cut: u32 },
    Node,
}

impl HostTree {
    /// Assembles the tree whose ranges of `primitives` are cut as said, the whole one at `root`.
    pub(super) fn assemble(boxes: &[Aabb], primitives: Vec<u32>, cuts: &[Cut], root: u32) -> Self {
        let mut nodes = Vec::new();
        let mut done: Vec<Subtree> = Vec::new();
        let end = primitives.len() as u32;
        let mut tasks = Vec::new();
        if end > 0 {
            tasks.push(Task::Range { first: 0, end, cut: root });
        }
        while let Some(task) = tasks.pop() {
            match task {
                Task::Range { first, end, cut: Cut::NONE } => {
                    let range = &primitives[first as usize..end as usize];
                    let bounds = union(range.iter().map(|&p| boxes[p as usize]));
                    done.push(Subtree { bounds, child: Child::Leaf { first, count: end - first } });
                }
                Task::Range { first, end, cut } => {
                    let Cut { left, right } = cuts[cut as usize];
                    tasks.push(Task::Node);
                    tasks.push(Task::Range { first: cut, end, cut: right });
                    tasks.push(Task::Range { first, end: cut, cut: left });
                }
                Task::Node => {
                    if let (Some(right), Some(left)) = (done.pop(), done.pop()) {
                        let bounds = left.bounds.union(&right.bounds);
                        let child = Child::Inner(NodeIndex(nodes.len() as u32));
                        nodes.push(Bvh2Node { children: [left, right] });
                        done.push(Subtree { bounds, child });
                    }
                }
            }
        }
        Self { nodes, primitives, root: done.pop() }
    }

    /// Measures the tree as [`xylem_core::quality::check`] does one in memory.
    pub fn quality(&self) -> Quality {
        let mut quality = Quality {
            root_area: self.root.map_or(0, |root| root.bounds.half_area()),
            ..Quality::default()
        };
        let mut depths: Vec<u32> = Vec::with_capacity(self.nodes.len());
        let leaf = |subtree: &Subtree, quality: &mut Quality| {
            if let Child::Leaf { count, .. } = subtree.child {
                quality.leaf_area += u128::from(subtree.bounds.half_area()) * u128::from(count);
                quality.largest_leaf = quality.largest_leaf.max(count);
            }
        };
        for node in &self.nodes {
            let [left, right] = &node.children;
            quality.inner_area += u128::from(left.bounds.union(&right.bounds).half_area());
            let below = node.children.iter().filter_map(|subtree| match subtree.child {
                Child::Inner(NodeIndex(index)) => Some(depths[index as usize]),
                Child::Leaf { .. } => None,
            });
            depths.push(1 + below.max().unwrap_or(0));
            leaf(left, &mut quality);
            leaf(right, &mut quality);
        }
        quality.depth = depths.last().copied().unwrap_or(0);
        if let (true, Some(root)) = (self.nodes.is_empty(), &self.root) {
            leaf(root, &mut quality);
        }
        quality
    }

    /// The SAH cost, see [`Quality::sah_cost`].
    pub fn sah_cost(&self) -> SahCost {
        self.quality().sah_cost()
    }
}

/// The smallest box around some boxes.
pub(super) fn union(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    boxes.fold(Aabb::EMPTY, |a, b| a.union(&b))
}
