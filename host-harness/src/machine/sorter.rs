//! Cycle model of the insertion sorters, RTL unit `xy_sorters` (P2 §5.5).
//!
//! | Property | Value |
//! |---|---|
//! | Room | one piece of `2B` records each, sorted in place |
//! | Input | two records a cycle; they wait inside until it is their turn; a piece may follow the one before a pair behind |
//! | Throughput | one compare-and-swap a cycle; none in a cycle in which records come in or leave |
//! | Load | beside a comparison of the record before that reads the other one of two banks, else a cycle |
//! | Output | two records a cycle, piece by piece in the order in which they came, each once it is in order |

use xylem_core::sort::Item;

/// A bank of insertion sorters that take pieces in turn.
#[derive(Clone, Debug)]
pub struct Sorters {
    sorters: Vec<Sorter>,
    /// Which sorter the next record goes to.
    filling: usize,
    /// Which sorter the next pair comes from.
    draining: usize,
}

/// One insertion sorter.
#[derive(Clone, Debug)]
struct Sorter {
    /// Records of a piece.
    piece: usize,
    /// The records that came, in their places.
    items: Vec<Item>,
    /// How many of them are in order or on their way there; the first one is.
    begun: usize,
    /// The place below the record that is on its way.
    below: Option<usize>,
    /// Whether the record after it has been read.
    next: bool,
    /// Whether the whole piece has come.
    complete: bool,
    /// The piece that leaves, from its second pair on, and how many of its records have left.
    leaving: Vec<Item>,
    left: usize,
    /// Whether the memory was written or read from outside in this cycle.
    in_use: bool,
}

impl Sorters {
    /// `count` sorters for pieces of at most `piece` records.
    pub fn new(count: u32, piece: u32) -> Self {
        let sorters = (0..count).map(|_| Sorter::new(piece as usize)).collect();
        Self { sorters, filling: 0, draining: 0 }
    }

    /// Whether the sorter whose turn it is can take a record in this cycle, or a second one. Ask
    /// before [`Sorters::deliver`]: room is seen a cycle later.
    pub fn is_ready(&self) -> bool {
        self.sorters[self.filling].is_ready()
    }

    /// Takes a record, the `last` of all or not; call when [`Sorters::is_ready`].
    pub fn accept(&mut self, item: Item, last: bool) {
        let sorter = &mut self.sorters[self.filling];
        sorter.items.push(item);
        sorter.in_use = true;
        sorter.complete = last || sorter.items.len() == sorter.piece;
        if sorter.complete {
            self.filling = (self.filling + 1) % self.sorters.len();
        }
    }

    /// Hands out the next two records, or the last one, of the oldest piece, if that is in order;
    /// gives them and how many they are.
    pub fn deliver(&mut self) -> Option<([Item; 2], usize)> {
        let sorter = self.sorters.get_mut(self.draining)?;
        let pair = sorter.deliver()?;
        if sorter.leaving.is_empty() {
            self.draining = (self.draining + 1) % self.sorters.len();
        }
        Some(pair)
    }

    /// Ends the cycle: every sorter whose memory is free does a step.
    pub fn tick(&mut self) {
        self.sorters.iter_mut().for_each(Sorter::tick);
    }

    /// How many sorters have records to put in order.
    pub fn busy(&self) -> u32 {
        self.sorters.iter().filter(|s| s.below.is_some() || s.begun < s.items.len()).count() as u32
    }

    /// How many sorters there are.
    pub fn len(&self) -> usize {
        self.sorters.len()
    }

    /// Whether no sorter holds a record.
    pub fn is_empty(&self) -> bool {
        self.sorters.iter().all(|s| s.items.is_empty() && s.leaving.is_empty())
    }
}

impl Sorter {
    fn new(piece: usize) -> Self {
        Self {
            piece,
            items: Vec::with_capacity(piece),
            begun: 1,
            below: None,
            next: false,
            complete: false,
            leaving: Vec::with_capacity(piece),
            left: 0,
            in_use: false,
        }
    }

    fn is_ready(&self) -> bool {
        // A pair may take the row of one that has left.
        !self.complete && (self.leaving.is_empty() || self.items.len() / 2 < self.left / 2)
    }

    fn deliver(&mut self) -> Option<([Item; 2], usize)> {
        if self.leaving.is_empty() {
            let in_order = self.below.is_none() && self.begun == self.items.len();
            if !self.complete || !in_order || self.in_use {
                return None;
            }
            std::mem::swap(&mut self.items, &mut self.leaving);
            (self.begun, self.complete) = (1, false);
        }
        self.in_use = true;
        let rest = &self.leaving[self.left..];
        let &first = rest.first()?;
        let pair = [first, rest.get(1).copied().unwrap_or(first)];
        let given = rest.len().min(2);
        self.left += given;
        if self.left == self.leaving.len() {
            self.leaving.clear();
            self.left = 0;
        }
        Some((pair, given))
    }

    fn tick(&mut self) {
        if std::mem::take(&mut self.in_use) || !self.leaving.is_empty() {
            return;
        }
        let mut may_load = true;
        if let Some(below) = self.below.take() {
            // Equal codes keep their order.
            let swap = self.items[below].code > self.items[below + 1].code;
            if swap {
                self.items.swap(below, below + 1);
            }
            // The next record can be read if it lies in the other bank.
            self.next |= self.begun < self.items.len() && self.begun % 2 != below % 2;
            if swap && below > 0 {
                self.below = Some(below - 1);
                return;
            }
            may_load = self.next;
        }
        if may_load && self.begun < self.items.len() {
            self.below = Some(self.begun - 1);
            self.begun += 1;
            self.next = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(code: u64, reference: u32) -> Item {
        Item { code, reference, ..Item::ZERO }
    }

    /// Runs cycles until something comes out; gives how many went by before.
    fn wait(sorters: &mut Sorters) -> u64 {
        for cycle in 0..10_000 {
            if sorters.deliver().is_some() {
                return cycle;
            }
            sorters.tick();
        }
        panic!("nothing comes out");
    }

    /// Sorts one piece that has come in cycle 0 all at once; gives the cycles until it is done.
    fn cycles(codes: &[u64]) -> u64 {
        let mut sorters = Sorters::new(1, codes.len() as u32);
        for (i, &code) in codes.iter().enumerate() {
            sorters.accept(item(code, i as u32), false);
        }
        wait(&mut sorters)
    }

    /// Everything that comes out.
    fn drain(sorters: &mut Sorters) -> Vec<Item> {
        wait(&mut sorters.clone());
        let mut all = Vec::new();
        for _ in 0..1000 {
            all.extend(
                sorters.deliver().into_iter().flat_map(|(pair, n)| pair.into_iter().take(n)),
            );
            sorters.tick();
        }
        all
    }

    #[test]
    fn a_sorted_piece_takes_one_compare_a_record_and_a_reversed_one_all_of_them() {
        let up: Vec<u64> = (0..32).collect();
        let down: Vec<u64> = up.iter().rev().copied().collect();
        // A cycle to come in, and for each record but the first a comparison and a load: the
        // comparison with the place below reads the bank that the next record is in.
        assert_eq!(cycles(&up), 1 + 2 * 31);
        // Record k goes through k comparisons down to place 0. From k = 2 on, one of them reads the
        // other bank than the one that the next record is in.
        assert_eq!(cycles(&down), 1 + 31 * 32 / 2 + 2);
        assert_eq!(cycles(&[5; 8]), 1 + 2 * 7);
    }

    #[test]
    fn a_late_record_waits_for_nothing_but_itself() {
        let mut sorters = Sorters::new(1, 2);
        sorters.accept(item(1, 0), false);
        for _ in 0..100 {
            assert!(sorters.deliver().is_none());
            sorters.tick();
        }
        sorters.accept(item(0, 1), false);
        // Written, loaded, compared.
        assert_eq!(wait(&mut sorters.clone()), 3);
        assert_eq!(drain(&mut sorters), [item(0, 1), item(1, 0)]);
    }

    #[test]
    fn nothing_is_sorted_while_records_come_in() {
        let mut sorters = Sorters::new(1, 8);
        for pair in 0..4 {
            sorters.accept(item(0, 0), false);
            sorters.accept(item(0, 0), false);
            sorters.tick();
            assert_eq!(sorters.busy(), 1, "pair {pair}");
        }
        assert_eq!(wait(&mut sorters), 2 * 7);
    }

    #[test]
    fn the_order_is_that_of_the_core_s_stable_sort() {
        let mut sorters = Sorters::new(1, 32);
        let mut expect: Vec<Item> = (0..31).map(|i| item(u64::from(i * 7 % 5), i)).collect();
        for (i, &item) in expect.iter().enumerate() {
            sorters.accept(item, i == 30);
        }
        expect.sort_by_key(|item| item.code);
        assert_eq!(drain(&mut sorters), expect);
    }

    #[test]
    fn a_piece_may_follow_a_pair_behind_the_one_that_leaves() {
        let mut sorters = Sorters::new(1, 4);
        (0..4).for_each(|code| sorters.accept(item(code, 0), false));
        assert!(!sorters.is_ready());
        wait(&mut sorters);
        sorters.tick();
        assert!(sorters.is_ready(), "the first pair has left");
        (4..6).for_each(|code| sorters.accept(item(code, 0), false));
        assert!(!sorters.is_ready());
        assert_eq!(sorters.deliver(), Some(([item(2, 0), item(3, 0)], 2)));
        sorters.tick();
        assert!(sorters.is_ready());
        (6..8).for_each(|code| sorters.accept(item(code, 0), false));
        let codes: Vec<u64> = drain(&mut sorters).iter().map(|item| item.code).collect();
        assert_eq!(codes, [4, 5, 6, 7]);
    }

    #[test]
    fn pieces_leave_in_the_order_in_which_they_came_and_a_busy_sorter_holds_the_rest_up() {
        let mut sorters = Sorters::new(2, 2);
        for code in [5, 0, 3, 4] {
            assert!(sorters.is_ready());
            sorters.accept(item(code, 0), false);
        }
        assert!(!sorters.is_ready());
        let codes: Vec<u64> = drain(&mut sorters).iter().map(|item| item.code).collect();
        assert_eq!(codes, [0, 5, 3, 4]);
        assert!(sorters.is_ready() && sorters.is_empty());
    }
}
