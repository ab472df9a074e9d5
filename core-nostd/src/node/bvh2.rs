//! The 64-byte node: two exact boxes.

use glam::IVec3;

use super::{Child, MAX_LEAF_SIZE, NodeIndex, Subtree};
use crate::geom::Aabb;

/// The 64-byte two-box node of P2 §4.1 and Fig. 2 (MBVH2), with fixed-point coordinates.
///
/// All fields are little-endian; coordinates are i32 in grid units.
///
/// | bytes   | field                                                     |
/// |---------|-----------------------------------------------------------|
/// | 0..12   | child 0: lowest corner x, y, z                            |
/// | 12..24  | child 0: highest corner x, y, z                           |
/// | 24..48  | child 1: the same                                         |
/// | 48..52  | child 0: node index, or first leaf table entry            |
/// | 52..56  | child 0: leaf size 1..=255, or 0 for a node               |
/// | 56..64  | child 1: the same two                                     |
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bvh2Node {
    /// The two children with their boxes.
    pub children: [Subtree; 2],
}

impl Bvh2Node {
    /// Something to fill storage with.
    pub(crate) const EMPTY: Self = Self { children: [Subtree::EMPTY; 2] };
}

mod field {
    use core::ops::Range;

    pub const fn bounds(child: usize) -> Range<usize> {
        24 * child..24 * child + 24
    }
    pub const fn index(child: usize) -> Range<usize> {
        48 + 8 * child..52 + 8 * child
    }
    pub const fn size(child: usize) -> Range<usize> {
        52 + 8 * child..56 + 8 * child
    }
}

impl Bvh2Node {
    /// Bytes of a node.
    pub const BYTES: usize = 64;

    /// The node as bytes.
    #[inline]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        self.write(&mut bytes);
        bytes
    }

    /// Writes the node to `bytes`.
    #[inline]
    pub fn write(&self, bytes: &mut [u8; Self::BYTES]) {
        Self::write_children(self.children.each_ref(), bytes);
    }

    /// Writes the node over `children` to `bytes`.
    #[inline(always)]
    pub fn write_children(children: [&Subtree; 2], bytes: &mut [u8; Self::BYTES]) {
        for (i, Subtree { bounds, child }) in children.into_iter().enumerate() {
            let corners = [bounds.min, bounds.max];
            let words = corners.iter().flat_map(|corner| corner.to_array());
            for (four, c) in bytes[field::bounds(i)].chunks_exact_mut(4).zip(words) {
                four.copy_from_slice(&c.to_le_bytes());
            }
            let (index, size) = child.words();
            bytes[field::index(i)].copy_from_slice(&index.to_le_bytes());
            bytes[field::size(i)].copy_from_slice(&size.to_le_bytes());
        }
    }
}

/// A borrowed 64-byte node. Accessors never panic, whatever the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Bvh2View<'a> {
    bytes: &'a [u8; Bvh2Node::BYTES],
}

impl<'a> Bvh2View<'a> {
    /// A view of a node's bytes.
    #[inline]
    pub const fn new(bytes: &'a [u8; Bvh2Node::BYTES]) -> Self {
        Self { bytes }
    }

    #[inline]
    fn word(&self, at: usize) -> i32 {
        i32::from_le_bytes([
            self.bytes[at],
            self.bytes[at + 1],
            self.bytes[at + 2],
            self.bytes[at + 3],
        ])
    }

    /// The box of child 0 or 1, unchecked.
    #[inline]
    pub fn bounds(&self, child: usize) -> Aabb {
        let at = field::bounds(child & 1).start;
        let vector = |at: usize| IVec3::new(self.word(at), self.word(at + 4), self.word(at + 8));
        Aabb::new(vector(at), vector(at + 12))
    }

    /// The pointer of child 0 or 1, or `None` if its leaf size is over [`MAX_LEAF_SIZE`].
    #[inline]
    pub fn child(&self, child: usize) -> Option<Child> {
        let index = self.word(field::index(child & 1).start) as u32;
        match self.word(field::size(child & 1).start) as u32 {
            0 => Some(Child::Inner(NodeIndex(index))),
            count if count <= MAX_LEAF_SIZE => Some(Child::Leaf { first: index, count }),
            _ => None,
        }
    }

    /// The whole node, or `None` if a child pointer or a box is not one that a builder writes.
    pub fn to_repr(&self) -> Option<Bvh2Node> {
        let subtree = |i| {
            let (bounds, child) = (self.bounds(i), self.child(i)?);
            bounds.is_valid().then_some(Subtree { bounds, child })
        };
        Some(Bvh2Node { children: [subtree(0)?, subtree(1)?] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node() -> Bvh2Node {
        let bounds = |v: i32| Aabb::new(IVec3::new(v, -v, 3), IVec3::new(v + 9, v, 4));
        Bvh2Node {
            children: [
                Subtree { bounds: bounds(1), child: Child::Inner(NodeIndex(0x0102_0304)) },
                Subtree { bounds: bounds(2), child: Child::Leaf { first: 5, count: 255 } },
            ],
        }
    }

    #[test]
    fn nodes_round_trip_with_fields_in_their_places() {
        let bytes = node().to_bytes();
        assert_eq!(bytes[..8], [1, 0, 0, 0, 255, 255, 255, 255]);
        assert_eq!(bytes[48..], [4, 3, 2, 1, 0, 0, 0, 0, 5, 0, 0, 0, 255, 0, 0, 0]);
        assert_eq!(Bvh2View::new(&bytes).to_repr(), Some(node()));
    }

    #[test]
    fn leaf_sizes_over_the_field_and_inverted_boxes_are_no_nodes() {
        let mut bytes = node().to_bytes();
        bytes[61] = 1;
        assert_eq!(Bvh2View::new(&bytes).child(1), None);
        let mut bytes = node().to_bytes();
        bytes[15] = 0x80;
        assert_eq!(Bvh2View::new(&bytes).to_repr(), None);
    }
}
