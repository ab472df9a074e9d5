//! The units and the control that alternates them.

use std::collections::VecDeque;
use std::ops::Range;

use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::Region;
use xylem_core::pipeline::BuildRegions;
use xylem_core::probe::Stage;
use xylem_core::sort::{Item, RecordFormat};

use super::super::activity::{Activity, Unit};
use super::super::config::MachineConfig;
use super::super::multimerge::{self, MultiMerge};
use super::super::port::{LINE_BYTES, Port, PortError};
use super::super::reader::Reader;
use super::super::sorter::Sorters;
use super::super::tail::Tail;
use super::super::writer::Writer;
use super::lines::{Lines, Reads};
use super::{MachineError, MachineRun, Stalls};
use crate::bus::{FlatMemory, Tally, Traffic};

/// A region of runs and its name.
type Runs = (Region, RegionName);

/// The machine in the middle of a build.
pub(super) struct Machine<'a, P> {
    pub(super) config: &'a MachineConfig,
    pub(super) image: &'a mut [u8],
    regions: &'a BuildRegions,
    count: u32,
    pub(super) port: &'a mut P,
    pub(super) now: u64,
    pub(super) reader: Reader,
    sorters: Sorters,
    pub(super) merge: MultiMerge,
    /// Records between the merge and what takes them, with the cycle from which they are there.
    fifo: VecDeque<(u64, Item)>,
    pub(super) tail: Tail<'a>,
    pub(super) runs: Option<Writer>,
    pub(super) lines: Lines,
    /// The cycle in which anything last moved.
    pub(super) moved_at: u64,
    pub(super) stage: Stage,
    traffic: Traffic,
    pub(super) activity: Activity,
    stalls: Stalls,
}

impl<'a, P: Port> Machine<'a, P> {
    pub(super) fn new(
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
            lines: Lines::default(),
            moved_at: 0,
            stage: Stage::PartialSort,
            traffic: Traffic::default(),
            activity: Activity::new(),
            stalls: Stalls::default(),
        }
    }

    /// The whole build, with `passes` merge passes before the last.
    pub(super) fn run(&mut self, passes: u32) -> Result<(), BuildError<PortError>> {
        self.partial_sort()?;
        let mut source = (self.regions.runs_a, RegionName::RunsA);
        let mut target = (self.regions.runs_b, RegionName::RunsB);
        let mut run = self.config.run_len();
        for _ in 0..passes {
            self.merge_pass(source, target, run)?;
            std::mem::swap(&mut source, &mut target);
            run = run.saturating_mul(self.config.width());
        }
        self.emit(source, run)
    }

    /// Blocks of the input become sorted runs.
    fn partial_sort(&mut self) -> Result<(), BuildError<PortError>> {
        let (sort, run) = (self.config.build.sort, self.config.run_len());
        let halves = sort.capacity / run;
        self.start_writing((self.regions.runs_a, RegionName::RunsA), Stage::PartialSort);
        // Records that the sorters have put into the scratchpad.
        let mut stored = 0;
        for block in 0..self.count.div_ceil(run) {
            let (first, end) = (block * run, self.count.min((block + 1) * run));
            // Fill this block, unless that was done while the one before was merged out.
            while stored < end {
                self.fill(&mut stored, end)?;
                self.stalls.fill_cycles += 1;
                self.cycle(Reads::Input)?;
            }
            self.merge.start_pieces(block % halves * run, end - first, sort.piece());
            // The next blocks may be filled as far as halves are free.
            let limit = self.count.min((block + halves) * run);
            self.fill(&mut stored, limit)?;
            self.cycle(Reads::Input)?;
            while !self.is_merged() {
                self.fill(&mut stored, limit)?;
                self.merge_to_run()?;
                self.cycle(Reads::Input)?;
            }
            self.fill(&mut stored, limit)?;
            self.cycle(Reads::Input)?;
        }
        let read_bytes = self.reader.bytes();
        let reads = read_bytes.div_ceil(u64::from(LINE_BYTES));
        let read = Tally { read_bytes, reads, ..Tally::default() };
        self.count_traffic(Stage::PartialSort, RegionName::Primitives, read);
        self.finish_writing()
    }

    /// One cycle of reader and sorters, which may put records into the scratchpad until it holds
    /// those below `limit`.
    fn fill(&mut self, stored: &mut u32, limit: u32) -> Result<(), BuildError<PortError>> {
        for _ in 0..2 {
            if !self.sorters.is_ready() {
                break;
            }
            let Some(item) = self.reader.next(self.image) else { break };
            let item = item.map_err(|index| BuildError::InvalidPrimitive { index })?;
            self.sorters.accept(item, self.reader.is_done());
            self.moved_at = self.now;
        }
        // After the sorters took records: room is seen a cycle later.
        if *stored < limit
            && let Some((items, given)) = self.sorters.deliver()
        {
            self.merge.store(*stored % self.config.build.sort.capacity, &items[..given]);
            *stored += given as u32;
            self.moved_at = self.now;
        }
        let busy = u64::from(self.sorters.busy()) * 1000 / self.sorters.len() as u64;
        self.activity.add(Unit::Sorters, busy);
        self.sorters.tick();
        Ok(())
    }

    /// Whether the merge is done and all has left the FIFO; another can be started.
    fn is_merged(&self) -> bool {
        self.merge.is_done() && self.fifo.is_empty()
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
            self.cycle(Reads::Runs)?;
            while !self.is_merged() {
                self.merge_to_run()?;
                self.cycle(Reads::Runs)?;
            }
            // The next group starts in the cycle in which this one is seen to be merged.
            first = end;
        }
        self.cycle(Reads::Runs)?;
        self.finish_writing()
    }

    /// The last merge, straight into the emitter.
    fn emit(&mut self, source: Runs, run: u32) -> Result<(), BuildError<PortError>> {
        self.enter(Stage::Merge);
        self.start_merge(source, 0..self.count, run);
        self.cycle(Reads::Runs)?;
        loop {
            let merged = self.is_merged();
            if merged && self.stage == Stage::Merge {
                self.enter(Stage::Emit);
            }
            self.merge_one();
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

    /// One cycle of the multi-merge. Goes before what takes its output: room is seen a cycle later.
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

    /// One cycle of the multi-merge and of the run writer behind its FIFO.
    fn merge_to_run(&mut self) -> Result<(), BuildError<PortError>> {
        self.merge_one();
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
            writer.flush();
            if !writer.is_empty() || !self.port.is_quiet() {
                self.cycle(Reads::Input)?;
                continue;
            }
            // What comes next starts in the cycle in which all is seen to be written.
            writer.count(&mut self.traffic);
            self.runs = None;
        }
        Ok(())
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

    pub(super) fn finish(mut self, passes: u32) -> Result<MachineRun, MachineError> {
        self.enter(self.stage);
        Ok(MachineRun {
            tree: *self.tail.tree().ok_or(BuildError::Internal)?,
            cycles: self.now,
            traffic: self.traffic,
            activity: self.activity,
            stalls: self.stalls,
            top: self.tail.top_events(),
            compressor: self.tail.compressor_events(),
            passes,
        })
    }
}
