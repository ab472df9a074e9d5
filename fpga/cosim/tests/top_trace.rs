//! The traversal unit in the whole accelerator: the driver's trace jobs end in the core's records, and
//! whatever goes wrong ends in a documented status, after which the next job runs clean.

use glam::IVec3;
use xylem::bus::FlatMemory;
use xylem::machine::port::IdealPort;
use xylem::machine::traverser::TraverserJob;
use xylem::run::{BuildOptions, build};
use xylem_core::geom::{Ray, Triangle};
use xylem_core::mem::Region;
use xylem_core::num::{SubGrid, Time};
use xylem_core::traverse::{Hit, Query};
use xylem_cosim::axi::Fault;
use xylem_cosim::jobs::trace_job;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::top::{Shared, Top, TopConfig};
use xylem_cosim::traverser::scenes::{FORMATS, Set, damaged, expected};
use xylem_driver::{JobError, Micros, RegisterAccess, TraceJob, WaitError};
use xylem_regs::{
    CTRL, Ctrl, ERROR_INFO, ErrorCode, ErrorInfo, JobKind, REGION_PRIMITIVES_BASE, RegionId,
    Register, STATUS, Stage,
};

/// A trace in memory, and what the core makes of it.
struct Case {
    memory: FlatMemory,
    job: TraceJob,
    records: Vec<u8>,
    error: Option<String>,
}

impl Case {
    fn new((memory, job): (FlatMemory, TraverserJob)) -> Self {
        let (records, error) = expected(&memory, &job);
        let job = trace_job(&job);
        Self { memory, job, records, error }
    }

    /// Starts the job and waits for its end.
    fn run(&self, top: &Shared<IdealPort>) -> Result<u32, JobError> {
        top.with(|top| top.memory.bytes = self.memory.bytes().to_vec());
        let mut driver = top.driver().unwrap();
        driver.start_trace(&self.job).unwrap_or_else(|error| panic!("{error}"));
        match driver.wait(Micros(100_000)) {
            Ok(_) => Ok(driver.hit_count().unwrap()),
            Err(WaitError::Job(error)) => Err(error),
            Err(other) => panic!("{other:?}, {:?}", top.with(|top| top.failure.clone())),
        }
    }

    /// Runs the job, which must end as the core's does; gives the cycles that the unit was busy.
    fn check(&self, what: &str, top: &Shared<IdealPort>) -> u64 {
        let before = top.driver().unwrap().counters().unwrap();
        let ended = self.run(top);
        let hits = self.records.chunks(Hit::BYTES).filter(|record| record[8..12] != [0xff; 4]);
        match (&self.error, &ended) {
            (None, Ok(count)) => assert_eq!(*count as usize, hits.count(), "{what}"),
            (Some(said), Err(error)) => {
                let got = (error.code, error.region);
                assert_eq!(got, self.status(said), "{what}: {error:?}, not {said}");
                if let Some((_, index)) = said.split_once(' ') {
                    let (base, size) = match got.1.unwrap() {
                        RegionId::Rays => (self.job.rays.base, Ray::BYTES as u32),
                        RegionId::LeafTable => (self.job.tree.leaf_table.base, 4),
                        _ => (self.job.triangles.base, 40),
                    };
                    let index = index.parse::<u32>().unwrap();
                    assert_eq!(error.addr.0, base.0 + size * index, "{what}");
                }
            }
            other => panic!("{what}: {other:?}"),
        }
        let base = self.job.hits.base.0 as usize;
        top.with(|top| {
            let records = &top.memory.bytes[base..base + self.records.len()];
            assert!(records == self.records, "{what}: records differ from the core's");
        });
        let after = top.driver().unwrap().counters().unwrap();
        if self.error.is_none() && self.job.tree.node_count > 0 {
            assert!(after.box_tests > before.box_tests, "{what}");
        }
        after.cycles - before.cycles
    }

    /// The status that stands for what the core says.
    fn status(&self, said: &str) -> (ErrorCode, Option<RegionId>) {
        let region = match FORMATS.iter().find(|(_, format)| *format == self.job.tree.format) {
            Some(("bvh2", _)) => RegionId::Nodes,
            _ => RegionId::Quantized,
        };
        match said.split(' ').next() {
            Some("ray") => (ErrorCode::BadRay, Some(RegionId::Rays)),
            Some("leaf") => (ErrorCode::CorruptNode, Some(RegionId::LeafTable)),
            Some("triangle") => (ErrorCode::BadPrimitive, Some(RegionId::Primitives)),
            _ => (ErrorCode::CorruptNode, Some(region)),
        }
    }
}

fn load(config: &TopConfig, stall: u64, latency: u32, seed: u64) -> Shared<IdealPort> {
    let library = config.build(None).unwrap_or_else(|error| panic!("{error}"));
    let port = IdealPort::new(latency);
    Shared::new(Top::load(&library, port, Vec::new(), stall, seed).unwrap())
}

#[test]
fn trace_jobs_give_the_core_s_records() {
    if !tools_for("trace_jobs_give_the_core_s_records") {
        return;
    }
    let sets = [("degenerate/one_triangle", 3), ("cornell_box", 6), ("flake_small", 4)]
        .map(|(name, count)| Set::new(name, count, 1));
    for (config, latency) in [(TopConfig::SMALL, 12), (TopConfig::PAPER, 30)] {
        let top = load(&config, 5, latency, 2);
        for set in &sets {
            for (name, format) in FORMATS {
                for query in [Query::Closest, Query::Any] {
                    let case = Case::new(set.job(format, query));
                    let what = format!("{}, {name}, {query:?}, {}", set.name, config.name);
                    let cycles = case.check(&what, &top);
                    let per_ray = cycles / u64::from(case.job.ray_count);
                    println!("top-trace: {what}: records equal, {per_ray} cycles a ray");
                }
            }
        }
    }
}

#[test]
fn damaged_trees_end_in_the_status_of_the_core_s_error() {
    if !tools_for("damaged_trees_end_in_the_status_of_the_core_s_error") {
        return;
    }
    let top = load(&TopConfig::SMALL, 0, 3, 3);
    let set = Set::new("cornell_box", 4, 4);
    let mut random = Random::new(5);
    let mut seen = std::collections::BTreeSet::new();
    for round in 0..60 {
        let (_, format) = FORMATS[round % 3];
        let (memory, job) = set.job(format, Query::Closest);
        let (memory, job) = damaged(memory, job, &mut random);
        let case = Case::new((memory, job));
        case.check(&format!("seed 5, round {round}"), &top);
        seen.insert(case.error.map(|said| said.split(' ').next().unwrap_or_default().to_owned()));
    }
    assert!(seen.len() >= 4, "damage ended in {seen:?} only");
    Case::new(set.job(FORMATS[0].1, Query::Any)).check("after all of them", &top);
}

#[test]
fn counts_beyond_a_region_stop_at_its_end() {
    if !tools_for("counts_beyond_a_region_stop_at_its_end") {
        return;
    }
    let top = load(&TopConfig::SMALL, 3, 8, 6);
    let set = Set::new("cornell_box", 10, 7);
    let case = Case::new(set.job(FORMATS[2].1, Query::Closest));
    for region in [RegionId::Rays, RegionId::Hits, RegionId::Nodes, RegionId::Primitives] {
        let mut registers = top.clone();
        top.with(|top| top.memory.bytes = case.memory.bytes().to_vec());
        let mut driver = top.driver().unwrap();
        // The driver refuses a region that is too short; other software may set one.
        driver.start_trace(&case.job).unwrap();
        driver.abort(Micros(100)).unwrap();
        let (code, which) = with_one_line(&mut registers, region, &top);
        assert_eq!((code, which), (ErrorCode::OutOfRegion, Some(region)));
        case.check(&format!("after {region:?}"), &top);
    }
}

/// Starts the trace that the registers hold anew, with `region` cut to one line, and says how it ends.
fn with_one_line(
    registers: &mut Shared<IdealPort>,
    region: RegionId,
    top: &Shared<IdealPort>,
) -> (ErrorCode, Option<RegionId>) {
    let size = REGION_PRIMITIVES_BASE.offset() + 8 * region as u32 + 4;
    registers.write(size, 64).unwrap();
    let start = Ctrl::RESET.with_job(JobKind::Trace).with_start(true);
    registers.write(CTRL.offset(), start.bits()).unwrap();
    // Bit 0: busy.
    while registers.read(STATUS.offset()).unwrap() & 1 == 1 {
        top.with(|top| (0..100).for_each(|_| top.tick()));
    }
    let info = ErrorInfo::from_bits(registers.read(ERROR_INFO.offset()).unwrap());
    (info.code().unwrap(), info.region_valid().then(|| info.region().unwrap()))
}

/// A trace whose rays hit each of some triangles, nearer every time, and for which the cache has room for all.
fn stack_of_triangles() -> (FlatMemory, TraverserJob) {
    let corners = |z| [[-4096, -4096, z], [4096, -4096, z], [0, 4096, z]].map(Into::into);
    let triangles: Vec<_> = (0..16)
        .map(|id| Triangle { vertices: corners(1 << 10 | id << 5), id: id as u32 })
        .collect();
    let run = build(&triangles, &BuildOptions::default()).unwrap();
    // Packed, so that no two lines have the same place in the cache.
    let mut bytes = Vec::new();
    let mut put = |part: &[u8]| {
        let base = bytes.len() as u32;
        bytes.extend(part);
        bytes.resize(bytes.len().next_multiple_of(64), 0);
        Region::new(base, bytes.len() as u32 - base)
    };
    let mut scene = run.scene;
    for (region, bytes) in [
        (&mut scene.tree.nodes, scene.tree.node_count * 64),
        (&mut scene.tree.leaf_table, scene.tree.entry_count * 4),
        (&mut scene.triangles, scene.triangle_count * 40),
    ] {
        let from = region.base.0 as usize;
        *region = put(&run.memory.bytes()[from..from + bytes as usize]);
    }
    let down = |x| {
        let origin = [x, 0, 1 << 12].map(|c| SubGrid::from_bits(c << 6));
        let direction = IVec3::new(0, 0, -(1 << 30));
        Ray::new(origin, direction, Time::ZERO, Ray::TIME_LIMIT).unwrap().to_bytes()
    };
    let rays: Vec<u8> = (0..3).flat_map(down).collect();
    let (rays, hits) = (put(&rays), put(&[0; 3 * Hit::BYTES]));
    let query = Query::Closest;
    let job = TraverserJob { scene, query, rays: rays.base, ray_count: 3, hits: hits.base };
    let mut memory = FlatMemory::new(bytes.len());
    memory.bytes_mut().copy_from_slice(&bytes);
    (memory, job)
}

#[test]
fn a_trace_may_go_without_memory_for_longer_than_memory_has_to_answer() {
    if !tools_for("a_trace_may_go_without_memory_for_longer_than_memory_has_to_answer") {
        return;
    }
    let config = TopConfig::SMALL;
    let top = load(&config, 0, 3, 11);
    let case = Case::new(stack_of_triangles());
    top.with(|top| top.memory.put_in(Fault::FailRead(u64::MAX)));
    let cycles = case.check("in the cache", &top);

    let mut driver = top.driver().unwrap();
    driver.start_trace(&case.job).unwrap();
    let (mut longest, mut still) = (0, 0);
    top.with(|top| {
        for _ in 0..cycles {
            let before = top.memory.lines();
            top.tick();
            still = if top.memory.lines() == before { still + 1 } else { 0 };
            longest = longest.max(still);
        }
    });
    driver.wait(Micros(1)).unwrap();
    // Answers come a few cycles after what was asked for.
    assert!(longest > config.time_out + 100, "no longer than {longest} cycles without memory");

    let (reads, _) = top.with(|top| top.memory.lines());
    for read in 0..reads / 2 {
        top.with(|top| top.memory.put_in(Fault::LoseRead(read)));
        let error = case.run(&top).unwrap_err();
        assert_eq!(error.code, ErrorCode::BusTimeout, "read {read}: {error:?}");
        top.with(|top| {
            top.memory.recover();
            (0..200).for_each(|_| top.tick());
        });
    }
    case.check("after lost answers", &top);
}

#[test]
fn faults_and_aborts_leave_a_unit_that_traces() {
    if !tools_for("faults_and_aborts_leave_a_unit_that_traces") {
        return;
    }
    let top = load(&TopConfig::SMALL, 3, 8, 8);
    let set = Set::new("cornell_box", 6, 9);
    let case = Case::new(set.job(FORMATS[1].1, Query::Closest));
    top.with(|top| top.memory.put_in(Fault::FailRead(u64::MAX)));
    let cycles = case.check("without fault", &top);
    let (reads, writes) = top.with(|top| top.memory.lines());
    for i in 0..=4 {
        for (fault, code) in [
            (Fault::FailRead((reads - 1) * i / 4), ErrorCode::BusRead),
            (Fault::FailWrite((writes - 1) * i / 4), ErrorCode::BusWrite),
            (Fault::LoseRead((reads - 1) * i / 4), ErrorCode::BusTimeout),
        ] {
            top.with(|top| top.memory.put_in(fault));
            let error = case.run(&top).unwrap_err();
            assert_eq!(error.code, code, "{fault:?}: {error:?}");
            // Of the last line of hits it is heard when the unit has ended.
            let late = fault == Fault::FailWrite(writes - 1);
            assert_eq!(error.stage, if late { Stage::Drain } else { Stage::Trace }, "{fault:?}");
            top.with(|top| {
                top.memory.recover();
                (0..200).for_each(|_| top.tick());
            });
            case.check(&format!("after {fault:?}"), &top);
        }
    }
    let mut random = Random::new(10);
    for round in 0..12 {
        let at = random.below(cycles);
        top.with(|top| top.memory.bytes = case.memory.bytes().to_vec());
        let mut driver = top.driver().unwrap();
        driver.start_trace(&case.job).unwrap();
        top.with(|top| (0..at).for_each(|_| top.tick()));
        match round % 3 {
            0 => driver.abort(Micros(100)).unwrap(),
            1 => driver.reset(Micros(100)).unwrap(),
            _ => top.with(Top::pull_reset),
        }
        case.check(&format!("after round {round}, at cycle {at}"), &top);
    }
}
