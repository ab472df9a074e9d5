//! The clocked builder against the core: equal bytes, whatever the configuration and the memory; and
//! when memory fails, a named error.

use std::time::Instant;

use rayon::prelude::*;
use xylem::dram;
use xylem::machine::config::MachineConfig;
use xylem::machine::fault::{Fault, FaultyPort};
use xylem::machine::mergetree::MachineError;
use xylem::machine::port::{DramPort, IdealPort, PortError};
use xylem::scene::{LoadOptions, Random};
use xylem_core::compress::{Compression, Repairs};
use xylem_core::emit::{CellConfig, EmitterKind, PlocConfig};
use xylem_core::error::BuildError;
use xylem_core::geom::Triangle;
use xylem_core::node::Quantization;
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::sort::{InputFormat, ReadSchedule, SortConfig};
use xylem_core::toplevel::{Binned, Bins, TopLevel};
use xylem_tests::clocked::Expected;
use xylem_tests::lbvh::morton_code;
use xylem_tests::places;
use xylem_tests::trees::soup;

const SEED: u64 = 0x5eed_c10c;

const SCHEDULES: [ReadSchedule; 2] = [ReadSchedule::DoubleBuffer, ReadSchedule::Forecast];

/// A machine with a sorter of the given shape, small in everything else.
fn machine(capacity: u32, burst: u32, schedule: ReadSchedule) -> MachineConfig {
    let sort = SortConfig { capacity, burst, schedule, ..SortConfig::PAPER };
    MachineConfig {
        sorters: 2,
        fifo: 4,
        spare_buffers: 2,
        read_ahead: 4,
        time_out: 50_000,
        ..MachineConfig::p2(BuildConfig { sort, ..BuildConfig::default() })
    }
}

fn memory(name: &str) -> &'static dram::Config {
    dram::Config::by_name(name).unwrap()
}

fn code(triangle: &Triangle) -> u64 {
    let build = BuildConfig::default();
    morton_code(&triangle.bounds(), build.morton)
}

/// Random, in order, in reverse order, one code for all, one, two and none.
fn inputs(count: usize) -> Vec<(&'static str, Vec<Triangle>)> {
    let random = soup(&mut Random::new(SEED), count);
    let mut sorted = random.clone();
    sorted.sort_by_key(code);
    let reversed = sorted.iter().rev().copied().collect();
    let (one, two) = (random[..1].to_vec(), random[..2].to_vec());
    let equal = vec![random[0]; count];
    vec![
        ("random", random),
        ("sorted", sorted),
        ("reversed", reversed),
        ("equal", equal),
        ("one", one),
        ("two", two),
        ("none", Vec::new()),
    ]
}

#[test]
fn every_shape_of_the_sorter_writes_the_core_s_bytes() {
    let inputs = inputs(3000);
    let mut configs = Vec::new();
    for capacity in (6..=13).map(|bits| 1 << bits) {
        for burst in [2, 4, 8, 16, 32].into_iter().filter(|burst| 4 * burst <= capacity) {
            for schedule in SCHEDULES {
                let config = machine(capacity, burst, schedule);
                configs.push(config);
                if 8 * burst <= capacity {
                    configs.push(MachineConfig { overlap: true, share: true, ..config });
                }
            }
        }
    }
    let runs: Vec<(u32, u64)> = configs
        .par_iter()
        .flat_map_iter(|config| inputs.iter().map(move |input| (config, input)))
        .map(|(config, (name, triangles))| {
            let expected = Expected::new(triangles, *config);
            let what = format!("{name}, {config:?}");
            let run = expected.assert_same(&what, &mut IdealPort::new(30));
            (run.passes, run.cycles)
        })
        .collect();
    let passes: std::collections::BTreeSet<u32> = runs.iter().map(|run| run.0 + 1).collect();
    let cycles: u64 = runs.iter().map(|run| run.1).sum();
    println!("{} builds in {passes:?} passes, {cycles} cycles, seed {SEED:#x}", runs.len());
    assert!([1, 2, 3].iter().all(|pass| passes.contains(pass)), "{passes:?}");
}

#[test]
fn small_leaves_triangles_as_input_and_odd_bursts_make_no_difference() {
    for (name, triangles) in inputs(700) {
        for max_leaf_size in [1, 3, 255] {
            for input in [InputFormat::Box32, InputFormat::Triangle40] {
                for write_burst in [64, 192, 512] {
                    let mut config = machine(128, 4, ReadSchedule::DoubleBuffer);
                    config.build.max_leaf_size = max_leaf_size;
                    config.build.input = input;
                    config.build.write_burst = write_burst;
                    let what = format!("{name}, {config:?}");
                    Expected::new(&triangles, config).assert_same(&what, &mut IdealPort::new(9));
                }
            }
        }
    }
}

#[test]
fn emitters_on_tape_write_the_core_s_bytes() {
    let ploc = |radius, chain| BuildConfig {
        emitter: EmitterKind::Ploc(PlocConfig { radius, chain }),
        ..BuildConfig::default()
    };
    let binned = |capacity| BuildConfig {
        top_level: TopLevel::Binned(Binned { bins: Bins::Eight }),
        cells: CellConfig { capacity, ..CellConfig::default() },
        ..BuildConfig::default()
    };
    let joined = BuildConfig { join_leaves: 4, ..BuildConfig::default() };
    let builds = [ploc(8, 4), ploc(2, 2), ploc(16, 8), binned(8192), binned(64), joined];
    for (name, triangles) in inputs(3000) {
        for build in builds {
            for (capacity, burst) in [(64, 4), (8192, 16)] {
                for schedule in SCHEDULES {
                    let mut config = machine(capacity, burst, schedule);
                    config.build = BuildConfig { sort: config.build.sort, ..build };
                    let what = format!("{name}, {config:?}");
                    let expected = Expected::new(&triangles, config);
                    let cycles = expected.assert_same(&what, &mut IdealPort::new(20)).cycles;
                    let mut slow = DramPort::new(memory("slow"), 1000);
                    assert!(expected.assert_same(&what, &mut slow).cycles >= cycles / 2, "{what}");
                }
            }
        }
    }
}

#[test]
fn compressors_on_the_clock_write_the_core_s_bytes() {
    let compressions = [
        (Quantization::RELATIVE, 1, Repairs::InMemory),
        (Quantization::MODULO, 2, Repairs::InMemory),
        (Quantization::RELATIVE, 4, Repairs::InLines(2)),
        (Quantization::RELATIVE, 1, Repairs::InLines(16)),
    ];
    let ploc = EmitterKind::Ploc(PlocConfig { radius: 8, chain: 4 });
    let binned = TopLevel::Binned(Binned { bins: Bins::Eight });
    for (name, triangles) in inputs(2000) {
        for (quantization, treelet_depth, repairs) in compressions {
            for (emitter, top_level) in [
                (EmitterKind::Lbvh, TopLevel::None),
                (EmitterKind::Lbvh, binned),
                (ploc, TopLevel::None),
            ] {
                if emitter == ploc && treelet_depth > 1 {
                    continue;
                }
                let mut config = machine(512, 4, ReadSchedule::DoubleBuffer);
                let compression =
                    Compression { quantization, treelet_depth, repairs, ..Compression::DEFAULT };
                config.build.compression = Some(compression);
                (config.build.emitter, config.build.top_level) = (emitter, top_level);
                let what = format!("{name}, {config:?}");
                let expected = Expected::new(&triangles, config);
                let quick = expected.assert_same(&what, &mut IdealPort::new(1));
                let slow = expected.assert_same(&what, &mut IdealPort::new(100));
                assert_eq!(slow.traffic.total().bytes(), quick.traffic.total().bytes(), "{what}");
                // Repairs in memory come one after the other.
                let repairs_wait = repairs == Repairs::InMemory;
                let waits = if repairs_wait { 100 * quick.compressor.backtracks() } else { 0 };
                assert!(slow.cycles >= waits, "{what}");
                expected.assert_same(&what, &mut DramPort::new(memory("p3"), 1000));
            }
        }
    }
}

#[test]
fn the_tape_of_the_hierarchy_emitter_takes_as_long_as_the_unit() {
    // A joined leaf of one primitive joins nothing, but is no plain emitter.
    let triangles = soup(&mut Random::new(SEED), 20_000);
    let plain = machine(8192, 16, ReadSchedule::DoubleBuffer);
    let mut taped = plain;
    taped.build.join_leaves = 1;
    for port in [1, 50] {
        let cycles = [plain, taped].map(|config| {
            Expected::new(&triangles, config).assert_same("tape", &mut IdealPort::new(port)).cycles
        });
        println!("latency {port}: unit {}, tape {}", cycles[0], cycles[1]);
        assert!(cycles[0].abs_diff(cycles[1]) * 100 < cycles[0], "{cycles:?}");
    }
}

#[test]
fn every_memory_gives_the_same_tree() {
    let triangles = soup(&mut Random::new(SEED), 5000);
    for dram in &dram::CONFIGS {
        for schedule in SCHEDULES {
            let config = machine(512, 8, schedule);
            let expected = Expected::new(&triangles, config);
            let mut port = DramPort::new(dram, config.clock_mhz);
            let run = expected.assert_same(dram.name, &mut port);
            println!("{} {schedule:?}: {} cycles", dram.name, run.cycles);
        }
    }
}

#[test]
fn real_scenes_have_the_core_s_bytes_on_every_machine() {
    let test = "real_scenes_have_the_core_s_bytes_on_every_machine";
    let Some(folder) = places::folder("XYLEM_SCENES", test) else { return };
    let most = if places::full() { u64::MAX } else { 900_000 };
    for path in places::meshes_in(&folder) {
        let size = std::fs::metadata(&path).map_or(0, |data| data.len());
        if size > most {
            continue;
        }
        let name = path.to_string_lossy();
        let mesh = xylem::scene::load(&name, &LoadOptions::default());
        let mesh = mesh.unwrap_or_else(|e| panic!("{e}"));
        let build = BuildConfig::default();
        let machines =
            [MachineConfig::p2(build), MachineConfig::p1(build), MachineConfig::improved(build)];
        let start = Instant::now();
        let cycles: Vec<u64> = machines
            .par_iter()
            .map(|config| {
                let mut port = DramPort::new(memory("fast"), config.clock_mhz);
                let expected = Expected::new(&mesh.triangles, *config);
                expected.assert_same(&mesh.name, &mut port).cycles
            })
            .collect();
        let rate = cycles.iter().sum::<u64>() as f64 / start.elapsed().as_secs_f64() / 1e6;
        println!("{}: {cycles:?} cycles, {rate:.1} Mcycles/s", mesh.name);
    }
}

#[test]
fn forecasting_sorts_twice_the_scene_in_one_pass() {
    // 1024 triangles: 16 runs of 64, where double buffers merge 8.
    let triangles = soup(&mut Random::new(SEED), 1024);
    let passes = SCHEDULES.map(|schedule| {
        let config = machine(64, 4, schedule);
        assert_eq!(config.one_pass_capacity(), [512, 1024][schedule as usize]);
        Expected::new(&triangles, config).assert_same("twice", &mut IdealPort::new(40)).passes + 1
    });
    assert_eq!(passes, [2, 1]);
}

#[test]
fn a_scene_that_double_buffering_takes_twice_through_memory_goes_once_by_forecasting() {
    let test = "a_scene_that_double_buffering_takes_twice_through_memory_goes_once_by_forecasting";
    let Some(_) = places::folder("XYLEM_SCENES", test) else { return };
    let mesh = xylem::scene::load("bunny", &LoadOptions::default()).unwrap();
    // 65,536 primitives in one pass with double buffers; the bunny has 69,451.
    let runs = SCHEDULES.map(|schedule| {
        let config = MachineConfig { spare_buffers: 16, ..machine(1024, 8, schedule) };
        let mut port = DramPort::new(memory("slow"), 1000);
        Expected::new(&mesh.triangles, config).assert_same("bunny", &mut port)
    });
    for (schedule, run) in SCHEDULES.iter().zip(&runs) {
        let (bytes, cycles) = (run.traffic.total().bytes(), run.cycles);
        println!("{schedule:?}: {} passes, {bytes} bytes, {cycles} cycles", run.passes + 1);
    }
    assert_eq!(runs.each_ref().map(|run| run.passes + 1), [2, 1]);
    assert!(runs[1].cycles < runs[0].cycles);
}

/// The stages that a fault at any of these accesses hits, with what the machine said.
fn faults(
    fault: impl Fn(u64) -> Fault + Sync,
    upto: u64,
) -> Vec<(u64, Result<(), BuildError<PortError>>)> {
    let triangles = soup(&mut Random::new(SEED), 700);
    let mut all = Vec::new();
    for schedule in SCHEDULES {
        let expected = Expected::new(&triangles, machine(64, 4, schedule));
        let some: Vec<_> = (0..upto)
            .into_par_iter()
            .map(|at| {
                let mut port = FaultyPort::new(IdealPort::new(20), fault(at));
                let outcome = match expected.run(&mut port) {
                    Ok((run, memory)) => {
                        assert_eq!(run.tree, expected.tree, "{:?}", fault(at));
                        let nodes = expected.layout.build.nodes;
                        assert!(memory.region(nodes) == expected.output.region(nodes));
                        Ok(())
                    }
                    Err(MachineError::Build(error)) => Err(error),
                    Err(error) => panic!("{error}"),
                };
                (at, outcome)
            })
            .collect();
        all.extend(some);
    }
    all
}

/// Which stages the errors name, all of them `expected`.
fn stages(
    outcomes: &[(u64, Result<(), BuildError<PortError>>)],
    expected: PortError,
) -> std::collections::BTreeSet<Stage> {
    let errors = outcomes.iter().filter_map(|(at, outcome)| Some((at, outcome.err()?)));
    errors
        .map(|(at, error)| match error {
            BuildError::Bus { stage, error, .. } if error == expected => stage,
            other => panic!("access {at}: {other}"),
        })
        .collect()
}

#[test]
fn a_failed_read_in_any_phase_is_an_error_that_names_it() {
    let outcomes = faults(Fault::FailRead, 1400);
    let named = stages(&outcomes, PortError::Read);
    assert_eq!(named, [Stage::PartialSort, Stage::Merge].into());
    let failed = outcomes.iter().filter(|(_, outcome)| outcome.is_err()).count();
    println!("{failed} of {} reads failed in {named:?}", outcomes.len());
    // 700 records in lines of two: the input, and runs twice with double buffers, once by
    // forecasting.
    assert_eq!(failed, 350 * 3 + 350 * 2);
}

#[test]
fn a_failed_write_in_any_phase_is_an_error_that_names_it() {
    let outcomes = faults(Fault::FailWrite, 1800);
    let named = stages(&outcomes, PortError::Write);
    println!("writes failed in {named:?}");
    assert!(named.is_superset(&[Stage::PartialSort, Stage::Merge].into()), "{named:?}");
}

#[test]
fn a_lost_answer_ends_in_a_time_out_and_not_in_a_wrong_tree() {
    let outcomes = faults(|at| Fault::LoseRead(at * 7), 200);
    let named = stages(&outcomes, PortError::TimeOut);
    assert_eq!(named, [Stage::PartialSort, Stage::Merge].into());
}

#[test]
fn a_memory_that_takes_nothing_any_more_ends_in_a_time_out() {
    let outcomes = faults(|at| Fault::Refuse(at * 7), 200);
    let named = stages(&outcomes, PortError::TimeOut);
    assert!(named.is_superset(&[Stage::PartialSort, Stage::Merge].into()), "{named:?}");
}

#[test]
fn a_slow_memory_costs_cycles_and_nothing_else() {
    let triangles = soup(&mut Random::new(SEED), 700);
    for schedule in SCHEDULES {
        let expected = Expected::new(&triangles, machine(64, 4, schedule));
        let mut last = 0;
        for delay in [0, 10, 100, 1000] {
            let mut port = FaultyPort::new(IdealPort::new(1), Fault::Delay(delay));
            let cycles = expected.assert_same("slow", &mut port).cycles;
            assert!(cycles >= last, "{delay}: {cycles} after {last}");
            last = cycles;
        }
        println!("{schedule:?}: {last} cycles with answers 1000 cycles late");
    }
}

#[test]
fn a_full_node_region_is_the_core_s_error_and_keeps_the_nodes_before() {
    let triangles = soup(&mut Random::new(SEED), 200);
    let mut expected = Expected::new(&triangles, machine(64, 4, ReadSchedule::DoubleBuffer));
    expected.layout.build.nodes.size = 64 * 100;
    let error = expected.run(&mut IdealPort::new(5)).unwrap_err();
    let wanted = "region `nodes` is too small: 6464 bytes needed, 6400 available";
    assert_eq!(error.to_string(), wanted);
}

#[test]
fn an_invalid_primitive_is_the_core_s_error() {
    let triangles = soup(&mut Random::new(SEED), 200);
    let mut expected = Expected::new(&triangles, machine(64, 4, ReadSchedule::DoubleBuffer));
    let at = (expected.layout.build.primitives.base.0 + 77 * 32) as usize;
    expected.input.bytes_mut()[at + 3] = 0x7f;
    let error = expected.run(&mut IdealPort::new(5)).unwrap_err();
    assert_eq!(error.to_string(), "primitive 77 has an inverted or off-grid box");
}

#[test]
fn the_merge_delivers_a_record_every_two_cycles_when_memory_keeps_up() {
    let triangles = soup(&mut Random::new(SEED), 20_000);
    let config = MachineConfig::p2(BuildConfig::default());
    let run = Expected::new(&triangles, config).assert_same("p2", &mut IdealPort::new(1));
    let merge = run.traffic.stage(Stage::Merge).millicycles / 1000;
    println!("{merge} cycles for 20,000 records, stalls {:?}", run.stalls);
    // Two cycles a record, and the start: a buffer for each of three runs.
    assert!((40_000..40_100).contains(&merge), "{merge}");
}
