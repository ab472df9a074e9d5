//! Cycle model of the insertion sorters, RTL unit `xy_sorters` (P2 §5.5).
//!
//! | Property | Value |
//! |---|---|
//! | Room | one piece of `2B` records each, sorted in place |
//! | Input | two records a cycle; they wait inside until it is their turn |
//! | Throughput | one compare-and-swap a cycle, and one cycle of overhead for each record; none in a cycle in which records come in |
//! | Output | two records a cycle, piece by piece in the order in which they came, each once it is in order |

use xylem_core::sort::Item;

/// A bank of insertion sorters that take pieces in turn.
#[derive(Clone, Debug)]
pub struct Sorters {
    sorters: Vec<Sorter>,
    piece: usize,
    /// Which sorter the next record goes to.
    filling: usize,
    /// Which sorter the next pair comes from.
    draining: usize,
}

/// One insertion sorter.
#[derive(Clone, Debug, Default)]
struct Sorter {
    /// The part of the piece that is in order, after the cycle `done_at`.
    sorted: Vec<Item>,
    /// The cycle in which the last record taken in will be in its place.
    done_at: u64,
    /// The cycle after the last one in which a record came in.
    fed_until: u64,
    /// Whether the whole piece has been taken in.
    complete: bool,
    /// Records handed out.
    given: usize,
}

impl Sorters {
    /// `count` sorters for pieces of at most `piece` records.
    pub fn new(count: u32, piece: u32) -> Self {
        let sorter = Sorter { sorted: Vec::with_capacity(piece as usize), ..Sorter::default() };
        let sorters = vec![sorter; count as usize];
        Self { sorters, piece: piece as usize, filling: 0, draining: 0 }
    }

    /// Whether the sorter whose turn it is can take a record, or two that do not end different
    /// pieces. Ask before [`Sorters::deliver`]: room is seen a cycle later.
    pub fn is_ready(&self) -> bool {
        !self.sorters[self.filling].complete
    }

    /// Takes a record in cycle `now`, the `last` of all or not; call when [`Sorters::is_ready`].
    pub fn accept(&mut self, item: Item, last: bool, now: u64) {
        let sorter = &mut self.sorters[self.filling];
        if sorter.done_at > now && sorter.fed_until <= now {
            // The memory is written from outside: a cycle is lost for sorting.
            sorter.done_at += 1;
        }
        sorter.fed_until = now + 1;
        // Equal codes keep their order: a record stops behind the first that is not higher.
        let place = sorter.sorted.iter().rposition(|other| other.code <= item.code);
        let place = place.map_or(0, |at| at + 1);
        let moved = sorter.sorted.len() - place;
        let compares = moved + usize::from(place > 0);
        sorter.sorted.insert(place, item);
        sorter.done_at = sorter.done_at.max(now + 1) + 1 + compares as u64;
        sorter.complete = last || sorter.sorted.len() == self.piece;
        if sorter.complete {
            self.filling = (self.filling + 1) % self.sorters.len();
        }
    }

    /// Hands out the next two records, or the last one, of the oldest piece, if that is in order in
    /// cycle `now`; gives them and how many they are.
    pub fn deliver(&mut self, now: u64) -> Option<([Item; 2], usize)> {
        let sorter = self.sorters.get_mut(self.draining)?;
        if !sorter.complete || sorter.done_at > now {
            return None;
        }
        let rest = &sorter.sorted[sorter.given..];
        let &first = rest.first()?;
        let pair = [first, rest.get(1).copied().unwrap_or(first)];
        let given = rest.len().min(2);
        sorter.given += given;
        if sorter.given == sorter.sorted.len() {
            sorter.sorted.clear();
            (sorter.complete, sorter.given) = (false, 0);
            self.draining = (self.draining + 1) % self.sorters.len();
        }
        Some((pair, given))
    }

    /// How many sorters move records at `now`.
    pub fn busy(&self, now: u64) -> u32 {
        self.sorters.iter().filter(|s| s.done_at > now).count() as u32
    }

    /// How many sorters there are.
    pub fn len(&self) -> usize {
        self.sorters.len()
    }

    /// Whether no sorter holds a record.
    pub fn is_empty(&self) -> bool {
        self.sorters.iter().all(|s| s.sorted.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(code: u64, reference: u32) -> Item {
        Item { code, reference, ..Item::ZERO }
    }

    /// Everything that comes out at `now`.
    fn drain(sorters: &mut Sorters, now: u64) -> Vec<Item> {
        let pairs = std::iter::from_fn(|| sorters.deliver(now));
        pairs.flat_map(|(items, given)| items.into_iter().take(given)).collect()
    }

    /// Sorts one piece that arrives in cycle 0 all at once; gives the cycle in which it is done.
    fn done_at(codes: &[u64]) -> u64 {
        let mut sorters = Sorters::new(1, codes.len() as u32);
        for (i, &code) in codes.iter().enumerate() {
            sorters.accept(item(code, i as u32), false, 0);
        }
        (0..).find(|&now| sorters.deliver(now).is_some()).unwrap()
    }

    #[test]
    fn a_sorted_piece_takes_one_compare_a_record_and_a_reversed_one_all_of_them() {
        let up: Vec<u64> = (0..32).collect();
        let down: Vec<u64> = up.iter().rev().copied().collect();
        // One cycle to come in and one of overhead a record; the first has nothing to be compared
        // with.
        assert_eq!(done_at(&up), 1 + 32 + 31);
        assert_eq!(done_at(&down), 1 + 32 + 31 * 32 / 2);
        assert_eq!(done_at(&[5; 8]), 1 + 8 + 7);
    }

    #[test]
    fn a_late_record_waits_for_nothing_but_itself() {
        let mut sorters = Sorters::new(1, 2);
        sorters.accept(item(1, 0), false, 0);
        sorters.accept(item(0, 1), false, 100);
        // Written in cycle 100, loaded in 101, compared in 102.
        assert!(sorters.deliver(102).is_none());
        assert_eq!(sorters.deliver(103), Some(([item(0, 1), item(1, 0)], 2)));
    }

    #[test]
    fn records_that_come_in_cost_those_inside_a_cycle() {
        // The first pair takes cycles 1 to 3 if it is left alone.
        let cycles = |second_at: u64| {
            let mut sorters = Sorters::new(1, 4);
            for (code, at) in [(0, 0), (1, 0), (2, second_at), (3, second_at)] {
                sorters.accept(item(code, 0), false, at);
            }
            (0..).find(|&now| sorters.deliver(now).is_some()).unwrap()
        };
        assert_eq!(cycles(0), 1 + 4 + 3);
        assert_eq!(cycles(1), 1 + 4 + 3 + 1, "a pair in two cycles costs one");
        assert_eq!(cycles(4), 1 + 4 + 3 + 1, "nothing was to be done in cycle 4");
    }

    #[test]
    fn the_order_is_that_of_the_core_s_stable_sort() {
        let mut sorters = Sorters::new(1, 32);
        let mut expect: Vec<Item> = (0..31).map(|i| item(u64::from(i * 7 % 5), i)).collect();
        for (i, &item) in expect.iter().enumerate() {
            sorters.accept(item, i == 30, 0);
        }
        expect.sort_by_key(|item| item.code);
        assert_eq!(drain(&mut sorters, u64::MAX), expect);
    }

    #[test]
    fn pieces_leave_in_the_order_in_which_they_came_and_a_busy_sorter_holds_the_rest_up() {
        let mut sorters = Sorters::new(2, 2);
        for code in [5, 0, 3, 4] {
            assert!(sorters.is_ready());
            sorters.accept(item(code, 0), false, 0);
        }
        assert!(!sorters.is_ready());
        let codes: Vec<u64> = drain(&mut sorters, 9).iter().map(|item| item.code).collect();
        assert_eq!(codes, [0, 5, 3, 4]);
        assert!(sorters.is_ready() && sorters.is_empty());
    }
}
