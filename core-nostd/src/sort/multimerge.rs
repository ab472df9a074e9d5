//! The multi-merge: many sorted runs in, one sorted stream out.

use super::{HeapEntry, Item, MAX_BURST, RecordFormat, ReplaceHeap, SortConfig, Workspace};
use crate::error::{BuildError, RegionName};
use crate::mem::{Bus, Region};
use crate::num::MortonCoder;
use crate::probe::{Probe, Stage};

/// The read position of one run: what of it is in the scratchpad and what is still in memory.
///
/// A run owns two bursts of the scratchpad (P2 §5.3: double buffering) or, with forecasting, one.
/// When one of them has been consumed, the next burst of the run replaces it: without a clock, the
/// order in which bursts run dry is the order that forecasting predicts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Queue {
    /// Record index, within the run region, of the next burst to read.
    next: u32,
    /// Record index after the run's last one.
    end: u32,
    /// Scratchpad position of the queue's head, relative to the run's share.
    head: u32,
    /// Records in the scratchpad.
    len: u32,
}

/// A multi-merge in progress (P2 §5.3).
///
/// The scratchpad holds the records, the heap only codes and slots. Each output replaces the top of
/// the heap by the successor from the same run, or by infinity when the run has ended.
#[derive(Debug)]
pub struct MultiMerge<'a> {
    items: &'a mut [Item],
    queues: &'a mut heapless::VecView<Queue>,
    heap: ReplaceHeap<'a>,
    burst: u32,
    /// Records of the scratchpad that a slot owns.
    share: u32,
    source: Source,
}

/// Where the bursts of the runs come from.
#[derive(Clone, Copy, Debug)]
struct Source {
    region: Region,
    name: RegionName,
    record: RecordFormat,
    coder: MortonCoder,
}

impl Source {
    /// The most bits that a code of a record can have; a pair's are what memory says.
    const fn code_bits(&self) -> u32 {
        match self.record {
            RecordFormat::Pair8 => 32,
            RecordFormat::Box32 | RecordFormat::Packed22 => self.coder.bits(),
        }
    }
}

impl<'a> MultiMerge<'a> {
    /// Starts merging the runs that lie one after the other in records `first .. end` of `region`,
    /// each `run` records long (the last one may be shorter). There are at most
    /// [`SortConfig::width`] of them.
    ///
    /// # Errors
    /// A bus error while the first two bursts of each run are read, or [`BuildError::RegionFull`]
    /// where the runs are not all inside the region.
    #[expect(clippy::too_many_arguments, reason = "each is one port of the unit")]
    pub(crate) fn over_runs<B: Bus, P: Probe>(
        bus: &mut B,
        config: &SortConfig,
        workspace: &'a mut Workspace<'_>,
        region: Region,
        name: RegionName,
        coder: MortonCoder,
        runs: core::ops::Range<u32>,
        run: u32,
        probe: &mut P,
    ) -> Result<Self, BuildError<B::Error>> {
        let source = Source { region, name, record: config.record, coder };
        let count = (runs.end - runs.start).div_ceil(run);
        let mut merge = Self::empty(config, workspace, source, config.share(), count)?;
        let mut first = runs.start;
        while first < runs.end {
            let end = runs.end.min(first.saturating_add(run));
            let queue = Queue { next: first, end, head: 0, len: 0 };
            merge.queues.push(queue).map_err(|_| BuildError::Internal)?;
            first = end;
        }
        for slot in 0..merge.queues.len() as u32 {
            for _ in 0..config.share() / config.burst {
                merge.refill(bus, slot)?;
            }
            merge.start(slot, probe);
        }
        Ok(merge)
    }

    /// Starts merging the sorted blocks that fill the scratchpad's first `len` records, two bursts
    /// long each, without fetching anything more (P2 §5.5).
    pub(crate) fn over_blocks<E: Copy, P: Probe>(
        config: &SortConfig,
        workspace: &'a mut Workspace<'_>,
        coder: MortonCoder,
        len: u32,
        probe: &mut P,
    ) -> Result<Self, BuildError<E>> {
        let source = Source {
            region: Region::default(),
            name: RegionName::RunsA,
            record: config.record,
            coder,
        };
        let block = config.piece();
        let mut merge = Self::empty(config, workspace, source, block, len.div_ceil(block))?;
        for slot in 0..len.div_ceil(block) {
            let queue = Queue { len: block.min(len - slot * block), ..Queue::default() };
            merge.queues.push(queue).map_err(|_| BuildError::Internal)?;
            merge.start(slot, probe);
        }
        Ok(merge)
    }

    fn empty<E: Copy>(
        config: &SortConfig,
        workspace: &'a mut Workspace<'_>,
        source: Source,
        share: u32,
        slots: u32,
    ) -> Result<Self, BuildError<E>> {
        workspace.queues.clear();
        let heap = ReplaceHeap::new(workspace.heap, slots as usize, source.code_bits());
        Ok(Self {
            items: &mut *workspace.items,
            queues: &mut *workspace.queues,
            heap: heap.map_err(|_| BuildError::Internal)?,
            burst: config.burst,
            share,
            source,
        })
    }

    fn start<P: Probe>(&mut self, slot: u32, probe: &mut P) {
        probe.heap_insert();
        let code = self.items[(slot * self.share) as usize].code;
        self.heap.insert(HeapEntry { code, slot });
    }

    /// Puts the next record in order into `item`; gives `false` after the last.
    ///
    /// # Errors
    /// A bus error while a burst is read; the merge must then be given up.
    #[inline(always)]
    pub fn next<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        item: &mut Item,
        probe: &mut P,
    ) -> Result<bool, BuildError<B::Error>> {
        let Some(HeapEntry { code, slot }) = self.heap.top() else { return Ok(false) };
        if code == HeapEntry::INFINITE {
            return Ok(false);
        }
        let base = (slot * self.share) as usize;
        let queue = &mut self.queues[slot as usize];
        *item = self.items[base + queue.head as usize];
        queue.head = (queue.head + 1) & (self.share - 1);
        queue.len -= 1;
        let burst_done = queue.head & (self.burst - 1) == 0;
        if burst_done && queue.next < queue.end {
            self.refill(bus, slot)?;
        }
        let queue = &self.queues[slot as usize];
        let code = match queue.len {
            0 => HeapEntry::INFINITE,
            _ => self.items[base + queue.head as usize].code,
        };
        probe.heap_replace();
        self.heap.replace(HeapEntry { code, slot });
        probe.merge_output();
        Ok(true)
    }

    /// Reads the next burst of a run into the half of its queue that is free.
    fn refill<B: Bus>(&mut self, bus: &mut B, slot: u32) -> Result<(), BuildError<B::Error>> {
        let queue = &mut self.queues[slot as usize];
        let count = self.burst.min(queue.end - queue.next);
        if count == 0 {
            return Ok(());
        }
        let Source { region, name, record, coder } = self.source;
        let stride = record.bytes();
        let (offset, len) = (queue.next.saturating_mul(stride), count * stride);
        let addr = region.at(offset, len).ok_or(BuildError::RegionFull {
            region: name,
            needed: u64::from(queue.end) * u64::from(stride),
            available: region.size,
        })?;
        let mut buffer = [0; MAX_BURST * RecordFormat::MAX_BYTES];
        let bytes = &mut buffer[..len as usize];
        bus.read(addr, bytes).map_err(|error| BuildError::Bus {
            stage: Stage::Merge,
            addr,
            error,
        })?;
        let tail = (queue.head + queue.len) & (self.share - 1);
        let start = (slot * self.share + tail) as usize;
        let free = &mut self.items[start..start + count as usize];
        for (item, record_bytes) in free.iter_mut().zip(bytes.chunks_exact(stride as usize)) {
            *item = record.decode(record_bytes, &coder);
        }
        queue.next += count;
        queue.len += count;
        Ok(())
    }
}
