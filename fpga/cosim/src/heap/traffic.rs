//! What a heap is fed: random operations with random pauses, the same for the same seed.

use xylem::machine::heap::{HeapConfig, HeapEntry, HeapOp, HeapOutputs};

use crate::random::Random;

/// Weights of insert, replace, remove and clear.
const MIXES: [[u64; 4]; 6] = [
    [1, 0, 0, 0],      // fill
    [4, 2, 0, 0],      // fill while merging
    [0, 1, 0, 0],      // merge
    [0, 0, 1, 0],      // drain
    [4, 16, 1, 0],     // mostly merge
    [192, 128, 64, 1], // with clears in flight
];

/// How the keys of an epoch are drawn.
#[derive(Clone, Copy, Debug)]
enum Keys {
    /// Over the whole range.
    Any,
    /// Few values, so that slots decide.
    Few,
    /// The highest ones, next to infinity.
    Highest,
    /// Not below the top, as in a merge.
    Rising,
}

/// Random operations in epochs, each with its own mix, keys and pauses.
///
/// An operation that is offered stays offered until it is taken. Between operations there are
/// pauses of random length; in some epochs none, so that operations come as fast as the unit takes
/// them.
#[derive(Clone, Debug)]
pub struct Traffic {
    config: HeapConfig,
    random: Random,
    left_in_epoch: u64,
    mix: [u64; 4],
    keys: Keys,
    longest_pause: u64,
    pause: u64,
    offered: Option<HeapOp>,
}

impl Traffic {
    /// Traffic for a heap of `config`.
    pub fn new(config: HeapConfig, seed: u64) -> Self {
        Self {
            config,
            random: Random::new(seed),
            left_in_epoch: 0,
            mix: MIXES[0],
            keys: Keys::Any,
            longest_pause: 0,
            pause: 0,
            offered: None,
        }
    }

    /// What is offered in a cycle whose outputs are `outputs`.
    pub fn offer(&mut self, outputs: HeapOutputs) -> Option<HeapOp> {
        if self.pause > 0 {
            self.pause -= 1;
            return None;
        }
        if self.offered.is_none() {
            self.offered = Some(self.draw(outputs));
        }
        let offered = self.offered;
        if outputs.ready {
            self.offered = None;
            self.pause = self.random.below(self.longest_pause + 1);
        }
        offered
    }

    fn draw(&mut self, outputs: HeapOutputs) -> HeapOp {
        if self.left_in_epoch == 0 {
            self.left_in_epoch = 1 + self.random.below(3 * self.config.capacity() as u64);
            self.mix = MIXES[self.random.below(MIXES.len() as u64) as usize];
            self.keys =
                [Keys::Any, Keys::Few, Keys::Highest, Keys::Rising][self.random.below(4) as usize];
            self.longest_pause = [0, 0, 1, 2, 12][self.random.below(5) as usize];
        }
        self.left_in_epoch -= 1;

        let entry = self.entry(outputs.top.unwrap_or_default());
        let mut pick = self.random.below(self.mix.iter().sum());
        let mut ops = [HeapOp::Insert(entry), HeapOp::Replace(entry), HeapOp::Remove]
            .into_iter()
            .zip(self.mix);
        let drawn = ops.find_map(|(op, weight)| {
            let hit = pick < weight;
            pick = pick.wrapping_sub(weight);
            hit.then_some(op)
        });
        self.mostly_legal(drawn.unwrap_or(HeapOp::Clear), entry, outputs)
    }

    /// Leaves few operations that are errors: enough to test them, too few to stand in the way.
    fn mostly_legal(&mut self, op: HeapOp, entry: HeapEntry, outputs: HeapOutputs) -> HeapOp {
        let error = match op {
            HeapOp::Insert(_) => outputs.full,
            HeapOp::Replace(_) | HeapOp::Remove => outputs.top.is_none(),
            HeapOp::Clear => false,
        };
        if !error || self.random.below(24) == 0 {
            return op;
        }
        match (outputs.top, outputs.full) {
            (Some(_), _) => HeapOp::Replace(entry),
            (None, false) => HeapOp::Insert(entry),
            (None, true) => HeapOp::Clear,
        }
    }

    fn entry(&mut self, top: HeapEntry) -> HeapEntry {
        let bits = self.random.bits();
        let slot = self.random.bits() as u32;
        let key = match self.keys {
            Keys::Any => bits,
            Keys::Few => bits % 8,
            Keys::Highest => !(bits % 4),
            Keys::Rising => top.key.saturating_add(bits % 1024),
        };
        self.config.truncate(HeapEntry { key, slot })
    }
}

#[cfg(test)]
mod tests {
    use xylem::machine::heap::HeapModel;

    use super::*;

    #[test]
    fn traffic_has_every_operation_pauses_and_a_few_errors() {
        let mut heap = HeapModel::new(HeapConfig::SMALL);
        let mut traffic = Traffic::new(HeapConfig::SMALL, 1);
        let (mut seen, mut errors, mut full) = ([0; 5], 0, 0);
        for _ in 0..100_000 {
            let op = traffic.offer(heap.outputs());
            let outputs = heap.tick(op);
            errors += u64::from(outputs.error);
            full += u64::from(outputs.full);
            seen[match op {
                None => 0,
                Some(HeapOp::Insert(_)) => 1,
                Some(HeapOp::Replace(_)) => 2,
                Some(HeapOp::Remove) => 3,
                Some(HeapOp::Clear) => 4,
            }] += 1;
        }
        assert!(seen.iter().all(|&count| count > 200), "{seen:?}");
        assert!((200..10_000).contains(&errors), "{errors}");
        assert!((10_000..90_000).contains(&full), "{full}");
    }

    #[test]
    fn offered_operation_stays_until_it_is_taken() {
        let mut traffic = Traffic::new(HeapConfig::SMALL, 2);
        let ready = HeapOutputs { ready: true, error: false, top: None, full: false };
        let busy = HeapOutputs { ready: false, ..ready };
        for _ in 0..1000 {
            if let Some(op) = traffic.offer(busy) {
                assert_eq!(traffic.offer(busy), Some(op));
                assert_eq!(traffic.offer(ready), Some(op));
            }
        }
    }
}
