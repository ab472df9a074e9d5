//! The numbers of a replayed trace.

use std::fmt;
use std::time::Duration;

use serde::Serialize;

use super::table::Table;
use super::units;
use crate::dram::{Energy, Memory, REQUEST_BYTES};

/// The numbers of a replayed trace, as `xylem dram --json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DramReport {
    /// The trace.
    pub trace: String,
    /// The memory, as `--memory` names it.
    pub memory: &'static str,
    /// What that stands for.
    pub memory_about: &'static str,
    /// Where its timing is from.
    pub timing_source: &'static str,
    /// The memory clock in MHz.
    pub clock_mhz: f64,
    /// Requests, of 64 bytes each.
    pub requests: u64,
    /// Reads, those answered from the write queue included.
    pub reads: u64,
    /// Writes.
    pub writes: u64,
    /// Reads answered from the write queue.
    pub forwarded_reads: u64,
    /// Bytes requested.
    pub bytes: u64,
    /// Memory clocks until all were done.
    pub mem_cycles: u64,
    /// The same in nanoseconds.
    pub ns: f64,
    /// Bytes a nanosecond.
    pub gb_per_s: f64,
    /// What all data buses together could move.
    pub peak_gb_per_s: f64,
    /// Clocks in which a data bus carried data, as a part of all.
    pub utilisation: f64,
    /// Requests whose row was open at their first command.
    pub row_hits: u64,
    /// Requests whose bank was closed at their first command.
    pub row_misses: u64,
    /// Requests whose bank had another row open at their first command.
    pub row_conflicts: u64,
    /// Rows opened.
    pub activates: u64,
    /// Refreshes of all banks of a channel.
    pub refreshes: u64,
    /// Energy of the whole memory in picojoules; null if there are no currents for it.
    pub energy_pj: Option<f64>,
    /// What of it an idle memory would not have used.
    pub dynamic_energy_pj: Option<f64>,
    /// Where the currents are from, and what the energy went into.
    pub energy: Option<Energy>,
    /// How long the host took, in milliseconds: measured.
    pub host_ms: f64,
    /// Memory clocks that the host simulated in a second, all channels at once: measured.
    pub host_cycles_per_s: f64,
}

impl DramReport {
    /// Collects the numbers of a memory that was idle at clock 0 and again at `clocks`.
    pub fn new(trace: &str, memory: &Memory, clocks: u64, host_time: Duration) -> Self {
        let (config, stats) = (memory.config(), memory.stats().total());
        let reads = stats.reads + stats.forwarded_reads;
        let requests = reads + stats.writes;
        let bytes = requests * REQUEST_BYTES;
        let ns = config.nanoseconds(clocks);
        let buses = clocks as f64 * f64::from(config.mapping.channels);
        let energy = memory.energy(clocks);
        let per = |n: f64, of: f64| if of > 0.0 { n / of } else { 0.0 };
        Self {
            trace: trace.to_owned(),
            memory: config.name,
            memory_about: config.about,
            timing_source: config.timing.source,
            clock_mhz: config.clock_mhz(),
            requests,
            reads,
            writes: stats.writes,
            forwarded_reads: stats.forwarded_reads,
            bytes,
            mem_cycles: clocks,
            ns,
            gb_per_s: per(bytes as f64, ns),
            peak_gb_per_s: config.peak_gb_per_s(),
            utilisation: per(stats.busy_clocks as f64, buses),
            row_hits: stats.row_hits,
            row_misses: stats.row_misses,
            row_conflicts: stats.row_conflicts,
            activates: stats.activates,
            refreshes: stats.refreshes,
            energy_pj: energy.map(|energy| energy.total_pj()),
            dynamic_energy_pj: energy.map(|energy| energy.dynamic_pj()),
            energy,
            host_ms: units::milliseconds(host_time),
            host_cycles_per_s: per(clocks as f64, host_time.as_secs_f64()),
        }
    }
}

impl fmt::Display for DramReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = units::count;
        writeln!(f, "{} on {}: {}", self.trace, self.memory, self.memory_about)?;
        writeln!(
            f,
            "  {} requests: {} reads, {} writes; {} reads answered from the write queue",
            count(self.requests),
            count(self.reads),
            count(self.writes),
            count(self.forwarded_reads)
        )?;
        writeln!(
            f,
            "  {} memory clocks of {:.0} MHz, {:.1} µs (modelled)",
            count(self.mem_cycles),
            self.clock_mhz,
            self.ns / 1e3
        )?;
        writeln!(
            f,
            "  {:.3} GB/s of {:.1}; the data buses were busy {:.1} % of the time",
            self.gb_per_s,
            self.peak_gb_per_s,
            self.utilisation * 100.0
        )?;
        writeln!(
            f,
            "  rows: {} hits, {} misses, {} conflicts; {} activates, {} refreshes",
            count(self.row_hits),
            count(self.row_misses),
            count(self.row_conflicts),
            count(self.activates),
            count(self.refreshes)
        )?;
        match &self.energy {
            Some(energy) => self.write_energy(f, energy)?,
            None => writeln!(f, "  energy: n/a, no source has this memory's currents")?,
        }
        writeln!(f, "  timing: {}", self.timing_source)?;
        writeln!(
            f,
            "  host: {:.0} ms, {}clock/s simulated",
            self.host_ms,
            units::rate(self.host_cycles_per_s)
        )
    }
}

impl DramReport {
    fn write_energy(&self, f: &mut fmt::Formatter<'_>, energy: &Energy) -> fmt::Result {
        let mut table = Table::new(["energy", "µJ", "mW"]);
        let rows = [
            ("background", energy.background_pj),
            ("activate, precharge", energy.activate_pj),
            ("read", energy.read_pj),
            ("write", energy.write_pj),
            ("refresh", energy.refresh_pj),
            ("total", energy.total_pj()),
            ("  if idle", energy.idle_pj),
            ("  dynamic", energy.dynamic_pj()),
        ];
        for (name, picojoules) in rows {
            // Picojoules a nanosecond are milliwatts.
            let milliwatts = if self.ns > 0.0 { picojoules / self.ns } else { 0.0 };
            let cells = [format!("{:.3}", picojoules / 1e6), format!("{milliwatts:.1}")];
            table.row([name.to_owned()].into_iter().chain(cells));
        }
        write!(f, "{table}")?;
        writeln!(f, "  energy source: {}", energy.source)
    }
}
