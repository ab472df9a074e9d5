//! What the job found, and the bytes that carry it to the host.

use xylem_core::probe::Stage;
#[cfg(doc)]
use xylem_core::traverse::Hit;

use crate::digest::Running;

/// The stages whose cycles are counted, in order.
pub const STAGES: [Stage; 7] = [
    Stage::PartialSort,
    Stage::Merge,
    Stage::Emit,
    Stage::TopLevel,
    Stage::Compress,
    Stage::Refit,
    Stage::Trace,
];

/// The outputs that are digested, in order.
pub const OUTPUTS: [Output; 4] =
    [Output::LeafTable, Output::Nodes, Output::QuantizedNodes, Output::Hits];

/// Something that the job wrote to memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
pub enum Output {
    /// The leaf table: the primitives in sorted order, 4 bytes each.
    LeafTable,
    /// The 64-byte nodes.
    Nodes,
    /// The 16-byte quantized nodes.
    QuantizedNodes,
    /// The hit records, [`Hit::BYTES`] bytes for each ray.
    Hits,
}

impl Output {
    /// The output's name in words.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::LeafTable => "leaf table",
            Self::Nodes => "nodes",
            Self::QuantizedNodes => "quantized nodes",
            Self::Hits => "hits",
        }
    }
}

/// The length and digest of one output.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OutputDigest {
    /// Its length in bytes.
    pub bytes: u32,
    /// The CRC-32 of its bytes.
    pub crc: u32,
}

/// What one run of the job did; of an animation, the counts but rays and hits and the outputs are those of
/// the last frame, and the rest is the sum over all.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Report {
    /// Triangles in the scene.
    pub primitives: u32,
    /// Leaves of the tree.
    pub leaves: u32,
    /// Nodes of the tree.
    pub nodes: u32,
    /// Cells that the top of the tree was built over; 0 where it was built like the rest.
    pub cells: u32,
    /// Rays traced.
    pub rays: u32,
    /// Rays that hit something.
    pub hits: u32,
    /// Cycles of each of [`STAGES`] on the clock that the job was given.
    pub cycles: [u64; STAGES.len()],
    /// Length and digest of each of [`OUTPUTS`].
    pub outputs: [OutputDigest; OUTPUTS.len()],
}

impl Report {
    /// Bytes of a report on the wire.
    pub const BYTES: usize = 24 + 8 * STAGES.len() + 8 * OUTPUTS.len();

    /// One digest of everything but the cycles: what must be the same on every machine.
    pub fn digest(&self) -> u32 {
        let mut running = Running::default();
        running.update(&self.bytes_with([0; STAGES.len()]));
        running.value()
    }

    /// The report's bytes: counts, cycles, then the outputs, little-endian.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        self.bytes_with(self.cycles)
    }

    fn bytes_with(&self, cycles: [u64; STAGES.len()]) -> [u8; Self::BYTES] {
        let counts = [self.primitives, self.leaves, self.nodes, self.cells, self.rays, self.hits];
        let cycles = cycles.into_iter().flat_map(halves);
        let outputs = self.outputs.iter().flat_map(|o| [o.bytes, o.crc]);
        to_bytes(counts.into_iter().chain(cycles).chain(outputs))
    }

    /// The report of some bytes, or `None` if there are more or fewer than [`Report::BYTES`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut words = words::<{ Self::BYTES }>(bytes)?;
        let mut word = || words.next().unwrap_or_default();
        let mut report = Self {
            primitives: word(),
            leaves: word(),
            nodes: word(),
            cells: word(),
            rays: word(),
            hits: word(),
            ..Self::default()
        };
        for cycles in &mut report.cycles {
            *cycles = u64::from(word()) | u64::from(word()) << 32;
        }
        for output in &mut report.outputs {
            *output = OutputDigest { bytes: word(), crc: word() };
        }
        Some(report)
    }
}

/// Words as bytes, little-endian; what the words leave over is 0.
pub(crate) fn to_bytes<const N: usize>(words: impl Iterator<Item = u32>) -> [u8; N] {
    let mut bytes = [0; N];
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// The words of so many bytes, or `None` if there are more or fewer.
pub(crate) fn words<const N: usize>(bytes: &[u8]) -> Option<impl Iterator<Item = u32>> {
    let bytes: &[u8; N] = bytes.try_into().ok()?;
    let (words, _) = bytes.as_chunks();
    Some(words.iter().copied().map(u32::from_le_bytes))
}

/// A long word as two, the lower half first.
pub(crate) const fn halves(long: u64) -> [u32; 2] {
    [long as u32, (long >> 32) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report() -> Report {
        let mut report = Report {
            primitives: 1,
            leaves: 2,
            nodes: 3,
            cells: 4,
            rays: 5,
            hits: 6,
            ..Report::default()
        };
        for (i, cycles) in report.cycles.iter_mut().enumerate() {
            *cycles = (1 << 40) + i as u64;
        }
        for (i, output) in report.outputs.iter_mut().enumerate() {
            *output = OutputDigest { bytes: 100 + i as u32, crc: u32::MAX - i as u32 };
        }
        report
    }

    #[test]
    fn reports_round_trip() {
        let bytes = report().to_bytes();
        assert_eq!(Report::from_bytes(&bytes), Some(report()));
        assert_eq!(Report::from_bytes(&bytes[1..]), None);
    }

    #[test]
    fn the_digest_ignores_cycles_and_nothing_else() {
        let with = |change: fn(&mut Report)| {
            let mut changed = report();
            change(&mut changed);
            changed.digest()
        };
        let digest = report().digest();
        assert_eq!(with(|r| r.cycles[0] += 1), digest);
        assert_ne!(with(|r| r.hits += 1), digest);
        assert_ne!(with(|r| r.cells += 1), digest);
        assert_ne!(with(|r| r.outputs[1].crc ^= 1), digest);
        assert_ne!(with(|r| r.outputs[0].bytes += 1), digest);
    }
}
