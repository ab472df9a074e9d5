//! Jobs on a register file that enforces the map: what is written, when, and what comes back.

mod fake;

use fake::fixtures::{build_job, compression, polled, trace_job, tree, wired};
use fake::{Fake, Outcome};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Child, NodeFormat, Quantization, Tree};
use xylem_driver::{
    Completion, CompressJob, CountersError, JobError, MapVersion, Micros, NoInterrupt, ProbeError,
    ResultError, StartError, StopError, WaitError, Xylem,
};
use xylem_regs::*;

#[test]
fn a_device_without_the_magic_number_is_not_found() {
    for found in [0, u32::MAX, 0x4d4c_5958] {
        let fake = Fake::new();
        fake.drive(MAGIC, Magic::from_bits(found));
        let error = Xylem::probe(fake.clone(), fake.clone(), NoInterrupt).unwrap_err();
        assert_eq!(error, ProbeError::NotFound { found });
        assert!(error.to_string().contains(&format!("{found:#010x}")), "{error}");
    }
}

#[test]
fn a_device_of_another_version_is_refused_and_a_repaired_one_is_not() {
    let fake = Fake::new();
    fake.drive(VERSION, Version::from_bits(Version::RESET.bits() | 9));
    polled(&fake);
    let supported = Version::RESET.bits();
    for bits in [supported + 0x0001_0000, supported - 0x0001_0000, supported | 0x0100_0000] {
        fake.drive(VERSION, Version::from_bits(bits));
        let error = Xylem::probe(fake.clone(), fake.clone(), NoInterrupt).unwrap_err();
        let [major, minor, ..] = bits.to_be_bytes();
        let found = MapVersion { major, minor, patch: 0 };
        let supported = MapVersion::SUPPORTED;
        assert_eq!(error, ProbeError::VersionMismatch { found, supported });
    }
}

#[test]
fn a_build_is_described_completely_and_started_last() {
    let fake = Fake::new();
    polled(&fake).start_build(&build_job()).unwrap();

    assert_eq!(fake.0.borrow().started, [JobKind::Build]);
    assert_eq!(fake.writes().last(), Some(&("ctrl", 0x101)));
    assert_eq!(fake.value(JOB_PRIMITIVES).value(), 1000);
    assert_eq!(fake.value(JOB_LIMITS).morton_bits(), 30);
    assert_eq!(fake.value(JOB_LIMITS).leaf_size(), 4);
    assert_eq!(fake.value(REGION_PRIMITIVES_BASE).bits(), 0x1_0000);
    assert_eq!(fake.value(REGION_LEAF_TABLE_SIZE).bits(), 0x1000);
    assert_eq!(fake.value(REGION_NODES_BASE).bits(), 0x3_0000);
    // One merge pass is enough, so that runs B must not be touched.
    assert_eq!(fake.value(REGION_RUNS_B_SIZE).bits(), 0);
}

#[test]
fn regions_of_an_earlier_job_are_withdrawn() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    xylem.start_trace(&trace_job()).unwrap();
    xylem.wait(Micros(1000)).unwrap();
    assert_eq!(fake.value(REGION_RAYS_SIZE).bits(), 0x1000);
    xylem.start_build(&build_job()).unwrap();
    assert_eq!(fake.value(REGION_RAYS_SIZE).bits(), 0);
}

#[test]
fn a_built_tree_is_described_by_the_device() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    let job = build_job();
    assert_eq!(xylem.built_tree(&job), Err(ResultError::NotDone));
    xylem.start_build(&job).unwrap();
    assert_eq!(xylem.built_tree(&job), Err(ResultError::NotDone));
    xylem.wait(Micros(1000)).unwrap();

    for (register, value) in [ROOT_LO_X, ROOT_LO_Y, ROOT_LO_Z].into_iter().zip([-5, 0, 1]) {
        fake.drive(register, Coordinate::RESET.with_value(value));
    }
    for (register, value) in [ROOT_HI_X, ROOT_HI_Y, ROOT_HI_Z].into_iter().zip([9, 8, 7]) {
        fake.drive(register, Coordinate::RESET.with_value(value));
    }
    fake.drive(ROOT_POINTER, RootPointer::RESET.with_index(99));
    fake.drive(RESULT_NODES, ResultCount::from_bits(100));
    fake.drive(RESULT_LEAVES, ResultCount::from_bits(101));
    assert_eq!(xylem.built_tree(&job), Ok(Tree { nodes: job.regions.nodes, ..tree() }));

    fake.drive(ROOT_POINTER, RootPointer::RESET);
    fake.drive(ROOT_LEAF_SIZE, RootLeafSize::RESET.with_count(4));
    let root = xylem.built_tree(&job).unwrap().root.unwrap();
    assert_eq!(root.child, Child::Leaf { first: 0, count: 4 });
}

#[test]
fn a_compressing_build_writes_quantized_nodes_only() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    let mut job = build_job();
    job.regions.nodes = Region::default();
    job.compressed = Some(compression());
    xylem.start_build(&job).unwrap();

    assert_eq!(fake.0.borrow().started, [JobKind::BuildCompressed]);
    assert_eq!(fake.value(REGION_NODES_SIZE).bits(), 0);
    assert_eq!(fake.value(REGION_QUANTIZED_BASE).bits(), 0x5_0000);
    assert_eq!(fake.value(JOB_FORMAT).coords(), Ok(CoordMode::Modulo));
    assert_eq!(fake.value(JOB_LIMITS).treelet_depth(), 2);
    xylem.wait(Micros(1000)).unwrap();
    fake.drive(RESULT_QUANTIZED, ResultCount::from_bits(7));
    let tree = xylem.built_tree(&job).unwrap();
    assert_eq!((tree.format, tree.node_count), (NodeFormat::Quantized(Quantization::MODULO), 7));
    assert_eq!(tree.nodes, compression().target);
}

#[test]
fn a_compression_is_told_the_tree_and_its_root() {
    let fake = Fake::new();
    let job = CompressJob { tree: tree(), compression: compression() };
    polled(&fake).start_compress(&job).unwrap();
    assert_eq!(fake.0.borrow().started, [JobKind::Compress]);
    assert_eq!(fake.value(JOB_NODES).value(), 100);
    assert_eq!(fake.value(ROOT_LO_X).value(), -5);
    assert_eq!(fake.value(ROOT_HI_Z).value(), 7);
    assert_eq!(fake.value(ROOT_POINTER).index(), 99);
    assert_eq!(fake.value(ROOT_LEAF_SIZE).count(), 0);
    assert_eq!(
        (job.tree().format, job.tree().nodes.base.0),
        (NodeFormat::Quantized(Quantization::MODULO), 0x5_0000)
    );
}

#[test]
fn a_trace_is_told_format_query_and_counts_and_tells_the_hits() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    let mut job = trace_job();
    job.tree = CompressJob { tree: tree(), compression: compression() }.tree();
    xylem.start_trace(&job).unwrap();
    let format = fake.value(JOB_FORMAT);
    assert_eq!(
        (format.node(), format.coords()),
        (Ok(xylem_regs::NodeFormat::Cbvh), Ok(CoordMode::Modulo))
    );
    assert_eq!(format.query(), Ok(Query::Any));
    assert_eq!((fake.value(JOB_RAYS).value(), fake.value(JOB_ENTRIES).value()), (64, 1000));
    assert_eq!(fake.value(REGION_QUANTIZED_BASE).bits(), 0x5_0000);
    assert_eq!(fake.value(REGION_NODES_SIZE).bits(), 0);
    xylem.wait(Micros(1000)).unwrap();
    fake.drive(RESULT_HITS, ResultCount::from_bits(17));
    assert_eq!(xylem.hit_count(), Ok(17));
}

#[test]
fn the_interrupt_ends_the_wait_and_is_cleared() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    xylem.start_build(&build_job()).unwrap();
    let reads_before = fake.0.borrow().status_reads;
    let completion = xylem.wait(Micros(10_000)).unwrap();
    assert_eq!(completion, Completion { waited: Micros(100), signalled: true });
    assert_eq!(fake.0.borrow().status_reads - reads_before, 1);
    assert!(!fake.value(INT_STATUS).done());
}

#[test]
fn polling_waits_just_as_long_and_a_longer_interval_looks_less_often() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    xylem.set_poll_interval(Micros(50));
    xylem.start_build(&build_job()).unwrap();
    let reads_before = fake.0.borrow().status_reads;
    assert_eq!(xylem.wait(Micros(10_000)).unwrap().waited, Micros(100));
    assert_eq!(fake.0.borrow().status_reads - reads_before, 3);
}

#[test]
fn a_job_whose_interrupt_got_lost_is_still_found_done() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    xylem.start_build(&build_job()).unwrap();
    fake.drive(INT_ENABLE, IntEnable::RESET);
    let completion = xylem.wait(Micros(500)).unwrap();
    assert_eq!(completion, Completion { waited: Micros(500), signalled: false });
}

#[test]
fn a_time_out_names_the_stage_and_the_time_and_the_job_can_be_waited_for_again() {
    let fake = Fake::new();
    fake.script(100, Outcome::Done);
    let mut xylem = polled(&fake);
    xylem.start_build(&build_job()).unwrap();
    let error = xylem.wait(Micros(99)).unwrap_err();
    assert_eq!(error, WaitError::TimedOut { stage: Stage::Emit, waited: Micros(99) });
    assert!(error.to_string().contains("stage emit after 99 µs"), "{error}");
    assert_eq!(xylem.wait(Micros(1)).unwrap().waited, Micros(1));
}

#[test]
fn a_time_out_of_zero_looks_once() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    xylem.start_build(&build_job()).unwrap();
    let timed_out = WaitError::TimedOut { stage: Stage::Emit, waited: Micros(0) };
    assert_eq!(xylem.wait(Micros(0)), Err(timed_out));
}

#[test]
fn waiting_for_nothing_is_an_error() {
    assert_eq!(polled(&Fake::new()).wait(Micros(9)), Err(WaitError::NotStarted));
}

#[test]
fn a_failed_job_is_decoded_and_the_next_one_runs_clean() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    fake.script(20, Outcome::Failed(ErrorCode::RegionFull, Some(RegionId::Nodes), 0x3_fff0));
    xylem.start_build(&build_job()).unwrap();
    let error = JobError {
        code: ErrorCode::RegionFull,
        stage: Stage::Emit,
        region: Some(RegionId::Nodes),
        addr: ByteAddr(0x3_fff0),
    };
    assert_eq!(xylem.wait(Micros(1000)), Err(WaitError::Job(error)));
    assert_eq!(
        error.to_string(),
        "job failed in stage emit: a region ran full; make it larger (region nodes)"
    );
    assert_eq!(xylem.built_tree(&build_job()), Err(ResultError::Failed));

    fake.script(20, Outcome::Done);
    xylem.start_build(&build_job()).unwrap();
    assert_eq!(xylem.wait(Micros(1000)).unwrap().waited, Micros(20));
}

#[test]
fn every_error_code_has_words_of_its_own() {
    let text = |code| {
        let (stage, addr) = (Stage::Sort, ByteAddr(64));
        JobError { code, stage, region: None, addr }.to_string()
    };
    let mut texts = ErrorCode::ALL.map(text).to_vec();
    texts.sort();
    texts.dedup();
    assert_eq!(texts.len(), ErrorCode::ALL.len());
}

#[test]
fn an_error_code_that_the_map_lacks_is_reported_with_its_bits() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    xylem.start_build(&build_job()).unwrap();
    fake.drive(STATUS, Status::from_bits(0b110));
    fake.drive(ERROR_INFO, ErrorInfo::from_bits(0xee));
    let value = UnknownValue(0xee);
    assert_eq!(xylem.wait(Micros(9)), Err(WaitError::Unknown { register: "error_info", value }));
}

#[test]
fn a_busy_device_takes_no_job_and_no_write() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    xylem.start_build(&build_job()).unwrap();
    let writes = fake.writes();
    assert_eq!(xylem.start_trace(&trace_job()), Err(StartError::Busy));
    assert_eq!(fake.writes(), writes);
}

#[test]
fn an_aborted_job_leaves_the_device_ready() {
    let fake = Fake::new();
    let mut xylem = wired(&fake);
    assert_eq!(xylem.abort(Micros(10)), Ok(()));
    assert_eq!(fake.writes(), [], "nothing ran, so nothing was to be aborted");
    xylem.start_build(&build_job()).unwrap();
    xylem.abort(Micros(10)).unwrap();
    xylem.start_trace(&trace_job()).unwrap();
    xylem.wait(Micros(1000)).unwrap();
}

#[test]
fn a_job_that_ignores_the_abort_times_out_and_gives_in_to_a_reset() {
    let fake = Fake::new();
    fake.script(20, Outcome::Hangs);
    let mut xylem = polled(&fake);
    xylem.start_build(&build_job()).unwrap();
    assert!(matches!(xylem.wait(Micros(50)), Err(WaitError::TimedOut { .. })));
    assert_eq!(xylem.abort(Micros(30)), Err(StopError::TimedOut { waited: Micros(30) }));
    xylem.reset(Micros(30)).unwrap();
    assert_eq!(xylem.wait(Micros(9)), Err(WaitError::NotStarted));
}

#[test]
fn counters_of_a_job_are_the_difference_of_two_snapshots() {
    let fake = Fake::new();
    let mut xylem = polled(&fake);
    fake.drive(COUNTERS_CYCLES_LO, CounterLo::from_bits(u32::MAX));
    let before = xylem.counters().unwrap();
    fake.drive(COUNTERS_CYCLES_LO, CounterLo::from_bits(9));
    fake.drive(COUNTERS_CYCLES_HI, CounterHi::from_bits(1));
    fake.drive(COUNTERS_BOX_TESTS_LO, CounterLo::from_bits(3));
    let job = xylem.counters().unwrap() - before;
    assert_eq!((job.cycles, job.box_tests, job.nodes), (10, 3, 0));
}

#[test]
fn counters_that_are_absent_are_not_read_as_zero() {
    let fake = Fake::new();
    fake.drive(CAP_FEATURES, CapFeatures::from_bits(0x0003_3737));
    assert_eq!(polled(&fake).counters(), Err(CountersError::Absent));
}
