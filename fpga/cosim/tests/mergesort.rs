//! The builder's front half in gates against the clocked builder and the core.

use xylem_core::num::MortonWidth;
use xylem_core::sort::InputFormat;
use xylem_cosim::bench::{self, Stop, Waves};
use xylem_cosim::mergesort::{self, Job, MergeSortConfig, MergeSortRtl, Neighbours};
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

fn library(config: MergeSortConfig) -> std::path::PathBuf {
    mergesort::build(config, None).unwrap_or_else(|error| panic!("{error}"))
}

const INPUTS: [InputFormat; 2] = [InputFormat::Box32, InputFormat::Triangle40];

/// What a run without a mismatch amounts to.
#[derive(Clone, Copy, Debug, Default)]
struct Summary {
    sorts: u64,
    given_up: u64,
    records: u64,
    most_records: u32,
    model_cycles: u64,
    rtl_cycles: u64,
}

const HEADER: &str = "| test | configuration | seed | sorts | given up | records | most | model cycles | RTL cycles | delta |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|";

impl Summary {
    fn row(&self, test: &str, config: MergeSortConfig, seed: u64) -> String {
        let Self { sorts, given_up, records, most_records, model_cycles, rtl_cycles } = self;
        let delta = *rtl_cycles as i64 - *model_cycles as i64;
        let name = config.name;
        format!(
            "| {test} | {name} | {seed} | {sorts} | {given_up} | {records} | {most_records} | {model_cycles} | {rtl_cycles} | {delta} |"
        )
    }
}

/// Sorts after sorts of any input behind any neighbours, some given up in the middle, for at least
/// `cycles` cycles.
fn run(
    library: &std::path::Path,
    config: MergeSortConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut rtl = MergeSortRtl::load(library, seed, waves)?;
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    let capacity = u64::from(config.capacity);
    while rtl.cycle() < cycles {
        let most = [4, 3 * u64::from(config.burst), 2 * capacity, 9 * capacity, 40 * capacity];
        // The large ones seldom.
        let pick = [0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 4][random.below(16) as usize];
        let edge = [capacity - 1, capacity, capacity + 1, 2 * capacity][random.below(4) as usize];
        let count = if random.below(8) == 0 { edge } else { random.below(most[pick]) };
        let morton = [MortonWidth::Bits30, MortonWidth::Bits63][random.below(2) as usize];
        let items = mergesort::primitives(&mut random, count as u32);
        let mut machine = config.machine(morton);
        machine.build.input = INPUTS[random.below(2) as usize];
        let job = Job::new(machine, &items);
        let neighbours = Neighbours::draw(&mut random);
        let give_up = (random.below(4) == 0).then(|| random.below(3000));
        let outcome = rtl.sort(&job, neighbours, random.bits(), give_up)?;
        if give_up.is_some_and(|at| at < outcome.model_cycles) {
            summary.given_up += 1;
            continue;
        }
        summary.sorts += 1;
        summary.records += count;
        summary.most_records = summary.most_records.max(count as u32);
        summary.model_cycles += outcome.model_cycles;
        summary.rtl_cycles += outcome.rtl_cycles;
    }
    Ok(summary)
}

#[test]
fn rtl_and_model_agree_in_every_cycle_and_runs_are_the_core_s() {
    if !tools_for("rtl_and_model_agree_in_every_cycle_and_runs_are_the_core_s") {
        return;
    }
    println!("{HEADER}");
    let config = MergeSortConfig::SMALL;
    let library = library(config);
    let mut given_up = 0;
    for seed in 1..=4 {
        let name = format!("mergesort-{}-seed{seed}", config.name);
        let run = |waves| run(&library, config, seed, 200_000, waves);
        let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
        println!("{}", s.row("merge sort lockstep", config, seed));
        assert_eq!(s.model_cycles, s.rtl_cycles);
        // Blocks, groups of runs and further passes.
        assert!(s.sorts > 20 && s.most_records > 16 * 128, "{s:?}");
        given_up += s.given_up;
    }
    assert!(given_up > 10, "{given_up}");
}

#[test]
fn the_paper_s_sizes_agree_and_deliver_a_record_every_two_cycles_when_memory_keeps_up() {
    if !tools_for("the_paper_s_sizes_agree") {
        return;
    }
    let config = MergeSortConfig::PAPER;
    let library = library(config);
    let mut rtl = MergeSortRtl::load(&library, 1, None).unwrap_or_else(|stop| panic!("{stop}"));
    let mut random = Random::new(20);
    println!("{HEADER}");
    let slow = Neighbours { jitter: 40, read_stall: 4, write_stall: 4, ..Neighbours::ideal(60) };
    for (count, neighbours) in [(20_000, Neighbours::ideal(10)), (9_001, slow)] {
        let items = mergesort::primitives(&mut random, count);
        let job = Job::new(config.machine(MortonWidth::Bits63), &items);
        let outcome = rtl.sort(&job, neighbours, 3, None).unwrap_or_else(|stop| panic!("{stop}"));
        let summary = Summary {
            sorts: 1,
            given_up: 0,
            records: count.into(),
            most_records: count,
            model_cycles: outcome.model_cycles,
            rtl_cycles: outcome.rtl_cycles,
        };
        println!("{}", summary.row("merge sort lockstep", config, 1));
        assert_eq!(outcome.model_cycles, outcome.rtl_cycles);
        if neighbours == Neighbours::ideal(10) {
            assert_eq!(outcome.stream_cycles, 2 * u64::from(count) - 1);
        }
    }
}

#[test]
fn a_record_that_is_none_and_a_region_too_short_are_errors_and_touch_nothing_else() {
    if !tools_for("a_record_that_is_none_and_a_region_too_short_are_errors") {
        return;
    }
    let config = MergeSortConfig::SMALL;
    let library = library(config);
    let mut rtl = MergeSortRtl::load(&library, 7, None).unwrap_or_else(|stop| panic!("{stop}"));
    let mut random = Random::new(7);
    let machine = config.machine(MortonWidth::Bits63);
    for (index, input) in [0, 1, 2, 77, 298, 299].into_iter().zip(INPUTS.into_iter().cycle()) {
        let items = mergesort::primitives(&mut random, 300);
        let mut machine = machine;
        machine.build.input = input;
        let mut job = Job::new(machine, &items);
        job.spoil(index);
        let (primitive, region, _) =
            rtl.fail(&job, 4000).unwrap_or_else(|stop| panic!("{index}: {stop}"));
        assert_eq!((primitive, region), (Some(index.into()), false));
        rtl.clear().unwrap_or_else(|stop| panic!("{index}: {stop}"));
    }
    for bytes in [32, 64, 4000] {
        let items = mergesort::primitives(&mut random, 300);
        let mut job = Job::new(machine, &items);
        job.shorten(bytes);
        let (primitive, region, memory) =
            rtl.fail(&job, 4000).unwrap_or_else(|stop| panic!("{bytes}: {stop}"));
        assert_eq!((primitive, region), (None, true));
        job.assert_runs_inside(memory);
        rtl.clear().unwrap_or_else(|stop| panic!("{bytes}: {stop}"));
    }
    // The next one runs clean.
    let items = mergesort::primitives(&mut random, 300);
    let job = Job::new(machine, &items);
    rtl.sort(&job, Neighbours::ideal(3), 1, None).unwrap_or_else(|stop| panic!("{stop}"));
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 13] = [
    (
        "equal codes change places",
        Mutation {
            file: "xy_sorter.sv",
            from: "code < read_code[b];",
            to: "code <= read_code[b];",
        },
    ),
    (
        "records come in while others change places",
        Mutation {
            file: "xy_sorter.sv",
            from: "assign works    = !accept && !giving_q;",
            to: "assign works    = !giving_q;",
        },
    ),
    (
        "x and z are confused in the code",
        Mutation {
            file: "xy_morton.sv",
            from: "{box_i.lo.x, box_i.lo.y, box_i.lo.z}",
            to: "{box_i.lo.z, box_i.lo.y, box_i.lo.x}",
        },
    ),
    (
        "the last line of an odd input is not asked for",
        Mutation {
            file: "xy_reader.sv",
            from: "32'((count_i + 32'd1) >> 1)",
            to: "32'(count_i >> 1)",
        },
    ),
    (
        "runs are read before they are written",
        Mutation {
            file: "xy_mergesort.sv",
            from: "if (writer_empty && quiet_i) begin",
            to: "if (writer_empty) begin",
        },
    ),
    (
        "boxes are taken for triangles",
        Mutation {
            file: "xy_mergesort.sv",
            from: "      .triangles_i,",
            to: "      .triangles_i(1'b1),",
        },
    ),
    (
        "a burst counts as here with its first line",
        Mutation {
            file: "xy_bursts.sv",
            from: "rsp_valid_i && complete",
            to: "rsp_valid_i && (rsp_line == '0)",
        },
    ),
    (
        "second bursts are not asked for",
        Mutation {
            file: "xy_bursts.sv",
            from: "gen_q <= !gen_second_q && (count_q > IndexWidth'(Burst));",
            to: "gen_q <= 1'b0;",
        },
    ),
    (
        "the successor is used before it is here",
        Mutation {
            file: "xy_multimerge.sv",
            from: "else if (buffer_ends) here = slot_full[next_place[PlaceWidth-1]];",
            to: "",
        },
    ),
    (
        "the successor leaves in the record's place",
        Mutation {
            file: "xy_multimerge.sv",
            from: "assign head = look_odd_q ? pad[1] : pad[0];",
            to: "assign head = look_odd_q ? pad[0] : pad[1];",
        },
    ),
    (
        "a run's last burst is followed by one of nothing",
        Mutation {
            file: "xy_multimerge.sv",
            from: "take && (look_left_q > IndexWidth'(Burst + 1))",
            to: "take && (look_left_q >= IndexWidth'(Burst + 1))",
        },
    ),
    (
        "the FIFO has one place less",
        Mutation {
            file: "xy_multimerge.sv",
            from: "assign room = room_q != '0;",
            to: "assign room = room_q > RoomWidth'(1);",
        },
    ),
    (
        "further passes read what they write",
        Mutation {
            file: "xy_mergesort.sv",
            from: "source_b_d = !source_b_q;",
            to: "source_b_d = source_b_q;",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = MergeSortConfig::SMALL;
    for (what, mutation) in MUTATIONS {
        bench::must_see(what, mergesort::build(config, Some(mutation)), |faulty| {
            run(faulty, config, 1, 150_000, None)
        });
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let all = table["mergesort"].as_table().unwrap();
    assert_eq!(all.len(), MergeSortConfig::ALL.len());
    for config in MergeSortConfig::ALL {
        let values = all[config.name].as_table().unwrap();
        for (key, value) in [
            ("capacity", config.capacity),
            ("burst", config.burst),
            ("sorters", config.sorters),
            ("fifo", config.fifo),
            ("read_ahead", config.read_ahead),
            ("code_bits", config.code_bits),
        ] {
            assert_eq!(values[key].as_integer(), Some(value.into()), "{}: {key}", config.name);
        }
    }
}
