//! When a tree that is refitted frame after frame is to be rebuilt.

use fixed::FixedU32;
use fixed::types::extra::U16;

use crate::quality::SahCost;

/// A ratio of costs, or a cost, as a parameter: UQ16.16.
pub type Factor = FixedU32<U16>;

/// The rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RebuildRule {
    /// Rebuild when the cost exceeds the one after the last rebuild by more than this factor.
    ///
    /// It bounds what any frame loses, and needs no knowledge of the machine.
    Drift(Factor),
    /// Rebuild when the frame's excess over the cost after the last rebuild is above the mean cost of
    /// a frame since then, rebuild included.
    ///
    /// The parameter is the price of a rebuild in SAH cost: the cycles that it takes more than a
    /// refit, over the cycles that all rays of a frame together spend for a SAH cost of 1. If excess
    /// grows alike after each rebuild, waiting longer or less long makes the mean frame dearer.
    Amortised(Factor),
}

impl Default for RebuildRule {
    /// A drift by 1.3.
    fn default() -> Self {
        Self::Drift(Factor::from_bits(85_197))
    }
}

/// What to do with the tree of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Update {
    /// The refitted tree will do.
    Refit,
    /// The tree is to be built anew.
    Rebuild,
}

/// The rule at work, from frame to frame.
///
/// Tell it the cost of each refitted tree with [`Upkeep::after_refit`] and that of each new one with
/// [`Upkeep::after_rebuild`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Upkeep {
    rule: RebuildRule,
    /// The cost after the last rebuild, and whether there was one.
    fresh: Option<SahCost>,
    /// Frames since the last rebuild, its own included.
    frames: u32,
    /// The excess of these frames together: UQ32.32 in 96 bits or fewer.
    excess: u128,
}

impl Upkeep {
    /// Before the first tree.
    pub const fn new(rule: RebuildRule) -> Self {
        Self { rule, fresh: None, frames: 0, excess: 0 }
    }

    /// A tree of this cost was built.
    pub fn after_rebuild(&mut self, cost: SahCost) {
        *self = Self { fresh: Some(cost), frames: 1, ..Self::new(self.rule) };
    }

    /// The tree was refitted and has this cost: will it do? Where it will not, rebuild it and say so.
    pub fn after_refit(&mut self, cost: SahCost) -> Update {
        let Some(fresh) = self.fresh else { return Update::Rebuild };
        let excess = u128::from(cost.saturating_sub(fresh).to_bits());
        let bits = |factor: Factor| u128::from(factor.to_bits());
        let rebuild = match self.rule {
            // UQ32.32 by UQ16.16 on both sides, 96 bits.
            RebuildRule::Drift(factor) => {
                u128::from(cost.to_bits()) << 16 > u128::from(fresh.to_bits()) * bits(factor)
            }
            RebuildRule::Amortised(price) => {
                excess * u128::from(self.frames) > self.excess + (bits(price) << 16)
            }
        };
        if rebuild {
            return Update::Rebuild;
        }
        self.frames = self.frames.saturating_add(1);
        self.excess = self.excess.saturating_add(excess);
        Update::Refit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::cases;

    fn cost(x: f64) -> SahCost {
        SahCost::from_num(x)
    }

    #[test]
    fn drift_rebuilds_just_above_the_factor_and_counts_from_the_last_rebuild() {
        let mut upkeep = Upkeep::new(RebuildRule::Drift(Factor::from_num(1.25)));
        assert_eq!(upkeep.after_refit(cost(1.0)), Update::Rebuild, "there is no tree yet");
        upkeep.after_rebuild(cost(40.0));
        assert_eq!(upkeep.after_refit(cost(39.0)), Update::Refit);
        assert_eq!(upkeep.after_refit(cost(50.0)), Update::Refit);
        assert_eq!(upkeep.after_refit(cost(50.0) + SahCost::DELTA), Update::Rebuild);
        upkeep.after_rebuild(cost(48.0));
        assert_eq!(upkeep.after_refit(cost(60.0)), Update::Refit);
        let mut largest = Upkeep::new(RebuildRule::Drift(Factor::MAX));
        largest.after_rebuild(SahCost::MAX);
        assert_eq!(largest.after_refit(SahCost::MAX), Update::Refit);
    }

    #[test]
    fn a_steady_growth_is_amortised_at_the_cheapest_period() {
        // The frame at age k has excess k; a rebuild costs 18. The mean of a period of n frames,
        // (18 + n (n - 1) / 2) / n, is lowest for n = 6.
        let mean = |n: u32| (18.0 + f64::from(n * (n - 1)) / 2.0) / f64::from(n);
        assert!((1..40).all(|n| mean(6) <= mean(n)));
        let mut upkeep = Upkeep::new(RebuildRule::Amortised(Factor::from_num(18)));
        upkeep.after_rebuild(cost(100.0));
        let age =
            (1..).find(|&k| upkeep.after_refit(cost(100.0 + f64::from(k))) == Update::Rebuild);
        // Six frames of ages 0 to 5; the next one begins a new period.
        assert_eq!(age, Some(6));
    }

    #[test]
    fn a_tree_that_does_not_get_worse_is_never_rebuilt() {
        for rule in [RebuildRule::default(), RebuildRule::Amortised(Factor::from_num(1))] {
            let mut upkeep = Upkeep::new(rule);
            upkeep.after_rebuild(cost(7.0));
            for _ in 0..cases(1000) {
                assert_eq!(upkeep.after_refit(cost(6.5)), Update::Refit);
            }
        }
    }
}
