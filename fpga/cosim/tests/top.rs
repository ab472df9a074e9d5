//! The whole builder in gates: the driver's jobs end in the core's bytes, and whatever goes wrong ends in
//! a documented status, after which the next job runs clean.

use xylem::machine::port::{IdealPort, Port};
use xylem::run::{self, Layout};
use xylem_core::geom::Triangle;
use xylem_core::mem::Region;
use xylem_core::node::{Coordinates, LeafEntry, Tree};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::{self, BuildConfig};
use xylem_cosim::axi::Fault;
use xylem_cosim::jobs::{COUNTS, build_job, soup};
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::top::{Shared, Top, TopConfig};
use xylem_driver::{BuildJob, JobError, Micros, RegisterAccess, WaitError};
use xylem_regs::{
    CTRL, Ctrl, ERROR_INFO, ErrorCode, ErrorInfo, JOB_LIMITS, JOB_PRIMITIVES, JobKind,
    REGION_PRIMITIVES_BASE, RegionId, Register, STATUS,
};

/// A scene in memory, the job that builds it, and what the core makes of it.
struct Case {
    config: BuildConfig,
    count: u32,
    layout: Layout,
    before: Vec<u8>,
    after: Vec<u8>,
    tree: Tree,
}

impl Case {
    fn new(triangles: &[Triangle], top: &TopConfig, change: impl Fn(&mut BuildConfig)) -> Self {
        let mut config = top.build_config();
        change(&mut config);
        let count = triangles.len() as u32;
        let (mut memory, layout) = run::load(triangles, &config).unwrap();
        let before = memory.bytes().to_vec();
        let mut buffers = run::Buffers::new(&config);
        let (mut work, mut storage) = buffers.parts();
        let regions = &layout.build;
        let tree = pipeline::build_with(
            &mut memory,
            &config,
            regions,
            count,
            &mut work,
            &mut storage,
            &mut (),
        );
        let tree = tree.unwrap();
        Self { config, count, layout, before, after: memory.bytes().to_vec(), tree }
    }

    fn job(&self) -> BuildJob {
        build_job(&self.layout, self.count, &self.config)
    }

    /// Runs the job to its end and compares every byte that a build leaves; gives the cycles it was busy.
    fn check<P: Port>(&self, what: &str, top: &Shared<P>) -> u64 {
        top.with(|top| top.memory.bytes.clone_from(&self.before));
        let mut driver = top.driver().unwrap();
        let job = self.job();
        let before = driver.counters().unwrap();
        driver.start_build(&job).unwrap_or_else(|error| panic!("{what}: {error}"));
        let waited = driver.wait(Micros(100_000));
        waited.unwrap_or_else(|error| panic!("{what}: {error:?}, {:?}", failure(top)));
        let built = driver.built_tree(&job).unwrap();
        assert_eq!(built.root, self.tree.root, "{what}");
        let counts = |tree: &Tree| (tree.node_count, tree.leaf_count, tree.entry_count);
        assert_eq!(counts(&built), counts(&self.tree), "{what}");
        let node_bytes = self.tree.format.bytes() as usize;
        let nodes = used(self.layout.build.nodes, self.tree.node_count, node_bytes);
        let entries = used(self.layout.build.leaf_table, self.count, LeafEntry::BYTES);
        for region in [entries, nodes] {
            let mut at = region.base.0 as usize..(region.base.0 + region.size) as usize;
            let differs = top.with(|top| at.find(|&i| top.memory.bytes[i] != self.after[i]));
            assert_eq!(differs, None, "{what}: first byte that differs in {region:?}");
        }
        let after = driver.counters().unwrap();
        assert_eq!(after.nodes - before.nodes, u64::from(self.tree.node_count), "{what}");
        assert_eq!(after.leaves - before.leaves, u64::from(self.tree.leaf_count), "{what}");
        after.cycles - before.cycles
    }
}

fn used(region: Region, count: u32, bytes: usize) -> Region {
    Region { size: count * bytes as u32, ..region }
}

fn failure<P: Port>(top: &Shared<P>) -> Option<String> {
    top.with(|top| top.failure.clone())
}

fn load(config: &TopConfig, stall: u64, latency: u32, seed: u64) -> Shared<IdealPort> {
    let library = config.build(None).unwrap_or_else(|error| panic!("{error}"));
    let port = IdealPort::new(latency);
    Shared::new(Top::load(&library, port, Vec::new(), stall, seed).unwrap())
}

#[test]
fn every_size_of_scene_gives_the_core_s_bytes() {
    if !tools_for("every_size_of_scene_gives_the_core_s_bytes") {
        return;
    }
    let config = TopConfig::SMALL;
    for (seed, stall, latency) in [(1, 0, 1), (2, 4, 9), (3, 0, 60)] {
        let top = load(&config, stall, latency, seed);
        for count in COUNTS {
            let case = Case::new(&soup(count, seed), &config, |_| ());
            case.check(&format!("{count} primitives, seed {seed}"), &top);
        }
    }
}

#[test]
fn leaves_and_codes_of_every_kind_give_the_core_s_bytes() {
    if !tools_for("leaves_and_codes_of_every_kind_give_the_core_s_bytes") {
        return;
    }
    let config = TopConfig::SMALL;
    let top = load(&config, 5, 6, 4);
    let equal = vec![soup(1, 7)[0]; 700];
    for morton in [MortonWidth::Bits30, MortonWidth::Bits63] {
        for max_leaf_size in [1, 2, 255] {
            let change = |config: &mut BuildConfig| {
                config.morton = morton;
                config.max_leaf_size = max_leaf_size;
            };
            for (name, triangles) in [("equal", equal.clone()), ("soup", soup(900, 8))] {
                let what = format!("{name}, {morton:?}, leaves of {max_leaf_size}");
                Case::new(&triangles, &config, change).check(&what, &top);
            }
        }
    }
}

/// A change that compresses nodes as `top` does, in `coordinates`.
fn compressed(top: &TopConfig, coordinates: Coordinates) -> impl Fn(&mut BuildConfig) {
    let compression = top.compression(coordinates);
    move |config| config.compression = Some(compression)
}

#[test]
fn trees_compressed_as_they_are_built_have_the_core_s_bytes() {
    if !tools_for("trees_compressed_as_they_are_built_have_the_core_s_bytes") {
        return;
    }
    for (config, counts) in
        [(TopConfig::SMALL, &[1, 2, 5, 9, 127, 300, 2049][..]), (TopConfig::PAPER, &[2, 300, 9000])]
    {
        for coordinates in [Coordinates::Relative, Coordinates::Modulo] {
            let top = load(&config, 4, 15, 6);
            let mut backtracks = 0;
            for &count in counts {
                let change = compressed(&config, coordinates);
                let case = Case::new(&soup(count, 20), &config, change);
                let before = top.driver().unwrap().counters().unwrap().backtracks;
                case.check(&format!("{count} primitives, {coordinates:?}"), &top);
                backtracks += top.driver().unwrap().counters().unwrap().backtracks - before;
                // The same unit builds plain trees in between.
                Case::new(&soup(count, 21), &config, |_| ()).check("plain", &top);
            }
            assert!(backtracks > 0, "nothing was repaired");
        }
    }
}

/// How a job that goes wrong ends.
fn end_of<P: Port>(top: &Shared<P>, case: &Case, job: &BuildJob) -> JobError {
    top.with(|top| top.memory.bytes.clone_from(&case.before));
    let mut driver = top.driver().unwrap();
    driver.start_build(job).unwrap_or_else(|error| panic!("{error}"));
    match driver.wait(Micros(1000)) {
        Err(WaitError::Job(error)) => error,
        other => panic!("{other:?}, {:?}", failure(top)),
    }
}

#[test]
fn bus_errors_in_every_phase_are_reported_and_the_next_job_runs_clean() {
    if !tools_for("bus_errors_in_every_phase_are_reported_and_the_next_job_runs_clean") {
        return;
    }
    let config = TopConfig::SMALL;
    let case = Case::new(&soup(2500, 9), &config, |_| ());
    let top = load(&config, 3, 8, 7);
    top.with(|top| top.memory.put_in(Fault::FailRead(u64::MAX)));
    case.check("without fault", &top);
    let (reads, writes) = top.with(|top| top.memory.lines());
    for i in 0..=10 {
        for (fault, code) in [
            (Fault::FailRead((reads - 1) * i / 10), ErrorCode::BusRead),
            (Fault::FailWrite((writes - 1) * i / 10), ErrorCode::BusWrite),
            (Fault::LoseRead((reads - 1) * i / 10), ErrorCode::BusTimeout),
            (Fault::Refuse((writes - 1) * i / 10), ErrorCode::BusTimeout),
        ] {
            top.with(|top| top.memory.put_in(fault));
            let error = end_of(&top, &case, &case.job());
            assert_eq!(error.code, code, "{fault:?}: {error:?}");
            top.with(|top| {
                top.memory.recover();
                // What was lost comes while nothing runs.
                (0..200).for_each(|_| top.tick());
            });
            case.check(&format!("after {fault:?}"), &top);
        }
    }
}

#[test]
fn jobs_that_cannot_be_done_touch_nothing_outside_their_regions() {
    if !tools_for("jobs_that_cannot_be_done_touch_nothing_outside_their_regions") {
        return;
    }
    let config = TopConfig::SMALL;
    let case = Case::new(&soup(1000, 10), &config, |_| ());
    let top = load(&config, 3, 8, 8);
    let mut small_nodes = case.job();
    small_nodes.regions.nodes.size = 640;
    let error = end_of(&top, &case, &small_nodes);
    assert_eq!((error.code, error.region), (ErrorCode::RegionFull, Some(RegionId::Nodes)));
    let nodes = case.layout.build.nodes;
    let after = (nodes.base.0 + 640) as usize..(nodes.base.0 + nodes.size) as usize;
    top.with(|top| assert!(top.memory.bytes[after.clone()] == case.before[after]));
    case.check("after a full region", &top);

    // What the driver refuses, other software may still ask for.
    let mut registers = top.clone();
    let mut ask = |offset: u32, value: u32| {
        let before = registers.read(offset).unwrap();
        registers.write(offset, value).unwrap();
        let start = Ctrl::RESET.with_job(JobKind::Build).with_start(true);
        registers.write(CTRL.offset(), start.bits()).unwrap();
        top.with(|top| {
            top.memory.bytes.clone_from(&case.before);
            (0..20_000).for_each(|_| top.tick());
        });
        let info = ErrorInfo::from_bits(registers.read(ERROR_INFO.offset()).unwrap());
        let status = registers.read(STATUS.offset()).unwrap();
        assert_eq!(status & 7, 0b110, "{offset:#x}: done and failed");
        registers.write(offset, before).unwrap();
        let region = info.region_valid().then(|| info.region().unwrap());
        (info.code().unwrap(), region)
    };
    let region = |id: RegionId| REGION_PRIMITIVES_BASE.offset() + 8 * id as u32;
    let bad = (ErrorCode::BadConfig, None);
    assert_eq!(ask(JOB_PRIMITIVES.offset(), 0), bad);
    assert_eq!(ask(JOB_LIMITS.offset(), 30), bad, "leaves of nothing");
    assert_eq!(ask(JOB_LIMITS.offset(), 0xff11), bad, "codes of 17 bits");
    let overlap = ask(region(RegionId::Nodes), case.layout.build.runs_a.base.0);
    assert_eq!(overlap, (ErrorCode::BadConfig, Some(RegionId::Nodes)));
    let past = ask(region(RegionId::LeafTable), 0xffff_ffc0);
    assert_eq!(past, (ErrorCode::BadConfig, Some(RegionId::LeafTable)));
    let short = ask(region(RegionId::Primitives) + 4, 64);
    assert_eq!(short, (ErrorCode::OutOfRegion, Some(RegionId::Primitives)));
    let none = ask(region(RegionId::RunsA) + 4, 0);
    assert_eq!(none, (ErrorCode::RegionFull, Some(RegionId::RunsA)));
    case.check("after all of them", &top);
}

#[test]
fn an_invalid_primitive_is_named() {
    if !tools_for("an_invalid_primitive_is_named") {
        return;
    }
    let config = TopConfig::SMALL;
    let mut case = Case::new(&soup(1000, 11), &config, |_| ());
    let top = load(&config, 3, 8, 9);
    let base = case.layout.build.primitives.base.0;
    for (index, byte, value) in [(0, 3, 0x40), (517, 27, 0x80), (999, 23, 0x41)] {
        let at = (base + 32 * index + byte) as usize;
        let good = std::mem::replace(&mut case.before[at], value);
        let error = end_of(&top, &case, &case.job());
        assert_eq!(error.code, ErrorCode::BadPrimitive);
        assert_eq!((error.addr.0 - base) / 32, index);
        case.before[at] = good;
        case.check("after an invalid primitive", &top);
    }
}

#[test]
fn aborts_and_resets_at_any_cycle_leave_a_unit_that_works() {
    if !tools_for("aborts_and_resets_at_any_cycle_leave_a_unit_that_works") {
        return;
    }
    let config = TopConfig::SMALL;
    let case = Case::new(&soup(700, 12), &config, |_| ());
    let top = load(&config, 3, 12, 10);
    let cycles = case.check("undisturbed", &top);
    let mut random = Random::new(11);
    for round in 0..45 {
        let at = random.below(cycles);
        top.with(|top| top.memory.bytes.clone_from(&case.before));
        let mut driver = top.driver().unwrap();
        driver.start_build(&case.job()).unwrap();
        top.with(|top| (0..at).for_each(|_| top.tick()));
        match round % 3 {
            0 => {
                driver.abort(Micros(100)).unwrap_or_else(|e| panic!("abort at {at}: {e}"));
                match driver.wait(Micros(1)) {
                    Err(WaitError::Job(error)) => assert_eq!(error.code, ErrorCode::Aborted),
                    // It had come to its end before.
                    other => assert!(other.is_ok() && at + 500 > cycles, "{at}: {other:?}"),
                }
            }
            1 => driver.reset(Micros(100)).unwrap_or_else(|e| panic!("reset at {at}: {e}")),
            _ => top.with(Top::pull_reset),
        }
        case.check(&format!("after round {round}, at cycle {at}"), &top);
    }
}

#[test]
fn a_driver_that_loses_patience_can_take_the_job_back() {
    if !tools_for("a_driver_that_loses_patience_can_take_the_job_back") {
        return;
    }
    let config = TopConfig::SMALL;
    let case = Case::new(&soup(3000, 13), &config, |_| ());
    let top = load(&config, 0, 12, 12);
    top.with(|top| top.memory.bytes.clone_from(&case.before));
    let mut driver = top.driver().unwrap();
    driver.start_build(&case.job()).unwrap();
    assert!(matches!(driver.wait(Micros(3)), Err(WaitError::TimedOut { .. })));
    driver.abort(Micros(100)).unwrap();
    case.check("after an abort", &top);
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let table: toml::Table = include_str!("../../rtl/configs.toml").parse().unwrap();
    let all = table["top"].as_table().unwrap();
    assert_eq!(all.len(), TopConfig::ALL.len());
    for config in TopConfig::ALL {
        let values = all[config.name].as_table().unwrap();
        for (key, value) in [
            ("capacity", config.capacity),
            ("burst", config.burst),
            ("sorters", config.sorters),
            ("fifo", config.fifo),
            ("read_ahead", config.read_ahead),
            ("code_bits", config.code_bits),
            ("data_bits", config.data_bits),
            ("depth", config.depth),
            ("tracer", u32::from(config.tracer)),
            ("cache_width", config.cache_width),
            ("cache_block", u32::from(config.cache_block)),
            ("write_lines", TopConfig::WRITE_LINES),
            ("time_out", config.time_out),
        ] {
            assert_eq!(values[key].as_integer(), Some(value.into()), "{}: {key}", config.name);
        }
    }
}
