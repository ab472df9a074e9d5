//! What the accelerator did of the job, and the bytes that carry it to the host.

use xylem_driver::Counters;

use crate::report::{OUTPUTS, halves, to_bytes, words};

/// The parts of the accelerated job, in order: each is at its own number.
pub const PARTS: [Part; 5] =
    [Part::Prepare, Part::Build, Part::Compress, Part::BuildCompressed, Part::Trace];

/// A part of the accelerated job.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
pub enum Part {
    /// The core makes the input, where the accelerator does not take triangles.
    Prepare,
    /// The tree of 64-byte nodes.
    Build,
    /// Its quantized nodes, from the root down.
    Compress,
    /// The tree of quantized nodes at once, which the software makes of the one of 64-byte nodes.
    BuildCompressed,
    /// The rays.
    Trace,
}

impl Part {
    /// The part's name in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Prepare => "prepare",
            Self::Build => "build",
            Self::Compress => "compress",
            Self::BuildCompressed => "build compressed",
            Self::Trace => "trace",
        }
    }
}

/// What a part took.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PartReport {
    /// Cycles on the clock that the job was given, from the first register access to the result.
    pub cycles: u64,
    /// What the accelerator counted meanwhile; all 0 in a part of the core's, and where the accelerator
    /// counts nothing.
    pub counters: Counters,
}

/// What the accelerator did of the job, beside what the software did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Accelerated {
    /// The parts that were done, in the order of [`PARTS`].
    pub parts: [Option<PartReport>; PARTS.len()],
    /// Whether each of [`OUTPUTS`] has the software's length and bytes, where the accelerator made it.
    pub outputs: [Option<bool>; OUTPUTS.len()],
    /// Whether the root, and the numbers of nodes, leaves and hits, are the software's.
    pub same_counts: bool,
}

impl Accelerated {
    /// Bytes of the report on the wire.
    pub const BYTES: usize = 4 + PARTS.len() * PART_NUMBERS * 8;

    /// Whether all that was made is what the software made.
    pub fn is_equal(&self) -> bool {
        self.same_counts && self.outputs.iter().all(|output| *output != Some(false))
    }

    /// The parts that the accelerator might have done, had it the units; `treelet_depth` is that of the
    /// [scene](crate::blob::Header::treelet_depth). They are the software's.
    pub fn missing(&self, treelet_depth: u8) -> impl Iterator<Item = Part> {
        let compress = if treelet_depth > 0 { Part::BuildCompressed } else { Part::Compress };
        let done = self.parts;
        let wanted = [Part::Build, compress, Part::Trace].into_iter();
        wanted.filter(move |&part| done.get(part as usize).is_some_and(Option::is_none))
    }

    /// The report's bytes, little-endian: a word of flags (from bit 0 the parts that were done, from bit
    /// 8 the outputs that were made, from bit 16 those that are equal, in bit 24 the counts), then for
    /// each part its cycles and counters as 64-bit numbers.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut flags = u32::from(self.same_counts) << 24;
        for (i, part) in self.parts.iter().enumerate() {
            flags |= u32::from(part.is_some()) << i;
        }
        for (i, output) in self.outputs.iter().enumerate() {
            flags |= u32::from(output.is_some()) << (8 + i);
            flags |= u32::from(*output == Some(true)) << (16 + i);
        }
        let numbers = self.parts.iter().flat_map(|part| numbers(&part.unwrap_or_default()));
        to_bytes(core::iter::once(flags).chain(numbers.flat_map(halves)))
    }

    /// The report of some bytes, or `None` if there are more or fewer than [`Accelerated::BYTES`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut words = words::<{ Self::BYTES }>(bytes)?;
        let mut word = || words.next().unwrap_or_default();
        let flags = word();
        let bit = |i: usize| flags >> i & 1 == 1;
        let mut long = || u64::from(word()) | u64::from(word()) << 32;
        let parts = PARTS.map(|_| from_numbers([(); PART_NUMBERS].map(|()| long())));
        Some(Self {
            parts: core::array::from_fn(|i| bit(i).then_some(parts[i])),
            outputs: core::array::from_fn(|i| bit(8 + i).then_some(bit(16 + i))),
            same_counts: bit(24),
        })
    }
}

/// 64-bit numbers that a part takes on the wire.
const PART_NUMBERS: usize = 11;

fn numbers(part: &PartReport) -> [u64; PART_NUMBERS] {
    let c = &part.counters;
    [
        part.cycles,
        c.cycles,
        c.bytes_read,
        c.bytes_written,
        c.nodes,
        c.leaves,
        c.heap_replaces,
        c.backtracks,
        c.node_fetches,
        c.box_tests,
        c.triangle_tests,
    ]
}

fn from_numbers(numbers: [u64; PART_NUMBERS]) -> PartReport {
    let [cycles, busy, bytes_read, bytes_written, nodes, leaves, rest @ ..] = numbers;
    let [heap_replaces, backtracks, node_fetches, box_tests, triangle_tests] = rest;
    let counters = Counters {
        cycles: busy,
        bytes_read,
        bytes_written,
        nodes,
        leaves,
        heap_replaces,
        backtracks,
        node_fetches,
        box_tests,
        triangle_tests,
    };
    PartReport { cycles, counters }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_round_trip() {
        let part = |n: u64| from_numbers(core::array::from_fn(|i| (1 << 40) + 100 * n + i as u64));
        let report = Accelerated {
            parts: [Some(part(1)), Some(part(2)), None, None, Some(part(3))],
            outputs: [Some(true), Some(false), None, Some(true)],
            same_counts: true,
        };
        let bytes = report.to_bytes();
        assert_eq!(Accelerated::from_bytes(&bytes), Some(report));
        assert!(report.missing(0).eq([Part::Compress]));
        assert!(report.missing(2).eq([Part::BuildCompressed]));
        assert_eq!(Accelerated::from_bytes(&bytes[1..]), None);
        assert_eq!(Accelerated::from_bytes(&[]), None);
    }

    #[test]
    fn one_wrong_output_or_count_is_no_equality_and_a_missing_one_is_no_difference() {
        let equal = Accelerated {
            outputs: [Some(true), Some(true), None, None],
            same_counts: true,
            ..Accelerated::default()
        };
        assert!(equal.is_equal());
        assert!(!Accelerated { same_counts: false, ..equal }.is_equal());
        let outputs = [Some(true), Some(false), None, None];
        assert!(!Accelerated { outputs, ..equal }.is_equal());
    }
}
