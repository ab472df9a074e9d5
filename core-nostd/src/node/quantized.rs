//! The quantized node: two boxes on the parent's local grid.

use super::{Child, NodeIndex};
use crate::error::ConfigError;

/// How a quantized coordinate names a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Coordinates {
    /// Counted from the parent's lower bound; the upper bound is stored less one (P3 Eq. 1).
    Relative,
    /// The cell's number on the scene-wide grid of that scale, modulo 2^N (P3 Eqs. 7–8).
    Modulo,
}

/// How boxes are quantized: what a reader must know beside the nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Quantization {
    /// What the stored numbers mean.
    pub coordinates: Coordinates,
    /// `N`, the width of a coordinate in bits, 4 to 8.
    pub bits: u8,
    /// No local grid is finer than `2^min_scale` grid units (P3 §4.4), 0 to 15.
    pub min_scale: u8,
}

impl Quantization {
    /// P3's width in relative coordinates.
    pub const RELATIVE: Self =
        Self { coordinates: Coordinates::Relative, bits: 6, min_scale: Self::MIN_SCALE };

    /// P3's width in modulo coordinates.
    pub const MODULO: Self = Self { coordinates: Coordinates::Modulo, ..Self::RELATIVE };

    /// The minimum scale if nothing else is asked for: one grid unit, by nature the finest.
    pub const MIN_SCALE: u8 = 0;

    /// The widths that a format can have, in bits.
    pub const WIDTHS: core::ops::RangeInclusive<u8> = 4..=8;

    /// The highest minimum scale.
    pub const MAX_MIN_SCALE: u8 = 15;

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ConfigError::Quantization`].
    pub fn check(&self) -> Result<(), ConfigError> {
        let good = Self::WIDTHS.contains(&self.bits) && self.min_scale <= Self::MAX_MIN_SCALE;
        if good { Ok(()) } else { Err(ConfigError::Quantization) }
    }

    /// Bytes of a node: whole words for twelve coordinates, two leaf bits and two pointers. 16 up
    /// to 6 bits, 20 above.
    pub const fn node_bytes(&self) -> u32 {
        if self.bits <= 6 { 16 } else { 20 }
    }

    /// Bytes of a node of up to four children: two pairs'.
    pub const fn wide_bytes(&self) -> u32 {
        2 * self.node_bytes()
    }

    /// The most cells that a box spans on its local grid: 2^N.
    pub const fn max_cells(&self) -> i32 {
        1 << self.bits
    }
}

/// The quantized pair of P3 §5: twelve coordinates, two leaf bits, two 27-bit pointers.
///
/// Each child is a little-endian integer of 8 bytes, or of 10 where coordinates have more than
/// 6 bits; child 0 first. With `N` bits a coordinate:
///
/// | bits             | `N` = 6  | field                                            |
/// |------------------|----------|--------------------------------------------------|
/// | 0..N             | 0..6     | x, lower bound                                   |
/// | N..2N            | 6..12    | x, upper bound                                   |
/// | 2N..4N           | 12..24   | y, the same                                      |
/// | 4N..6N           | 24..36   | z, the same                                      |
/// | 6N               | 36       | leaf                                             |
/// | 6N+1..6N+28      | 37..64   | node index, or first leaf table entry            |
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
    /// Lower bounds on x, y, z; `N` bits each.
    pub low: [u8; 3],
    /// Upper bounds on x, y, z; `N` bits each.
    pub high: [u8; 3],
    /// Where the child is; a leaf's count is [`Child::TO_MARK`].
    pub child: Child,
}

/// Width of a pointer in bits.
const POINTER_BITS: u32 = 27;

impl QuantizedPair {
    /// Bytes of the longest pair.
    pub const MAX_BYTES: usize = 20;

    /// The highest node index or leaf table entry that a pointer can name.
    pub const MAX_POINTER: u32 = (1 << POINTER_BITS) - 1;

    /// The pair as bytes, of which a node has the first [`Quantization::node_bytes`]. Coordinates
    /// are cut to `bits` bits, 4 to 8, and pointers to 27.
    pub fn to_bytes(&self, bits: u8) -> [u8; Self::MAX_BYTES] {
        let mut bytes = [0; Self::MAX_BYTES];
        let half = if bits <= 6 { 8 } else { 10 };
        for (half, child) in bytes.chunks_exact_mut(half).zip(&self.children) {
            half.copy_from_slice(&child.to_word(bits).to_le_bytes()[..half.len()]);
        }
        bytes
    }
}

impl QuantizedChild {
    /// Something to fill a pair with.
    pub(crate) const EMPTY: Self =
        Self { low: [0; 3], high: [0; 3], child: Child::Inner(NodeIndex(0)) };

    pub(super) fn to_word(self, bits: u8) -> u128 {
        let (n, mask) = (u32::from(bits), (1u64 << bits) - 1);
        let coordinates = (0..3).fold(0, |word, axis| {
            let (low, high) = (u64::from(self.low[axis]), u64::from(self.high[axis]));
            word | (low & mask | (high & mask) << n) << (2 * n * axis as u32)
        });
        let (leaf, pointer) = match self.child {
            Child::Inner(NodeIndex(index)) => (0, index),
            Child::Leaf { first, .. } => (1, first),
        };
        let tail = leaf | (pointer & QuantizedPair::MAX_POINTER) << 1;
        u128::from(coordinates) | u128::from(tail) << (6 * n)
    }

    /// A child of `bits`-bit coordinates and its leaf bit and pointer.
    #[inline(always)]
    pub(super) fn from_parts(coordinates: u64, tail: u32, bits: u8) -> Self {
        let (n, mask) = (u32::from(bits), (1u64 << bits) - 1);
        let field = |i: u32| (coordinates >> (n * i) & mask) as u8;
        let pointer = tail >> 1 & QuantizedPair::MAX_POINTER;
        let child = match tail & 1 {
            0 => Child::Inner(NodeIndex(pointer)),
            _ => Child::Leaf { first: pointer, count: Child::TO_MARK },
        };
        Self { low: [field(0), field(2), field(4)], high: [field(1), field(3), field(5)], child }
    }
}

/// A borrowed quantized pair. Every bit pattern is one; accessors never panic.
#[derive(Clone, Copy, Debug)]
pub struct QuantizedView<'a> {
    bytes: &'a [u8; QuantizedPair::MAX_BYTES],
    bits: u8,
}

impl<'a> QuantizedView<'a> {
    /// A view of a pair's bytes, with coordinates of `bits` bits, 4 to 8.
    #[inline]
    pub const fn new(bytes: &'a [u8; QuantizedPair::MAX_BYTES], bits: u8) -> Self {
        Self { bytes, bits }
    }

    /// Child 0 or 1.
    #[inline(always)]
    pub fn child(&self, child: usize) -> QuantizedChild {
        let bits = self.bits;
        let word = |at: usize| {
            let mut eight = [0; 8];
            eight.copy_from_slice(&self.bytes[at..at + 8]);
            u64::from_le_bytes(eight)
        };
        if bits <= 6 {
            let word = word(8 * (child & 1));
            return QuantizedChild::from_parts(word, (word >> (6 * bits)) as u32, bits);
        }
        // The upper 8 of 10 bytes hold what lies above bit 16.
        let at = 10 * (child & 1);
        let tail = word(at + 2) >> (6 * bits - 16);
        QuantizedChild::from_parts(word(at), tail as u32, bits)
    }

    /// The whole pair.
    pub fn to_repr(&self) -> QuantizedPair {
        QuantizedPair { children: [self.child(0), self.child(1)] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, cases};

    fn child(low: [u8; 3], high: [u8; 3], child: Child) -> QuantizedChild {
        QuantizedChild { low, high, child }
    }

    #[test]
    fn pairs_round_trip_with_fields_in_their_places() {
        let pointer = Child::Inner(NodeIndex(QuantizedPair::MAX_POINTER));
        let leaf = Child::Leaf { first: 1, count: Child::TO_MARK };
        let pair = QuantizedPair {
            children: [child([1, 2, 3], [63, 62, 61], pointer), child([0, 0, 32], [0, 0, 0], leaf)],
        };
        let bytes = pair.to_bytes(6);
        assert_eq!(QuantizedView::new(&bytes, 6).to_repr(), pair);
        // x: 1 | 63 << 6; the pointer fills everything from bit 37 on; the leaf bit is clear.
        assert_eq!(u16::from_le_bytes([bytes[0], bytes[1]]) & 0xfff, 1 | 63 << 6);
        assert_eq!(bytes[4..8], [0b1110_1111, 0xff, 0xff, 0xff]);
        let second = u64::from_le_bytes(bytes[8..16].try_into().unwrap());
        assert_eq!(second, 32 << 24 | 1 << 36 | 1 << 37);
        assert_eq!(bytes[16..], [0; 4]);
    }

    #[test]
    fn pairs_of_every_width_round_trip() {
        for bits in Quantization::WIDTHS {
            let top = ((1u32 << bits) - 1) as u8;
            let leaf = Child::Leaf { first: QuantizedPair::MAX_POINTER, count: Child::TO_MARK };
            let pair = QuantizedPair {
                children: [
                    child([top, 0, 1], [0, top, top - 1], leaf),
                    child([5, 6, 7], [top, 1, 0], Child::Inner(NodeIndex(0x2aa_aaaa))),
                ],
            };
            let bytes = pair.to_bytes(bits);
            assert_eq!(QuantizedView::new(&bytes, bits).to_repr(), pair, "{bits}");
            let quantization = Quantization { bits, ..Quantization::MODULO };
            assert!(bytes[quantization.node_bytes() as usize..].iter().all(|&b| b == 0));
        }
    }

    #[test]
    fn every_bit_pattern_of_six_bits_a_coordinate_survives() {
        let mut random = Random(7);
        for _ in 0..cases(1000) {
            let mut bytes = [0; 20];
            for byte in &mut bytes[..16] {
                *byte = random.below(256) as u8;
            }
            assert_eq!(QuantizedView::new(&bytes, 6).to_repr().to_bytes(6), bytes);
        }
    }
}
