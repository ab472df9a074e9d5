//! The memory traffic of Doyle et al.'s binned SAH hardware, as P2 §6.1 models it.

use xylem_core::node::{Bvh2Node, Child, LeafEntry, NodeIndex};

use super::HostTree;

/// The builder's memory: what fits on chip, and what records are long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DoyleModel {
    /// Primitive boxes that the local buffers hold.
    pub capacity: u64,
    /// Bytes of a primitive's box in memory.
    pub record_bytes: u64,
}

impl DoyleModel {
    /// The instance that P2 models: 8192 boxes. P2 does not say how long a record is; here it is six
    /// coordinates and a reference, without the padding of the streaming builder's.
    pub const PAPER: Self = Self { capacity: 8192, record_bytes: 28 };

    /// What the build of a tree moves.
    ///
    /// A range of primitives that is too long for the buffers is swept through memory: it is written
    /// by the sweep that makes it and read by its own. (The whole scene is read twice instead: its
    /// bins come from a sweep of their own.) A sweep makes both child ranges at a time; where each
    /// would fit but both do not, the smaller one goes through memory.
    pub fn traffic(&self, tree: &HostTree) -> DoyleTraffic {
        let mut sizes: Vec<u64> = Vec::with_capacity(tree.nodes.len());
        let mut swept = 0;
        for node in &tree.nodes {
            let [left, right] = node.children.map(|subtree| match subtree.child {
                Child::Inner(NodeIndex(index)) => sizes[index as usize],
                Child::Leaf { count, .. } => u64::from(count),
            });
            sizes.push(left + right);
            swept += match (left > self.capacity, right > self.capacity) {
                (false, false) if left + right > self.capacity => left.min(right),
                (long_left, long_right) => {
                    u64::from(long_left) * left + u64::from(long_right) * right
                }
            };
        }
        let count = tree.primitives.len() as u64;
        let whole = if count > self.capacity { 2 } else { 1 };
        DoyleTraffic {
            read_bytes: (whole * count + swept) * self.record_bytes,
            write_bytes: swept * self.record_bytes,
            tree_bytes: tree.nodes.len() as u64 * Bvh2Node::BYTES as u64
                + count * LeafEntry::BYTES as u64,
        }
    }
}

/// Bytes that a build moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DoyleTraffic {
    /// Primitives read.
    pub read_bytes: u64,
    /// Primitives written.
    pub write_bytes: u64,
    /// Nodes and leaf references written.
    pub tree_bytes: u64,
}

impl DoyleTraffic {
    /// All of it.
    pub const fn bytes(&self) -> u64 {
        self.read_bytes + self.write_bytes + self.tree_bytes
    }
}

#[cfg(test)]
mod tests {
    use super::super::binned;
    use super::*;
    use xylem_core::geom::Aabb;

    /// `count` cubes in a row with a cube's width between, in clusters of `cluster`.
    fn row(count: i32, cluster: i32) -> HostTree {
        let cube = |i: i32| {
            let x = 2 * i + 1000 * (i / cluster);
            Aabb::new([x, 0, 0].into(), [x + 1, 1, 1].into())
        };
        binned(&(0..count).map(cube).collect::<Vec<_>>(), 16)
    }

    fn swept(tree: &HostTree, capacity: u64) -> u64 {
        DoyleModel { capacity, record_bytes: 32 }.traffic(tree).write_bytes / 32
    }

    #[test]
    fn what_fits_is_read_once_and_never_written() {
        let tree = row(64, 32);
        let traffic = DoyleModel { capacity: 64, record_bytes: 32 }.traffic(&tree);
        assert_eq!((traffic.read_bytes, traffic.write_bytes), (64 * 32, 0));
        assert_eq!(traffic.tree_bytes, 64 * tree.nodes.len() as u64 + 4 * 64);
        assert_eq!(traffic.bytes(), 64 * 32 + traffic.tree_bytes);
    }

    #[test]
    fn of_two_children_that_fit_one_by_one_the_smaller_is_swept() {
        // 40 in two clusters: 32 and 8.
        let tree = row(40, 32);
        assert_eq!(swept(&tree, 40), 0);
        assert_eq!(swept(&tree, 39), 8);
        assert_eq!(swept(&tree, 32), 8);
        // Now the larger one does not fit: only it is swept, and of its halves one.
        assert_eq!(swept(&tree, 31), 32 + 16);
    }
}
