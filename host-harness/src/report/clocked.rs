//! The numbers of a build on the clock.

use std::fmt;

use serde::Serialize;

use super::{Table, units};
use crate::machine::activity::Unit;
use crate::machine::mergetree::Stalls;
use crate::run::{ClockedRun, MemoryRun};

/// What the units of a machine and its memory did. All of it is **modelled**, but for the last
/// number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClockedReport {
    /// Bytes of records on chip: scratchpad, spare buffers, sorters and FIFO.
    pub storage_bytes: u64,
    /// Merge passes.
    pub merge_passes: u32,
    /// Bytes moved over the time of the build, in 10^9 a second.
    pub gb_per_s: f64,
    /// The share of the memory's peak rate that was used, from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bus_utilisation: Option<f64>,
    /// Why the multi-merge stood still.
    pub stalls: Stalls,
    /// How busy each unit was.
    pub units: Vec<UnitReport>,
    /// What the memory did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dram: Option<MemoryReport>,
    /// Cycles that the host simulated in a second: measured.
    pub simulated_cycles_per_s: f64,
}

/// A unit's work.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UnitReport {
    /// The unit.
    pub unit: Unit,
    /// Cycles in which it worked; of several alike, their mean.
    pub busy_cycles: f64,
    /// The share of all cycles.
    pub busy: f64,
}

/// A memory's work.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemoryReport {
    /// Clocks of the memory.
    pub mem_cycles: u64,
    /// Bursts that found their row open.
    pub row_hits: u64,
    /// Bursts that found their bank closed.
    pub row_misses: u64,
    /// Bursts that found another row open.
    pub row_conflicts: u64,
    /// Energy of the devices in picojoules, without I/O.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_pj: Option<f64>,
    /// What of it an idle memory would not have used in the same time (P2 §6.2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dynamic_energy_pj: Option<f64>,
    /// Where the currents are from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy_source: Option<&'static str>,
}

impl MemoryReport {
    fn new(run: &MemoryRun) -> Self {
        Self {
            mem_cycles: run.clocks,
            row_hits: run.stats.row_hits,
            row_misses: run.stats.row_misses,
            row_conflicts: run.stats.row_conflicts,
            energy_pj: run.energy.map(|energy| energy.total_pj()),
            dynamic_energy_pj: run.energy.map(|energy| energy.dynamic_pj()),
            energy_source: run.energy.map(|energy| energy.source),
        }
    }
}

impl ClockedReport {
    /// Collects the numbers of a run.
    pub fn new(run: &ClockedRun) -> Self {
        let machine = &run.machine;
        let unit = |unit| {
            let busy_cycles = machine.activity.busy_cycles(unit);
            UnitReport { unit, busy_cycles, busy: busy_cycles / machine.cycles.max(1) as f64 }
        };
        Self {
            storage_bytes: run.config.storage_bytes(),
            merge_passes: machine.passes + 1,
            gb_per_s: run.gb_per_s(),
            bus_utilisation: run.bus_utilisation(),
            stalls: machine.stalls,
            units: Unit::ALL.map(unit).into_iter().filter(|u| u.busy_cycles > 0.0).collect(),
            dram: run.memory.as_ref().map(MemoryReport::new),
            simulated_cycles_per_s: run.cycles_per_second(),
        }
    }

    /// How busy each unit was.
    pub fn unit_table(&self) -> Table {
        let mut table = Table::new(["unit", "busy cycles", "share"]);
        for UnitReport { unit, busy_cycles, busy } in &self.units {
            let cycles = units::count(busy_cycles.round() as u64);
            table.row([unit.name().to_owned(), cycles, format!("{:.1} %", 100.0 * busy)]);
        }
        table
    }
}

impl fmt::Display for ClockedReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Stalls { data_cycles, room_cycles, fill_cycles } = self.stalls;
        let [data, room, fill] = [data_cycles, room_cycles, fill_cycles].map(units::count);
        writeln!(f, "\n{}", self.unit_table())?;
        let used = self.bus_utilisation.map_or(String::new(), |share| {
            format!(", {:.1} % of the memory's peak", 100.0 * share)
        });
        writeln!(
            f,
            "  {:.2} GB/s{used}; {} merge passes; {} of records on chip",
            self.gb_per_s,
            self.merge_passes,
            units::bytes(self.storage_bytes)
        )?;
        writeln!(
            f,
            "  multi-merge stood still: {data} cycles for data, {room} for room, {fill} while filling"
        )?;
        if let Some(dram) = &self.dram {
            let [hits, misses, conflicts] =
                [dram.row_hits, dram.row_misses, dram.row_conflicts].map(units::count);
            writeln!(f, "  DRAM: {hits} row hits, {misses} misses, {conflicts} conflicts")?;
            if let (Some(all), Some(dynamic), Some(source)) =
                (dram.energy_pj, dram.dynamic_energy_pj, dram.energy_source)
            {
                let [all, dynamic] = [all, dynamic].map(|pj| pj * 1e-6);
                writeln!(f, "  DRAM energy {all:.1} uJ, {dynamic:.1} uJ above idle ({source})")?;
            }
        }
        let rate = units::rate(self.simulated_cycles_per_s);
        writeln!(f, "  simulated {rate} cycles a second (measured)")
    }
}
