//! The merge heap: the lowest of many runs' heads, replaced by its successor.

use core::hint::select_unpredictable;

use heapless::VecView;

/// One entry of the merge heap: a Morton code and the run it came from.
///
/// Entries are ordered by code, then by slot. Two entries never compare equal, because each slot is
/// in the heap once; the order of a merge is therefore fully determined.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct HeapEntry {
    /// The Morton code, or [`HeapEntry::INFINITE`] where a run has ended.
    pub code: u64,
    /// The scratchpad slot of the run.
    pub slot: u32,
}

impl HeapEntry {
    /// A code above every Morton code.
    pub const INFINITE: u64 = 1 << 63;

    /// A place that nobody has come to yet; no slot has this number.
    const VACANT: Self = Self { code: Self::INFINITE, slot: u32::MAX };
}

/// A min-heap over the slots `0 .. n` with the two operations of P2 §5.2: insert, and replace of the
/// top.
///
/// It is kept as a tournament of losers: entry 0 is the lowest of all, and each match above it keeps
/// the entry that lost there. A replaced top comes from the slot of its successor, so its way to the
/// root is known beforehand, and a step of it is one comparison of codes without a branch. The hardware unit
/// is a pipelined binary heap over one memory a level; it delivers the same tops, because the order
/// of entries is total. Removing is a replace with [`HeapEntry::INFINITE`].
#[derive(Debug)]
pub struct ReplaceHeap<'a> {
    matches: &'a mut VecView<HeapEntry>,
    /// Codes have at most 32 bits, and the slot is kept below the code: one key to compare.
    packed: bool,
}

/// How far a code is above its slot in a packed key. What is infinite comes above all codes.
const PACKED_SHIFT: u32 = 31;

impl<'a> ReplaceHeap<'a> {
    /// A heap for `slots` slots and codes of `code_bits` bits in the given storage, which must hold
    /// as many entries as the next power of two; what it held is dropped.
    ///
    /// # Errors
    /// The number of entries that the storage lacks.
    pub fn new(
        storage: &'a mut VecView<HeapEntry>,
        slots: usize,
        code_bits: u32,
    ) -> Result<Self, usize> {
        let players = slots.next_power_of_two();
        storage.clear();
        storage
            .resize(players, HeapEntry::VACANT)
            .map_err(|_| players.saturating_sub(storage.capacity()))?;
        let mut heap = Self { matches: storage, packed: code_bits <= 32 };
        for slot in slots as u32..players as u32 {
            heap.insert(HeapEntry { code: HeapEntry::INFINITE, slot });
        }
        Ok(heap)
    }

    /// The lowest entry, once every slot has been inserted.
    #[inline(always)]
    pub fn top(&self) -> Option<HeapEntry> {
        let top = self.matches.first().filter(|top| top.slot != HeapEntry::VACANT.slot)?;
        if !self.packed {
            return Some(*top);
        }
        let slot = top.code as u32 & ((1 << PACKED_SHIFT) - 1);
        let infinite = top.code & HeapEntry::INFINITE != 0;
        let code = if infinite { HeapEntry::INFINITE } else { top.code >> PACKED_SHIFT };
        Some(HeapEntry { code, slot })
    }

    /// The entry as it is kept.
    #[inline(always)]
    fn pack(&self, entry: HeapEntry) -> HeapEntry {
        if !self.packed {
            return entry;
        }
        let infinite = HeapEntry::INFINITE >> PACKED_SHIFT;
        let code = entry.code.min(infinite) << PACKED_SHIFT | u64::from(entry.slot);
        HeapEntry { code, ..entry }
    }

    /// Enters a slot, each once: it plays its way up until it has to wait for an opponent. A slot
    /// outside the heap is ignored.
    pub fn insert(&mut self, mut entry: HeapEntry) {
        entry = self.pack(entry);
        let matches = self.matches.as_mut_slice();
        let mut place = (matches.len() + entry.slot as usize) / 2;
        while let Some(other) = matches.get_mut(place) {
            if place == 0 || other.slot == HeapEntry::VACANT.slot {
                *other = entry;
                return;
            }
            if *other < entry {
                core::mem::swap(other, &mut entry);
            }
            place /= 2;
        }
    }

    /// Replaces the top by an entry of the same slot and lets it find its place. Does nothing
    /// before every slot has been inserted, or if the slot is not the top's.
    #[inline(always)]
    pub fn replace(&mut self, entry: HeapEntry) {
        if self.top().is_none_or(|top| top.slot != entry.slot) {
            return;
        }
        let mut low = self.pack(entry);
        let matches = self.matches.as_mut_slice();
        let mut from = matches.len() + entry.slot as usize;
        while self.packed && from > 1 {
            let Some(other) = matches.get_mut(from / 2) else { break };
            (low.code, other.code) = (low.code.min(other.code), low.code.max(other.code));
            from /= 2;
        }
        while from > 1 {
            let Some(other) = matches.get_mut(from / 2) else { break };
            // Who comes from the right has the higher slot and loses a tie.
            let swap = other.code < low.code + (from & 1) as u64;
            let (a, b) = (low, *other);
            low.code = select_unpredictable(swap, b.code, a.code);
            low.slot = select_unpredictable(swap, b.slot, a.slot);
            other.code = select_unpredictable(swap, a.code, b.code);
            other.slot = select_unpredictable(swap, a.slot, b.slot);
            from /= 2;
        }
        if let Some(top) = matches.first_mut() {
            *top = low;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Vec;

    fn entry(code: u64, slot: u32) -> HeapEntry {
        HeapEntry { code, slot }
    }

    /// Codes of both kinds: packed with their slots, and not.
    const WIDTHS: [u32; 2] = [30, 63];

    #[test]
    fn tops_come_out_in_order_with_ties_by_slot() {
        for bits in WIDTHS {
            let mut storage = Vec::<HeapEntry, 8>::new();
            let mut heap = ReplaceHeap::new(&mut storage, 6, bits).unwrap();
            for (slot, code) in [5, 3, 9, 3, 7, 3].into_iter().enumerate() {
                assert_eq!(heap.top(), None);
                heap.insert(entry(code, slot as u32));
            }
            let mut out = Vec::<(u64, u32), 8>::new();
            while let Some(HeapEntry { code, slot }) = heap.top() {
                if code == HeapEntry::INFINITE {
                    break;
                }
                out.push((code, slot)).unwrap();
                heap.replace(entry(HeapEntry::INFINITE, slot));
            }
            assert_eq!(out.as_slice(), [(3, 1), (3, 3), (3, 5), (5, 0), (7, 4), (9, 2)]);
        }
    }

    #[test]
    fn slots_may_enter_in_any_order() {
        for bits in WIDTHS {
            let mut storage = Vec::<HeapEntry, 4>::new();
            let mut heap = ReplaceHeap::new(&mut storage, 4, bits).unwrap();
            for slot in [2, 0, 3, 1] {
                heap.insert(entry(10 - u64::from(slot), slot));
            }
            assert_eq!(heap.top(), Some(entry(7, 3)));
            heap.replace(entry(20, 3));
            assert_eq!(heap.top(), Some(entry(8, 2)));
        }
    }

    #[test]
    fn one_slot_is_a_heap_and_none_has_no_finite_top() {
        let mut storage = Vec::<HeapEntry, 4>::new();
        let mut heap = ReplaceHeap::new(&mut storage, 1, 30).unwrap();
        heap.insert(entry(4, 0));
        assert_eq!(heap.top(), Some(entry(4, 0)));
        heap.replace(entry(6, 0));
        assert_eq!(heap.top(), Some(entry(6, 0)));
        let heap = ReplaceHeap::new(&mut storage, 0, 30).unwrap();
        assert!(heap.top().is_none_or(|top| top.code == HeapEntry::INFINITE));
    }

    #[test]
    fn storage_that_is_too_small_is_refused_with_what_it_lacks() {
        let mut storage = Vec::<HeapEntry, 6>::new();
        assert_eq!(ReplaceHeap::new(&mut storage, 5, 30).unwrap_err(), 2);
    }

    #[test]
    fn replacing_another_slot_or_too_early_does_nothing() {
        let mut storage = Vec::<HeapEntry, 2>::new();
        let mut heap = ReplaceHeap::new(&mut storage, 2, 30).unwrap();
        heap.replace(entry(1, 1));
        heap.insert(entry(5, 0));
        heap.insert(entry(6, 1));
        heap.insert(entry(0, 9));
        heap.replace(entry(1, 1));
        assert_eq!(heap.top(), Some(entry(5, 0)));
    }
}
