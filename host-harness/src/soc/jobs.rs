//! The jobs of the simulated accelerator: registers in, bytes and cycles out.

use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Child, NodeIndex, Tree};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildRegions;
use xylem_core::probe;
use xylem_core::sort::InputFormat;
use xylem_regs::{
    self as regs, ErrorCode, JobFormat, JobKind, JobLimits, REGION_ALIGN, RegionId, Stage,
};

use super::AcceleratorConfig;
use crate::bus::FlatMemory;
use crate::machine::config::MachineConfig;
use crate::machine::mergetree::{self, MachineError};
use crate::machine::port::{Access, IdealPort, LINE_BYTES, Port, PortError, Response};

/// `cap.features`: builds from boxes, runs of 32-byte boxes, and counters.
pub const FEATURES: u32 = 1 | 1 << 4 | 1 << 8 | 1 << 20;

/// Cycles that a job takes beside its unit's: one for each pair of regions that is compared before it, and
/// two around it.
const OVERHEAD: u64 = (RegionId::ALL.len() * (RegionId::ALL.len() - 1) / 2 + 2) as u64;

/// What a job reads from its registers.
#[derive(Clone, Copy, Debug)]
pub struct Parameters {
    /// What memory's first byte is called on the bus.
    pub origin: u32,
    /// What to do; `None` for a job that the map does not have.
    pub job: Option<JobKind>,
    /// `job.primitives`.
    pub primitives: u32,
    /// `job.format`.
    pub format: JobFormat,
    /// `job.limits`.
    pub limits: JobLimits,
    /// By [`RegionId`].
    pub regions: [Region; RegionId::ALL.len()],
}

/// What a job comes to.
#[derive(Debug)]
pub struct JobRun {
    /// Cycles from its start to its end.
    pub cycles: u64,
    /// Cycles until it has sorted blocks, and until the last merge begins.
    milestones: [u64; 2],
    /// The tree, or why there is none.
    pub outcome: Result<Tree, Failure>,
    /// What it wrote, by position in memory.
    pub written: Vec<(usize, Vec<u8>)>,
    /// What it counted, in the order of the counters.
    pub counts: [u64; 6],
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
    /// The stage `after` so many cycles. Further passes are taken to be equally long.
    pub fn stage_at(&self, after: u64) -> Stage {
        let [sorted, merged] = self.milestones;
        match after {
            _ if after < sorted => Stage::Sort,
            _ if after < merged => Stage::Merge,
            _ => Stage::Emit,
        }
    }

    /// A job that ends before anything is touched.
    fn refused(region: Option<RegionId>) -> Self {
        let failure = Failure { region, ..Failure::of(ErrorCode::BadConfig) };
        let mut counts = [0; 6];
        counts[0] = OVERHEAD;
        Self {
            cycles: OVERHEAD,
            milestones: [0; 2],
            outcome: Err(failure),
            written: Vec::new(),
            counts,
        }
    }
}

/// Runs a job on a copy of `memory`.
pub fn run(
    config: &AcceleratorConfig,
    latency: u32,
    with: &Parameters,
    memory: &FlatMemory,
) -> JobRun {
    let Some(machine) = machine(config, with) else { return JobRun::refused(None) };
    if let Some(region) = first_bad_region(&with.regions) {
        return JobRun::refused(Some(region));
    }
    let regions = BuildRegions {
        primitives: with.inside(RegionId::Primitives),
        runs_a: with.inside(RegionId::RunsA),
        runs_b: with.inside(RegionId::RunsB),
        nodes: with.inside(RegionId::Nodes),
        leaf_table: with.inside(RegionId::LeafTable),
    };
    let mut copy = memory.clone();
    let mut port = Counted::new(IdealPort::new(latency));
    let built = mergetree::build(&machine, &mut copy, &regions, with.primitives, &mut port);
    let outputs = [regions.runs_a, regions.runs_b, regions.nodes, regions.leaf_table];
    let written = outputs.iter().map(|out| (out.base.0 as usize, copy.region(*out).to_vec()));
    let written = written.filter(|(_, bytes)| !bytes.is_empty()).collect();
    let (ticks, read) = (port.ticks, port.reads * u64::from(LINE_BYTES));
    let cycles = ticks + OVERHEAD;
    match built {
        Ok(run) => {
            let sorted = run.traffic.stage(probe::Stage::PartialSort).millicycles / 1000;
            let merges = run.traffic.stage(probe::Stage::Merge).millicycles / 1000;
            let passes = u64::from(run.passes);
            let merged = sorted + merges * passes / (passes + 1);
            let wrote = run.traffic.total().write_bytes;
            let tree = run.tree;
            let (nodes, leaves) = (u64::from(tree.node_count), u64::from(tree.leaf_count));
            let replaces = heap_replaces(&machine, with.primitives);
            let counts = [cycles, read, wrote, nodes, leaves, replaces];
            JobRun { cycles, milestones: [sorted, merged], outcome: Ok(tree), written, counts }
        }
        Err(error) => JobRun {
            cycles,
            milestones: [cycles; 2],
            outcome: Err(with.failure(error)),
            written,
            counts: [cycles, read, 0, 0, 0, 0],
        },
    }
}

/// The machine that does a build of these parameters, or `None` if that is not what it does.
fn machine(config: &AcceleratorConfig, with: &Parameters) -> Option<MachineConfig> {
    let Parameters { format, limits, .. } = with;
    let morton = match limits.morton_bits() {
        30 => MortonWidth::Bits30,
        63 if config.code_bits >= 63 => MortonWidth::Bits63,
        _ => return None,
    };
    let fits = with.job == Some(JobKind::Build)
        && (1..1 << 27).contains(&with.primitives)
        && format.input() == Ok(regs::InputFormat::Aabb)
        && format.record() == Ok(regs::RecordFormat::Box32)
        && limits.leaf_size() > 0;
    fits.then(|| config.machine(morton, limits.leaf_size().into()))
}

/// A region that passes the end of the address space, or shares bytes with one before it.
fn first_bad_region(regions: &[Region]) -> Option<RegionId> {
    let end = |region: &Region| u64::from(region.base.0) + u64::from(region.size);
    let used = || RegionId::ALL.into_iter().zip(regions).filter(|(_, region)| region.size > 0);
    let past = used().find(|(_, region)| end(region) > 1 << 32);
    let overlaps = |(id, region): &(RegionId, &Region)| {
        used().any(|(other, before)| {
            (other as u8) < *id as u8
                && u64::from(before.base.0) < end(region)
                && u64::from(region.base.0) < end(before)
        })
    };
    past.or_else(|| used().find(overlaps)).map(|(id, _)| id)
}

/// How often the merges replace the top of their heap: for every record but the last of its input,
/// a piece of the scratchpad or a run.
fn heap_replaces(machine: &MachineConfig, count: u32) -> u64 {
    let mut inputs = count.div_ceil(machine.build.sort.piece());
    let mut replaces = u64::from(count - inputs);
    inputs = count.div_ceil(machine.run_len());
    for _ in 0..=machine.further_passes(count) {
        replaces += u64::from(count - inputs);
        inputs = inputs.div_ceil(machine.width());
    }
    replaces
}

/// A child as the root's two registers hold it: an index, and the size of a leaf or 0.
pub fn pointer(child: Child) -> (u32, u32) {
    match child {
        Child::Inner(NodeIndex(index)) => (index, 0),
        Child::Leaf { first, count } => (first, count),
    }
}

impl Parameters {
    /// A region by its place in memory.
    fn inside(&self, id: RegionId) -> Region {
        let region = self.regions[id as usize];
        Region { base: ByteAddr(region.base.0.wrapping_sub(self.origin)), ..region }
    }

    /// What the registers say of an error.
    fn failure(&self, error: MachineError) -> Failure {
        let base = |id: RegionId| self.regions[id as usize].base.0;
        match error {
            MachineError::Config(_) => Failure::of(ErrorCode::BadConfig),
            // Regions start on lines, so this one is not in memory.
            MachineError::Alignment(name) => {
                let id = region_id(name);
                let (code, stage) = match name {
                    RegionName::Primitives => (ErrorCode::BusRead, Stage::Sort),
                    RegionName::RunsA => (ErrorCode::BusWrite, Stage::Sort),
                    RegionName::RunsB => (ErrorCode::BusWrite, Stage::Merge),
                    _ => (ErrorCode::BusWrite, Stage::Emit),
                };
                Failure { stage, addr: id.map_or(0, base), ..Failure::of(code) }
            }
            MachineError::Build(error) => self.build_failure(error),
        }
    }

    fn build_failure(&self, error: BuildError<PortError>) -> Failure {
        match error {
            BuildError::RegionFull { region, .. } => {
                let id = region_id(region);
                let (code, stage) = match region {
                    RegionName::Primitives => (ErrorCode::OutOfRegion, Stage::Sort),
                    RegionName::RunsA => (ErrorCode::RegionFull, Stage::Sort),
                    RegionName::RunsB => (ErrorCode::RegionFull, Stage::Merge),
                    _ => (ErrorCode::RegionFull, Stage::Emit),
                };
                Failure { stage, region: id, ..Failure::of(code) }
            }
            BuildError::InvalidPrimitive { index } => {
                let id = RegionId::Primitives;
                let offset = index.0.wrapping_mul(InputFormat::Box32.bytes());
                let addr = self.regions[id as usize].base.0.wrapping_add(offset);
                let code = ErrorCode::BadPrimitive;
                Failure { code, stage: Stage::Sort, region: Some(id), addr }
            }
            BuildError::Bus { stage, addr, error } => {
                let code = match error {
                    PortError::Read => ErrorCode::BusRead,
                    PortError::Write => ErrorCode::BusWrite,
                    PortError::TimeOut => ErrorCode::BusTimeout,
                };
                let stage = match stage {
                    probe::Stage::PartialSort => Stage::Sort,
                    probe::Stage::Merge => Stage::Merge,
                    _ => Stage::Emit,
                };
                let addr = addr.0.wrapping_add(self.origin);
                Failure { stage, addr, ..Failure::of(code) }
            }
            BuildError::Config(_) | BuildError::PointerOverflow => {
                Failure::of(ErrorCode::BadConfig)
            }
            _ => Failure { stage: Stage::Emit, ..Failure::of(ErrorCode::StackOverflow) },
        }
    }
}

fn region_id(name: RegionName) -> Option<RegionId> {
    Some(match name {
        RegionName::Primitives => RegionId::Primitives,
        RegionName::RunsA => RegionId::RunsA,
        RegionName::RunsB => RegionId::RunsB,
        RegionName::Nodes => RegionId::Nodes,
        RegionName::LeafTable => RegionId::LeafTable,
        RegionName::QuantizedNodes => RegionId::Quantized,
        RegionName::Triangles => return None,
    })
}

// Addresses are moved by whole lines.
const _: () = assert!(REGION_ALIGN == LINE_BYTES);

/// A port that counts its cycles and the lines that were read.
#[derive(Debug)]
struct Counted<P> {
    port: P,
    ticks: u64,
    reads: u64,
}

impl<P> Counted<P> {
    const fn new(port: P) -> Self {
        Self { port, ticks: 0, reads: 0 }
    }
}

impl<P: Port> Port for Counted<P> {
    fn offer(&mut self, access: Access) -> bool {
        let taken = self.port.offer(access);
        self.reads += u64::from(taken && !access.write);
        taken
    }

    fn take(&mut self) -> Option<Response> {
        self.port.take()
    }

    fn tick(&mut self) {
        self.ticks += 1;
        self.port.tick();
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        self.port.peak_bytes_per_cycle()
    }
}
