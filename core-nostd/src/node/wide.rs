//! The wide node: up to four boxes on the parent's local grid.

use super::{QuantizedChild, QuantizedPair};

/// A quantized node of up to four children.
///
/// The children are those of a [`QuantizedPair`], coded alike, and follow one another: 32 bytes, or 40
/// where coordinates have more than 6 bits. With `N` bits a coordinate, child `i` is the
/// little-endian integer of 8 (or 10) bytes from byte `8 i` (`10 i`) on:
///
/// | bits             | `N` = 6  | field                                            |
/// |------------------|----------|--------------------------------------------------|
/// | 0..6N            | 0..36    | x, y, z: lower bound and upper bound, `N` bits each |
/// | 6N               | 36       | leaf                                             |
/// | 6N+1..6N+28      | 37..64   | node index, or first leaf table entry            |
///
/// A leaf whose pointer is all ones is no child. Children come first and no children after them; a
/// reader need not rely on it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct WideNode {
    /// The children.
    pub children: [Option<QuantizedChild>; Self::CHILDREN],
}

impl WideNode {
    /// The most children.
    pub const CHILDREN: usize = 4;

    /// Bytes of the longest node.
    pub const MAX_BYTES: usize = 2 * QuantizedPair::MAX_BYTES;

    /// The highest node index or leaf table entry that a pointer can name.
    pub const MAX_POINTER: u32 = QuantizedPair::MAX_POINTER - 1;

    /// Something to fill.
    pub(crate) const EMPTY: Self = Self { children: [None; Self::CHILDREN] };

    /// The node as bytes, of which it has the first [`wide_bytes`]. Coordinates are cut to `bits`
    /// bits, 4 to 8, and pointers to 27.
    ///
    /// [`wide_bytes`]: super::Quantization::wide_bytes
    pub fn to_bytes(&self, bits: u8) -> [u8; Self::MAX_BYTES] {
        let mut bytes = [0; Self::MAX_BYTES];
        for (place, child) in bytes.chunks_exact_mut(child_bytes(bits)).zip(&self.children) {
            let word = child.map_or(u128::MAX, |child| child.to_word(bits));
            place.copy_from_slice(&word.to_le_bytes()[..place.len()]);
        }
        bytes
    }
}

/// A borrowed wide node. Every bit pattern is one; accessors never panic.
#[derive(Clone, Copy, Debug)]
pub struct WideView<'a> {
    bytes: &'a [u8; WideNode::MAX_BYTES],
    bits: u8,
}

impl<'a> WideView<'a> {
    /// A view of a node's bytes, with coordinates of `bits` bits, 4 to 8.
    #[inline]
    pub const fn new(bytes: &'a [u8; WideNode::MAX_BYTES], bits: u8) -> Self {
        Self { bytes, bits }
    }

    /// Child 0 to 3, if there is one.
    #[inline(always)]
    pub fn child(&self, child: usize) -> Option<QuantizedChild> {
        let len = child_bytes(self.bits);
        let at = len * (child & 3);
        let mut word = [0; 16];
        word[..len].copy_from_slice(&self.bytes[at..at + len]);
        let word = u128::from_le_bytes(word);
        let tail = (word >> (6 * u32::from(self.bits))) as u32 & NONE;
        (tail != NONE).then(|| QuantizedChild::from_parts(word as u64, tail, self.bits))
    }

    /// The whole node.
    pub fn to_repr(&self) -> WideNode {
        WideNode { children: [0, 1, 2, 3].map(|i| self.child(i)) }
    }
}

/// The leaf bit and the pointer of no child.
const NONE: u32 = QuantizedPair::MAX_POINTER << 1 | 1;

/// Bytes of a child.
#[inline(always)]
const fn child_bytes(bits: u8) -> usize {
    if bits <= 6 { 8 } else { 10 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Child, NodeIndex, Quantization};

    #[test]
    fn nodes_of_every_width_round_trip_with_any_number_of_children() {
        for bits in Quantization::WIDTHS {
            let top = ((1u32 << bits) - 1) as u8;
            let child = |child| QuantizedChild { low: [top, 0, 1], high: [0, top, top - 1], child };
            let leaf = Child::Leaf { first: WideNode::MAX_POINTER, count: Child::TO_MARK };
            let inner = Child::Inner(NodeIndex(QuantizedPair::MAX_POINTER));
            for count in 0..=4 {
                let some = |i| (i < count).then(|| child(if i == 1 { inner } else { leaf }));
                let node = WideNode { children: [0, 1, 2, 3].map(some) };
                let bytes = node.to_bytes(bits);
                assert_eq!(WideView::new(&bytes, bits).to_repr(), node, "{bits}, {count}");
                let len = Quantization { bits, ..Quantization::MODULO }.wide_bytes() as usize;
                assert!(bytes[len..].iter().all(|&b| b == 0));
            }
        }
    }

    #[test]
    fn children_are_coded_as_those_of_a_pair() {
        for bits in Quantization::WIDTHS {
            let child = |at: u8| QuantizedChild {
                low: [at, 2, 3],
                high: [7, at + 1, 9],
                child: Child::Inner(NodeIndex(77)),
            };
            let pair = QuantizedPair { children: [child(4), child(6)] }.to_bytes(bits);
            let wide = WideNode { children: [Some(child(4)), Some(child(6)), None, None] };
            let (wide, len) = (wide.to_bytes(bits), 2 * child_bytes(bits));
            assert_eq!(wide[..len], pair[..len]);
            assert!(wide[len..2 * len].iter().all(|&b| b == 0xff));
        }
    }
}
