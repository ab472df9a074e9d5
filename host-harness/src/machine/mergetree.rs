//! MergeTree: the streaming builder, assembled and clocked (P1 §4, P2 §5).
//!
//! ```text
//!            ┌────────┐   ┌───────────┐   ┌────────────┐   ┌──────┐   ┌─────────┐   ┌───────┐
//!  memory ──►│ reader │──►│ insertion │──►│ scratchpad │──►│ heap │──►│  FIFO   │─┬►│ runs  │──► memory
//!     │      └────────┘   │  sorters  │   │            │   │      │   └─────────┘ │ └───────┘
//!     └──────── runs, in bursts ─────────►│            │   └──────┘               │ ┌─────────┐ nodes
//!                                         └────────────┘                          └►│ emitter │──► memory
//!                                                                                   └─────────┘ leaf table
//! ```
//!
//! In a cycle, units run from the back to the front, so a value passes one unit a cycle; then the
//! port takes at most one line in each direction. The control alternates filling the scratchpad and
//! merging it out until all runs are written, then merges runs until one merge can take them all,
//! and feeds that into the emitter.

use std::collections::VecDeque;
use std::ops::Range;

use xylem_core::emit::{EmitterKind, list_bound};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::Tree;
use xylem_core::pipeline::{BuildRegions, TreeStream};
use xylem_core::probe::Stage;
use xylem_core::sort::{Item, RecordFormat};
use xylem_core::toplevel::TopStorage;

use super::activity::{Activity, Unit};
use super::config::{MachineConfig, MachineConfigError};
use super::emitter::EmitterUnit;
use super::multimerge::{self, MultiMerge};
use super::port::{Access, LINE_BYTES, Port, PortError, Response};
use super::reader::Reader;
use super::sorter::Sorters;
use super::tail::{self, Tail, TapeUnit};
use super::tape::Tape;
use super::toplevel::TopEvents;
use super::writer::Writer;
use crate::bus::{FlatMemory, Tally, Traffic};

/// What a build on the clock took.
#[derive(Clone, Debug)]
pub struct MachineRun {
    /// The tree; its bytes are in memory.
    pub tree: Tree,
    /// Cycles of the machine's clock.
    pub cycles: u64,
    /// Bytes and cycles by stage and region. Emission overlaps the last merge, whose cycles count as
    /// [`Stage::Merge`]; [`Stage::Emit`] has those after the last record left the merge.
    pub traffic: Traffic,
    /// How busy each unit was.
    pub activity: Activity,
    /// Why the multi-merge stood still.
    pub stalls: Stalls,
    /// What the top-level builder did.
    pub top: TopEvents,
    /// Further merge passes before the last.
    pub passes: u32,
}

/// Cycles in which the multi-merge could have done an operation and did none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
pub struct Stalls {
    /// The successor of the lowest record had not come from memory.
    pub data_cycles: u64,
    /// Its output had no room.
    pub room_cycles: u64,
    /// The scratchpad was being filled by the insertion sorters.
    pub fill_cycles: u64,
}

/// Why a machine stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum MachineError {
    /// The machine cannot be built.
    #[error("{0}")]
    Config(#[from] MachineConfigError),
    /// A region does not start on a line of 64 bytes, or memory is shorter than the region.
    #[error("region `{0}` must lie in memory and start on a multiple of 64 bytes")]
    Alignment(RegionName),
    /// The build failed; what was written before stays in memory.
    #[error("{0}")]
    Build(#[from] BuildError<PortError>),
}

/// Builds a tree on the clock: the same bytes as `xylem_core::pipeline::build`.
///
/// `memory` holds the regions; `port` says when its lines move.
///
/// # Errors
/// [`MachineError`].
pub fn build<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    regions: &BuildRegions,
    count: u32,
    port: &mut P,
) -> Result<MachineRun, MachineError> {
    config.check()?;
    check_regions(config, memory, regions, count)?;
    let build = config.runs();
    let tape = Tape::new(config.sweeps(), regions);
    let mut cells = config.top_cells();
    let mut top = TopStorage { cells: &mut cells, nodes: &mut [] };
    let passes = config.further_passes(count);
    let tail = if Tail::is_plain(&build) {
        Tail::Emitter(EmitterUnit::new(&build, regions))
    } else {
        // The last merge reads from one region of runs, so the other one is free.
        let lists = match passes % 2 {
            0 => (regions.runs_b, RegionName::RunsB),
            _ => (regions.runs_a, RegionName::RunsA),
        };
        if let EmitterKind::Ploc(_) = build.emitter {
            let needed = u64::from(list_bound(count)) * u64::from(RecordFormat::Box32.bytes());
            let (Region { size: available, .. }, region) = lists;
            if needed > u64::from(available) {
                return Err(BuildError::RegionFull { region, needed, available }.into());
            }
        }
        let stream = TreeStream::new(&build, regions, lists, count, &mut top, &mut tape.probe());
        let scratchpad = config.build.sort.capacity as usize;
        // A burst is taken whole.
        let sort = config.build.sort;
        let burst = sort.burst * sort.record.bytes() / LINE_BYTES;
        let room = config.read_ahead.max(burst);
        Tail::Tape(TapeUnit::new(&tape, stream, scratchpad, room))
    };
    let mut machine = Machine::new(config, memory, regions, count, port, tail);
    machine.partial_sort()?;
    let mut source = (regions.runs_a, RegionName::RunsA);
    let mut target = (regions.runs_b, RegionName::RunsB);
    let mut run = config.run_len();
    for _ in 0..passes {
        machine.merge_pass(source, target, run)?;
        std::mem::swap(&mut source, &mut target);
        run = run.saturating_mul(config.width());
    }
    machine.emit(source, run)?;
    machine.finish(passes)
}

fn check_regions(
    config: &MachineConfig,
    memory: &FlatMemory,
    regions: &BuildRegions,
    count: u32,
) -> Result<(), MachineError> {
    // Runs of the same length merged no less widely: no more passes, and no more room for them.
    regions.check::<PortError>(&config.runs(), count)?;
    for (region, name) in [
        (regions.primitives, RegionName::Primitives),
        (regions.runs_a, RegionName::RunsA),
        (regions.runs_b, RegionName::RunsB),
        (regions.nodes, RegionName::Nodes),
        (regions.leaf_table, RegionName::LeafTable),
    ] {
        let end = u64::from(region.base.0) + u64::from(region.size);
        let inside = end <= memory.bytes().len() as u64 || region.size == 0;
        if !inside || !region.base.0.is_multiple_of(LINE_BYTES) {
            return Err(MachineError::Alignment(name));
        }
    }
    Ok(())
}

/// A region of runs and its name.
type Runs = (Region, RegionName);

/// What the port's read tags say: where a line goes.
const FOR_READER: u32 = u32::MAX;
const FOR_TAIL: u32 = u32::MAX - 1;

/// Who reads in a cycle.
#[derive(Clone, Copy)]
enum Reads {
    /// The primitive reader.
    Input,
    /// The multi-merge.
    Runs,
    /// What comes after it.
    Tail,
}

struct Machine<'a, P> {
    config: &'a MachineConfig,
    image: &'a mut [u8],
    regions: &'a BuildRegions,
    count: u32,
    port: &'a mut P,
    now: u64,
    reader: Reader,
    sorters: Sorters,
    merge: MultiMerge,
    /// Records between the merge and what takes them, with the cycle from which they are there.
    fifo: VecDeque<(u64, Item)>,
    tail: Tail<'a>,
    runs: Option<Writer>,
    /// Bytes asked for of the burst that the merge wants first.
    asked: u32,
    /// Lines asked for that have not come, oldest first.
    outstanding: VecDeque<Access>,
    /// Which of the writers the port serves.
    turn: usize,
    /// The cycle in which anything last moved.
    moved_at: u64,
    stage: Stage,
    traffic: Traffic,
    activity: Activity,
    stalls: Stalls,
}

impl<'a, P: Port> Machine<'a, P> {
    fn new(
        config: &'a MachineConfig,
        memory: &'a mut FlatMemory,
        regions: &'a BuildRegions,
        count: u32,
        port: &'a mut P,
        tail: Tail<'a>,
    ) -> Self {
        let sort = config.build.sort;
        let coder = config.build.coder();
        Self {
            config,
            image: memory.bytes_mut(),
            regions,
            count,
            port,
            now: 0,
            reader: Reader::new(
                regions.primitives,
                config.build.decoder(),
                count,
                config.read_ahead,
            ),
            sorters: Sorters::new(config.sorters, sort.piece()),
            merge: MultiMerge::new(
                sort.capacity,
                sort.burst,
                config.spare_buffers,
                sort.width().max(sort.capacity / sort.piece()),
                sort.schedule,
                coder,
            ),
            fifo: VecDeque::new(),
            tail,
            runs: None,
            asked: 0,
            outstanding: VecDeque::new(),
            turn: 0,
            moved_at: 0,
            stage: Stage::PartialSort,
            traffic: Traffic::default(),
            activity: Activity::new(),
            stalls: Stalls::default(),
        }
    }

    /// Blocks of the input become sorted runs.
    fn partial_sort(&mut self) -> Result<(), BuildError<PortError>> {
        let (sort, run) = (self.config.build.sort, self.config.run_len());
        let halves = sort.capacity / run;
        self.start_writing((self.regions.runs_a, RegionName::RunsA), Stage::PartialSort);
        let mut fill = Fill { pieces_in: 0, pieces_taken: 0 };
        let pieces = run / sort.piece();
        let all_pieces = self.count.div_ceil(sort.piece());
        for block in 0..self.count.div_ceil(run) {
            // Fill this block, unless that was done while the one before was merged out.
            while fill.pieces_in < all_pieces.min((block + 1) * pieces) {
                self.fill(&mut fill, block + 1)?;
                self.stalls.fill_cycles += 1;
                self.cycle(Reads::Input)?;
            }
            let len = run.min(self.count - block * run);
            self.merge.start_pieces(block % halves * run, len, sort.piece());
            // The next blocks may be filled as far as halves are free.
            while !self.merge.is_done() || !self.fifo.is_empty() {
                self.fill(&mut fill, block + halves)?;
                self.write_run()?;
                self.merge_one();
                self.cycle(Reads::Input)?;
            }
        }
        let read_bytes = self.reader.bytes();
        let reads = read_bytes.div_ceil(u64::from(LINE_BYTES));
        let read = Tally { read_bytes, reads, ..Tally::default() };
        self.count_traffic(Stage::PartialSort, RegionName::Primitives, read);
        self.finish_writing()
    }

    /// One cycle of reader and sorters, which may put pieces of blocks below `limit` into the
    /// scratchpad.
    fn fill(&mut self, fill: &mut Fill, limit: u32) -> Result<(), BuildError<PortError>> {
        let (sort, run) = (self.config.build.sort, self.config.run_len());
        let pieces = run / sort.piece();
        if let Some(piece) = self.sorters.take(self.now, limit * pieces) {
            let at = piece.number % (sort.capacity / sort.piece()) * sort.piece();
            self.merge.store(at, &piece.items);
            fill.pieces_in += 1;
            self.moved_at = self.now;
        }
        for _ in 0..2 {
            if !self.sorters.is_ready() {
                break;
            }
            let Some(item) = self.reader.next(self.image) else { break };
            let item = item.map_err(|index| BuildError::InvalidPrimitive { index })?;
            self.sorters.accept(item, self.now);
            self.moved_at = self.now;
            let position = self.reader.position();
            if position.is_multiple_of(sort.piece()) || self.reader.is_done() {
                self.sorters.close(fill.pieces_taken);
                fill.pieces_taken += 1;
            }
        }
        let busy = u64::from(self.sorters.busy(self.now)) * 1000 / self.sorters.len() as u64;
        self.activity.add(Unit::Sorters, busy);
        Ok(())
    }

    /// Merges groups of runs from one region into longer runs in the other.
    fn merge_pass(
        &mut self,
        source: Runs,
        target: Runs,
        run: u32,
    ) -> Result<(), BuildError<PortError>> {
        self.enter(Stage::Merge);
        self.start_writing(target, Stage::Merge);
        let group = run.saturating_mul(self.config.width());
        let mut first = 0;
        while first < self.count {
            let end = self.count.min(first.saturating_add(group));
            self.start_merge(source, first..end, run);
            while !self.merge.is_done() || !self.fifo.is_empty() {
                self.write_run()?;
                self.merge_one();
                self.cycle(Reads::Runs)?;
            }
            first = end;
        }
        self.finish_writing()
    }

    /// The last merge, straight into the emitter.
    fn emit(&mut self, source: Runs, run: u32) -> Result<(), BuildError<PortError>> {
        self.enter(Stage::Merge);
        self.start_merge(source, 0..self.count, run);
        loop {
            let merged = self.merge.is_done() && self.fifo.is_empty();
            if merged && self.stage == Stage::Merge {
                self.enter(Stage::Emit);
            }
            let item = self.fifo.front().filter(|(at, _)| *at <= self.now).map(|(_, item)| item);
            let did = self.tail.tick(item, merged, self.image)?;
            if did.accepted {
                self.fifo.pop_front();
            }
            if did.worked {
                let unit = if self.tail.is_top() { Unit::TopLevel } else { Unit::Emitter };
                self.activity.add(unit, 1000);
                self.moved_at = self.now;
            }
            if self.tail.is_top() && self.stage != Stage::TopLevel {
                self.enter(Stage::TopLevel);
            }
            if self.tail.is_finished() {
                break;
            }
            if !merged {
                self.merge_one();
            }
            self.cycle(if merged { Reads::Tail } else { Reads::Runs })?;
        }
        self.tail.count(&mut self.traffic);
        Ok(())
    }

    fn start_merge(&mut self, (source, name): Runs, range: Range<u32>, run: u32) {
        let sort = self.config.build.sort;
        let records = u64::from(range.end - range.start);
        let read_bytes = records * u64::from(sort.record.bytes());
        let reads = records.div_ceil(u64::from(sort.burst));
        self.count_traffic(Stage::Merge, name, Tally { read_bytes, reads, ..Tally::default() });
        self.merge.start_runs(source, range, run, self.config.share);
    }

    /// One cycle of the multi-merge.
    fn merge_one(&mut self) {
        let room = self.fifo.len() < self.config.fifo as usize;
        match self.merge.tick(room) {
            multimerge::Did::Output(item) => {
                self.fifo.push_back((self.now + 2, item));
                self.activity.add(Unit::MultiMerge, 1000);
                self.moved_at = self.now;
            }
            multimerge::Did::Insert => {
                self.activity.add(Unit::MultiMerge, 1000);
                self.moved_at = self.now;
            }
            multimerge::Did::WaitForData => self.stalls.data_cycles += 1,
            multimerge::Did::WaitForRoom => self.stalls.room_cycles += 1,
            multimerge::Did::Busy | multimerge::Did::Idle => {}
        }
    }

    /// Moves a record from the FIFO to the run writer.
    fn write_run(&mut self) -> Result<(), BuildError<PortError>> {
        let stride = RecordFormat::Box32.bytes() as usize;
        let (Some(writer), Some(&(at, item))) = (&mut self.runs, self.fifo.front()) else {
            return Ok(());
        };
        if at <= self.now && writer.is_ready(stride) {
            self.fifo.pop_front();
            let mut record = [0; RecordFormat::MAX_BYTES];
            RecordFormat::Box32.encode(&item, &mut record);
            writer.push(self.image, &record[..stride])?;
            self.moved_at = self.now;
        }
        Ok(())
    }

    fn start_writing(&mut self, (region, name): Runs, stage: Stage) {
        let sort = self.config.build.sort;
        self.runs = Some(Writer::new(region, name, stage, sort.burst * sort.record.bytes()));
    }

    /// Sends the rest of the runs.
    fn finish_writing(&mut self) -> Result<(), BuildError<PortError>> {
        while let Some(writer) = &mut self.runs {
            writer.flush(self.image);
            if writer.is_empty() {
                writer.count(&mut self.traffic);
                self.runs = None;
            } else {
                self.cycle(Reads::Input)?;
            }
        }
        Ok(())
    }

    /// The rest of a cycle: the memory port, and time.
    fn cycle(&mut self, reads: Reads) -> Result<(), BuildError<PortError>> {
        if let Some(Response { access, failed }) = self.port.take() {
            self.respond(access, failed)?;
        }
        match reads {
            Reads::Input => self.read_input(),
            Reads::Runs => self.read_bursts(),
            Reads::Tail => self.read_for_tail(),
        }
        self.write();
        self.port.tick();
        self.activity.tick();
        self.now += 1;
        if self.now - self.moved_at > self.config.time_out {
            let waiting = self.outstanding.front().copied().or_else(|| self.wanted());
            let addr = ByteAddr(waiting.map_or(0, |access| access.addr));
            let (stage, error) = (self.stage, PortError::TimeOut);
            return Err(BuildError::Bus { stage, addr, error });
        }
        Ok(())
    }

    /// The access that the port has not taken, if there is one.
    fn wanted(&self) -> Option<Access> {
        let read = |addr| Access { addr, write: false, tag: 0 };
        let write = (0..=tail::PORTS).find_map(|port| self.write_offer(port));
        let burst = self.merge.request().map(|request| read(request.addr + self.asked));
        let tail = || self.tail.read().map(read);
        burst.or(write).or_else(|| self.reader.offer().map(read)).or_else(tail)
    }

    fn respond(&mut self, access: Access, failed: bool) -> Result<(), BuildError<PortError>> {
        self.moved_at = self.now;
        if failed {
            let error = if access.write { PortError::Write } else { PortError::Read };
            return Err(BuildError::Bus { stage: self.stage, addr: ByteAddr(access.addr), error });
        }
        // Nearly always the oldest.
        if let Some(at) = self.outstanding.iter().position(|other| *other == access) {
            self.outstanding.remove(at);
        }
        match access.tag {
            FOR_READER => self.reader.arrive(access.addr),
            FOR_TAIL => self.tail.arrive(access.addr),
            buffer => self.merge.arrive(buffer, self.image),
        }
        Ok(())
    }

    fn read_input(&mut self) {
        if let Some(addr) = self.reader.offer()
            && self.ask(Access { addr, write: false, tag: FOR_READER })
        {
            self.reader.taken();
        }
    }

    fn read_bursts(&mut self) {
        let Some(request) = self.merge.request() else { return };
        let access = Access { addr: request.addr + self.asked, write: false, tag: request.buffer };
        if self.ask(access) {
            self.asked += LINE_BYTES;
        }
        if self.asked >= request.bytes {
            self.merge.requested();
            self.asked = 0;
        }
    }

    fn read_for_tail(&mut self) {
        if let Some(addr) = self.tail.read()
            && self.ask(Access { addr, write: false, tag: FOR_TAIL })
        {
            self.tail.read_taken(addr);
        }
    }

    fn ask(&mut self, access: Access) -> bool {
        let taken = self.port.offer(access);
        if taken {
            self.outstanding.push_back(access);
            self.activity.add(Unit::ReadPort, 1000);
            self.moved_at = self.now;
        }
        taken
    }

    /// The line that a write port offers: first that of runs, then those of the tail.
    fn write_offer(&self, port: usize) -> Option<Access> {
        match port.checked_sub(1) {
            None => self.runs.as_ref()?.offer(),
            Some(port) => self.tail.offer(port),
        }
    }

    fn in_burst(&self, port: usize) -> bool {
        match port.checked_sub(1) {
            None => self.runs.as_ref().is_some_and(Writer::in_burst),
            Some(port) => self.tail.in_burst(port),
        }
    }

    /// Offers a line of one write port. A burst keeps its turn until its last line.
    fn write(&mut self) {
        const PORTS: usize = tail::PORTS + 1;
        if !self.in_burst(self.turn) {
            let wants = |port: &usize| self.write_offer(*port).is_some();
            let Some(next) = (1..=PORTS).map(|i| (self.turn + i) % PORTS).find(wants) else {
                return;
            };
            self.turn = next;
        }
        let Some(access) = self.write_offer(self.turn) else { return };
        if self.port.offer(access) {
            match self.turn.checked_sub(1) {
                None => self.runs.iter_mut().for_each(Writer::taken),
                Some(port) => self.tail.taken(port),
            }
            self.activity.add(Unit::WritePort, 1000);
            self.moved_at = self.now;
        }
    }

    /// Begins a stage; the cycles since the last belong to the one before.
    fn enter(&mut self, stage: Stage) {
        let spent: u64 = self.traffic.tallies.values().map(|tally| tally.millicycles).sum();
        let millicycles = self.now * 1000 - spent;
        let tally = Tally { millicycles, ..Tally::default() };
        *self.traffic.tallies.entry((self.stage, None)).or_default() += tally;
        self.stage = stage;
    }

    fn count_traffic(&mut self, stage: Stage, region: RegionName, tally: Tally) {
        *self.traffic.tallies.entry((stage, Some(region.as_str()))).or_default() += tally;
    }

    fn finish(mut self, passes: u32) -> Result<MachineRun, MachineError> {
        self.enter(self.stage);
        Ok(MachineRun {
            tree: *self.tail.tree().ok_or(BuildError::Internal)?,
            cycles: self.now,
            traffic: self.traffic,
            activity: self.activity,
            stalls: self.stalls,
            top: self.tail.top_events(),
            passes,
        })
    }
}

/// How far the scratchpad is filled, in pieces.
struct Fill {
    /// Pieces in the scratchpad.
    pieces_in: u32,
    /// Pieces given to sorters.
    pieces_taken: u32,
}
