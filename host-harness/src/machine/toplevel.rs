//! How long the unit for binned top-level builds takes: a formula over the core's events.

use xylem_core::probe::Probe;

/// The serial unit of P1 §4.5 and P2 §6.1: it reads one box a cycle from its buffer, partitions it
/// for this sweep and bins it for the next, and then works out the best plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SweepUnit {
    /// Cycles for the areas, costs and planes after each sweep.
    pub plane_cycles: u64,
}

impl SweepUnit {
    /// The papers': 32 cycles after each sweep, none of which overlap the next.
    pub const PAPER: Self = Self { plane_cycles: 32 };

    /// Cycles of all sweeps. The nodes are written meanwhile, a join taking two stack operations of the
    /// emitter, less than the sweeps that lead to it.
    pub const fn cycles(&self, events: &TopEvents) -> u64 {
        events.swept_cells + self.plane_cycles * events.sweeps
    }
}

/// What the top-level builders reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TopEvents {
    /// Cells that the emitter handed out and that were not joined again.
    pub cells: u64,
    /// How often the cell buffer was full and its threshold raised.
    pub raises: u64,
    /// Cells that went through the emitter again for it.
    pub raised_cells: u64,
    /// Sweeps of the binned builder, one for each range of two or more cells.
    pub sweeps: u64,
    /// Cells in all these ranges.
    pub swept_cells: u64,
    /// Treelets looked at.
    pub treelets: u64,
    /// Treelets rebuilt.
    pub better_treelets: u64,
}

impl Probe for TopEvents {
    fn top_cell(&mut self) {
        self.cells += 1;
    }
    fn top_coarsen(&mut self, cells: usize) {
        self.raises += 1;
        self.raised_cells += cells as u64;
        self.cells -= cells as u64;
    }
    fn top_sweep(&mut self, cells: usize) {
        self.sweeps += 1;
        self.swept_cells += cells as u64;
    }
    fn top_treelet(&mut self, _: usize, better: bool) {
        self.treelets += 1;
        self.better_treelets += u64::from(better);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_takes_a_cycle_a_cell_and_32_after() {
        let mut events = TopEvents::default();
        // Four cells, halved twice.
        for cells in [4, 2, 2] {
            events.top_sweep(cells);
        }
        assert_eq!(SweepUnit::PAPER.cycles(&events), 8 + 3 * 32);
        assert_eq!(SweepUnit { plane_cycles: 0 }.cycles(&events), 8);
    }
}
