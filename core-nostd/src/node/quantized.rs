//! The 16-byte node: two boxes on the parent's local grid.

use super::{Child, NodeIndex};

/// The 16-byte quantized pair of P3 §5: twelve 6-bit coordinates, two leaf bits, two 27-bit
/// pointers.
///
/// Each child is a little-endian u64, child 0 first:
///
/// | bits     | field                                                     |
/// |----------|-----------------------------------------------------------|
/// | 0..6     | x, lower bound                                            |
/// | 6..12    | x, upper bound                                            |
/// | 12..24   | y, the same                                               |
/// | 24..36   | z, the same                                               |
/// | 36       | leaf                                                      |
/// | 37..64   | node index, or first leaf table entry                     |
///
/// What the coordinates mean, and on which grid, is the traversal context's business: see
/// [`crate::compress`]. The leaf bit replaces a size; a leaf ends with the marked entry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct QuantizedPair {
    /// The two children.
    pub children: [QuantizedChild; 2],
}

/// One half of a [`QuantizedPair`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct QuantizedChild {
    /// Lower bounds on x, y, z; 6 bits each.
    pub low: [u8; 3],
    /// Upper bounds on x, y, z; 6 bits each.
    pub high: [u8; 3],
    /// Where the child is; a leaf's count is [`Child::TO_MARK`].
    pub child: Child,
}

/// Width of a pointer in bits.
const POINTER_BITS: u32 = 27;

impl QuantizedPair {
    /// Bytes of a pair.
    pub const BYTES: usize = 16;

    /// The highest node index or leaf table entry that a pointer can name.
    pub const MAX_POINTER: u32 = (1 << POINTER_BITS) - 1;

    /// The pair as bytes. Coordinates are cut to 6 bits and pointers to 27.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        for (eight, child) in bytes.chunks_exact_mut(8).zip(&self.children) {
            eight.copy_from_slice(&child.to_word().to_le_bytes());
        }
        bytes
    }
}

impl QuantizedChild {
    fn to_word(self) -> u64 {
        let coordinates = (0..3).fold(0, |word, axis| {
            let (low, high) = (u64::from(self.low[axis] & 63), u64::from(self.high[axis] & 63));
            word | (low | high << 6) << (12 * axis)
        });
        let (leaf, pointer) = match self.child {
            Child::Inner(NodeIndex(index)) => (0, index),
            Child::Leaf { first, .. } => (1, first),
        };
        coordinates | leaf << 36 | u64::from(pointer & QuantizedPair::MAX_POINTER) << 37
    }

    #[inline]
    fn from_word(word: u64) -> Self {
        let six = |at: u32| (word >> at & 63) as u8;
        let pointer = (word >> 37) as u32;
        let child = match word >> 36 & 1 {
            0 => Child::Inner(NodeIndex(pointer)),
            _ => Child::Leaf { first: pointer, count: Child::TO_MARK },
        };
        Self { low: [six(0), six(12), six(24)], high: [six(6), six(18), six(30)], child }
    }
}

/// A borrowed quantized pair. Every bit pattern is one; accessors never panic.
#[derive(Clone, Copy, Debug)]
pub struct QuantizedView<'a> {
    bytes: &'a [u8; QuantizedPair::BYTES],
}

impl<'a> QuantizedView<'a> {
    /// A view of a pair's bytes.
    #[inline]
    pub const fn new(bytes: &'a [u8; QuantizedPair::BYTES]) -> Self {
        Self { bytes }
    }

    /// Child 0 or 1.
    #[inline]
    pub fn child(&self, child: usize) -> QuantizedChild {
        let mut eight = [0; 8];
        eight.copy_from_slice(&self.bytes[8 * (child & 1)..8 * (child & 1) + 8]);
        QuantizedChild::from_word(u64::from_le_bytes(eight))
    }

    /// The whole pair.
    pub fn to_repr(&self) -> QuantizedPair {
        QuantizedPair { children: [self.child(0), self.child(1)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_round_trip_with_fields_in_their_places() {
        let pair = QuantizedPair {
            children: [
                QuantizedChild {
                    low: [1, 2, 3],
                    high: [63, 62, 61],
                    child: Child::Inner(NodeIndex(QuantizedPair::MAX_POINTER)),
                },
                QuantizedChild {
                    low: [0, 0, 32],
                    high: [0, 0, 0],
                    child: Child::Leaf { first: 1, count: Child::TO_MARK },
                },
            ],
        };
        let bytes = pair.to_bytes();
        assert_eq!(QuantizedView::new(&bytes).to_repr(), pair);
        // x: 1 | 63 << 6; the pointer fills everything from bit 37 on; the leaf bit is clear.
        assert_eq!(u16::from_le_bytes([bytes[0], bytes[1]]) & 0xfff, 1 | 63 << 6);
        assert_eq!(bytes[4..8], [0b1110_1111, 0xff, 0xff, 0xff]);
        assert_eq!(
            u64::from_le_bytes(bytes[8..].try_into().unwrap()),
            32 << 24 | 1 << 36 | 1 << 37
        );
    }

    #[test]
    fn every_bit_pattern_survives() {
        let mut seed = 7u64;
        for _ in 0..1000 {
            let mut bytes = [0; 16];
            for byte in &mut bytes {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                *byte = (seed >> 56) as u8;
            }
            assert_eq!(QuantizedView::new(&bytes).to_repr().to_bytes(), bytes);
        }
    }
}
