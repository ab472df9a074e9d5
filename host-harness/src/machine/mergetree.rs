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

use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::Tree;
use xylem_core::pipeline::BuildRegions;
use xylem_core::probe::Stage;
use xylem_core::sort::{Item, RecordFormat};

use super::activity::{Activity, Unit};
use super::config::{MachineConfig, MachineConfigError};
use super::emitter::EmitterUnit;
use super::multimerge::{self, MultiMerge};
use super::port::{Access, LINE_BYTES, Port, PortError, Response};
use super::reader::Reader;
use super::sorter::Sorters;
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
    let mut machine = Machine::new(config, memory, regions, count, port);
    machine.partial_sort()?;
    let mut source = (regions.runs_a, RegionName::RunsA);
    let mut target = (regions.runs_b, RegionName::RunsB);
    let mut run = config.run_len();
    let passes = config.further_passes(count);
    for _ in 0..passes {
        machine.merge_pass(source, target, run)?;
        std::mem::swap(&mut source, &mut target);
        run = run.saturating_mul(config.width());
    }
    machine.emit(source, run)?;
    Ok(machine.finish(passes))
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
    emitter: EmitterUnit,
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
            emitter: EmitterUnit::new(&config.build, regions),
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
                self.cycle(false)?;
            }
            let len = run.min(self.count - block * run);
            self.merge.start_pieces(block % halves * run, len, sort.piece());
            // The next blocks may be filled as far as halves are free.
            while !self.merge.is_done() || !self.fifo.is_empty() {
                self.fill(&mut fill, block + halves)?;
                self.write_run()?;
                self.merge_one();
                self.cycle(false)?;
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
                self.cycle(true)?;
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
            let did = self.emitter.tick(item, merged, self.image)?;
            if did.accepted {
                self.fifo.pop_front();
            }
            if did.worked {
                self.activity.add(Unit::Emitter, 1000);
                self.moved_at = self.now;
            }
            if self.emitter.is_finished() {
                self.emitter.nodes.flush(self.image);
                self.emitter.leaf_table.flush(self.image);
                if self.emitter.nodes.is_empty() && self.emitter.leaf_table.is_empty() {
                    break;
                }
            }
            if !merged {
                self.merge_one();
            }
            self.cycle(true)?;
        }
        for writer in [&self.emitter.nodes, &self.emitter.leaf_table] {
            let sent = writer.sent();
            let tally = Tally { write_bytes: sent.bytes, writes: sent.bursts, ..Tally::default() };
            let key = (Stage::Emit, Some(writer.name().as_str()));
            *self.traffic.tallies.entry(key).or_default() += tally;
        }
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
                let (name, stage, sent) = (writer.name(), writer.stage(), writer.sent());
                let tally =
                    Tally { write_bytes: sent.bytes, writes: sent.bursts, ..Tally::default() };
                self.count_traffic(stage, name, tally);
                self.runs = None;
            } else {
                self.cycle(false)?;
            }
        }
        Ok(())
    }

    /// The rest of a cycle: the memory port, and time. `bursts` says that runs are read.
    fn cycle(&mut self, bursts: bool) -> Result<(), BuildError<PortError>> {
        if let Some(Response { access, failed }) = self.port.take() {
            self.respond(access, failed)?;
        }
        if bursts {
            self.read_bursts()
        } else {
            self.read_input()
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
        let write = self.writers().into_iter().find_map(|writer| writer?.offer());
        let burst = self.merge.request().map(|request| read(request.addr + self.asked));
        burst.or(write).or_else(|| self.reader.offer().map(read))
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

    fn ask(&mut self, access: Access) -> bool {
        let taken = self.port.offer(access);
        if taken {
            self.outstanding.push_back(access);
            self.activity.add(Unit::ReadPort, 1000);
            self.moved_at = self.now;
        }
        taken
    }

    fn writers(&self) -> [Option<&Writer>; 3] {
        [self.runs.as_ref(), Some(&self.emitter.nodes), Some(&self.emitter.leaf_table)]
    }

    /// Offers a line of one writer. A burst keeps its turn until its last line.
    fn write(&mut self) {
        let writers = self.writers();
        if !writers[self.turn].is_some_and(Writer::in_burst) {
            let wants = |i: &usize| writers[*i].is_some_and(|writer| writer.offer().is_some());
            let Some(next) = (1..=3).map(|i| (self.turn + i) % 3).find(wants) else { return };
            self.turn = next;
        }
        let Some(access) = self.writers()[self.turn].and_then(Writer::offer) else { return };
        if self.port.offer(access) {
            match self.turn {
                0 => self.runs.iter_mut().for_each(Writer::taken),
                1 => self.emitter.nodes.taken(),
                _ => self.emitter.leaf_table.taken(),
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

    fn finish(mut self, passes: u32) -> MachineRun {
        self.enter(self.stage);
        MachineRun {
            tree: *self.emitter.tree(),
            cycles: self.now,
            traffic: self.traffic,
            activity: self.activity,
            stalls: self.stalls,
            passes,
        }
    }
}

/// How far the scratchpad is filled, in pieces.
struct Fill {
    /// Pieces in the scratchpad.
    pieces_in: u32,
    /// Pieces given to sorters.
    pieces_taken: u32,
}
