//! The tree that a build must give, made top-down and recursively.
//!
//! Written from the definition, not from the streaming algorithm: sort by Morton code, cut into
//! leaves of equal codes, and split each range where the highest bit that is not the same for all
//! of it changes. Nodes are numbered in the order in which a depth-first walk leaves them.

use glam::IVec3;
use xylem_core::geom::{Aabb, PrimIndex, Triangle};
use xylem_core::node::{Bvh2Node, Child, LeafEntry, NodeIndex, Subtree};
use xylem_core::num::{Grid, MortonWidth};

/// A tree as it must be in memory.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Lbvh {
    /// The bytes of the nodes.
    pub nodes: Vec<u8>,
    /// The bytes of the leaf table.
    pub leaf_table: Vec<u8>,
    /// The root.
    pub root: Option<Subtree>,
}

/// A leaf: its place in the order of all leaves and its box.
struct Leaf {
    code: u64,
    number: u32,
    subtree: Subtree,
}

impl Lbvh {
    /// The tree over `triangles` with leaves of at most `max_leaf` triangles.
    pub fn new(triangles: &[Triangle], morton: MortonWidth, max_leaf: u32) -> Self {
        let code = |i: &u32| morton_code(&triangles[*i as usize].bounds(), morton);
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        order.sort_by_key(code);
        let mut tree = Self::default();
        let mut leaves = Vec::new();
        for equal in order.chunk_by(|a, b| code(a) == code(b)) {
            for chunk in equal.chunks(max_leaf as usize) {
                let first = (tree.leaf_table.len() / LeafEntry::BYTES) as u32;
                let child = Child::Leaf { first, count: chunk.len() as u32 };
                let boxes = chunk.iter().map(|&i| triangles[i as usize].bounds());
                let bounds = boxes.fold(Aabb::EMPTY, |a, b| a.union(&b));
                let number = leaves.len() as u32;
                leaves.push(Leaf {
                    code: code(&chunk[0]),
                    number,
                    subtree: Subtree { bounds, child },
                });
                for (i, &primitive) in chunk.iter().enumerate() {
                    let last = i + 1 == chunk.len();
                    let entry = LeafEntry { primitive: PrimIndex(primitive), last };
                    tree.leaf_table.extend(entry.to_bytes());
                }
            }
        }
        if !leaves.is_empty() {
            tree.root = Some(tree.grow(&leaves));
        }
        tree
    }

    fn grow(&mut self, leaves: &[Leaf]) -> Subtree {
        let [first, .., last] = leaves else { return leaves[0].subtree };
        let key = |leaf: &Leaf| u128::from(leaf.code) << 32 | u128::from(leaf.number);
        let bit = (key(first) ^ key(last)).ilog2();
        let (left, right) = leaves.split_at(leaves.partition_point(|l| key(l) >> bit & 1 == 0));
        let children = [self.grow(left), self.grow(right)];
        let index = NodeIndex((self.nodes.len() / Bvh2Node::BYTES) as u32);
        self.nodes.extend(Bvh2Node { children }.to_bytes());
        let bounds = children[0].bounds.union(&children[1].bounds);
        Subtree { bounds, child: Child::Inner(index) }
    }
}

/// The Morton code of a box's centre, bit by bit.
pub fn morton_code(bounds: &Aabb, morton: MortonWidth) -> u64 {
    let sum: IVec3 = bounds.min + bounds.max;
    let centre = sum.to_array().map(|s| s.div_euclid(2) - Grid::DEFAULT.min());
    let mut code = 0;
    for bit in (0..24).rev().take(morton.axis_bits() as usize) {
        for c in centre {
            code = code << 1 | u64::from(c as u32 >> bit & 1);
        }
    }
    code
}
