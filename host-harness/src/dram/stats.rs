//! What a memory counted.

use std::ops::{Add, Sub};

use serde::Serialize;

/// What one channel counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct ChannelStats {
    /// Reads whose data came from the DRAM.
    pub reads: u64,
    /// Writes that went to the DRAM.
    pub writes: u64,
    /// Reads answered from the write queue.
    pub forwarded_reads: u64,
    /// Requests whose row was open at their first command.
    pub row_hits: u64,
    /// Requests whose bank was closed at their first command.
    pub row_misses: u64,
    /// Requests whose bank had another row open at their first command.
    pub row_conflicts: u64,
    /// Rows opened.
    pub activates: u64,
    /// Rows closed; a precharge of all banks counts once for each open row.
    pub precharges: u64,
    /// Bursts read.
    pub read_bursts: u64,
    /// Bursts written.
    pub write_bursts: u64,
    /// Refreshes of all banks.
    pub refreshes: u64,
    /// Clocks in which the data bus carried data.
    pub busy_clocks: u64,
}

/// What a memory counted, by channel. For a phase, subtract totals.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Stats {
    /// One entry for each channel.
    pub channels: Vec<ChannelStats>,
}

impl Stats {
    /// All channels together.
    pub fn total(&self) -> ChannelStats {
        self.channels.iter().fold(ChannelStats::default(), |sum, channel| sum + *channel)
    }
}

impl ChannelStats {
    fn zip(self, other: Self, f: impl Fn(u64, u64) -> u64) -> Self {
        Self {
            reads: f(self.reads, other.reads),
            writes: f(self.writes, other.writes),
            forwarded_reads: f(self.forwarded_reads, other.forwarded_reads),
            row_hits: f(self.row_hits, other.row_hits),
            row_misses: f(self.row_misses, other.row_misses),
            row_conflicts: f(self.row_conflicts, other.row_conflicts),
            activates: f(self.activates, other.activates),
            precharges: f(self.precharges, other.precharges),
            read_bursts: f(self.read_bursts, other.read_bursts),
            write_bursts: f(self.write_bursts, other.write_bursts),
            refreshes: f(self.refreshes, other.refreshes),
            busy_clocks: f(self.busy_clocks, other.busy_clocks),
        }
    }
}

impl Add for ChannelStats {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.zip(other, u64::wrapping_add)
    }
}

impl Sub for ChannelStats {
    type Output = Self;

    /// What was counted since `earlier`; counters never fall, so that nothing saturates.
    fn sub(self, earlier: Self) -> Self {
        self.zip(earlier, u64::saturating_sub)
    }
}
