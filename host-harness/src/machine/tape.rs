//! What a part of the builder does, put on tape: work and bursts in their order, to be timed later.
//!
//! Units whose cycles follow from what they do, and not from when, need no second statement of it.
//! The core runs them against a [`Tape`], a bus and a probe at once, which records how many cycles of
//! work lie between their bursts; a [`Player`](super::player::Player) plays that back on the clock,
//! where work takes its cycles, writes wait for room, and reads for their lines.
//!
//! | Event | Cycles |
//! |---|---|
//! | stack operation, or primitive into the open leaf | 1 (P2 §5.4) |
//! | beat of the clustering chain | 1, or as many as it writes nodes or leaves |
//! | pass of the clustering chain | 6 a sweep of latency after its list has ended |
//! | sweep of the binned top-level builder | 1 a cell, and 32 (P1 §4.5, P2 §6.1) |
//! | node encoded for the first time | none: the encoder takes one a cycle, as the emitter makes them |
//! | node encoded again | 4, after its line has come if it is not held: one at a time (P3 §5.3) |

use std::cell::RefCell;
use std::collections::VecDeque;

use xylem_core::error::RegionName;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::pipeline::BuildRegions;
use xylem_core::probe::{Probe, Stage};

use super::compressor::{CompressorEvents, CompressorTiming};
use super::ploc::PlocTiming;
use super::toplevel::{SweepUnit, TopEvents};
use crate::bus::{Tally, Traffic};

/// What is on a tape.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// So many cycles of work.
    Work(u64),
    /// A burst that must be in memory before what follows.
    Read {
        /// First byte.
        addr: u32,
        /// Bytes.
        bytes: u32,
    },
    /// A burst to be written.
    Write {
        /// First byte.
        addr: u32,
        /// Bytes.
        bytes: u32,
    },
    /// Nothing that follows may be read before all that was written has left.
    Barrier,
    /// Another stage begins.
    Stage(Stage),
}

/// A recorder around a memory image.
#[derive(Debug, Default)]
pub struct Tape {
    inner: RefCell<Recorder>,
}

#[derive(Debug, Default)]
struct Recorder {
    events: VecDeque<Event>,
    work: u64,
    /// Nodes and leaves of the clustering beat under way.
    nodes: u64,
    leaves: u64,
    /// Sweeps of the clustering chain, where there is one, and whether a pass has begun.
    sweeps: u64,
    passes: u32,
    /// What bursts are counted under.
    stage: Option<Stage>,
    /// What cycles are counted under, once it is no longer the emission.
    stage_time: Option<Stage>,
    top_events: TopEvents,
    compressor: CompressorEvents,
    regions: Vec<(RegionName, Region)>,
    traffic: Traffic,
}

impl Tape {
    /// An empty tape for an emitter whose clustering chain has `sweeps` sweeps, 0 if it has none.
    pub fn new(sweeps: u32, regions: &BuildRegions) -> Self {
        let regions = vec![
            (RegionName::RunsA, regions.runs_a),
            (RegionName::RunsB, regions.runs_b),
            (RegionName::Nodes, regions.nodes),
            (RegionName::LeafTable, regions.leaf_table),
        ];
        let recorder = Recorder { sweeps: sweeps.into(), regions, ..Recorder::default() };
        Self { inner: RefCell::new(recorder) }
    }

    /// Adds all bursts on the tape so far to `traffic`.
    pub fn count(&self, traffic: &mut Traffic) {
        *traffic += &self.inner.borrow().traffic;
    }

    /// The tape as a bus on `image`.
    pub fn bus<'a>(&'a self, image: &'a mut [u8]) -> TapeBus<'a> {
        TapeBus { tape: self, image }
    }

    /// The tape as a probe.
    pub fn probe(&self) -> TapeProbe<'_> {
        TapeProbe { tape: self }
    }

    /// What the compressor did so far.
    pub fn compressor_events(&self) -> CompressorEvents {
        self.inner.borrow().compressor
    }

    /// What the top-level builder did so far.
    pub fn top_events(&self) -> TopEvents {
        self.inner.borrow().top_events
    }

    /// Moves what was recorded to the end of `events`.
    pub fn drain(&self, events: &mut VecDeque<Event>) {
        let mut recorder = self.inner.borrow_mut();
        recorder.cut();
        events.append(&mut recorder.events);
    }

    fn with(&self, record: impl FnOnce(&mut Recorder)) {
        record(&mut self.inner.borrow_mut());
    }
}

impl Recorder {
    /// Puts the work so far on the tape.
    fn cut(&mut self) {
        if self.work > 0 {
            let work = std::mem::take(&mut self.work);
            self.events.push_back(Event::Work(work));
        }
    }

    fn push(&mut self, event: Event) {
        self.cut();
        self.events.push_back(event);
        let (addr, tally) = match event {
            Event::Read { addr, bytes } => {
                (addr, Tally { read_bytes: bytes.into(), reads: 1, ..Tally::default() })
            }
            Event::Write { addr, bytes } => {
                (addr, Tally { write_bytes: bytes.into(), writes: 1, ..Tally::default() })
            }
            _ => return,
        };
        let holds = |region: &Region| region.base.0 <= addr && addr - region.base.0 < region.size;
        let name = self.regions.iter().find(|(_, region)| holds(region)).map(|(name, _)| *name);
        let stage = self.stage.unwrap_or(Stage::Emit);
        let key = (stage, name.map(RegionName::as_str));
        *self.traffic.tallies.entry(key).or_default() += tally;
    }
}

/// See [`Tape::bus`].
#[derive(Debug)]
pub struct TapeBus<'a> {
    tape: &'a Tape,
    image: &'a mut [u8],
}

/// An access outside the memory image.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutOfRange;

impl Bus for TapeBus<'_> {
    type Error = OutOfRange;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), OutOfRange> {
        let start = addr.0 as usize;
        let bytes = self.image.get(start..start + buf.len()).ok_or(OutOfRange)?;
        buf.copy_from_slice(bytes);
        let bytes = buf.len() as u32;
        self.tape.with(|tape| {
            if tape.stage == Some(Stage::Compress) {
                // Which node is next follows from this one.
                tape.push(Event::Barrier);
            }
            tape.push(Event::Read { addr: addr.0, bytes });
        });
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), OutOfRange> {
        let start = addr.0 as usize;
        let target = self.image.get_mut(start..start + bytes.len()).ok_or(OutOfRange)?;
        target.copy_from_slice(bytes);
        let bytes = bytes.len() as u32;
        self.tape.with(|tape| tape.push(Event::Write { addr: addr.0, bytes }));
        Ok(())
    }
}

/// See [`Tape::probe`].
#[derive(Clone, Copy, Debug)]
pub struct TapeProbe<'a> {
    tape: &'a Tape,
}

impl Probe for TapeProbe<'_> {
    fn stage(&mut self, stage: Stage) {
        // Merge, emission and repairs alternate record by record; they are one time.
        self.tape.with(|tape| {
            let top = tape.stage_time == Some(Stage::TopLevel);
            if stage == Stage::TopLevel && !top {
                tape.stage_time = Some(stage);
                tape.push(Event::Stage(stage));
            }
            tape.stage = Some(match stage {
                Stage::Compress | Stage::TopLevel => stage,
                _ => Stage::Emit,
            });
        });
    }

    fn emit_push(&mut self, _: usize) {
        self.tape.with(|tape| tape.work += 1);
    }

    fn emit_node(&mut self) {
        self.tape.with(|tape| match tape.sweeps {
            0 => tape.work += 1,
            _ => tape.nodes += 1,
        });
    }

    fn emit_extend_leaf(&mut self) {
        self.tape.with(|tape| tape.work += 1);
    }

    fn ploc_pass(&mut self, _: u32) {
        self.tape.with(|tape| {
            if tape.passes > 0 {
                tape.work += tape.sweeps * PlocTiming::default().distance_latency;
                tape.push(Event::Barrier);
            }
            tape.passes += 1;
        });
    }

    fn ploc_leaf(&mut self, _: u32) {
        self.tape.with(|tape| tape.leaves += 1);
    }

    fn ploc_beat(&mut self) {
        let PlocTiming { node_interval, leaf_interval, .. } = PlocTiming::default();
        self.tape.with(|tape| {
            let nodes = std::mem::take(&mut tape.nodes);
            let leaves = std::mem::take(&mut tape.leaves);
            tape.work += 1.max(nodes * node_interval).max(leaves * leaf_interval);
        });
    }

    fn compress_node(&mut self) {
        self.tape.with(|tape| tape.compressor.compress_node());
    }

    fn backtrack(&mut self, depth: u8) {
        self.tape.with(|tape| {
            tape.compressor.backtrack(depth);
            tape.work += CompressorTiming::default().repair;
        });
    }

    fn top_cell(&mut self) {
        self.tape.with(|tape| tape.top_events.top_cell());
    }

    fn top_coarsen(&mut self, cells: usize) {
        self.tape.with(|tape| tape.top_events.top_coarsen(cells));
    }

    fn top_sweep(&mut self, cells: usize) {
        self.tape.with(|tape| {
            tape.top_events.top_sweep(cells);
            tape.work += cells as u64 + SweepUnit::PAPER.plane_cycles;
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_has_the_bursts_with_the_work_between_them() {
        let tape = Tape::new(0, &BuildRegions::default());
        let mut image = vec![0; 128];
        let mut probe = tape.probe();
        probe.emit_push(1);
        probe.emit_node();
        tape.bus(&mut image).write(ByteAddr(64), &[7; 64]).unwrap();
        probe.top_sweep(5);
        tape.bus(&mut image).read(ByteAddr(64), &mut [0; 32]).unwrap();
        assert!(tape.bus(&mut image).read(ByteAddr(100), &mut [0; 32]).is_err());
        let mut events = VecDeque::new();
        tape.drain(&mut events);
        let expect = [
            Event::Work(2),
            Event::Write { addr: 64, bytes: 64 },
            Event::Work(37),
            Event::Read { addr: 64, bytes: 32 },
        ];
        assert_eq!(events, expect);
        assert_eq!(image[64], 7);
    }
}
