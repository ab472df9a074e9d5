//! Cycles by stage.

use xylem_core::node::Subtree;
use xylem_core::probe::{Probe, Stage};
use xylem_core::refit::CostMeter;

use crate::report::STAGES;

/// A cycle counter.
pub trait Clock {
    /// Cycles since some fixed moment.
    fn cycles(&mut self) -> u64;
}

/// The clock of a machine without one: it stands still, and every stage takes 0 cycles.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    fn cycles(&mut self) -> u64 {
        0
    }
}

/// Adds up the cycles of each stage as stages begin and resume, counts cells, and meters the nodes of
/// a build if asked to.
///
/// Every change of stage reads the clock, which takes its own few cycles (some 60 on PicoRV32);
/// they count for the stages around it. Merging and emission alternate with every primitive.
pub(crate) struct StageCycles<'a, C> {
    clock: &'a mut C,
    since: u64,
    current: Option<Stage>,
    cycles: [u64; STAGES.len()],
    /// Cells of the last build.
    pub cells: u32,
    /// What the nodes of a build go through, if anything.
    pub meter: Option<CostMeter>,
}

impl<'a, C: Clock> StageCycles<'a, C> {
    pub fn new(clock: &'a mut C) -> Self {
        let since = clock.cycles();
        Self { clock, since, current: None, cycles: [0; STAGES.len()], cells: 0, meter: None }
    }

    /// Ends the stage under way.
    fn lap(&mut self) {
        let now = self.clock.cycles();
        let slot = self.current.and_then(|stage| STAGES.iter().position(|s| *s == stage));
        if let Some(cycles) = slot.and_then(|slot| self.cycles.get_mut(slot)) {
            *cycles += now.wrapping_sub(self.since);
        }
        self.since = now;
    }

    /// Ends the stage under way and hands out the cycles of each since the last time. What follows is
    /// nobody's, until a stage begins.
    pub fn take(&mut self) -> [u64; STAGES.len()] {
        self.lap();
        self.current = None;
        core::mem::take(&mut self.cycles)
    }
}

impl<C: Clock> Probe for StageCycles<'_, C> {
    fn stage(&mut self, stage: Stage) {
        self.lap();
        self.current = Some(stage);
    }

    #[inline]
    fn built_node(&mut self, children: [&Subtree; 2]) {
        if let Some(meter) = &mut self.meter {
            meter.node(children);
        }
    }

    fn top_cell(&mut self) {
        self.cells += 1;
    }

    fn top_coarsen(&mut self, cells: usize) {
        // They come out anew, and fewer.
        self.cells = self.cells.saturating_sub(cells as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Ticks(u64);

    impl Clock for Ticks {
        fn cycles(&mut self) -> u64 {
            self.0 += 10;
            self.0
        }
    }

    #[test]
    fn cycles_are_filed_by_stage_and_time_before_the_first_is_nobody_s() {
        let mut clock = Ticks(0);
        let mut stages = StageCycles::new(&mut clock);
        for stage in [Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::Merge, Stage::Trace] {
            stages.stage(stage);
        }
        assert_eq!(stages.take(), [10, 20, 10, 0, 0, 0, 10]);
        stages.stage(Stage::Refit);
        assert_eq!(stages.take(), [0, 0, 0, 0, 0, 10, 0]);
    }
}
