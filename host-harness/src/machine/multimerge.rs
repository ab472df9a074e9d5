//! Cycle model of the multi-merge unit, RTL unit `xy_multimerge`: the state machine around heap and
//! scratchpad (P2 §5.3).
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one record every two cycles, one heap operation each |
//! | Latency | two cycles from the heap operation to the record in the output FIFO |
//! | Start | two cycles, then one heap insert for each slot, two cycles each, as soon as its first record is here |
//! | Reads | a burst's first line is asked for in the cycle after the operation that made room for it, or two cycles after a start |
//! | Stalls | while the successor of the lowest record has not come, or the FIFO is full |
//!
//! The loop of the gates takes two cycles: in one, the lowest slot's next record and its successor are read
//! from the scratchpad, in the other the heap takes the successor's code. So what memory sends is used two
//! cycles after it has come at the earliest.
//!
//! A slot is a piece of the scratchpad in the partial sort and a run in memory in the merge. It
//! holds a queue of buffers of `B` records. The [`ReadSchedule`] decides which buffer is read next.

use std::collections::{BTreeSet, VecDeque};

use xylem_core::mem::Region;
use xylem_core::num::MortonCoder;
use xylem_core::sort::{Item, ReadSchedule, RecordFormat};

use super::heap::{HeapConfig, HeapEntry, HeapModel, HeapOp};
use super::port::LINE_BYTES;

/// The multi-merge unit with its scratchpad.
#[derive(Debug)]
pub struct MultiMerge {
    burst: u32,
    schedule: ReadSchedule,
    coder: MortonCoder,
    /// The scratchpad and the spare buffers, `burst` records each.
    pad: Vec<Item>,
    /// What each buffer is for.
    loads: Vec<Load>,
    heap: HeapModel,
    slots: Vec<Slot>,
    /// Slots put into the heap so far.
    inserted: usize,
    /// Buffers that no slot owns; forecasting only.
    free: Vec<u32>,
    /// The last key on chip of each run that has more to read: who runs dry first. This is the
    /// second heap of P2 §7.
    forecast: BTreeSet<(u64, u32)>,
    /// The burst being read.
    request: Option<Request>,
    /// Bursts to be read after it, in order.
    queue: VecDeque<Request>,
    /// Whether runs were started in this cycle: their first burst is looked up in the next.
    starting: bool,
    /// The buffer whose last line came in the last cycle.
    landed: Option<u32>,
    /// Records that have not left.
    left: u32,
    /// Where the runs are.
    source: Region,
}

/// A queue of buffers.
#[derive(Clone, Debug, Default)]
struct Slot {
    buffers: VecDeque<Buffer>,
    /// Position in the first buffer.
    head: u32,
    /// Record index of the next burst to ask for.
    next: u32,
    /// Record index after the last one.
    end: u32,
}

#[derive(Clone, Copy, Debug)]
struct Buffer {
    id: u32,
    len: u32,
}

/// The burst that was last read into a buffer.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    slot: u32,
    /// Record index of its first record.
    first: u32,
    len: u32,
    /// Lines that have not come.
    missing: u32,
    /// Whether its records can be used.
    here: bool,
}

/// A burst to be read into a buffer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Request {
    /// Which buffer.
    pub buffer: u32,
    /// First byte.
    pub addr: u32,
    /// Bytes of records.
    pub bytes: u32,
}

/// What the unit did in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Did {
    /// The heap was busy with the operation of the cycle before.
    Busy,
    /// A slot entered the heap.
    Insert,
    /// The lowest record left.
    Output(Item),
    /// The lowest record's successor has not come.
    WaitForData,
    /// There is no room for the output.
    WaitForRoom,
    /// Nothing is left, or nothing was started.
    Idle,
}

impl MultiMerge {
    /// A unit for `capacity` records and `spare` more buffers, that merges up to `width` slots.
    pub fn new(
        capacity: u32,
        burst: u32,
        spare: u32,
        width: u32,
        schedule: ReadSchedule,
        coder: MortonCoder,
    ) -> Self {
        let spare = if schedule == ReadSchedule::Forecast { spare } else { 0 };
        let buffers = capacity / burst + spare;
        let levels = width.max(8).next_power_of_two().trailing_zeros();
        let heap =
            HeapConfig { name: "merge", levels, key_bits: 64, slot_bits: 32, block_level: 7 };
        Self {
            burst,
            schedule,
            coder,
            pad: vec![Item::ZERO; (buffers * burst) as usize],
            loads: vec![Load::default(); buffers as usize],
            heap: HeapModel::new(heap),
            slots: Vec::new(),
            inserted: 0,
            free: Vec::new(),
            forecast: BTreeSet::new(),
            request: None,
            queue: VecDeque::new(),
            starting: false,
            landed: None,
            left: 0,
            source: Region::default(),
        }
    }

    /// Puts up to two records a cycle into the scratchpad, from record `at` on.
    pub fn store(&mut self, at: u32, items: &[Item]) {
        self.pad[at as usize..at as usize + items.len()].copy_from_slice(items);
    }

    /// Starts merging the pieces of at most `piece` records that fill `len` records from `at` on. In
    /// the starting cycle nothing else is done: the first [`MultiMerge::tick`] is the next cycle's.
    pub fn start_pieces(&mut self, at: u32, len: u32, piece: u32) {
        self.clear(len);
        for start in (0..len).step_by(piece as usize) {
            let stop = len.min(start + piece);
            let mut slot = Slot::default();
            for first in (start..stop).step_by(self.burst as usize) {
                let id = (at + first) / self.burst;
                slot.buffers.push_back(Buffer { id, len: self.burst.min(stop - first) });
                self.loads[id as usize].here = true;
            }
            self.slots.push(slot);
        }
    }

    /// Starts merging the runs in `source`, records `first .. end`, `run` records each. With `share`
    /// they divide the whole scratchpad between them. As for [`MultiMerge::start_pieces`], this takes
    /// the cycle.
    pub fn start_runs(
        &mut self,
        source: Region,
        range: std::ops::Range<u32>,
        run: u32,
        share: bool,
    ) {
        self.clear(range.end - range.start);
        self.source = source;
        self.starting = true;
        let mut first = range.start;
        while first < range.end {
            let end = range.end.min(first.saturating_add(run));
            self.slots.push(Slot { next: first, end, ..Slot::default() });
            first = end;
        }
        let buffers = self.loads.len() as u32;
        let slots = self.slots.len() as u32;
        let owned = match self.schedule {
            ReadSchedule::Forecast => 1,
            ReadSchedule::DoubleBuffer if share => (buffers / slots.max(1)).max(2),
            ReadSchedule::DoubleBuffer => 2,
        };
        // The first buffer of every run comes before the second of any.
        for round in 0..owned {
            for slot in 0..slots {
                self.ask(slot, slot * owned + round);
            }
        }
        if self.schedule == ReadSchedule::Forecast {
            self.free = (slots..buffers).rev().collect();
        }
    }

    fn clear(&mut self, left: u32) {
        self.heap.tick(Some(HeapOp::Clear));
        self.left = left;
        self.slots.clear();
        self.inserted = 0;
        self.free.clear();
        self.forecast.clear();
    }

    /// Asks for the next burst of a run, if it has any, into a buffer.
    fn ask(&mut self, slot: u32, buffer: u32) -> bool {
        let Slot { buffers, next, end, .. } = &mut self.slots[slot as usize];
        let len = self.burst.min(*end - *next);
        if len == 0 {
            return false;
        }
        let stride = RecordFormat::Box32.bytes();
        let (addr, bytes) = (self.source.base.0 + *next * stride, len * stride);
        let missing = bytes.div_ceil(LINE_BYTES);
        self.loads[buffer as usize] = Load { slot, first: *next, len, missing, here: false };
        self.queue.push_back(Request { buffer, addr, bytes });
        buffers.push_back(Buffer { id: buffer, len });
        *next += len;
        true
    }

    /// The burst being read.
    pub fn request(&self) -> Option<Request> {
        self.request
    }

    /// That burst has been asked for whole.
    pub fn requested(&mut self) {
        self.request = None;
    }

    /// Ends the cycle of the read port.
    pub fn tick_requests(&mut self) {
        if !std::mem::take(&mut self.starting) && self.request.is_none() {
            self.request = self.queue.pop_front();
        }
    }

    /// A line of `buffer` has come; its records are decoded from `image`, the memory, with the last.
    pub fn arrive(&mut self, buffer: u32, image: &[u8]) {
        let Some(load) = self.loads.get_mut(buffer as usize) else { return };
        load.missing = load.missing.saturating_sub(1);
        let Load { slot, first, len, missing, .. } = *load;
        if missing > 0 {
            return;
        }
        self.landed = Some(buffer);
        let stride = RecordFormat::Box32.bytes();
        let at = (buffer * self.burst) as usize;
        let records = (self.source.base.0 + first * stride) as usize..;
        let records = image[records].chunks_exact(stride as usize);
        for (item, bytes) in self.pad[at..at + len as usize].iter_mut().zip(records) {
            *item = RecordFormat::Box32.decode(bytes, &self.coder);
        }
        let Slot { next, end, .. } = self.slots[slot as usize];
        let newest = first + len == next;
        if self.schedule == ReadSchedule::Forecast && newest && next < end {
            self.forecast.insert((self.pad[at + len as usize - 1].code, slot));
        }
    }

    /// Runs one cycle; `room` says whether the output FIFO had room for a record when it began.
    pub fn tick(&mut self, room: bool) -> Did {
        let landed = self.landed.take();
        let did = self.act(room);
        // It has been written, and can be read; what is read now can be used in the next cycle.
        if let Some(buffer) = landed {
            self.loads[buffer as usize].here = true;
        }
        did
    }

    fn act(&mut self, room: bool) -> Did {
        // The second heap fills at most one buffer a cycle. It waits for the first burst of every
        // run: before that, the run that needs a buffer first may be unknown, and all spare ones
        // could go to others. From then on the lowest run's last key is known when its buffer before
        // is freed, so that it, or a run that runs dry earlier, gets that buffer.
        if self.inserted == self.slots.len()
            && !self.free.is_empty()
            && let Some((_, slot)) = self.forecast.pop_first()
            && let Some(buffer) = self.free.pop()
        {
            self.ask(slot, buffer);
        }
        let outputs = self.heap.outputs();
        if !outputs.ready {
            self.heap.tick(None);
            return Did::Busy;
        }
        if self.inserted < self.slots.len() {
            let slot = self.inserted as u32;
            let Some(code) = self.head_code(slot) else {
                self.heap.tick(None);
                return Did::WaitForData;
            };
            self.inserted += 1;
            self.heap.tick(Some(HeapOp::Insert(HeapEntry { key: code, slot })));
            return Did::Insert;
        }
        let Some(HeapEntry { slot, .. }) = outputs.top else {
            self.heap.tick(None);
            return Did::Idle;
        };
        if !room {
            self.heap.tick(None);
            return Did::WaitForRoom;
        }
        let Slot { buffers, head, next, end } = &mut self.slots[slot as usize];
        let Some(&Buffer { id, len }) = buffers.front() else { return Did::Idle };
        let item = self.pad[(id * self.burst + *head) as usize];
        let consumed = *head + 1 == len;
        if consumed {
            let successor_is_here = match buffers.get(1) {
                Some(next) => self.loads[next.id as usize].here,
                None => next == end,
            };
            if !successor_is_here {
                self.heap.tick(None);
                return Did::WaitForData;
            }
            *head = 0;
            buffers.pop_front();
            match self.schedule {
                ReadSchedule::DoubleBuffer => {
                    self.ask(slot, id);
                }
                ReadSchedule::Forecast => self.free.push(id),
            }
        } else {
            *head += 1;
        }
        let op = match self.head_code(slot) {
            Some(key) => HeapOp::Replace(HeapEntry { key, slot }),
            None => HeapOp::Remove,
        };
        self.heap.tick(Some(op));
        self.left -= 1;
        Did::Output(item)
    }

    /// The code of a slot's first record, if it is here.
    fn head_code(&self, slot: u32) -> Option<u64> {
        let slot = &self.slots[slot as usize];
        let front = slot.buffers.front()?;
        let here = self.loads[front.id as usize].here;
        here.then(|| self.pad[(front.id * self.burst + slot.head) as usize].code)
    }

    /// Whether all records of all slots have left, and another merge can be started.
    pub fn is_done(&self) -> bool {
        self.left == 0 && self.heap.outputs().ready
    }
}
