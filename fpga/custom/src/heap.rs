//! The merge heap, a match of which is two instructions.

use xylem_core::sort::{HeapEntry, ReplaceHeap};

use crate::cfu::{Cfu, Unit, heap};

/// The two operations that a merge needs of a full heap.
pub trait MergeHeap {
    /// The lowest entry.
    fn top(&self) -> HeapEntry;

    /// Replaces the top by another entry of its slot.
    fn replace(&mut self, entry: HeapEntry);
}

impl MergeHeap for ReplaceHeap<'_> {
    #[inline(always)]
    fn top(&self) -> HeapEntry {
        ReplaceHeap::top(self).unwrap_or(HeapEntry { code: HeapEntry::INFINITE, slot: 0 })
    }

    #[inline(always)]
    fn replace(&mut self, entry: HeapEntry) {
        ReplaceHeap::replace(self, entry);
    }
}

/// How far a code is above its slot in a key, as in [`ReplaceHeap`].
const SHIFT: u32 = 31;

/// [`ReplaceHeap`] for codes of at most 32 bits and a power of two of slots, its matches decided by the custom
/// function unit.
#[derive(Debug)]
pub struct CustomHeap<'a, C> {
    /// The lowest key, then the loser of each match.
    matches: &'a mut [u64],
    cfu: &'a C,
}

impl<'a, C: Cfu> CustomHeap<'a, C> {
    /// A heap over `codes`, one a slot, in `matches`, which are as many; `None` if that is no power of two.
    pub fn new(
        cfu: &'a C,
        matches: &'a mut [u64],
        codes: impl Iterator<Item = u64>,
    ) -> Option<Self> {
        if !matches.len().is_power_of_two() {
            return None;
        }
        // Places that nobody has come to are above every key; a key finds its own on the way up.
        matches.fill(u64::MAX);
        let len = matches.len();
        let mut heap = Self { matches, cfu };
        for (slot, code) in (0..len as u32).zip(codes) {
            heap.insert(HeapEntry { code, slot });
        }
        Some(heap)
    }

    fn insert(&mut self, entry: HeapEntry) {
        let mut key = pack(entry);
        let mut from = self.matches.len() + entry.slot as usize;
        while from > 1 {
            from /= 2;
            let Some(other) = self.matches.get_mut(from) else { return };
            if *other == u64::MAX {
                *other = key;
                return;
            }
            (key, *other) = (key.min(*other), key.max(*other));
        }
        if let Some(top) = self.matches.first_mut() {
            *top = key;
        }
    }
}

#[inline(always)]
fn pack(entry: HeapEntry) -> u64 {
    entry.code.min(HeapEntry::INFINITE >> SHIFT) << SHIFT | u64::from(entry.slot)
}

impl<C: Cfu> MergeHeap for CustomHeap<'_, C> {
    #[inline(always)]
    fn top(&self) -> HeapEntry {
        let key = self.matches.first().copied().unwrap_or(u64::MAX);
        let slot = key as u32 & ((1 << SHIFT) - 1);
        let infinite = key & HeapEntry::INFINITE != 0;
        HeapEntry { code: if infinite { HeapEntry::INFINITE } else { key >> SHIFT }, slot }
    }

    #[inline(always)]
    fn replace(&mut self, entry: HeapEntry) {
        const HEAP: u32 = Unit::HEAP;
        let cfu = self.cfu;
        cfu.call_wide::<HEAP, { heap::KEY_LOAD }>(pack(entry));
        let mut from = self.matches.len() + entry.slot as usize;
        while from > 1 {
            from /= 2;
            let Some(other) = self.matches.get_mut(from) else { break };
            let low = cfu.call_wide::<HEAP, { heap::KEY_MEET }>(*other);
            let high = cfu.call::<HEAP, { heap::REST_HIGH }>(0, 0);
            *other = u64::from(high) << 32 | u64::from(low);
        }
        let low = cfu.call::<HEAP, { heap::KEY_LOW }>(0, 0);
        let high = cfu.call::<HEAP, { heap::KEY_HIGH }>(0, 0);
        if let Some(top) = self.matches.first_mut() {
            *top = u64::from(high) << 32 | u64::from(low);
        }
    }
}
