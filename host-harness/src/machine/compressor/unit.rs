//! Cycle model of the streaming compressor in gates, `xy_compressor`, with treelets of depth 1.
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one node a cycle, while none is to be repaired |
//! | Latency | 6 cycles from a node to its pair: three for contexts, two for codes, one on either side |
//! | Repair | read, 3 cycles to recode both children, write; the next one reads after that |
//! | Order | a node's repairs, those below child 0 first, then its pair; it holds up what follows |
//! | Reads | wait until no line is being sent; the open line is sent first if it is the one wanted |
//!
//! What it computes is `xylem_core::compress::Compressor`, which is asked when a node comes to the last
//! stage; what it then reads and writes takes place in the cycles after that.

use std::collections::VecDeque;

use xylem_core::compress::{Compression, Compressor, Place, Repairs};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Bvh2Node, Child, NodeIndex, Subtree};
use xylem_core::probe::{Probe, Stage};

use super::CompressorEvents;
use crate::bus::{Tally, Traffic};
use crate::machine::port::{LINE_BYTES, PortError};

/// Registers from a node to its encoded pair; the last one is where repairs are asked for.
const STAGES: usize = 6;
/// Pairs of a line.
const PLACES: u32 = LINE_BYTES / 16;

/// The compressor between the emitter and the memory port.
#[derive(Debug)]
pub struct CompressorUnit {
    /// The core's, until the root has come.
    core: Option<Compressor<'static>>,
    nodes: u32,
    stages: VecDeque<Option<Token>>,
    /// What is left to do for the node in the last stage.
    work: Work,
    repair: State,
    current: Option<Repair>,
    pairs: PairWriter,
    /// The root has come in, or there was none.
    ended: bool,
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

/// What goes through the stages.
#[derive(Clone, Copy, Debug)]
enum Token {
    Node(Bvh2Node),
    Root(Subtree),
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

/// What the core did for a node: the repairs below each child, then perhaps a line that is full.
#[derive(Debug, Default)]
struct Work {
    chains: VecDeque<VecDeque<Repair>>,
    line: Option<Line>,
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

impl CompressorUnit {
    /// Whether there is a unit for `compression` in gates.
    pub fn has(compression: &Compression) -> bool {
        compression.treelet_depth == 1
            && compression.repairs == Repairs::InMemory
            && compression.quantization.bits <= 6
    }

    /// A unit that has seen nothing and writes to `region`.
    pub fn new(compression: Compression, region: Region) -> Self {
        Self {
            core: Some(Compressor::new(compression, region, &mut [])),
            nodes: 0,
            stages: (0..STAGES).map(|_| None).collect(),
            work: Work::default(),
            repair: State::Idle,
            current: None,
            pairs: PairWriter::default(),
            ended: false,
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
        self.last_stage().is_none() || self.passes()
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
        let (passes, ready) = (self.passes(), self.is_ready());
        let is_root = matches!(self.last_stage(), Some(Token::Root(_)));
        if passes && let Some(line) = self.work.line.take() {
            self.pairs.line = Some(line);
        }
        self.tick_pairs(passes && !is_root);
        self.tick_repair();

        let inner = |root: &&Subtree| matches!(root.child, Child::Inner(_));
        let root = inputs.root.filter(|_| inputs.end && !self.ended).filter(inner);
        self.last |= passes && is_root || inputs.end && !self.ended && root.is_none();
        self.ended |= inputs.end && (ready || root.is_none());
        if ready {
            let node = inputs.node.map(|node| Token::Node(*node));
            self.stages.pop_back();
            self.stages.push_front(root.map(|root| Token::Root(*root)).or(node));
            self.run_core(image)?;
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

    fn last_stage(&self) -> Option<&Token> {
        self.stages.back()?.as_ref()
    }

    /// Whether the node in the last stage leaves it.
    fn passes(&self) -> bool {
        let repaired = self.repair == State::Idle && self.work.chains.is_empty();
        match self.last_stage() {
            None => false,
            Some(Token::Root(_)) => repaired,
            Some(Token::Node(_)) => repaired && self.pairs.next < PLACES,
        }
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
        self.repair = match self.repair {
            State::Idle if self.last_stage().is_some() => match self.work.chains.front_mut() {
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
                self.current = self.work.chains.front_mut().and_then(VecDeque::pop_front);
                if self.current.is_none() {
                    self.work.chains.pop_front();
                    State::Idle
                } else {
                    State::Request
                }
            }
            other => other,
        };
    }

    /// Lets the core do what is to be done for the node that is now in the last stage.
    fn run_core(&mut self, image: &mut [u8]) -> Result<(), BuildError<PortError>> {
        let Some(token) = self.last_stage().copied() else { return Ok(()) };
        let mut bus = Recorder { image, accesses: Vec::new() };
        let mut probe = Depths { depths: Vec::new(), events: self.events };
        let outside = |error: BuildError<OutOfRange>| error.map_bus(|OutOfRange| PortError::Write);
        match token {
            Token::Node(node) => {
                let core = self.core.as_mut().ok_or(BuildError::Internal)?;
                let index = NodeIndex(self.nodes);
                core.accept(&mut bus, &node, index, Place::Next, &mut probe).map_err(outside)?;
                self.nodes += 1;
            }
            Token::Root(root) => {
                let core = self.core.take().ok_or(BuildError::Internal)?;
                core.finish(&mut bus, Some(&root), &mut probe).map_err(outside)?;
            }
        }
        self.events = probe.events;
        self.work = Work::of(bus.accesses, probe.depths, &mut self.traffic);
        Ok(())
    }
}

/// What the core did to memory.
enum Record {
    Read(u32, u32),
    Write(Line),
}

impl Work {
    /// Sorts accesses: a read belongs to a repair, as does the write after it; a write before it made room
    /// for it; and one alone is a line that is full.
    fn of(accesses: Vec<Record>, depths: Vec<u8>, traffic: &mut Traffic) -> Self {
        let mut work = Self::default();
        let mut depths = depths.into_iter();
        let mut read = None;
        for access in accesses {
            match access {
                Record::Read(addr, bytes) => {
                    let read_bytes = u64::from(bytes);
                    let tally = Tally { read_bytes, reads: 1, ..Tally::default() };
                    count(traffic, Stage::Compress, tally);
                    read = Some((addr, work.line.take()));
                }
                Record::Write(line) => {
                    let stage = if read.is_some() { Stage::Compress } else { Stage::Emit };
                    let write_bytes = line.bytes.len() as u64;
                    count(traffic, stage, Tally { write_bytes, writes: 1, ..Tally::default() });
                    let Some((read, flush)) = read.take() else {
                        work.line = Some(line);
                        continue;
                    };
                    if depths.next() == Some(1) {
                        work.chains.push_back(VecDeque::new());
                    }
                    let repair = Repair { flush, read, write: line };
                    work.chains.back_mut().into_iter().for_each(|c| c.push_back(repair.clone()));
                }
            }
        }
        work
    }
}

fn count(traffic: &mut Traffic, stage: Stage, tally: Tally) {
    *traffic.tallies.entry((stage, Some(RegionName::Nodes.as_str()))).or_default() += tally;
}

/// A bus on the memory image that notes every access.
struct Recorder<'a> {
    image: &'a mut [u8],
    accesses: Vec<Record>,
}

/// An access outside the memory image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct OutOfRange;

impl Bus for Recorder<'_> {
    type Error = OutOfRange;

    fn read(&mut self, ByteAddr(addr): ByteAddr, buf: &mut [u8]) -> Result<(), OutOfRange> {
        let start = addr as usize;
        buf.copy_from_slice(self.image.get(start..start + buf.len()).ok_or(OutOfRange)?);
        self.accesses.push(Record::Read(addr, buf.len() as u32));
        Ok(())
    }

    fn write(&mut self, ByteAddr(addr): ByteAddr, bytes: &[u8]) -> Result<(), OutOfRange> {
        let start = addr as usize;
        let target = self.image.get_mut(start..start + bytes.len()).ok_or(OutOfRange)?;
        target.copy_from_slice(bytes);
        self.accesses.push(Record::Write(Line { addr, bytes: bytes.to_vec() }));
        Ok(())
    }
}

/// How deep each repair is below the one that was asked for, which is at depth 1.
struct Depths {
    depths: Vec<u8>,
    events: CompressorEvents,
}

impl Probe for Depths {
    fn compress_node(&mut self) {
        self.events.compress_node();
    }

    fn backtrack(&mut self, depth: u8) {
        self.depths.push(depth);
        self.events.backtrack(depth);
    }
}
