//! Cycle model of the insertion sorters (P2 §5.5).
//!
//! | Property | Value |
//! |---|---|
//! | Room | one piece of `2B` records each |
//! | Input | as fast as it comes; records wait inside until it is their turn |
//! | Throughput | one compare-and-swap a cycle, and one cycle of overhead for each record |
//! | Output | two records a cycle, one sorter at a time, once its piece is in order |

use xylem_core::sort::Item;

/// A bank of insertion sorters that take pieces in turn.
#[derive(Debug)]
pub struct Sorters {
    sorters: Vec<Sorter>,
    piece: usize,
    /// Which sorter the next record goes to.
    filling: usize,
}

/// One insertion sorter.
#[derive(Clone, Debug, Default)]
struct Sorter {
    /// The part of the piece that is in order.
    sorted: Vec<Item>,
    /// Records taken in.
    taken: usize,
    /// The cycle in which the last record taken in will be in its place.
    done_at: u64,
    /// Number of the piece.
    number: u32,
    /// Whether the whole piece has been taken in.
    full: bool,
}

/// A piece in order, on its way into the scratchpad.
#[derive(Debug)]
pub struct Piece {
    /// Its number, as given to [`Sorters::close`].
    pub number: u32,
    /// Its records.
    pub items: Vec<Item>,
}

impl Sorters {
    /// `count` sorters for pieces of at most `piece` records.
    pub fn new(count: u32, piece: u32) -> Self {
        let sorter = Sorter { sorted: Vec::with_capacity(piece as usize), ..Sorter::default() };
        Self { sorters: vec![sorter; count as usize], piece: piece as usize, filling: 0 }
    }

    /// Whether the sorter whose turn it is can take a record.
    pub fn is_ready(&self) -> bool {
        let sorter = &self.sorters[self.filling];
        !sorter.full && sorter.taken < self.piece
    }

    /// Takes a record in cycle `now`; call when [`Sorters::is_ready`].
    pub fn accept(&mut self, item: Item, now: u64) {
        let sorter = &mut self.sorters[self.filling];
        // Equal codes keep their order: a record stops behind the first that is not higher.
        let place = sorter.sorted.iter().rposition(|other| other.code <= item.code);
        let place = place.map_or(0, |at| at + 1);
        let moved = sorter.sorted.len() - place;
        let compares = moved + usize::from(place > 0);
        sorter.sorted.insert(place, item);
        sorter.taken += 1;
        sorter.done_at = sorter.done_at.max(now) + 1 + compares as u64;
    }

    /// Declares the piece being filled complete and gives it a number; the next record goes to the
    /// next sorter.
    pub fn close(&mut self, number: u32) {
        let sorter = &mut self.sorters[self.filling];
        (sorter.full, sorter.number) = (true, number);
        self.filling = (self.filling + 1) % self.sorters.len();
    }

    /// Takes the lowest-numbered piece that is in order at `now` and below `limit` out of its
    /// sorter.
    pub fn take(&mut self, now: u64, limit: u32) -> Option<Piece> {
        let ready = self.sorters.iter_mut().filter(|s| s.full && s.done_at <= now);
        let sorter = ready.filter(|s| s.number < limit).min_by_key(|s| s.number)?;
        let items = std::mem::replace(&mut sorter.sorted, Vec::with_capacity(self.piece));
        (sorter.taken, sorter.full) = (0, false);
        Some(Piece { number: sorter.number, items })
    }

    /// How many sorters move records at `now`.
    pub fn busy(&self, now: u64) -> u32 {
        self.sorters.iter().filter(|s| s.taken > 0 && s.done_at > now).count() as u32
    }

    /// How many sorters there are.
    pub fn len(&self) -> usize {
        self.sorters.len()
    }

    /// Whether no sorter holds a record.
    pub fn is_empty(&self) -> bool {
        self.sorters.iter().all(|s| s.taken == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(code: u64, reference: u32) -> Item {
        Item { code, reference, ..Item::ZERO }
    }

    /// Sorts one piece that arrives at cycle 0 all at once; gives the cycle in which it is done.
    fn done_at(codes: &[u64]) -> u64 {
        let mut sorters = Sorters::new(1, codes.len() as u32);
        for (i, &code) in codes.iter().enumerate() {
            sorters.accept(item(code, i as u32), 0);
        }
        sorters.close(0);
        (0..).find(|&now| sorters.take(now, 1).is_some()).unwrap()
    }

    #[test]
    fn a_sorted_piece_takes_one_compare_a_record_and_a_reversed_one_all_of_them() {
        let up: Vec<u64> = (0..32).collect();
        let down: Vec<u64> = up.iter().rev().copied().collect();
        // One cycle of overhead a record; the first has nothing to be compared with.
        assert_eq!(done_at(&up), 32 + 31);
        assert_eq!(done_at(&down), 32 + 31 * 32 / 2);
        assert_eq!(done_at(&[5; 8]), 8 + 7);
    }

    #[test]
    fn a_late_record_waits_for_nothing_but_itself() {
        let mut sorters = Sorters::new(1, 2);
        sorters.accept(item(1, 0), 0);
        sorters.accept(item(0, 1), 100);
        sorters.close(0);
        assert!(sorters.take(101, 1).is_none());
        let piece = sorters.take(102, 1).unwrap();
        assert_eq!(piece.items, [item(0, 1), item(1, 0)]);
    }

    #[test]
    fn the_order_is_that_of_the_core_s_stable_sort() {
        let mut sorters = Sorters::new(1, 32);
        let mut expect: Vec<Item> = (0..32).map(|i| item(u64::from(i * 7 % 5), i)).collect();
        for &item in &expect {
            sorters.accept(item, 0);
        }
        sorters.close(3);
        expect.sort_by_key(|item| item.code);
        assert!(sorters.take(u64::MAX, 3).is_none(), "not wanted yet");
        assert_eq!(sorters.take(u64::MAX, 4).unwrap().items, expect);
    }

    #[test]
    fn pieces_go_round_and_a_busy_sorter_holds_its_successors_up() {
        let mut sorters = Sorters::new(2, 1);
        for number in 0..2 {
            assert!(sorters.is_ready());
            sorters.accept(item(0, 0), 0);
            sorters.close(number);
        }
        assert!(!sorters.is_ready());
        assert_eq!(sorters.take(1, 9).unwrap().number, 0);
        assert!(sorters.is_ready());
        assert!(!sorters.is_empty());
    }
}
