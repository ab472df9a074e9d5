//! Cycle model of the streaming compressor in gates, `xy_compressor`.
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one pair a cycle, while no node is to be repaired |
//! | Input | a node stays until what leaves its treelet has left: a cycle for each pair, at least one |
//! | Latency | 6 cycles from a node to a pair, 2 more for each layer of treelets above the first |
//! | Repair | read, 3 cycles to recode both children, write; the next one reads after that |
//! | Order | a node's repairs, those below child 0 first, then its pair; it holds up what follows |
//! | Reads | wait until no line is being sent; the open line is sent first if it is the one wanted |
//!
//! What it computes is `xylem_core::compress::Compressor`, which is asked when a node comes in; what it then
//! reads and writes takes place in the cycles in which the gates come to it.

use std::collections::VecDeque;

use xylem_core::compress::{Compression, Compressor, HeldNode, Place, Repairs};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Bvh2Node, Child, NodeIndex, Subtree};
use xylem_core::probe::{Probe, Stage};

use super::CompressorEvents;
use crate::bus::{Tally, Traffic};
use crate::machine::port::{LINE_BYTES, PortError};

/// Stages behind the one in which a node comes in, with treelets of depth 1; repairs are asked for in the
/// last one.
const STAGES: usize = 5;
/// Stages more for each layer of treelets above the first.
const LAYER: usize = 2;
/// Pairs of a line.
const PLACES: u32 = LINE_BYTES / 16;

/// The compressor between the emitter and the memory port.
#[derive(Debug)]
pub struct CompressorUnit<'a> {
    /// The core's, until the root has come.
    core: Option<Compressor<'a>>,
    nodes: u32,
    /// What leaves for the node that came in last, if that is still there.
    input: Option<VecDeque<Item>>,
    stages: VecDeque<Option<Item>>,
    repair: State,
    current: Option<Repair>,
    pairs: PairWriter,
    /// Nothing but what is open is left.
    last: bool,
    read_taken: bool,
    write_taken: bool,
    arrived: bool,
    events: CompressorEvents,
    traffic: Traffic,
}

/// What the unit sees in a cycle.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The node that it takes; none unless [`CompressorUnit::is_ready`].
    pub node: Option<&'a Bvh2Node>,
    /// No node follows, and the root is known; stays.
    pub end: bool,
    /// The root, with `end`; stays.
    pub root: Option<&'a Subtree>,
}

/// Bytes that go to memory in one access, all in one line.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Line {
    /// The first one's address.
    pub addr: u32,
    /// What is written.
    pub bytes: Vec<u8>,
}

#[derive(Clone, Debug)]
struct Repair {
    /// The open line, where it is the one to be read.
    flush: Option<Line>,
    read: u32,
    write: Line,
}

/// What goes through the stages: what the core did for a pair.
#[derive(Debug, Default)]
struct Item {
    /// The repairs below each child.
    chains: VecDeque<VecDeque<Repair>>,
    /// Whether a pair follows; not for a root that is already in memory.
    is_node: bool,
    /// A line that is then full, or, with the last item, what is left open.
    line: Option<Line>,
    /// Nothing follows.
    is_last: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Idle,
    Request,
    Wait,
    /// Decoding, encoding, checking: cycles left.
    Recode(u8),
    Write,
}

/// The model of `xy_pair_writer`.
#[derive(Debug, Default)]
struct PairWriter {
    /// Pairs in the open line, and where the next one goes.
    open: u32,
    next: u32,
    /// The open line's bytes, once it is known how many.
    line: Option<Line>,
    sending: Option<Line>,
}

impl<'a> CompressorUnit<'a> {
    /// Whether this is the model of a unit for `compression`. The gates can be built for treelets of four
    /// layers, but have been held against the model with one and two.
    pub fn has(compression: &Compression) -> bool {
        compression.repairs == Repairs::InMemory
            && compression.quantization.bits <= 6
            && compression.treelet_depth <= 2
    }

    /// A unit that has seen nothing and writes to `region`; `held` as in [`Compressor::new`].
    pub fn new(compression: Compression, region: Region, held: &'a mut [HeldNode]) -> Self {
        let layers = usize::from(compression.treelet_depth).saturating_sub(1);
        Self {
            core: Some(Compressor::new(compression, region, held)),
            nodes: 0,
            input: None,
            stages: (0..STAGES + LAYER * layers).map(|_| None).collect(),
            repair: State::Idle,
            current: None,
            pairs: PairWriter::default(),
            last: false,
            read_taken: false,
            write_taken: false,
            arrived: false,
            events: CompressorEvents::default(),
            traffic: Traffic::default(),
        }
    }

    /// Whether a node would be taken in this cycle; none is once the stream has ended.
    pub fn is_ready(&self) -> bool {
        match &self.input {
            None => true,
            Some(items) => self.moves() && items.len() <= 1,
        }
    }

    /// The line that it asks for.
    pub fn read(&self) -> Option<u32> {
        let repair = self.current.as_ref().filter(|_| self.repair == State::Request)?;
        let may = repair.flush.is_none() && self.pairs.sending.is_none();
        may.then_some(repair.read)
    }

    /// The line that it writes.
    pub fn write(&self) -> Option<&Line> {
        let repaired = || self.current.as_ref().filter(|_| self.repair == State::Write);
        self.pairs.sending.as_ref().or_else(|| Some(&repaired()?.write))
    }

    /// Whether the line that it writes has a node that was encoded again.
    pub fn is_repairing(&self) -> bool {
        self.repair == State::Write
    }

    /// The line that it asks for was asked for.
    pub fn read_taken(&mut self) {
        self.read_taken = true;
    }

    /// The line that it writes was taken.
    pub fn write_taken(&mut self) {
        self.write_taken = true;
    }

    /// The line that it asked for has come.
    pub fn arrive(&mut self) {
        self.arrived = true;
    }

    /// Ends a cycle.
    ///
    /// # Errors
    /// [`BuildError`] of the core.
    pub fn tick(
        &mut self,
        inputs: &Inputs<'_>,
        image: &mut [u8],
    ) -> Result<(), BuildError<PortError>> {
        let (passes, moves, ready) = (self.passes(), self.moves(), self.is_ready());
        let (mut pushes, mut ends) = (false, false);
        if passes && let Some(item) = self.stages.back_mut().and_then(Option::as_mut) {
            (pushes, ends) = (item.is_node, item.is_last);
            if let Some(line) = item.line.take() {
                self.pairs.line = Some(line);
            }
        }
        self.tick_pairs(pushes);
        self.tick_repair();
        if moves {
            self.stages.pop_back();
            self.stages.push_front(self.input.as_mut().and_then(VecDeque::pop_front));
        }
        let is_inner = |root: &&Subtree| matches!(root.child, Child::Inner(_));
        let root = inputs.root.filter(is_inner);
        self.last |= ends || inputs.end && root.is_none();
        if ready {
            let root = root.filter(|_| inputs.end);
            self.input = match (inputs.node, root) {
                (Some(node), _) => Some(self.accept(node, image)?),
                (None, Some(root)) if self.core.is_some() => Some(self.finish(root, image)?),
                _ => None,
            };
        }
        (self.read_taken, self.write_taken, self.arrived) = (false, false, false);
        Ok(())
    }

    /// Whether everything is sent.
    pub fn is_done(&self) -> bool {
        self.last && self.pairs.open == 0 && self.pairs.sending.is_none()
    }

    /// What it did so far.
    pub fn events(&self) -> CompressorEvents {
        self.events
    }

    /// Adds what it read and wrote so far to `traffic`.
    pub fn count(&self, traffic: &mut Traffic) {
        *traffic += &self.traffic;
    }

    fn last_stage(&self) -> Option<&Item> {
        self.stages.back()?.as_ref()
    }

    /// Whether the item in the last stage leaves it.
    fn passes(&self) -> bool {
        self.last_stage().is_some_and(|item| {
            let repaired = self.repair == State::Idle && item.chains.is_empty();
            repaired && (!item.is_node || self.pairs.next < PLACES)
        })
    }

    /// Whether everything moves a stage on.
    fn moves(&self) -> bool {
        self.last_stage().is_none() || self.passes()
    }

    fn tick_pairs(&mut self, push: bool) {
        let pairs = &mut self.pairs;
        if self.write_taken {
            pairs.sending = None;
        }
        if push {
            pairs.open += 1;
            pairs.next += 1;
        }
        if pairs.sending.is_some() || pairs.open == 0 {
            return;
        }
        if pairs.next == PLACES {
            (pairs.open, pairs.next) = (0, 0);
            pairs.sending = pairs.line.take();
        } else if self.repair == State::Request {
            let flush = self.current.as_mut().and_then(|repair| repair.flush.take());
            if flush.is_some() {
                pairs.open = 0;
                pairs.sending = flush;
            }
        } else if self.last {
            pairs.open = 0;
            pairs.sending = pairs.line.take();
        }
    }

    fn tick_repair(&mut self) {
        let Some(item) = self.stages.back_mut().and_then(Option::as_mut) else { return };
        self.repair = match self.repair {
            State::Idle => match item.chains.front_mut() {
                Some(chain) => {
                    self.current = chain.pop_front();
                    State::Request
                }
                None => State::Idle,
            },
            State::Request if self.read_taken => State::Wait,
            State::Wait if self.arrived => State::Recode(3),
            State::Recode(1) => State::Write,
            State::Recode(left) => State::Recode(left - 1),
            State::Write if self.write_taken => {
                self.current = item.chains.front_mut().and_then(VecDeque::pop_front);
                if self.current.is_none() {
                    item.chains.pop_front();
                    State::Idle
                } else {
                    State::Request
                }
            }
            other => other,
        };
    }

    fn accept(
        &mut self,
        node: &Bvh2Node,
        image: &mut [u8],
    ) -> Result<VecDeque<Item>, BuildError<PortError>> {
        let core = self.core.as_mut().ok_or(BuildError::Internal)?;
        let (mut bus, mut probe) = (Recorder::new(image), Marks::new(self.events));
        let index = NodeIndex(self.nodes);
        core.accept(&mut bus, node, index, Place::Next, &mut probe).map_err(outside)?;
        self.nodes += 1;
        self.events = probe.events;
        Ok(items(bus.accesses, &probe.marks, &mut self.traffic))
    }

    fn finish(
        &mut self,
        root: &Subtree,
        image: &mut [u8],
    ) -> Result<VecDeque<Item>, BuildError<PortError>> {
        let core = self.core.take().ok_or(BuildError::Internal)?;
        let (mut bus, mut probe) = (Recorder::new(image), Marks::new(self.events));
        core.finish(&mut bus, Some(root), &mut probe).map_err(outside)?;
        if !probe.marks.last().is_some_and(|mark| *mark == Mark::Pair) {
            probe.marks.push(Mark::End);
        }
        self.events = probe.events;
        let mut items = items(bus.accesses, &probe.marks, &mut self.traffic);
        if let Some(item) = items.back_mut() {
            item.is_last = true;
        }
        Ok(items)
    }
}

/// What the core did to memory.
enum Access {
    Read(u32, u32),
    Write(Line),
}

/// What the core told between its accesses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mark {
    /// A repair, so deep below the one that was asked for, which is at depth 1.
    Repair(u8),
    /// A new pair was put.
    Pair,
    /// Nothing follows.
    End,
}

/// Sorts what the core did by pairs: to each repair belong a read, the write after it, and one before it if
/// the open line made room; to a pair, a write up to the end of a line; what is left, to the last item.
fn items(accesses: Vec<Access>, marks: &[Mark], traffic: &mut Traffic) -> VecDeque<Item> {
    let mut accesses = accesses.into_iter().peekable();
    let (mut items, mut item) = (VecDeque::new(), Item::default());
    let write = |traffic: &mut Traffic, stage, line: Line| {
        let write_bytes = line.bytes.len() as u64;
        count(traffic, stage, Tally { write_bytes, writes: 1, ..Tally::default() });
        line
    };
    for mark in marks {
        match mark {
            Mark::Repair(depth) => {
                let mut flush = None;
                if let Some(Access::Write(line)) =
                    accesses.next_if(|access| matches!(access, Access::Write(_)))
                {
                    flush = Some(write(traffic, Stage::Emit, line));
                }
                if let (Some(Access::Read(read, bytes)), Some(Access::Write(line))) =
                    (accesses.next(), accesses.next())
                {
                    let tally = Tally { read_bytes: bytes.into(), reads: 1, ..Tally::default() };
                    count(traffic, Stage::Compress, tally);
                    let line = write(traffic, Stage::Compress, line);
                    if *depth == 1 {
                        item.chains.push_back(VecDeque::new());
                    }
                    if let Some(chain) = item.chains.back_mut() {
                        chain.push_back(Repair { flush, read, write: line });
                    }
                }
            }
            Mark::Pair | Mark::End => {
                item.is_node = *mark == Mark::Pair;
                let full = |access: &Access| match access {
                    Access::Write(line) => {
                        (line.addr + line.bytes.len() as u32).is_multiple_of(LINE_BYTES)
                    }
                    Access::Read(..) => false,
                };
                if let Some(Access::Write(line)) = accesses.next_if(full) {
                    item.line = Some(write(traffic, Stage::Emit, line));
                }
                items.push_back(std::mem::take(&mut item));
            }
        }
    }
    if let (Some(Access::Write(line)), Some(item)) = (accesses.next(), items.back_mut()) {
        item.line = Some(write(traffic, Stage::Emit, line));
    }
    items
}

fn count(traffic: &mut Traffic, stage: Stage, tally: Tally) {
    *traffic.tallies.entry((stage, Some(RegionName::Nodes.as_str()))).or_default() += tally;
}

/// A bus on the memory image that notes every access.
struct Recorder<'a> {
    image: &'a mut [u8],
    accesses: Vec<Access>,
}

/// An access outside the memory image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct OutOfRange;

impl<'a> Recorder<'a> {
    fn new(image: &'a mut [u8]) -> Self {
        Self { image, accesses: Vec::new() }
    }
}

fn outside(error: BuildError<OutOfRange>) -> BuildError<PortError> {
    error.map_bus(|OutOfRange| PortError::Write)
}

impl Bus for Recorder<'_> {
    type Error = OutOfRange;

    fn read(&mut self, ByteAddr(addr): ByteAddr, buf: &mut [u8]) -> Result<(), OutOfRange> {
        let start = addr as usize;
        buf.copy_from_slice(self.image.get(start..start + buf.len()).ok_or(OutOfRange)?);
        self.accesses.push(Access::Read(addr, buf.len() as u32));
        Ok(())
    }

    fn write(&mut self, ByteAddr(addr): ByteAddr, bytes: &[u8]) -> Result<(), OutOfRange> {
        let start = addr as usize;
        let target = self.image.get_mut(start..start + bytes.len()).ok_or(OutOfRange)?;
        target.copy_from_slice(bytes);
        self.accesses.push(Access::Write(Line { addr, bytes: bytes.to_vec() }));
        Ok(())
    }
}

/// A probe that notes marks.
struct Marks {
    marks: Vec<Mark>,
    events: CompressorEvents,
}

impl Marks {
    fn new(events: CompressorEvents) -> Self {
        Self { marks: Vec::new(), events }
    }
}

impl Probe for Marks {
    fn compress_node(&mut self) {
        self.marks.push(Mark::Pair);
        self.events.compress_node();
    }

    fn backtrack(&mut self, depth: u8) {
        self.marks.push(Mark::Repair(depth));
        self.events.backtrack(depth);
    }
}
