//! All jobs, and all that can go wrong with them.

use xylem_core::mem::Region;
use xylem_core::node::NodeFormat;
use xylem_core::traverse::Query;
use xylem_driver::{Completion, ConfigError, Micros, StartError, Xylem};
use xylem_firmware::report::{OUTPUTS, Output};
use xylem_regs::{JOB_FORMAT, JOB_LIMITS, REGION_PRIMITIVES_BASE};

use super::*;

const FORMATS: [NodeFormat; 3] = [
    NodeFormat::Bvh2,
    NodeFormat::Quantized(Quantization::RELATIVE),
    NodeFormat::Quantized(Quantization::MODULO),
];

#[test]
fn every_job_makes_what_the_software_makes_in_every_format() {
    let mut backtracks = 0;
    for (format, query) in FORMATS.into_iter().zip([Query::Closest, Query::Any, Query::Closest]) {
        for config in [AcceleratorConfig::SMALL, AcceleratorConfig::PAPER] {
            let (board, done) =
                board_of(config, &SceneBlob { format, query, ..scene(&config, 700) });
            let report = accelerate(&board, &done).expect("a job that ends well");
            assert!(report.is_equal(), "{} {format:?}: {report:?}", config.name);
            assert_eq!(report.outputs, [Some(true); OUTPUTS.len()]);
            assert_eq!(report.missing(config.treelet_depth).count(), 0);
            let counters = |part| report.parts[part as usize].map(|part| part.counters);
            let build = counters(Part::Build).expect("a build");
            let compressed = counters(Part::BuildCompressed).expect("a build");
            let trace = counters(Part::Trace).expect("a trace");
            assert_eq!((build.nodes, build.leaves), (compressed.nodes, compressed.leaves));
            assert_eq!((build.backtracks, build.heap_replaces), (0, compressed.heap_replaces));
            backtracks += compressed.backtracks;
            assert!(compressed.bytes_written < build.bytes_written);
            assert_eq!(trace.bytes_written, 24 * u64::from(done.report.rays));
            assert!(trace.node_fetches > 0 && trace.box_tests >= 2 * trace.node_fetches);
            assert!(trace.triangle_tests >= u64::from(done.report.hits) && done.report.hits > 0);
        }
    }
    assert!(backtracks > 0);
}

#[test]
fn what_the_accelerator_has_no_unit_for_stays_software() {
    let full = AcceleratorConfig::SMALL;
    let without_traverser = AcceleratorConfig { traverser: None, ..full };
    let without_compressor = AcceleratorConfig { treelet_depth: 0, ..full };
    let deeper = AcceleratorConfig { treelet_depth: 2, ..full };
    for (config, missing) in [
        (without_traverser, vec![Part::Trace]),
        (without_compressor, vec![Part::BuildCompressed]),
        (deeper, vec![Part::BuildCompressed]),
        (full, vec![]),
    ] {
        let (board, done) = board_of(config, &scene(&full, 100));
        let report = accelerate(&board, &done).expect("a job that ends well");
        assert!(report.is_equal(), "{report:?}");
        assert_eq!(report.missing(1).collect::<Vec<_>>(), missing);
        // Rays go through the software's tree where the accelerator makes none of its own.
        assert_eq!(report.outputs[Output::Hits as usize].is_some(), config.traverser.is_some());
        assert_eq!(report.outputs[Output::QuantizedNodes as usize].is_some(), {
            !missing.contains(&Part::BuildCompressed)
        });
    }
}

#[test]
fn a_scene_without_primitives_is_refused_by_the_driver() {
    let (board, done) = board(AcceleratorConfig::SMALL, 0);
    let error = ConfigError::Empty { what: "primitive list" };
    let error = AcceleratorError::Start { part: Part::Build, error: StartError::Config(error) };
    assert_eq!(accelerate(&board, &done), Err(error));
    assert_eq!(board.0.borrow().accelerator.read(STATUS.offset(), 0), 0);
}

/// A board whose last job was a trace of quantized nodes, described by its registers.
struct Bench {
    board: Board,
    driver: Xylem<Board, Board, Board>,
    kind: u32,
}

/// The driver's word for how the job ended.
type Waited = Result<Completion, WaitError<Infallible, Infallible>>;

impl Bench {
    /// With the registers of the trace, or of the build that compresses.
    fn new(traces: bool) -> Self {
        let config = AcceleratorConfig::SMALL;
        let config = if traces { config } else { AcceleratorConfig { traverser: None, ..config } };
        let (board, done) = board(config, 300);
        accelerate(&board, &done).expect("a job that ends well");
        let driver = Xylem::probe(board.clone(), board.clone(), board.clone());
        let kind = if traces { 4 } else { 3 };
        Self { driver: driver.expect("an accelerator"), board, kind }
    }

    fn register(&self, offset: u32) -> u32 {
        let parts = self.board.0.borrow();
        parts.accelerator.read(offset, parts.now)
    }

    fn set(&mut self, offset: u32, value: u32) {
        RegisterAccess::write(&mut self.board, offset, value).expect("a register");
    }

    fn region(&self, id: RegionId) -> Region {
        let at = base(id);
        Region::new(self.register(at), self.register(at + 4))
    }

    /// The bytes of a region from `offset` on.
    fn patch(&self, id: RegionId, offset: u32, bytes: &[u8]) -> Vec<u8> {
        let at = (self.region(id).base.0 + offset - EXTERNAL.base.0) as usize;
        let mut parts = self.board.0.borrow_mut();
        let place = &mut parts.memory.bytes_mut()[at..at + bytes.len()];
        let before = place.to_vec();
        place.copy_from_slice(bytes);
        before
    }

    fn run(&mut self, timeout: u32) -> Waited {
        self.set(CTRL.offset(), 1 | self.kind << 8);
        self.driver.wait(Micros(timeout))
    }

    /// What the job makes.
    fn output(&self) -> Vec<u8> {
        let output = if self.kind == 4 { RegionId::Hits } else { RegionId::Quantized };
        let output = self.region(output);
        let base = ByteAddr(output.base.0 - EXTERNAL.base.0);
        self.board.0.borrow().memory.region(Region { base, ..output }).to_vec()
    }

    /// Runs the job with a register changed, and once more without.
    fn with(&mut self, offset: u32, value: u32) -> JobError {
        let output = self.output();
        let before = self.register(offset);
        self.set(offset, value);
        let error = failed(self.run(100_000));
        self.set(offset, before);
        self.runs_clean(&output);
        error
    }

    /// Runs the job with bytes changed, and once more without.
    fn with_bytes(&mut self, id: RegionId, offset: u32, bytes: &[u8]) -> JobError {
        let output = self.output();
        let before = self.patch(id, offset, bytes);
        let error = failed(self.run(100_000));
        self.patch(id, offset, &before);
        self.runs_clean(&output);
        error
    }

    /// Runs the job with a fault in memory, and once more without.
    fn with_fault(&mut self, fault: Fault) -> Waited {
        let output = self.output();
        self.board.0.borrow_mut().accelerator.fault = Some(fault);
        let ended = self.run(100_000);
        self.runs_clean(&output);
        ended
    }

    fn runs_clean(&mut self, output: &[u8]) {
        self.run(100_000).expect("the next job runs clean");
        assert!(self.output() == output);
    }
}

fn base(id: RegionId) -> u32 {
    REGION_PRIMITIVES_BASE.offset() + 8 * id as u32
}

fn size(id: RegionId) -> u32 {
    base(id) + 4
}

fn failed(ended: Waited) -> JobError {
    match ended {
        Err(WaitError::Job(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_wrong_trace_ends_in_its_documented_code_and_the_next_runs_clean() {
    let mut bench = Bench::new(true);
    let start = |bench: &Bench, id| bench.region(id).base.0;
    let (nowhere, bad_config) = (0x4000_0000, ErrorCode::BadConfig);
    let out_of_region = ErrorCode::OutOfRegion;
    for (offset, value, code, region) in [
        (JOB_RAYS.offset(), 0, bad_config, None),
        (JOB_RAYS.offset(), 1 << 26, bad_config, None),
        (JOB_PRIMITIVES.offset(), 0, bad_config, None),
        (JOB_PRIMITIVES.offset(), 1 << 26, bad_config, None),
        (JOB_NODES.offset(), 1 << 26, bad_config, None),
        (JOB_ENTRIES.offset(), 1 << 26, bad_config, None),
        (base(RegionId::Hits), start(&bench, RegionId::Rays), bad_config, Some(RegionId::Hits)),
        (size(RegionId::Hits), 1 << 31, bad_config, Some(RegionId::Hits)),
        (size(RegionId::Rays), 0, out_of_region, Some(RegionId::Rays)),
        (size(RegionId::Rays), 64, out_of_region, Some(RegionId::Rays)),
        (size(RegionId::Quantized), 0, out_of_region, Some(RegionId::Quantized)),
        (size(RegionId::LeafTable), 0, out_of_region, Some(RegionId::LeafTable)),
        (size(RegionId::Primitives), 0, out_of_region, Some(RegionId::Primitives)),
        (size(RegionId::Hits), 64, out_of_region, Some(RegionId::Hits)),
        (base(RegionId::Rays), nowhere, ErrorCode::BusRead, None),
        (base(RegionId::Quantized), nowhere, ErrorCode::BusRead, None),
        (base(RegionId::LeafTable), nowhere, ErrorCode::BusRead, None),
        (base(RegionId::Primitives), nowhere, ErrorCode::BusRead, None),
        (base(RegionId::Hits), nowhere, ErrorCode::BusWrite, None),
        (ROOT_POINTER.offset(), 1 << 20, ErrorCode::CorruptNode, Some(RegionId::Quantized)),
        (JOB_ENTRIES.offset(), 0, ErrorCode::CorruptNode, Some(RegionId::LeafTable)),
        (JOB_PRIMITIVES.offset(), 1, ErrorCode::CorruptNode, Some(RegionId::LeafTable)),
    ] {
        let error = bench.with(offset, value);
        assert_eq!((error.code, error.region), (code, region), "{offset:#x}: {error}");
        assert_eq!(error.stage == Stage::Idle, code == bad_config, "{error}");
        match code {
            ErrorCode::BusRead | ErrorCode::BusWrite => assert_eq!(error.addr.0 >> 16, 0x4000),
            ErrorCode::OutOfRegion => {
                let region = bench.region(error.region.expect("a region"));
                assert!(
                    error.addr.0 >= region.base.0 && error.addr.0.is_multiple_of(64),
                    "{error}"
                );
            }
            _ => {}
        }
    }
    let error = bench.with(ROOT_POINTER.offset(), 1 << 20);
    assert_eq!(error.addr.0, start(&bench, RegionId::Quantized).wrapping_add(16 << 20));
}

#[test]
fn every_record_that_is_none_is_named_by_its_address() {
    let mut bench = Bench::new(true);
    // The third ray gets no direction.
    let error = bench.with_bytes(RegionId::Rays, 80 + 12, &[0; 12]);
    let rays = bench.region(RegionId::Rays).base.0;
    let wanted = JobError {
        code: ErrorCode::BadRay,
        stage: Stage::Trace,
        region: Some(RegionId::Rays),
        addr: ByteAddr(rays + 80),
    };
    assert_eq!(error, wanted);
    assert!(error.to_string().contains("is not a ray"), "{error}");
    // All triangles start off the grid.
    let count = bench.register(JOB_PRIMITIVES.offset());
    let error = bench.with_bytes(RegionId::Primitives, 0, &[0x7f; 40].repeat(count as usize));
    let triangles = bench.region(RegionId::Primitives).base.0;
    assert_eq!((error.code, error.region), (ErrorCode::BadPrimitive, Some(RegionId::Primitives)));
    assert!((error.addr.0 - triangles).is_multiple_of(40));
    // The leaf table names no triangles.
    let entries = bench.register(JOB_ENTRIES.offset());
    let error = bench.with_bytes(RegionId::LeafTable, 0, &[0x7f; 4].repeat(entries as usize));
    assert_eq!((error.code, error.region), (ErrorCode::CorruptNode, Some(RegionId::LeafTable)));
    assert!(error.to_string().contains("leaf table entry"), "{error}");
}

#[test]
fn every_wrong_compressing_build_ends_in_its_documented_code_and_the_next_runs_clean() {
    let mut bench = Bench::new(false);
    let leaf_table = bench.region(RegionId::LeafTable).base.0;
    let depths = |depth: u32| 30 | 255 << 8 | depth << 16;
    for (offset, value, code, region) in [
        (JOB_PRIMITIVES.offset(), 0, ErrorCode::BadConfig, None),
        (JOB_PRIMITIVES.offset(), 1 << 27, ErrorCode::BadConfig, None),
        (JOB_LIMITS.offset(), depths(0), ErrorCode::BadConfig, None),
        (JOB_LIMITS.offset(), depths(2), ErrorCode::BadConfig, None),
        (JOB_FORMAT.offset(), 2, ErrorCode::BadConfig, None),
        (base(RegionId::Quantized), leaf_table, ErrorCode::BadConfig, Some(RegionId::Quantized)),
        (size(RegionId::Quantized), 64, ErrorCode::RegionFull, Some(RegionId::Quantized)),
        (base(RegionId::Quantized), 0x4000_0000, ErrorCode::BusWrite, None),
    ] {
        let error = bench.with(offset, value);
        assert_eq!((error.code, error.region), (code, region), "{offset:#x}: {error}");
    }
}

#[test]
fn a_bus_error_at_every_phase_ends_the_job_and_the_next_runs_clean() {
    for traces in [false, true] {
        let mut bench = Bench::new(traces);
        let (reads, writes) = if traces { (0..40, 0..5) } else { (0..300, 0..240) };
        for (phases, fault, code) in [
            (reads, Fault::FailRead as fn(u64) -> Fault, ErrorCode::BusRead),
            (writes, Fault::FailWrite, ErrorCode::BusWrite),
        ] {
            let mut stages = Vec::new();
            for phase in phases.step_by(if traces { 1 } else { 23 }) {
                let error = failed(bench.with_fault(fault(phase)));
                assert_eq!((error.code, error.region), (code, None), "{phase}: {error}");
                assert!(
                    EXTERNAL.base.0 <= error.addr.0 && error.addr.0.is_multiple_of(64),
                    "{error}"
                );
                stages.push(error.stage);
            }
            stages.dedup();
            // Of the last line of hits it is heard when the unit has ended.
            match (traces, code) {
                (true, ErrorCode::BusWrite) => assert_eq!(stages, [Stage::Trace, Stage::Drain]),
                (true, _) => assert_eq!(stages, [Stage::Trace]),
                (false, _) => assert!(stages.len() > 1, "{stages:?}"),
            }
        }
    }
}

#[test]
fn memory_that_never_answers_is_given_up_by_the_hardware_or_by_the_driver() {
    for traces in [false, true] {
        let mut bench = Bench::new(traces);
        let error = failed(bench.with_fault(Fault::LoseRead(7)));
        assert_eq!((error.code, error.region), (ErrorCode::BusTimeout, None), "{error}");
        // The driver's patience ends before the hardware's, and it stops the job one way or the other.
        let output = bench.output();
        for resets in [false, true] {
            bench.board.0.borrow_mut().accelerator.fault = Some(Fault::LoseRead(7));
            let ended = bench.run(15);
            assert!(matches!(ended, Err(WaitError::TimedOut { .. })), "{ended:?}");
            let driver = &mut bench.driver;
            let stopped = if resets { driver.reset(Micros(9)) } else { driver.abort(Micros(9)) };
            assert_eq!(stopped, Ok(()));
            bench.set(INT_ENABLE.offset(), 0b11);
            bench.runs_clean(&output);
        }
    }
}
