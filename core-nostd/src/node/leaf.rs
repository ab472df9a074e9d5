//! The leaf table.

use crate::geom::PrimIndex;

/// An entry of the leaf table: one primitive of a leaf.
///
/// | bits   | field                                   |
/// |--------|-----------------------------------------|
/// | 0..31  | the primitive's reference               |
/// | 31     | set in the last entry of a leaf         |
///
/// The mark lets a 27-bit leaf pointer do without a size (P3 §5 gives the quantized leaf a pointer
/// only). The table is in sorted order, so the leaves follow one another without gaps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LeafEntry {
    /// The primitive, at most 31 bits.
    pub primitive: PrimIndex,
    /// Whether the leaf ends here.
    pub last: bool,
}

impl LeafEntry {
    /// Bytes of an entry.
    pub const BYTES: usize = 4;

    /// The entry as little-endian bytes.
    #[inline]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        ((self.primitive.0 & 0x7fff_ffff) | (self.last as u32) << 31).to_le_bytes()
    }

    /// The entry of little-endian bytes; every pattern is one.
    #[inline]
    pub const fn from_bytes(bytes: [u8; Self::BYTES]) -> Self {
        let word = u32::from_le_bytes(bytes);
        Self { primitive: PrimIndex(word & 0x7fff_ffff), last: word >> 31 == 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_the_reference_with_the_mark_on_top() {
        let entry = LeafEntry { primitive: PrimIndex(0x7654_3210), last: true };
        assert_eq!(entry.to_bytes(), [0x10, 0x32, 0x54, 0xf6]);
        assert_eq!(LeafEntry::from_bytes(entry.to_bytes()), entry);
    }
}
