//! The merge sort: what it is fed, and the lockstep with the clocked builder's front half.
//!
//! The model runs first, behind a memory and an emitter that stall as a seed says; what every wire did in
//! every cycle is written down, and the RTL is fed the same and must do the same. It works on a memory of its
//! own: what it reads is what it has written.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use glam::IVec3;
use xylem::bus::FlatMemory;
use xylem::machine::config::MachineConfig;
use xylem::machine::mergetree::{self, MachineError};
use xylem::machine::port::{Access, LINE_BYTES, Port, Response};
use xylem::run::{Buffers, Layout};
use xylem_core::geom::{Aabb, Triangle};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::{self, BuildConfig};
use xylem_core::sort::{InputFormat, Item, RecordFormat, SortConfig};

use crate::bench::{Bench, Stop, Waves};
use crate::pins;
use crate::random::Random;
use crate::types::{record_bytes, split};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// The sizes of the builder's front half, named as in `configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MergeSortConfig {
    /// Its name.
    pub name: &'static str,
    /// Records of the scratchpad.
    pub capacity: u32,
    /// Records of a burst.
    pub burst: u32,
    /// Insertion sorters.
    pub sorters: u32,
    /// Records of the FIFO behind the merge.
    pub fifo: u32,
    /// Lines that the reader asks for ahead.
    pub read_ahead: u32,
    /// Bits of a Morton code.
    pub code_bits: u32,
}

impl MergeSortConfig {
    /// For tests, which fill it often.
    pub const SMALL: Self = Self {
        name: "small",
        capacity: 128,
        burst: 4,
        sorters: 2,
        fifo: 4,
        read_ahead: 8,
        code_bits: 63,
    };
    /// P2 §6.2.
    pub const PAPER: Self = Self {
        name: "paper",
        capacity: 8192,
        burst: 16,
        sorters: 8,
        fifo: 16,
        read_ahead: 32,
        code_bits: 63,
    };
    /// All of them.
    pub const ALL: [Self; 2] = [Self::SMALL, Self::PAPER];

    /// The same sizes for the clocked builder.
    pub fn machine(&self, morton: MortonWidth) -> MachineConfig {
        let sort =
            SortConfig { capacity: self.capacity, burst: self.burst, ..SortConfig::default() };
        MachineConfig {
            sorters: self.sorters,
            fifo: self.fifo,
            read_ahead: self.read_ahead,
            ..MachineConfig::p2(BuildConfig { sort, morton, ..BuildConfig::default() })
        }
    }
}

/// Builds the merge sort in `config`, with a fault if `mutation` says so.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(config: MergeSortConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let unit = Unit {
        top: "xy_mergesort",
        files: "mergesort.f",
        config: config.name,
        parameters: &[
            ("Capacity", config.capacity.into()),
            ("Burst", config.burst.into()),
            ("Sorters", config.sorters.into()),
            ("Fifo", config.fifo.into()),
            ("ReadAhead", config.read_ahead.into()),
            ("CodeWidth", config.code_bits.into()),
        ],
    };
    verilate::unit(&unit, mutation)
}

/// How memory and emitter behave.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Neighbours {
    /// Cycles from a request to its line, at least 1.
    pub latency: u64,
    /// The most by which a line is later still; lines then come in any order.
    pub jitter: u64,
    /// In how many of 16 cycles no request is taken.
    pub read_stall: u64,
    /// In how many of 16 cycles no line is taken.
    pub write_stall: u64,
    /// In how many of 16 cycles no item is taken.
    pub item_stall: u64,
    /// In how many of 16 cycles memory does not say that all is written.
    pub unrest: u64,
}

impl Neighbours {
    /// Memory that takes and gives a line in every cycle, and an emitter that always waits.
    pub const fn ideal(latency: u64) -> Self {
        Self { latency, jitter: 0, read_stall: 0, write_stall: 0, item_stall: 0, unrest: 0 }
    }

    /// Any.
    pub fn draw(random: &mut Random) -> Self {
        let mut one_of = |values: &[u64]| values[random.below(values.len() as u64) as usize];
        Self {
            latency: one_of(&[1, 1, 2, 10, 60]),
            jitter: one_of(&[0, 0, 3, 40]),
            read_stall: one_of(&[0, 0, 4, 13]),
            write_stall: one_of(&[0, 0, 4, 13]),
            item_stall: one_of(&[0, 0, 4, 14]),
            unrest: one_of(&[0, 0, 14]),
        }
    }
}

/// Primitives in memory: boxes of all sizes, whose codes are spread, few or ordered.
pub fn primitives(random: &mut Random, count: u32) -> Vec<Item> {
    let spread = [24, 24, 12, 4][random.below(4) as usize];
    let mut corner = || {
        let bits = random.bits();
        IVec3::from_array(
            [0, 20, 40].map(|at| (bits << at) as i32 >> (32 - spread) << (24 - spread)),
        )
    };
    let mut items: Vec<Item> = (0..count)
        .map(|_| {
            let (a, b) = (corner(), corner());
            Item { bounds: Aabb::new(a.min(b), a.max(b)), ..Item::ZERO }
        })
        .collect();
    match random.below(4) {
        0 => items.sort_by_key(|item| item.bounds.min.x),
        1 => items.sort_by_key(|item| -item.bounds.min.x),
        _ => {}
    }
    for item in &mut items {
        item.reference = random.bits() as u32 >> 1;
    }
    items
}

/// Writes a primitive as an input of `format` has it: a box, or a triangle with that box.
pub fn encode(item: &Item, format: InputFormat, bytes: &mut [u8]) {
    match format {
        InputFormat::Box32 => RecordFormat::Box32.encode(item, bytes),
        InputFormat::Triangle40 => {
            let Aabb { min, max } = item.bounds;
            // Which vertex is lowest and which highest differs between triangles and axes.
            let vertex = |turn: u32| {
                let pick = |axis: usize| {
                    let corners = [min[axis], max[axis], (min[axis] + max[axis]) / 2];
                    corners[((item.reference >> (2 * axis)) + turn) as usize % 3]
                };
                IVec3::new(pick(0), pick(1), pick(2))
            };
            let triangle = Triangle { vertices: [0, 1, 2].map(vertex), id: item.reference };
            bytes.copy_from_slice(&triangle.to_bytes());
        }
    }
}

/// A sort to be done: its input in memory, and what must come of it.
#[derive(Debug)]
pub struct Job {
    machine: MachineConfig,
    layout: Layout,
    count: u32,
    /// Memory with the input in it and nothing else.
    input: FlatMemory,
}

impl Job {
    /// Puts `items` into memory.
    ///
    /// # Panics
    /// If there are too many of them.
    pub fn new(machine: MachineConfig, items: &[Item]) -> Self {
        let count = items.len() as u32;
        let layout = Layout::new(&machine.build, count).unwrap_or_else(|size| panic!("{size}"));
        let mut input = FlatMemory::new(layout.size as usize);
        let start = layout.build.primitives.base.0 as usize;
        let format = machine.build.input;
        let records = input.bytes_mut()[start..].chunks_exact_mut(format.bytes() as usize);
        for (bytes, item) in records.zip(items) {
            encode(item, format, bytes);
        }
        Self { machine, layout, count, input }
    }

    /// Makes record `index` one that is none.
    pub fn spoil(&mut self, index: u32) {
        let stride = self.machine.build.input.bytes();
        let at = (self.layout.build.primitives.base.0 + stride * index) as usize;
        self.input.bytes_mut()[at + 3] = 0x7f;
    }

    /// Makes the first region of runs `bytes` shorter.
    pub fn shorten(&mut self, bytes: u32) {
        self.layout.build.runs_a.size -= bytes;
    }

    /// Checks that what differs between `memory` and the input lies in the regions of runs.
    ///
    /// # Panics
    /// If something else was touched.
    pub fn assert_runs_inside(&self, memory: &FlatMemory) {
        let (a, b) = (self.layout.build.runs_a, self.layout.build.runs_b);
        let inside = |at: usize| {
            [a, b].iter().any(|r| (r.base.0 as usize..(r.base.0 + r.size) as usize).contains(&at))
        };
        let pairs = memory.bytes().iter().zip(self.input.bytes()).enumerate();
        let outside = pairs.filter(|(at, (now, then))| now != then && !inside(*at)).count();
        assert_eq!(outside, 0, "bytes outside the regions of runs");
    }

    /// What the core makes of it: memory with its runs.
    fn core(&self) -> FlatMemory {
        let mut memory = self.input.clone();
        let mut buffers = Buffers::new(&self.machine.build);
        let (mut workspace, mut storage) = buffers.parts();
        let (regions, config) = (&self.layout.build, &self.machine.build);
        let (workspace, storage) = (&mut workspace, &mut storage);
        pipeline::build_with(&mut memory, config, regions, self.count, workspace, storage, &mut ())
            .unwrap_or_else(|error| panic!("{error}"));
        memory
    }

    /// Runs the model; gives what happened in every cycle.
    ///
    /// # Errors
    /// The machine's.
    fn script(&self, neighbours: Neighbours, seed: u64) -> Result<Vec<Cycle>, MachineError> {
        let recorder = RefCell::new(Recorder::new(neighbours, seed));
        let mut memory = self.input.clone();
        let mut take = |item: Option<&Item>, end| {
            let now = &mut recorder.borrow_mut().now;
            (now.item, now.end) = (item.copied(), end);
            now.item_ready
        };
        let (machine, regions) = (&self.machine, &self.layout.build);
        let mut port = Wires(&recorder);
        mergetree::sort(machine, &mut memory, regions, self.count, &mut port, &mut take)?;
        let Recorder { mut script, now, .. } = recorder.into_inner();
        script.push(now);
        Ok(script)
    }
}

/// What the wires did in a cycle.
#[derive(Clone, Copy, Debug, Default)]
struct Cycle {
    /// The line asked for.
    read: Option<u32>,
    read_ready: bool,
    /// The line written.
    write: Option<u32>,
    write_ready: bool,
    /// Whether what was written can be read back.
    quiet: bool,
    /// The number, of all lines asked for, of the one that came.
    response: Option<u64>,
    /// The record offered.
    item: Option<Item>,
    item_ready: bool,
    /// Whether all had left.
    end: bool,
}

/// The model's memory port: writes down what happens.
#[derive(Debug)]
struct Recorder {
    neighbours: Neighbours,
    random: Random,
    cycle: u64,
    asked: u64,
    /// Lines under way: when they are due, their numbers, and the access.
    flying: Vec<(u64, u64, Access)>,
    now: Cycle,
    script: Vec<Cycle>,
}

impl Recorder {
    fn new(neighbours: Neighbours, seed: u64) -> Self {
        let random = Random::new(seed);
        let (flying, script) = (Vec::new(), Vec::new());
        let now = Cycle::default();
        let mut new = Self { neighbours, random, cycle: 0, asked: 0, flying, now, script };
        new.now = new.draw();
        new
    }

    fn draw(&mut self) -> Cycle {
        let mut ready = |stall| self.random.below(16) >= stall;
        Cycle {
            read_ready: ready(self.neighbours.read_stall),
            write_ready: ready(self.neighbours.write_stall),
            item_ready: ready(self.neighbours.item_stall),
            quiet: ready(self.neighbours.unrest),
            ..Cycle::default()
        }
    }
}

/// The model's end of its port.
#[derive(Debug)]
struct Wires<'a>(&'a RefCell<Recorder>);

impl Port for Wires<'_> {
    fn offer(&mut self, access: Access) -> bool {
        let recorder = &mut *self.0.borrow_mut();
        if access.write {
            recorder.now.write = Some(access.addr);
            return recorder.now.write_ready;
        }
        recorder.now.read = Some(access.addr);
        if recorder.now.read_ready {
            let late = recorder.random.below(recorder.neighbours.jitter + 1);
            let due = recorder.cycle + recorder.neighbours.latency + late;
            recorder.flying.push((due, recorder.asked, access));
            recorder.asked += 1;
        }
        recorder.now.read_ready
    }

    fn take(&mut self) -> Option<Response> {
        let recorder = &mut *self.0.borrow_mut();
        let due = recorder.flying.iter().position(|(due, ..)| *due <= recorder.cycle)?;
        let (_, number, access) = recorder.flying.remove(due);
        recorder.now.response = Some(number);
        Some(Response { access, failed: false })
    }

    fn tick(&mut self) {
        let recorder = &mut *self.0.borrow_mut();
        let next = recorder.draw();
        recorder.script.push(std::mem::replace(&mut recorder.now, next));
        recorder.cycle += 1;
    }

    fn is_quiet(&self) -> bool {
        self.0.borrow().now.quiet
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        None
    }
}

pins!(Pins {
    clear_i, start_i, wide_i, triangles_i, quiet_i, count_i, primitives_base_i, runs_a_base_i, runs_a_size_i, runs_b_base_i,
    runs_b_size_i, rd_ready_i, rsp_valid_i, rsp_tag_i, rsp_data_i, wr_ready_i, item_ready_i;
    ready_o, rd_valid_o, rd_addr_o, rd_tag_o, wr_valid_o, wr_addr_o, wr_data_o, wr_strb_o,
    item_valid_o, item_o, item_split_o, end_o, primitive_error_o, region_error_o, error_index_o,
});

/// The merge sort in gates, with a memory.
#[derive(Debug)]
pub struct MergeSortRtl {
    bench: Bench,
    pins: Pins,
    memory: FlatMemory,
    /// What the inputs are.
    given: Cycle,
    /// The code of the last item taken; 0 before the first one.
    before: u64,
    /// Lines asked for: the tag, and the bytes that were there then; `None` once they have come.
    asked: Vec<Option<(u64, Vec<u8>)>>,
}

/// What a sort came to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outcome {
    /// Cycles that the model took.
    pub model_cycles: u64,
    /// Cycles that the RTL took.
    pub rtl_cycles: u64,
    /// Cycles from the first record to the last one, both included.
    pub stream_cycles: u64,
}

impl MergeSortRtl {
    /// Loads a library that [`build`] built and resets the unit.
    ///
    /// # Errors
    /// As [`Bench::load`].
    pub fn load(library: &Path, seed: u64, waves: Waves) -> Result<Self, Stop> {
        let bench = Bench::load(library, seed, waves)?;
        let pins = Pins::new(&bench.rtl);
        let (memory, given) = (FlatMemory::new(0), Cycle::default());
        Ok(Self { bench, pins, memory, given, before: 0, asked: Vec::new() })
    }

    /// Cycles since the reset.
    pub fn cycle(&self) -> u64 {
        self.bench.cycle()
    }

    /// Sorts, in lockstep with the model; then compares memory with the core's. With `give_up`, stops
    /// after that many cycles and clears the unit.
    ///
    /// # Errors
    /// The first cycle in which the sides differ or the RTL fails.
    ///
    /// # Panics
    /// If the model fails, or memory differs from the core's.
    pub fn sort(
        &mut self,
        job: &Job,
        neighbours: Neighbours,
        seed: u64,
        give_up: Option<u64>,
    ) -> Result<Outcome, Stop> {
        let script = job.script(neighbours, seed).unwrap_or_else(|error| panic!("{error}"));
        self.start(job)?;
        let begin = self.bench.cycle();
        let mut stream = None;
        for (at, cycle) in script.iter().enumerate() {
            if give_up == Some(at as u64) {
                self.clear()?;
                break;
            }
            self.set(cycle);
            self.bench.rtl.settle();
            self.compare(cycle)?;
            if let Some(item) = cycle.item.filter(|_| cycle.item_ready) {
                self.before = item.code;
            }
            if self.bench.rtl.is_set(self.pins.item_valid_o) {
                stream = Some((stream.map_or(at, |(first, _)| first), at));
            }
            self.edge()?;
        }
        let rtl_cycles = self.bench.cycle() - begin - 1;
        if give_up.is_none() {
            let (core, regions) = (job.core(), &job.layout.build);
            for (name, region) in [("A", regions.runs_a), ("B", regions.runs_b)] {
                assert!(self.memory.region(region) == core.region(region), "runs {name}");
            }
        }
        let stream_cycles = stream.map_or(0, |(first, last)| last - first + 1) as u64;
        Ok(Outcome { model_cycles: script.len() as u64 - 1, rtl_cycles, stream_cycles })
    }

    /// Starts a sort, when the unit is ready.
    fn start(&mut self, job: &Job) -> Result<(), Stop> {
        self.memory = job.input.clone();
        self.asked.clear();
        self.before = 0;
        self.set(&Cycle::default());
        let (pins, rtl) = (&self.pins, &mut self.bench.rtl);
        let regions = &job.layout.build;
        rtl.set(pins.wide_i, job.machine.build.morton == MortonWidth::Bits63);
        rtl.set(pins.triangles_i, job.machine.build.input == InputFormat::Triangle40);
        for (pin, value) in [
            (pins.count_i, job.count),
            (pins.primitives_base_i, regions.primitives.base.0),
            (pins.runs_a_base_i, regions.runs_a.base.0),
            (pins.runs_a_size_i, regions.runs_a.size),
            (pins.runs_b_base_i, regions.runs_b.base.0),
            (pins.runs_b_size_i, regions.runs_b.size),
        ] {
            rtl.set(pin, value);
        }
        // The scratchpad's counts are cleared after a reset.
        for _ in 0..job.machine.build.sort.capacity {
            self.bench.rtl.settle();
            if self.bench.rtl.is_set(self.pins.ready_o) {
                break;
            }
            self.edge()?;
        }
        self.bench.expect(self.pins.ready_o, true)?;
        self.bench.rtl.set(self.pins.start_i, true);
        self.bench.rtl.settle();
        self.edge()?;
        self.bench.rtl.set(self.pins.start_i, false);
        Ok(())
    }

    /// Lets the lines under way come, and clears the unit.
    ///
    /// # Errors
    /// If the RTL fails.
    pub fn clear(&mut self) -> Result<(), Stop> {
        let under_way = (0..self.asked.len() as u64).filter(|&i| self.asked[i as usize].is_some());
        for number in under_way.collect::<Vec<_>>() {
            self.set(&Cycle { response: Some(number), ..Cycle::default() });
            self.bench.rtl.settle();
            self.edge()?;
        }
        self.set(&Cycle::default());
        self.bench.rtl.set(self.pins.clear_i, true);
        self.bench.rtl.settle();
        self.edge()?;
        self.bench.rtl.set(self.pins.clear_i, false);
        Ok(())
    }

    fn set(&mut self, cycle: &Cycle) {
        self.given = *cycle;
        let (pins, rtl) = (&self.pins, &mut self.bench.rtl);
        rtl.set(pins.rd_ready_i, cycle.read_ready);
        rtl.set(pins.wr_ready_i, cycle.write_ready);
        rtl.set(pins.item_ready_i, cycle.item_ready);
        rtl.set(pins.quiet_i, cycle.quiet);
        let line = cycle.response.and_then(|number| self.asked.get_mut(number as usize)?.take());
        rtl.set(pins.rsp_valid_i, line.is_some());
        if let Some((tag, bytes)) = line {
            rtl.set(pins.rsp_tag_i, tag);
            rtl.set_bytes(pins.rsp_data_i, &bytes);
        }
    }

    fn compare(&self, cycle: &Cycle) -> Result<(), Stop> {
        let Self { bench, pins, .. } = self;
        bench.expect(pins.rd_valid_o, cycle.read.is_some())?;
        if let Some(addr) = cycle.read {
            bench.expect(pins.rd_addr_o, addr)?;
        }
        bench.expect(pins.wr_valid_o, cycle.write.is_some())?;
        if let Some(addr) = cycle.write {
            bench.expect(pins.wr_addr_o, addr)?;
        }
        bench.expect(pins.item_valid_o, cycle.item.is_some())?;
        if let Some(item) = cycle.item {
            bench.expect_bytes(pins.item_o, &record_bytes(&item))?;
            bench.expect(pins.item_split_o, split(self.before, item.code))?;
        }
        bench.expect(pins.end_o, cycle.end)?;
        bench.expect(pins.primitive_error_o, false)?;
        bench.expect(pins.region_error_o, false)
    }

    /// Ends the cycle; lines that were taken go to memory, or will come from it.
    fn edge(&mut self) -> Result<(), Stop> {
        let (pins, rtl) = (&self.pins, &self.bench.rtl);
        let line = |addr: u64| addr as usize..(addr as usize + LINE_BYTES as usize);
        if rtl.is_set(pins.wr_valid_o) && self.given.write_ready {
            let (data, strobes) = (rtl.bytes(pins.wr_data_o), rtl.get(pins.wr_strb_o));
            let target = &mut self.memory.bytes_mut()[line(rtl.get(pins.wr_addr_o))];
            for (i, (to, from)) in target.iter_mut().zip(data).enumerate() {
                if strobes >> i & 1 != 0 {
                    *to = from;
                }
            }
        }
        if rtl.is_set(pins.rd_valid_o) && self.given.read_ready {
            let bytes = self.memory.bytes()[line(rtl.get(pins.rd_addr_o))].to_vec();
            self.asked.push(Some((rtl.get(pins.rd_tag_o), bytes)));
        }
        self.bench.edge()
    }

    /// Sorts without a model for `cycles` cycles, behind a memory that answers at once. Gives the errors, of a primitive with its index, and of a region; and memory.
    ///
    /// # Errors
    /// If the RTL fails.
    pub fn fail(
        &mut self,
        job: &Job,
        cycles: u64,
    ) -> Result<(Option<u64>, bool, &FlatMemory), Stop> {
        self.start(job)?;
        let mut come = VecDeque::new();
        for _ in 0..cycles {
            let asked = self.asked.len() as u64;
            let response = come.pop_front();
            let ready =
                Cycle { read_ready: true, write_ready: true, item_ready: true, ..Cycle::default() };
            let cycle = Cycle { quiet: true, response, ..ready };
            self.set(&cycle);
            self.bench.rtl.settle();
            self.edge()?;
            come.extend(asked..self.asked.len() as u64);
        }
        let (pins, rtl) = (&self.pins, &self.bench.rtl);
        let index = rtl.is_set(pins.primitive_error_o).then(|| rtl.get(pins.error_index_o));
        let region = rtl.is_set(pins.region_error_o);
        Ok((index, region, &self.memory))
    }
}
