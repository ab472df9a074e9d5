//! The jobs of the simulated accelerator: registers in, bytes and cycles out.

mod build;
mod memory;
mod trace;

use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Child, NodeIndex, Subtree};
use xylem_regs::{ErrorCode, JobFormat, JobKind, JobLimits, REGION_ALIGN, RegionId, Stage};

use super::AcceleratorConfig;
use crate::bus::FlatMemory;
use crate::machine::fault::Fault;
use crate::machine::job::Lost;
use crate::machine::port::{LINE_BYTES, PortError};

/// Event counters, in the order of the registers.
pub const COUNTERS: usize = 10;

/// What a job reads from its registers.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// What memory's first byte is called on the bus.
    pub origin: u32,
    /// What to do; `None` for a job that the map does not have.
    pub job: Option<JobKind>,
    /// `job.primitives`.
    pub primitives: u32,
    /// `job.rays`.
    pub rays: u32,
    /// `job.nodes`.
    pub nodes: u32,
    /// `job.entries`.
    pub entries: u32,
    /// `job.format`.
    pub format: JobFormat,
    /// `job.limits`.
    pub limits: JobLimits,
    /// `root`.
    pub root: Subtree,
    /// By [`RegionId`].
    pub regions: [Region; RegionId::ALL.len()],
}

impl Parameters {
    /// A region by its place in memory.
    fn inside(&self, id: RegionId) -> Region {
        let region = self.region(id);
        Region { base: ByteAddr(region.base.0.wrapping_sub(self.origin)), ..region }
    }

    /// A region as the registers say it.
    fn region(&self, id: RegionId) -> Region {
        self.regions[id as usize]
    }

    /// What the registers say of a line that was not written when its unit had ended.
    fn lost(&self, Lost { error, addr }: Lost) -> Failure {
        let addr = addr.wrapping_add(self.origin);
        Failure { stage: Stage::Drain, addr, ..Failure::of(bus_code(error)) }
    }
}

/// What the registers call what memory did.
const fn bus_code(error: PortError) -> ErrorCode {
    match error {
        PortError::Read => ErrorCode::BusRead,
        PortError::Write => ErrorCode::BusWrite,
        PortError::TimeOut => ErrorCode::BusTimeout,
    }
}

/// The memory that jobs see.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// What is in it.
    pub memory: &'a FlatMemory,
    /// Cycles to its answers.
    pub latency: u32,
    /// What goes wrong with it in this job, if anything.
    pub fault: Option<Fault>,
}

impl Site<'_> {
    /// A copy of memory as far as the job's regions reach; nothing behind them is touched.
    fn copy(&self, with: &Parameters) -> FlatMemory {
        let bytes = self.memory.bytes();
        let ends = RegionId::ALL.into_iter().map(|id| {
            let Region { base, size } = with.inside(id);
            base.0 as usize + size as usize
        });
        let end = ends.filter(|end| *end <= bytes.len()).max().unwrap_or_default();
        let mut copy = FlatMemory::new(end);
        copy.bytes_mut().copy_from_slice(&bytes[..end]);
        copy
    }
}

/// What a job comes to.
#[derive(Debug)]
pub struct JobRun {
    /// Cycles from its start to its end.
    pub cycles: u64,
    /// Its stages and when each begins.
    stages: Vec<(u64, Stage)>,
    /// What it leaves in the registers, or why it failed.
    pub outcome: Result<Results, Failure>,
    /// What it wrote, by position in memory.
    pub written: Vec<(usize, Vec<u8>)>,
    /// What it counted, in the order of the counters.
    pub counts: [u64; COUNTERS],
}

/// What a job that ends well leaves in the registers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Results {
    /// The root of a tree that was built.
    pub root: Option<Subtree>,
    /// `result.nodes`, `leaves`, `quantized` and `hits`.
    pub counts: [u32; 4],
}

/// How a job failed, as the registers say it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Failure {
    /// `error_info.code`.
    pub code: ErrorCode,
    /// `error_info.stage`.
    pub stage: Stage,
    /// `error_info.region`.
    pub region: Option<RegionId>,
    /// `error_addr`.
    pub addr: u32,
}

impl Failure {
    /// A failure while nothing ran, that concerns no place.
    pub const fn of(code: ErrorCode) -> Self {
        Self { code, stage: Stage::Idle, region: None, addr: 0 }
    }
}

impl JobRun {
    /// The stage `after` so many cycles.
    pub fn stage_at(&self, after: u64) -> Stage {
        let begun = self.stages.iter().take_while(|(at, _)| *at <= after).last();
        begun.map_or(Stage::Idle, |(_, stage)| *stage)
    }

    /// A job whose check ends it after so many cycles, before anything is touched.
    fn refused(checked: u64, region: Option<RegionId>) -> Self {
        let failure = Failure { region, ..Failure::of(ErrorCode::BadConfig) };
        let mut counts = [0; COUNTERS];
        // And one in which memory is seen to be quiet.
        let cycles = checked + 1;
        counts[0] = cycles;
        Self { cycles, stages: Vec::new(), outcome: Err(failure), written: Vec::new(), counts }
    }
}

/// `cap.features`: builds from boxes and triangles, runs of 32-byte boxes, and counters; compressing builds and traces
/// where there are units.
pub fn features(config: &AcceleratorConfig) -> u32 {
    let compresses = if config.treelet_depth > 0 { 1 << 3 } else { 0 };
    let traces = if config.traverser.is_some() { 1 << 2 | 1 << 12 | 1 << 13 } else { 0 };
    let coordinates = if compresses | traces > 0 { 1 << 16 | 1 << 17 } else { 0 };
    1 | 1 << 4 | 1 << 5 | 1 << 8 | 1 << 20 | compresses | traces | coordinates
}

/// Runs a job on a copy of memory.
pub fn run(config: &AcceleratorConfig, with: &Parameters, site: Site<'_>) -> JobRun {
    let (builder, tracer) = (build::machine(config, with), trace::unit(config, with));
    match (builder, tracer, first_bad_region(&with.regions)) {
        (None, None, _) => JobRun::refused(1, None),
        (_, _, Some((cycles, region))) => JobRun::refused(cycles, Some(region)),
        (Some(machine), ..) => build::run(&machine, with, site),
        (None, Some(unit), None) => trace::run(unit, config.time_out, with, site),
    }
}

/// The first of two regions, compared as the control does it, of which one passes the end of the address space
/// or both share bytes; and how many comparisons it takes to find it.
fn first_bad_region(regions: &[Region]) -> Option<(u64, RegionId)> {
    let end = |region: &Region| u64::from(region.base.0) + u64::from(region.size);
    let passes = |at: usize| end(&regions[at]) > 1 << 32;
    let overlap = |at: usize, other: usize| {
        let (one, two) = (&regions[at], &regions[other]);
        let some = one.size > 0 && two.size > 0;
        some && u64::from(one.base.0) < end(two) && u64::from(two.base.0) < end(one)
    };
    let pairs = (0..regions.len()).flat_map(|at| (at + 1..regions.len()).map(move |to| (at, to)));
    let mut bad = (1..).zip(pairs).filter_map(|(compared, (at, other))| {
        let region = if passes(at) { at } else { other };
        let refused = passes(at) || passes(other) || overlap(at, other);
        refused.then(|| (compared, RegionId::ALL[region]))
    });
    bad.next()
}

/// A child as the root's two registers hold it: an index, and the size of a leaf or 0.
pub fn pointer(child: Child) -> (u32, u32) {
    match child {
        Child::Inner(NodeIndex(index)) => (index, 0),
        Child::Leaf { first, count } => (first, count),
    }
}

/// What those registers hold.
pub fn child(index: u32, leaf_size: u32) -> Child {
    match leaf_size {
        0 => Child::Inner(NodeIndex(index)),
        count => Child::Leaf { first: index, count },
    }
}

// Addresses are moved by whole lines.
const _: () = assert!(REGION_ALIGN == LINE_BYTES);
