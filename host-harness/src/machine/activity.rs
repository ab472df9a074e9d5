//! How busy each unit was over time.

/// The units whose activity is recorded, in the order of the data.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Lines asked for at the read port.
    ReadPort,
    /// Lines offered to and taken at the write port.
    WritePort,
    /// Insertion sorters.
    Sorters,
    /// Heap operations; at most every second cycle.
    MultiMerge,
    /// Stack operations and leaf extensions.
    Emitter,
    /// The top-level builder.
    TopLevel,
}

impl Unit {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::ReadPort,
        Self::WritePort,
        Self::Sorters,
        Self::MultiMerge,
        Self::Emitter,
        Self::TopLevel,
    ];

    /// Its name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ReadPort => "memory reads",
            Self::WritePort => "memory writes",
            Self::Sorters => "insertion sorters",
            Self::MultiMerge => "multi-merge",
            Self::Emitter => "hierarchy emitter",
            Self::TopLevel => "top-level build",
        }
    }
}

/// Busy cycles of every unit in windows of time.
///
/// The number of windows is bounded: when there are too many, neighbours are joined and windows get
/// twice as long.
#[derive(Clone, Debug)]
pub struct Activity {
    window: u64,
    /// Cycles recorded in the last window.
    filled: u64,
    /// Busy thousandths of a cycle.
    busy: Vec<[u64; Unit::ALL.len()]>,
}

/// The most windows that are kept.
const MAX_WINDOWS: usize = 1024;

impl Activity {
    /// Nothing recorded.
    pub fn new() -> Self {
        Self { window: 16, filled: 0, busy: vec![[0; 6]] }
    }

    /// Adds busy thousandths of the present cycle to a unit.
    pub fn add(&mut self, unit: Unit, thousandths: u64) {
        if let Some(last) = self.busy.last_mut() {
            last[unit as usize] += thousandths;
        }
    }

    /// Ends the present cycle.
    pub fn tick(&mut self) {
        self.advance(1);
    }

    /// Ends `cycles` cycles at once, in which the units last told of were busy as told.
    pub fn advance(&mut self, cycles: u64) {
        self.filled += cycles;
        while self.filled >= self.window {
            self.filled -= self.window;
            if self.busy.len() == MAX_WINDOWS {
                let joined = self.busy.chunks(2).map(|pair| {
                    let mut sum = pair[0];
                    for (sum, other) in sum.iter_mut().zip(pair.get(1).into_iter().flatten()) {
                        *sum += other;
                    }
                    sum
                });
                self.busy = joined.collect();
                self.window *= 2;
            }
            self.busy.push([0; 6]);
        }
    }

    /// Cycles of a window; the last one may be shorter.
    pub fn window(&self) -> u64 {
        self.window
    }

    /// The share of each window, from 0 to 1, in which `unit` was busy.
    pub fn shares(&self, unit: Unit) -> impl Iterator<Item = f64> + '_ {
        let scale = 1.0 / (1000.0 * self.window as f64);
        self.busy.iter().map(move |window| window[unit as usize] as f64 * scale)
    }

    /// Busy cycles of `unit` in all.
    pub fn busy_cycles(&self, unit: Unit) -> f64 {
        self.busy.iter().map(|window| window[unit as usize]).sum::<u64>() as f64 / 1000.0
    }
}

impl Default for Activity {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_join_and_lose_nothing() {
        let mut activity = Activity::new();
        for cycle in 0..1_000_000u64 {
            activity.add(Unit::Emitter, 1000 * (cycle % 2));
            activity.tick();
        }
        assert_eq!(activity.busy_cycles(Unit::Emitter), 500_000.0);
        assert!(activity.busy.len() <= MAX_WINDOWS);
        let shares: Vec<f64> = activity.shares(Unit::Emitter).collect();
        assert!(shares[..shares.len() - 1].iter().all(|&share| share == 0.5));
        assert_eq!(activity.busy_cycles(Unit::Sorters), 0.0);
    }
}
