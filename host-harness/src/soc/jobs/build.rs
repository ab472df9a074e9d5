//! Builds: the clocked MergeTree between the registers and memory, with the streaming compressor behind it where
//! the job asks for that.

use xylem_core::compress::{Compression, Repairs};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::node::Quantization;
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildRegions;
use xylem_core::probe;
use xylem_core::sort::InputFormat;
use xylem_regs::{self as regs, ErrorCode, JobKind, RegionId, Stage};

use super::memory::MemoryPort;
use super::{COUNTERS, Failure, JobRun, Parameters, Results, Site, bus_code};
use crate::machine::config::MachineConfig;
use crate::machine::job;
use crate::machine::mergetree::{MachineError, MachineRun};
use crate::machine::port::{LINE_BYTES, PortError};
use crate::soc::AcceleratorConfig;

/// Builds on a copy of memory.
pub fn run(machine: &MachineConfig, with: &Parameters, site: Site<'_>) -> JobRun {
    let regions = BuildRegions {
        primitives: with.inside(RegionId::Primitives),
        runs_a: with.inside(RegionId::RunsA),
        runs_b: with.inside(RegionId::RunsB),
        nodes: with.inside(with.nodes_go_to()),
        leaf_table: with.inside(RegionId::LeafTable),
    };
    let mut copy = site.copy(with);
    let port = MemoryPort::new(site);
    let job = job::build(machine, &mut copy, &regions, with.primitives, port);
    let outputs = [regions.runs_a, regions.runs_b, regions.nodes, regions.leaf_table];
    let written = outputs.iter().map(|out| (out.base.0 as usize, copy.region(*out).to_vec()));
    let written = written.filter(|(_, bytes)| !bytes.is_empty()).collect();
    let mut counts = [0; COUNTERS];
    let cycles = job.cycles;
    (counts[0], counts[1]) = (cycles, job.lines_read * u64::from(LINE_BYTES));
    let mut stages = vec![(0, Stage::Sort)];
    let outcome = match (job.unit, job.drained) {
        (Err(error), _) => Err(with.failure(error)),
        (Ok(_), Err(lost)) => Err(with.lost(lost)),
        (Ok(run), Ok(())) => {
            let replaces = heap_replaces(machine, with.primitives);
            let (nodes, leaves) = (run.tree.node_count.into(), run.tree.leaf_count.into());
            let wrote = run.traffic.total().write_bytes;
            counts[2..7].copy_from_slice(&[
                wrote,
                nodes,
                leaves,
                replaces,
                run.compressor.backtracks(),
            ]);
            stages.extend(milestones(&run));
            Ok(with.results(&run))
        }
    };
    JobRun { cycles, stages, outcome, written, counts }
}

/// When its later stages begin. Further passes are taken to be equally long.
fn milestones(run: &MachineRun) -> [(u64, Stage); 2] {
    let cycles = |stage| run.traffic.stage(stage).millicycles / 1000;
    let sorted = cycles(probe::Stage::PartialSort);
    let passes = u64::from(run.passes);
    let merged = sorted + cycles(probe::Stage::Merge) * passes / (passes + 1);
    [(sorted, Stage::Merge), (merged, Stage::Emit)]
}

/// The machine that does a build of these parameters, or `None` if that is not what it does.
pub fn machine(config: &AcceleratorConfig, with: &Parameters) -> Option<MachineConfig> {
    let Parameters { format, limits, .. } = with;
    let compression = match with.job {
        Some(JobKind::Build) => None,
        Some(JobKind::BuildCompressed) if config.treelet_depth > 0 => {
            let depth = config.treelet_depth;
            Some(compression(with, depth)).filter(|_| limits.treelet_depth() == depth)
        }
        _ => return None,
    };
    let morton = match limits.morton_bits() {
        30 => MortonWidth::Bits30,
        63 if config.code_bits >= 63 => MortonWidth::Bits63,
        _ => return None,
    };
    let input = with.input()?;
    let compresses = with.job == Some(JobKind::BuildCompressed);
    let fits = compresses == compression.is_some()
        && (1..1 << 27).contains(&with.primitives)
        && format.record() == Ok(regs::RecordFormat::Box32)
        && limits.leaf_size() > 0;
    fits.then(|| config.machine(input, morton, limits.leaf_size().into(), compression))
}

/// How nodes are compressed.
fn compression(with: &Parameters, treelet_depth: u8) -> Compression {
    let quantization = match with.format.coords() {
        Ok(regs::CoordMode::Modulo) => Quantization::MODULO,
        _ => Quantization::RELATIVE,
    };
    let repairs = Repairs::InMemory;
    Compression { quantization, treelet_depth, margin: Compression::MARGIN, repairs }
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

impl Parameters {
    /// What its input consists of, if the map has that.
    fn input(&self) -> Option<InputFormat> {
        Some(match self.format.input().ok()? {
            regs::InputFormat::Aabb => InputFormat::Box32,
            regs::InputFormat::Triangle => InputFormat::Triangle40,
        })
    }

    /// Where the nodes of a build go.
    fn nodes_go_to(&self) -> RegionId {
        match self.job {
            Some(JobKind::BuildCompressed) => RegionId::Quantized,
            _ => RegionId::Nodes,
        }
    }

    fn results(&self, run: &MachineRun) -> Results {
        let (nodes, leaves) = (run.tree.node_count, run.tree.leaf_count);
        let counts = match self.nodes_go_to() {
            RegionId::Quantized => [0, leaves, nodes, 0],
            _ => [nodes, leaves, 0, 0],
        };
        Results { root: run.tree.root, counts }
    }

    /// What the registers say of an error.
    fn failure(&self, error: MachineError) -> Failure {
        let base = |id: RegionId| self.regions[id as usize].base.0;
        match error {
            MachineError::Config(_) => Failure::of(ErrorCode::BadConfig),
            // Regions start on lines, so this one is not in memory.
            MachineError::Alignment(name) => {
                let id = self.region_id(name);
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
                let id = self.region_id(region);
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
                let bytes = self.input().map_or(0, InputFormat::bytes);
                let offset = index.0.wrapping_mul(bytes);
                let addr = self.regions[id as usize].base.0.wrapping_add(offset);
                let code = ErrorCode::BadPrimitive;
                Failure { code, stage: Stage::Sort, region: Some(id), addr }
            }
            BuildError::Bus { stage, addr, error } => {
                let stage = match stage {
                    probe::Stage::PartialSort => Stage::Sort,
                    probe::Stage::Merge => Stage::Merge,
                    _ => Stage::Emit,
                };
                let addr = addr.0.wrapping_add(self.origin);
                Failure { stage, addr, ..Failure::of(bus_code(error)) }
            }
            // A line that was read back for a repair is not one that was written.
            BuildError::CorruptNode { .. } => {
                let (code, region) = (ErrorCode::CorruptNode, Some(RegionId::Quantized));
                Failure { code, stage: Stage::Emit, region, addr: 0 }
            }
            BuildError::Config(_) | BuildError::PointerOverflow => {
                Failure::of(ErrorCode::BadConfig)
            }
            _ => Failure { stage: Stage::Emit, ..Failure::of(ErrorCode::StackOverflow) },
        }
    }

    fn region_id(&self, name: RegionName) -> Option<RegionId> {
        Some(match name {
            RegionName::Primitives => RegionId::Primitives,
            RegionName::RunsA => RegionId::RunsA,
            RegionName::RunsB => RegionId::RunsB,
            RegionName::Nodes | RegionName::QuantizedNodes => self.nodes_go_to(),
            RegionName::LeafTable => RegionId::LeafTable,
            RegionName::Triangles => return None,
        })
    }
}
