//! The merge heap: a binary min-heap whose top is replaced by its successor.

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
    pub const INFINITE: u64 = u64::MAX;

    /// The entry as one number in the same order.
    #[inline]
    const fn key(&self) -> u128 {
        (self.code as u128) << 32 | self.slot as u128
    }
}

/// A binary min-heap with the two operations of P2 §5.2: insert, and replace of the top.
///
/// Removing is a replace with [`HeapEntry::INFINITE`], as in the hardware unit: entries sink and
/// stay. The hardware unit pipelines the same operations over one memory a level and delivers the
/// same tops, because the order of entries is total.
#[derive(Debug)]
pub struct ReplaceHeap<'a> {
    entries: &'a mut VecView<HeapEntry>,
}

impl<'a> ReplaceHeap<'a> {
    /// An empty heap in the given storage; what the storage held is dropped.
    pub fn new(entries: &'a mut VecView<HeapEntry>) -> Self {
        entries.clear();
        Self { entries }
    }

    /// The lowest entry.
    #[inline]
    pub fn top(&self) -> Option<HeapEntry> {
        self.entries.first().copied()
    }

    /// Adds an entry.
    ///
    /// # Errors
    /// The entry itself, if the storage is full; the heap is unchanged.
    pub fn insert(&mut self, entry: HeapEntry) -> Result<(), HeapEntry> {
        let mut hole = self.entries.len();
        self.entries.push(entry)?;
        while hole > 0 {
            let parent = (hole - 1) / 2;
            if self.entries[parent] <= entry {
                break;
            }
            self.entries[hole] = self.entries[parent];
            hole = parent;
        }
        self.entries[hole] = entry;
        Ok(())
    }

    /// Replaces the top by `entry` and lets it sink to its place. Does nothing on an empty heap.
    #[inline]
    pub fn replace(&mut self, entry: HeapEntry) {
        let entries = self.entries.as_mut_slice();
        if entries.is_empty() {
            return;
        }
        let key = entry.key();
        let mut hole = 0;
        loop {
            let left = 2 * hole + 1;
            let child = match entries.get(left..left + 2) {
                // Added, not branched on: which child is lower cannot be predicted.
                Some([first, second]) => left + usize::from(second.key() < first.key()),
                _ if left < entries.len() => left,
                _ => break,
            };
            let lower = entries[child];
            if key <= lower.key() {
                break;
            }
            entries[hole] = lower;
            hole = child;
        }
        entries[hole] = entry;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Vec;

    #[test]
    fn tops_come_out_in_order_with_ties_by_slot() {
        let mut storage = Vec::<HeapEntry, 8>::new();
        let mut heap = ReplaceHeap::new(&mut storage);
        for (slot, code) in [5, 3, 9, 3, 7, 3].into_iter().enumerate() {
            heap.insert(HeapEntry { code, slot: slot as u32 }).unwrap();
        }
        let mut out = Vec::<(u64, u32), 8>::new();
        while let Some(HeapEntry { code, slot }) = heap.top() {
            if code == HeapEntry::INFINITE {
                break;
            }
            out.push((code, slot)).unwrap();
            heap.replace(HeapEntry { code: HeapEntry::INFINITE, slot });
        }
        assert_eq!(out.as_slice(), [(3, 1), (3, 3), (3, 5), (5, 0), (7, 4), (9, 2)]);
    }

    #[test]
    fn a_full_heap_gives_the_entry_back_and_keeps_its_top() {
        let mut storage = Vec::<HeapEntry, 2>::new();
        let mut heap = ReplaceHeap::new(&mut storage);
        let entry = |code| HeapEntry { code, slot: 0 };
        heap.insert(entry(2)).unwrap();
        heap.insert(entry(1)).unwrap();
        assert_eq!(heap.insert(entry(0)), Err(entry(0)));
        assert_eq!(heap.top(), Some(entry(1)));
    }

    #[test]
    fn replacing_in_an_empty_heap_does_nothing() {
        let mut storage = Vec::<HeapEntry, 2>::new();
        let mut heap = ReplaceHeap::new(&mut storage);
        heap.replace(HeapEntry { code: 1, slot: 1 });
        assert_eq!(heap.top(), None);
    }
}
