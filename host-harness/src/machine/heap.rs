//! Cycle model of the pipelined heap, RTL unit `xy_heap`.
//!
//! | Property | Value |
//! |---|---|
//! | Capacity | 2^levels entries, counted in inserts since the last clear |
//! | Latency | 1 cycle from an operation to the top |
//! | Throughput | one operation of any kind every 2 cycles |
//! | Errors | reported in the cycle after the operation; nothing changes |
//!
//! The RTL's levels settle behind the top for some cycles more. That cannot be seen: entries are
//! totally ordered by key, then slot, so the top depends only on which entries are in the heap, and
//! the top register is right in every cycle. The model therefore holds the entries in order and the
//! handshake's time, and nothing else; in particular it computes no key.

use std::fmt;

/// The sizes of a heap, under the names of `fpga/rtl/configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct HeapConfig {
    /// Name of the configuration.
    pub name: &'static str,
    /// Memory levels below the top register; the heap holds 2^`levels` entries. 3 to 16.
    pub levels: u32,
    /// Bits of a key. 1 to 64.
    pub key_bits: u32,
    /// Bits of a slot. 1 to 32.
    pub slot_bits: u32,
    /// First level in block memory. Has no effect on function or time.
    pub block_level: u32,
}

impl HeapConfig {
    /// 16 entries: for tests that must fill it often, and for small devices.
    pub const SMALL: Self =
        Self { name: "small", levels: 4, key_bits: 30, slot_bits: 4, block_level: 7 };
    /// 256 entries of 30-bit Morton codes: the merge of the paper.
    pub const PAPER: Self =
        Self { name: "paper", levels: 8, key_bits: 30, slot_bits: 8, block_level: 7 };
    /// 256 entries of 63-bit Morton codes.
    pub const WIDE: Self =
        Self { name: "wide", levels: 8, key_bits: 63, slot_bits: 8, block_level: 7 };
    /// Every named configuration.
    pub const ALL: [Self; 3] = [Self::SMALL, Self::PAPER, Self::WIDE];

    /// How many entries the heap holds.
    pub const fn capacity(&self) -> usize {
        1 << self.levels
    }

    /// The entry as the unit's ports carry it: higher bits than the configuration's are cut off.
    pub const fn truncate(&self, entry: HeapEntry) -> HeapEntry {
        HeapEntry {
            key: entry.key & (u64::MAX >> (64 - self.key_bits)),
            slot: entry.slot & (u32::MAX >> (32 - self.slot_bits)),
        }
    }
}

/// What the heap orders: by key, and by slot where keys are equal; the lowest is the top.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash, Default)]
pub struct HeapEntry {
    /// Sorting key, a Morton code. No value is reserved.
    pub key: u64,
    /// What tells entries of equal keys apart: the input the entry came from.
    pub slot: u32,
}

impl fmt::Display for HeapEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#x}/{}", self.key, self.slot)
    }
}

/// What a heap is asked to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum HeapOp {
    /// Adds an entry. An error if the heap is full.
    Insert(HeapEntry),
    /// Takes the top away and adds an entry. An error if there is no top.
    Replace(HeapEntry),
    /// Takes the top away. Its place is not free for inserts until a clear. An error if there is no
    /// top.
    Remove,
    /// Forgets every entry.
    Clear,
}

/// The outputs of the unit in one cycle. All come from registers: the cycle's operation does not
/// change them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct HeapOutputs {
    /// An operation offered in this cycle is taken.
    pub ready: bool,
    /// The operation taken in the last cycle could not be done and changed nothing.
    pub error: bool,
    /// The lowest entry, if there is one.
    pub top: Option<HeapEntry>,
    /// Inserts are errors.
    pub full: bool,
}

/// The pipelined heap, cycle by cycle.
///
/// # Examples
///
/// ```
/// use xylem::machine::heap::{HeapConfig, HeapEntry, HeapModel, HeapOp};
///
/// let mut heap = HeapModel::new(HeapConfig::SMALL);
/// let entry = HeapEntry { key: 7, slot: 0 };
/// assert!(heap.tick(Some(HeapOp::Insert(entry))).ready);
/// let next = heap.tick(None);
/// assert_eq!(next.top, Some(entry));
/// assert!(!next.ready);
/// assert!(heap.tick(None).ready);
/// ```
#[derive(Clone, Debug)]
pub struct HeapModel {
    config: HeapConfig,
    /// Highest first, so the top is the last.
    entries: Vec<HeapEntry>,
    /// Places taken by inserts since the last clear.
    places: usize,
    ready: bool,
    error: bool,
}

impl HeapModel {
    /// An empty heap, as it is after reset.
    pub fn new(config: HeapConfig) -> Self {
        let entries = Vec::with_capacity(config.capacity());
        Self { config, entries, places: 0, ready: true, error: false }
    }

    /// The sizes of this heap.
    pub const fn config(&self) -> HeapConfig {
        self.config
    }

    /// How many entries the heap holds.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether the heap holds no entry.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The outputs of the present cycle.
    pub fn outputs(&self) -> HeapOutputs {
        HeapOutputs {
            ready: self.ready,
            error: self.error,
            top: self.entries.last().copied(),
            full: self.places == self.config.capacity(),
        }
    }

    /// Runs one clock cycle in which `op` is offered, and returns the outputs during it.
    ///
    /// The operation is taken if the outputs say ready; otherwise the caller offers it again.
    pub fn tick(&mut self, op: Option<HeapOp>) -> HeapOutputs {
        let outputs = self.outputs();
        let taken = op.filter(|_| self.ready);
        self.ready = taken.is_none();
        self.error = !taken.is_none_or(|op| self.apply(op));
        outputs
    }

    /// Does `op`, or says that it cannot be done and leaves everything as it was.
    fn apply(&mut self, op: HeapOp) -> bool {
        match op {
            HeapOp::Insert(entry) => {
                if self.places == self.config.capacity() {
                    return false;
                }
                self.places += 1;
                self.place(entry);
            }
            HeapOp::Replace(entry) => {
                if self.entries.pop().is_none() {
                    return false;
                }
                self.place(entry);
            }
            HeapOp::Remove => return self.entries.pop().is_some(),
            HeapOp::Clear => {
                self.entries.clear();
                self.places = 0;
            }
        }
        true
    }

    fn place(&mut self, entry: HeapEntry) {
        let entry = self.config.truncate(entry);
        let at = self.entries.partition_point(|other| *other > entry);
        self.entries.insert(at, entry);
    }
}

#[cfg(test)]
mod tests {
    use std::cmp::Reverse;
    use std::collections::BinaryHeap;

    use super::*;

    fn entry(key: u64, slot: u32) -> HeapEntry {
        HeapEntry { key, slot }
    }

    /// A small heap with `keys` inserted and time passed until it is ready.
    fn heap_of(keys: &[u64]) -> HeapModel {
        let mut heap = HeapModel::new(HeapConfig::SMALL);
        for (slot, &key) in keys.iter().enumerate() {
            do_op(&mut heap, HeapOp::Insert(entry(key, slot as u32)));
        }
        heap
    }

    /// Does `op` in two cycles and returns the outputs of the second.
    fn do_op(heap: &mut HeapModel, op: HeapOp) -> HeapOutputs {
        assert!(heap.tick(Some(op)).ready, "not ready for {op:?}");
        heap.tick(None)
    }

    /// The same numbers on every machine for a seed.
    fn splitmix(state: &mut u64) -> u64 {
        *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = *state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    #[test]
    fn reset_leaves_an_empty_ready_heap() {
        let expected = HeapOutputs { ready: true, error: false, top: None, full: false };
        assert_eq!(HeapModel::new(HeapConfig::PAPER).outputs(), expected);
    }

    #[test]
    fn replace_takes_exactly_two_cycles_and_shows_its_top_after_one() {
        for op in [HeapOp::Replace(entry(5, 9)), HeapOp::Insert(entry(3, 9)), HeapOp::Remove] {
            let mut heap = heap_of(&[4, 8]);
            let taken = heap.tick(Some(op)); // T
            assert_eq!((taken.ready, taken.top), (true, Some(entry(4, 0))), "{op:?}");
            let busy = heap.tick(Some(HeapOp::Clear)); // T+1: offered, not taken
            let top = match op {
                HeapOp::Remove => entry(8, 1),
                HeapOp::Insert(entry) | HeapOp::Replace(entry) => entry,
                HeapOp::Clear => unreachable!(),
            };
            assert_eq!((busy.ready, busy.top), (false, Some(top)), "{op:?}");
            let next = heap.tick(Some(HeapOp::Clear)); // T+2: taken
            assert_eq!((next.ready, next.top), (true, Some(top)), "{op:?}");
            assert_eq!(heap.outputs().top, None, "{op:?}");
        }
    }

    #[test]
    fn steady_stream_of_replaces_yields_one_entry_every_two_cycles() {
        let mut heap = heap_of(&[0, 1, 2, 3]);
        let mut outputs = 0;
        for cycle in 0..1000 {
            let top = heap.outputs().top.unwrap();
            let out = heap.tick(Some(HeapOp::Replace(entry(top.key + 4, top.slot))));
            assert_eq!(out.ready, cycle % 2 == 0);
            outputs += u64::from(out.ready);
        }
        assert_eq!(outputs, 500);
        assert_eq!(heap.outputs().top.unwrap().key, 500);
    }

    #[test]
    fn equal_keys_come_out_by_slot() {
        let mut heap = HeapModel::new(HeapConfig::SMALL);
        for slot in [3, 1, 2, 0] {
            do_op(&mut heap, HeapOp::Insert(entry(6, slot)));
        }
        for slot in 0..4 {
            assert_eq!(heap.outputs().top, Some(entry(6, slot)));
            do_op(&mut heap, HeapOp::Remove);
        }
        assert_eq!(heap.outputs().top, None);
    }

    #[test]
    fn highest_key_is_an_ordinary_key() {
        let highest = entry((1 << 30) - 1, 15);
        let mut heap = HeapModel::new(HeapConfig::SMALL);
        assert_eq!(do_op(&mut heap, HeapOp::Insert(highest)).top, Some(highest));
    }

    #[test]
    fn rejected_operation_is_reported_once_and_keeps_state() {
        let mut empty = HeapModel::new(HeapConfig::SMALL);
        for op in [HeapOp::Replace(entry(1, 1)), HeapOp::Remove] {
            let out = do_op(&mut empty, op);
            assert_eq!((out.error, out.top, out.full), (true, None, false), "{op:?}");
            assert!(!empty.outputs().error);
        }

        let mut full = heap_of(&[2; 16]);
        assert!(full.outputs().full);
        let out = do_op(&mut full, HeapOp::Insert(entry(1, 1)));
        assert_eq!((out.error, out.top), (true, Some(entry(2, 0))));
        assert_eq!(full.entries.len(), 16);
    }

    #[test]
    fn removed_entries_give_their_places_back_only_on_clear() {
        let mut heap = heap_of(&[2; 16]);
        do_op(&mut heap, HeapOp::Remove);
        assert!(do_op(&mut heap, HeapOp::Insert(entry(1, 1))).error);
        do_op(&mut heap, HeapOp::Clear);
        assert!(!heap.outputs().full);
        assert!(!do_op(&mut heap, HeapOp::Insert(entry(1, 1))).error);
    }

    #[test]
    fn top_is_that_of_a_software_heap_in_every_cycle() {
        for seed in 0..8 {
            println!("seed {seed}");
            let mut random = seed;
            let mut heap = HeapModel::new(HeapConfig::SMALL);
            let mut reference = BinaryHeap::new();
            let mut inserted = 0;
            for _ in 0..20_000 {
                let new = entry(splitmix(&mut random) % 32, splitmix(&mut random) as u32 % 16);
                let op = match splitmix(&mut random) % 64 {
                    0 => Some(HeapOp::Clear),
                    1..20 => Some(HeapOp::Insert(new)),
                    20..44 => Some(HeapOp::Replace(new)),
                    44..52 => Some(HeapOp::Remove),
                    _ => None,
                };
                let out = heap.tick(op);
                assert_eq!(out.top.map(Reverse), reference.peek().copied());
                match op.filter(|_| out.ready) {
                    Some(HeapOp::Insert(new)) if inserted < 16 => {
                        inserted += 1;
                        reference.push(Reverse(new));
                    }
                    Some(HeapOp::Replace(new)) if reference.pop().is_some() => {
                        reference.push(Reverse(new));
                    }
                    Some(HeapOp::Remove) => {
                        reference.pop();
                    }
                    Some(HeapOp::Clear) => {
                        inserted = 0;
                        reference.clear();
                    }
                    _ => {}
                }
            }
        }
    }
}
