//! Tracing a region of rays: `xy_traverser`'s model between the registers and memory.

use glam::IVec3;
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Bvh2Node, LeafEntry, NodeFormat, Quantization, Subtree, Tree};
use xylem_core::traverse::{Hit, Query, Scene};
use xylem_regs::{self as regs, ErrorCode, JobKind, RegionId, Stage};

use super::memory::MemoryPort;
use super::{Failure, JobRun, Parameters, Results, Site, bus_code};
use crate::machine::job;
use crate::machine::port::LINE_BYTES;
use crate::machine::traverser::script::Records;
use crate::machine::traverser::{Stop, TraverserConfig, TraverserError, TraverserJob};
use crate::soc::AcceleratorConfig;

/// Counts are below this, so that no address needs more than 32 bits.
const COUNT_LIMIT: u32 = 1 << 26;

/// The unit that does a trace of these parameters, or `None` if that is not what there is.
pub fn unit(config: &AcceleratorConfig, with: &Parameters) -> Option<TraverserConfig> {
    let counts = [with.rays, with.primitives, with.nodes, with.entries];
    let some = with.rays > 0 && with.primitives > 0;
    let fits = with.job == Some(JobKind::Trace) && some && counts.iter().all(|&n| n < COUNT_LIMIT);
    config.traverser.filter(|_| fits)
}

/// Traces on a copy of memory, which is given up after `time_out` cycles.
pub fn run(unit: TraverserConfig, time_out: u64, with: &Parameters, site: Site<'_>) -> JobRun {
    let of = |records| Some(with.region_of(records));
    let may = |records: Option<Records>, addr: u32| {
        let id = records.and_then(of).unwrap_or(RegionId::Hits);
        let Region { base: ByteAddr(base), size } = with.inside(id);
        addr.wrapping_sub(base) < size
    };
    let mut copy = site.copy(with);
    let trace = with.traverser_job();
    let done = job::trace(unit, &mut copy, trace, MemoryPort::new(site), may, time_out);
    let (run, result) = done.unit;
    let ended = result.map_err(|stop| with.stopped(stop));
    let ended = ended.and_then(|()| done.drained.map_err(|lost| with.lost(lost)));
    let hits = with.inside(RegionId::Hits);
    let size = hits.size.min(bytes(with.rays, Hit::BYTES));
    let written = copy.region(Region { size, ..hits }).to_vec();
    let cycles = done.cycles;
    let read = done.lines_read * u64::from(LINE_BYTES);
    let results = Results { root: None, counts: [0, 0, 0, run.hits] };
    JobRun {
        cycles,
        stages: vec![(0, Stage::Trace)],
        outcome: ended.map(|()| results),
        written: if written.is_empty() {
            Vec::new()
        } else {
            vec![(hits.base.0 as usize, written)]
        },
        counts: [
            cycles,
            read,
            run.write_bytes,
            0,
            0,
            0,
            0,
            run.nodes,
            run.box_tests,
            run.triangle_tests,
        ],
    }
}

impl Parameters {
    /// The format of the nodes to walk.
    fn node_format(&self) -> NodeFormat {
        match (self.format.node(), self.format.coords()) {
            (Ok(regs::NodeFormat::Bvh2), _) => NodeFormat::Bvh2,
            (_, Ok(regs::CoordMode::Modulo)) => NodeFormat::Quantized(Quantization::MODULO),
            _ => NodeFormat::Quantized(Quantization::RELATIVE),
        }
    }

    /// Where records are, and hits where there are none.
    fn region_of(&self, records: Records) -> RegionId {
        match records {
            Records::Rays => RegionId::Rays,
            Records::Nodes if self.node_format() == NodeFormat::Bvh2 => RegionId::Nodes,
            Records::Nodes => RegionId::Quantized,
            Records::Entries => RegionId::LeafTable,
            Records::Triangles => RegionId::Primitives,
        }
    }

    /// The bytes of one.
    fn stride(&self, records: Records) -> u32 {
        match records {
            Records::Rays => Ray::BYTES as u32,
            Records::Nodes => self.node_format().bytes(),
            Records::Entries => LeafEntry::BYTES as u32,
            Records::Triangles => Triangle::BYTES as u32,
        }
    }

    /// The job as the unit sees it, in memory's own addresses. The unit knows counts, not sizes: each
    /// region is as long as its count says, and what is outside of the job's region is not read.
    fn traverser_job(&self) -> TraverserJob {
        let place = |records, count: u32| Region {
            base: self.inside(self.region_of(records)).base,
            size: bytes(count, self.stride(records) as usize),
        };
        let grid = |corner: IVec3| corner.map(|c| c << (32 - GRID_BITS) >> (32 - GRID_BITS));
        let Aabb { min, max } = self.root.bounds;
        let bounds = Aabb { min: grid(min), max: grid(max) };
        let tree = Tree {
            format: self.node_format(),
            root: Some(Subtree { bounds, ..self.root }),
            node_count: self.nodes,
            leaf_count: 0,
            entry_count: self.entries,
            nodes: place(Records::Nodes, self.nodes),
            leaf_table: place(Records::Entries, self.entries),
        };
        let triangles = place(Records::Triangles, self.primitives);
        let query = match self.format.query() {
            Ok(regs::Query::Any) => Query::Any,
            _ => Query::Closest,
        };
        TraverserJob {
            scene: Scene { tree, triangles, triangle_count: self.primitives },
            query,
            rays: self.inside(RegionId::Rays).base,
            ray_count: self.rays,
            hits: self.inside(RegionId::Hits).base,
        }
    }

    /// What the registers say of an end before all rays are traced.
    fn stopped(&self, stop: Stop) -> Failure {
        let stage = Stage::Trace;
        let at = |code, records, index: u32| {
            let id = self.region_of(records);
            let offset = index.wrapping_mul(self.stride(records));
            let addr = self.region(id).base.0.wrapping_add(offset);
            Failure { code, stage, region: Some(id), addr }
        };
        match stop {
            Stop::Unit(TraverserError::BadRay(ray)) => at(ErrorCode::BadRay, Records::Rays, ray),
            Stop::Unit(TraverserError::CorruptNode(node)) => {
                at(ErrorCode::CorruptNode, Records::Nodes, node)
            }
            Stop::Unit(TraverserError::CorruptLeaf(entry)) => {
                at(ErrorCode::CorruptNode, Records::Entries, entry)
            }
            Stop::Unit(TraverserError::CorruptTriangle(index)) => {
                at(ErrorCode::BadPrimitive, Records::Triangles, index)
            }
            // Lines that are not there end a job before the unit misses them.
            Stop::Unit(TraverserError::Regions) => Failure::of(ErrorCode::BadConfig),
            Stop::Outside { records, addr } => {
                let region = records.map_or(RegionId::Hits, |records| self.region_of(records));
                let addr = addr.wrapping_add(self.origin);
                Failure { code: ErrorCode::OutOfRegion, stage, region: Some(region), addr }
            }
            Stop::Port { error, addr } => {
                let addr = addr.wrapping_add(self.origin);
                Failure { stage, addr, ..Failure::of(bus_code(error)) }
            }
        }
    }
}

/// Bits of a root coordinate that are looked at.
const GRID_BITS: u32 = 24;

/// Bytes of `count` records, at most as many as fit 32 bits: counts are bounded.
fn bytes(count: u32, stride: usize) -> u32 {
    count.saturating_mul(stride as u32)
}

const _: () = assert!(Bvh2Node::BYTES as u64 * COUNT_LIMIT as u64 <= 1 << 32);
