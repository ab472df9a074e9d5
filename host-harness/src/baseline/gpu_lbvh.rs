//! The memory traffic of sorting and building an LBVH, GPU-style and with multi-merges: P2 Table I
//! from its parameters.

/// What is sorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sorted {
    /// Morton codes with references, 8 bytes; the boxes are read again for the hierarchy.
    Codes,
    /// Boxes with references, 32 bytes.
    Boxes,
}

/// How it is sorted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sort {
    /// A counting sort by digits of `digit_bits` of a key of `key_bits`: in each pass every record is
    /// read to be counted, read to be moved, and written.
    Counting {
        /// Bits of a key.
        key_bits: u64,
        /// Bits of a digit.
        digit_bits: u64,
    },
    /// Sorted runs are written by the first stage; each pass reads all records, and all but the last
    /// write them.
    MultiMerge {
        /// Merge passes, 1 or more.
        passes: u64,
    },
}

impl Sort {
    /// The sort of GPU builders: radix 16 over 32-bit keys.
    pub const RADIX_16: Self = Self::Counting { key_bits: 32, digit_bits: 4 };
}

/// Bytes for each primitive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrimitiveTraffic {
    /// Boxes read from the input.
    pub read_bytes: u64,
    /// Records moved by the sort.
    pub sort_bytes: u64,
    /// Boxes read again, nodes and leaf references written.
    pub tree_bytes: u64,
}

const BOX_BYTES: u64 = 32;
const CODE_BYTES: u64 = 8;
const NODE_BYTES: u64 = 64;
const REFERENCE_BYTES: u64 = 4;

impl PrimitiveTraffic {
    /// A row of P2 Table I, which counts one node a primitive.
    pub const fn new(sorted: Sorted, sort: Sort) -> Self {
        let (record, again) = match sorted {
            Sorted::Codes => (CODE_BYTES, BOX_BYTES),
            Sorted::Boxes => (BOX_BYTES, 0),
        };
        let moves = match sort {
            Sort::Counting { key_bits, digit_bits } => 3 * key_bits.div_ceil(digit_bits),
            Sort::MultiMerge { passes } => 2 * passes,
        };
        Self {
            read_bytes: BOX_BYTES,
            sort_bytes: moves * record,
            tree_bytes: again + NODE_BYTES + REFERENCE_BYTES,
        }
    }

    /// All of it.
    pub const fn bytes(&self) -> u64 {
        self.read_bytes + self.sort_bytes + self.tree_bytes
    }

    /// Bytes for a scene of `primitives` whose tree has `nodes`.
    pub const fn scene_bytes(&self, primitives: u64, nodes: u64) -> u64 {
        primitives * (self.bytes() - NODE_BYTES) + nodes * NODE_BYTES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rows_of_p2_table_1() {
        let merge = |passes| Sort::MultiMerge { passes };
        let rows = [
            (Sorted::Codes, Sort::RADIX_16, [32, 192, 100, 324]),
            (Sorted::Codes, merge(1), [32, 16, 100, 148]),
            (Sorted::Codes, merge(2), [32, 32, 100, 164]),
            (Sorted::Boxes, Sort::RADIX_16, [32, 768, 68, 868]),
            (Sorted::Boxes, merge(1), [32, 64, 68, 164]),
            (Sorted::Boxes, merge(2), [32, 128, 68, 228]),
        ];
        for (sorted, sort, expect) in rows {
            let row = PrimitiveTraffic::new(sorted, sort);
            let ours = [row.read_bytes, row.sort_bytes, row.tree_bytes, row.bytes()];
            assert_eq!(ours, expect, "{sorted:?} {sort:?}");
        }
    }

    #[test]
    fn a_scene_has_the_nodes_it_has() {
        let row = PrimitiveTraffic::new(Sorted::Boxes, Sort::MultiMerge { passes: 1 });
        // The bunny: 69,451 triangles in 65,362 leaves are 10.6 MiB.
        let mib = row.scene_bytes(69_451, 65_361) as f64 / f64::from(1 << 20);
        assert!((mib - 10.61).abs() < 0.01, "{mib}");
    }
}
