//! The accelerator's event counters.

use core::fmt;
use core::ops::Sub;

use xylem_regs::{
    COUNTERS_BACKTRACKS_LO, COUNTERS_BOX_TESTS_LO, COUNTERS_BYTES_READ_LO,
    COUNTERS_BYTES_WRITTEN_LO, COUNTERS_CYCLES_LO, COUNTERS_HEAP_REPLACES_LO, COUNTERS_LEAVES_LO,
    COUNTERS_NODE_FETCHES_LO, COUNTERS_NODES_LO, COUNTERS_TRIANGLE_TESTS_LO, CounterLo, Reg,
};

use crate::access::RegisterAccess;

/// A snapshot of the event counters.
///
/// They run on from job to job; subtract the snapshot taken before a job from the one after it.
/// Each counter is coherent by itself. While a job runs, different counters are of slightly
/// different moments; while the accelerator is idle, all stand still.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Clock cycles while busy.
    pub cycles: u64,
    /// Bytes read from external memory.
    pub bytes_read: u64,
    /// Bytes written to external memory.
    pub bytes_written: u64,
    /// Nodes emitted.
    pub nodes: u64,
    /// Leaves emitted.
    pub leaves: u64,
    /// Replace operations of the merge heap.
    pub heap_replaces: u64,
    /// Nodes repaired by the compressor.
    pub backtracks: u64,
    /// Nodes fetched by the traversal unit.
    pub node_fetches: u64,
    /// Ray-box tests.
    pub box_tests: u64,
    /// Ray-triangle tests.
    pub triangle_tests: u64,
}

impl Counters {
    pub(crate) fn read<R: RegisterAccess>(regs: &mut R) -> Result<Self, CountersError<R::Error>> {
        Ok(Self {
            cycles: read_counter(regs, COUNTERS_CYCLES_LO)?,
            bytes_read: read_counter(regs, COUNTERS_BYTES_READ_LO)?,
            bytes_written: read_counter(regs, COUNTERS_BYTES_WRITTEN_LO)?,
            nodes: read_counter(regs, COUNTERS_NODES_LO)?,
            leaves: read_counter(regs, COUNTERS_LEAVES_LO)?,
            heap_replaces: read_counter(regs, COUNTERS_HEAP_REPLACES_LO)?,
            backtracks: read_counter(regs, COUNTERS_BACKTRACKS_LO)?,
            node_fetches: read_counter(regs, COUNTERS_NODE_FETCHES_LO)?,
            box_tests: read_counter(regs, COUNTERS_BOX_TESTS_LO)?,
            triangle_tests: read_counter(regs, COUNTERS_TRIANGLE_TESTS_LO)?,
        })
    }
}

/// What was counted between two snapshots, the later one minus the earlier one. A counter that
/// wrapped in between is still right; a soft reset in between makes the difference meaningless.
impl Sub for Counters {
    type Output = Self;

    fn sub(self, earlier: Self) -> Self {
        Self {
            cycles: self.cycles.wrapping_sub(earlier.cycles),
            bytes_read: self.bytes_read.wrapping_sub(earlier.bytes_read),
            bytes_written: self.bytes_written.wrapping_sub(earlier.bytes_written),
            nodes: self.nodes.wrapping_sub(earlier.nodes),
            leaves: self.leaves.wrapping_sub(earlier.leaves),
            heap_replaces: self.heap_replaces.wrapping_sub(earlier.heap_replaces),
            backtracks: self.backtracks.wrapping_sub(earlier.backtracks),
            node_fetches: self.node_fetches.wrapping_sub(earlier.node_fetches),
            box_tests: self.box_tests.wrapping_sub(earlier.box_tests),
            triangle_tests: self.triangle_tests.wrapping_sub(earlier.triangle_tests),
        }
    }
}

/// How often a counter is read before it is given up. The high half changes once in 2³² events, so
/// a second change in a row already means a broken bus.
const ATTEMPTS: usize = 4;

/// Reads a counter whose high half follows its low half: high, low, high, until the highs agree.
fn read_counter<R: RegisterAccess>(
    regs: &mut R,
    low: Reg<CounterLo>,
) -> Result<u64, CountersError<R::Error>> {
    let high_offset = low.offset() + 4;
    let mut before = regs.read(high_offset).map_err(CountersError::Access)?;
    for _ in 0..ATTEMPTS {
        let mut halves = [0; 2];
        regs.read_burst(low.offset(), &mut halves).map_err(CountersError::Access)?;
        let [low_half, after] = halves;
        if before == after {
            return Ok(u64::from(after) << 32 | u64::from(low_half));
        }
        before = after;
    }
    Err(CountersError::Unstable { offset: low.offset() })
}

/// Why the counters could not be read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CountersError<E> {
    /// A register access failed.
    Access(E),
    /// This accelerator was synthesized without counters.
    Absent,
    /// The high half of the counter at this byte offset never read the same twice.
    Unstable {
        /// Byte offset of the counter's low half.
        offset: u32,
    },
}

impl<E: fmt::Display> fmt::Display for CountersError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "counters could not be read: {error}"),
            Self::Absent => f.write_str("this accelerator has no event counters"),
            Self::Unstable { offset } => {
                write!(
                    f,
                    "counter at {offset:#05x} changes its high half at every read; check the bus"
                )
            }
        }
    }
}

impl<E: core::error::Error> core::error::Error for CountersError<E> {}
