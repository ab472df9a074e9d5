//! The memory model against other simulators, closed formulas and the rules of LPDDR3.
//!
//! `XYLEM_FULL=1 cargo test -p xylem-tests --test dram -- --nocapture` prints all patterns on all
//! memories; without `XYLEM_FULL`, memories other than `slow` get three of them.

use std::convert::Infallible;
use std::sync::LazyLock;

use proptest::prelude::*;
use rayon::prelude::*;
use xylem::dram::{CONFIGS, ChannelStats, Config, Issued, Memory, Request, replay};
use xylem::report::Table;
use xylem_tests::cases::for_all;
use xylem_tests::commands::{LPDDR3_1333, LPDDR3_1600, Sheet, check};
use xylem_tests::dram::{Pattern, patterns};
use xylem_tests::places::full;

const SEED: u64 = 0x5eed_0064;
const REFERENCE: &str = include_str!("../data/dram-reference.csv");

/// A pattern on a memory.
#[derive(Debug)]
struct Run {
    pattern: &'static str,
    memory: &'static str,
    clocks: u64,
    gb_per_s: f64,
    stats: ChannelStats,
}

/// What short runs have on every memory.
const SHORT: [&str; 3] = ["a_seq_read", "d_rand64_read", "e4_merge_rnd_skew"];

/// The patterns that are asked for on every memory.
static RUNS: LazyLock<Vec<Run>> = LazyLock::new(|| {
    let patterns = patterns();
    let pairs = CONFIGS.iter().flat_map(|config| patterns.iter().map(move |p| (config, p)));
    let wanted = |(config, pattern): &(&Config, &Pattern)| {
        full() || config.name == "slow" || SHORT.contains(&pattern.name)
    };
    let pairs: Vec<_> = pairs.filter(wanted).collect();
    let run = |(config, pattern): &(&Config, &Pattern)| {
        let mut memory = Memory::new(config);
        let requests = pattern.requests.iter().map(|request| Ok::<_, Infallible>(*request));
        let mut done = 0;
        let Ok(clocks) = replay(&mut memory, requests, |_| {}, |_| done += 1);
        let stats = memory.stats().total();
        let reads = pattern.requests.iter().filter(|(_, write)| !write).count() as u64;
        assert_eq!((done, stats.reads + stats.forwarded_reads), (reads, reads));
        assert_eq!(stats.writes + reads, pattern.requests.len() as u64);
        Run {
            pattern: pattern.name,
            memory: config.name,
            clocks,
            gb_per_s: pattern.requests.len() as f64 * 64.0 / config.nanoseconds(clocks),
            stats,
        }
    };
    pairs.par_iter().map(run).collect()
});

fn find(pattern: &str, memory: &str) -> Option<&'static Run> {
    RUNS.iter().find(|run| run.pattern == pattern && run.memory == memory)
}

fn run(pattern: &str, memory: &str) -> &'static Run {
    find(pattern, memory).unwrap_or_else(|| panic!("no run of {pattern} on {memory}"))
}

/// A row of the reference: what a simulator reports for a pattern.
#[derive(Debug)]
struct Reference {
    pattern: &'static str,
    simulator: &'static str,
    clocks: u64,
    gb_per_s: f64,
    rows: [u64; 3],
}

fn reference() -> Vec<Reference> {
    let lines = REFERENCE.lines().filter(|line| !line.starts_with('#')).skip(1);
    let row = |line: &'static str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [pattern, config, _, clocks, _, gb_per_s, hits, misses, conflicts] = cells[..] else {
            panic!("{line}: nine cells are expected");
        };
        let number = |cell: &str| cell.parse().unwrap_or_else(|e| panic!("{line}: {cell}: {e}"));
        Reference {
            pattern,
            simulator: config.split('/').next().unwrap_or(config),
            clocks: number(clocks),
            gb_per_s: gb_per_s.parse().unwrap(),
            rows: [hits, misses, conflicts].map(number),
        }
    };
    let rows: Vec<_> = lines.map(row).collect();
    assert_eq!(rows.len(), 12);
    rows
}

#[test]
fn bandwidths_agree_with_other_simulators() {
    let references = reference();
    let of = |simulator: &'static str| references.iter().filter(move |r| r.simulator == simulator);
    for ramulator in of("ramulator1") {
        let pattern = ramulator.pattern;
        let ours = run(pattern, "slow").gb_per_s;
        let dramsim = of("dramsim3").find(|row| row.pattern == pattern).unwrap().gb_per_s;
        let (a, b) = (ramulator.gb_per_s, dramsim);
        let (low, high) = match pattern {
            "a_seq_read" | "b_seq_write" => (a * 0.99, a * 1.01),
            "d_rand64_read" => (a * 0.97, a * 1.03),
            "c_rand512_read" => (a * 0.96, a * 1.04),
            _ => (a.min(b) * 0.95, a.max(b) * 1.05),
        };
        let deviation = |of: f64| (ours / of - 1.0) * 100.0;
        println!(
            "{pattern}: {ours:.4} GB/s; Ramulator 1 {a:.4} ({:+.2} %), DRAMsim3 {b:.4} ({:+.2} %)",
            deviation(a),
            deviation(b)
        );
        assert!((low..=high).contains(&ours), "{pattern}: {ours} not in {low}..{high}");
    }
}

#[test]
fn clocks_and_row_counts_equal_ramulators() {
    for row in reference().iter().filter(|row| row.simulator == "ramulator1") {
        let run = run(row.pattern, "slow");
        let rows = [run.stats.row_hits, run.stats.row_misses, run.stats.row_conflicts];
        assert_eq!((run.clocks, rows), (row.clocks, row.rows), "{}", row.pattern);
    }
}

#[test]
fn patterns_stay_below_the_peak_on_every_memory() {
    let mut header = vec!["GB/s".to_owned()];
    header.extend(CONFIGS.iter().map(|config| config.name.to_owned()));
    let mut table = Table::new(header);
    for pattern in patterns() {
        let cells = CONFIGS.iter().map(|config| {
            let Some(run) = find(pattern.name, config.name) else { return "-".to_owned() };
            assert!(run.gb_per_s < config.peak_gb_per_s(), "{run:?}");
            let buses = run.clocks * u64::from(config.mapping.channels);
            assert!(run.stats.busy_clocks <= buses, "{run:?}");
            format!("{:.3}", run.gb_per_s)
        });
        table.row([pattern.name.to_owned()].into_iter().chain(cells));
    }
    print!("{table}");
}

#[test]
fn streaming_reaches_the_peak_less_refresh() {
    // A refresh costs its own time, closing the rows before and opening one after.
    let lost = [("slow", 3120.0, 6 + 17 + 168 + 15), ("fast", 2600.0, 5 + 14 + 140 + 12)];
    for (memory, interval, lost) in lost {
        let peak = Config::by_name(memory).unwrap().peak_gb_per_s();
        let bound = peak * (1.0 - f64::from(lost) / interval);
        let reached = run("a_seq_read", memory).gb_per_s / bound;
        println!("{memory}: {reached:.4} of the peak less refresh");
        assert!((0.99..1.01).contains(&reached), "{memory}: {reached}");
    }
    // Without refresh, only the first latency is lost.
    for memory in ["p1-16", "p1-32"] {
        let peak = Config::by_name(memory).unwrap().peak_gb_per_s();
        assert!(run("a_seq_read", memory).gb_per_s > 0.999 * peak);
    }
}

#[test]
fn random_requests_are_bound_by_the_window_of_four_activates() {
    let bound = 4.0 * 64.0 / (40.0 * 1.25) * (1.0 - (17.0 + 168.0) / 3120.0);
    let reached = run("d_rand64_read", "slow").gb_per_s / bound;
    assert!((0.98..1.005).contains(&reached), "{reached}");
}

#[test]
fn streams_that_share_a_bank_lose_a_fifth() {
    let aligned = run("e1_merge_rr_aligned", "slow").gb_per_s;
    let lost = 1.0 - aligned / run("e3_merge_rr_skew", "slow").gb_per_s;
    println!("aligned bases lose {:.1} % (about 22 % elsewhere)", lost * 100.0);
    assert!((0.19..0.25).contains(&lost), "{lost}");
}

/// A request and the clocks since the one before it was accepted.
type Traffic = Vec<(u64, bool, u64)>;

/// What became of traffic: when each read was accepted and came back, by its place; all commands of
/// each channel; all counts.
#[derive(Debug, PartialEq)]
struct Outcome {
    reads: Vec<(u64, u64, u64)>,
    commands: Vec<Vec<Issued>>,
    stats: Vec<ChannelStats>,
    clocks: u64,
}

/// Runs traffic, clock by clock or from event to event.
fn drive(config: &Config, traffic: &Traffic, skip: bool) -> Outcome {
    let mut memory = Memory::new(config);
    memory.record_commands();
    let mut accepted_at = vec![0; traffic.len()];
    let (mut reads, mut clock, mut at, mut due) = (Vec::new(), 0, 0, 0);
    loop {
        memory.tick(clock);
        while let Some(tag) = memory.take_done() {
            reads.push((tag, accepted_at[tag as usize], clock));
        }
        let mut refused = false;
        while let Some((addr, write, _)) = traffic.get(at).filter(|_| due <= clock && !refused) {
            let request = Request { addr: *addr, write: *write, tag: at as u64 };
            refused = !memory.offer(request, clock);
            if !refused {
                accepted_at[at] = clock;
                at += 1;
                due = clock + traffic.get(at).map_or(0, |(_, _, gap)| *gap);
            }
        }
        if at == traffic.len() && memory.is_idle() {
            break;
        }
        let event = memory.next_event(clock);
        let offer = (at < traffic.len() && !refused).then_some(due);
        clock = match event.into_iter().chain(offer).min() {
            Some(next) if skip => next,
            _ => clock + 1,
        };
    }
    let channels = 0..config.mapping.channels as usize;
    let commands = channels.map(|channel| memory.commands(channel).to_vec()).collect();
    Outcome { reads, commands, stats: memory.stats().channels.clone(), clocks: clock }
}

/// Runs of requests, few rows of few banks, so that all cases of rows and turns come up.
fn traffic(channels: u64) -> impl Strategy<Value = Traffic> {
    let gap = prop_oneof![12 => Just(0_u64), 3 => 1..=6_u64, 1 => 1..=400_u64];
    let run = (0..4_u64, 0..8_u64, 0..128_u64, 1..=40_u64, 0..3_u64, any::<bool>(), gap);
    prop::collection::vec(run, 1..60).prop_map(move |runs| {
        let mut traffic = Vec::new();
        for (row, bank, column, length, stride, write, gap) in runs {
            for i in 0..length {
                let place = ((row * 8 + bank) * 128 * channels + column + i * stride) * 64;
                traffic.push((place, write, if i == 0 { gap } else { 0 }));
            }
        }
        traffic
    })
}

/// LPDDR3 memories and the sheet that their commands must keep to.
const SHEETS: [(&str, &Sheet); 4] = [
    ("slow", &LPDDR3_1600),
    ("medium", &LPDDR3_1600),
    ("fast", &LPDDR3_1333),
    ("p3", &LPDDR3_1600),
];

#[test]
fn random_traffic_keeps_every_rule_and_answers_every_read_once() {
    // 32 older requests and a drain of 32 writes, all in conflict, and a refresh in between.
    const LONGEST_WAIT: u64 = 64 * 60 + 400;
    let longest = std::cell::Cell::new(0);
    for (name, sheet) in SHEETS {
        let config = Config::by_name(name).unwrap();
        for_all(SEED, 40, traffic(u64::from(config.mapping.channels)), |traffic| {
            let outcome = drive(config, &traffic, false);
            for commands in &outcome.commands {
                check(commands, sheet).map_err(TestCaseError::fail)?;
            }
            let mut tags: Vec<u64> = outcome.reads.iter().map(|(tag, _, _)| *tag).collect();
            tags.sort_unstable();
            let expected = (0..).zip(&traffic).filter(|(_, (_, write, _))| !write);
            prop_assert_eq!(tags, expected.map(|(tag, _)| tag).collect::<Vec<u64>>());
            for (tag, accepted, done) in &outcome.reads {
                longest.set(longest.get().max(done - accepted));
                prop_assert!(done - accepted <= LONGEST_WAIT, "{tag}: {accepted} to {done}");
            }
            Ok(())
        });
    }
    println!("the longest wait of a read was {} clocks", longest.get());
}

#[test]
fn skipping_clocks_and_running_again_change_nothing() {
    for config in CONFIGS {
        for_all(SEED, 15, traffic(u64::from(config.mapping.channels)), |traffic| {
            let stepped = drive(&config, &traffic, false);
            prop_assert_eq!(&stepped, &drive(&config, &traffic, true));
            prop_assert_eq!(&stepped, &drive(&config, &traffic, false));
            Ok(())
        });
    }
}

#[test]
fn the_checker_finds_a_command_that_is_a_clock_early() {
    let config = Config::by_name("slow").unwrap();
    let traffic: Traffic = (0..200).map(|i| (i * 4096 * 5, i % 3 == 0, 0)).collect();
    let commands = drive(config, &traffic, false).commands.remove(0);
    assert_eq!(check(&commands, &LPDDR3_1600), Ok(()));
    // Commands that the rules, and not the controller's choice, held back to the clock they have.
    let mut found = 0;
    for i in 1..commands.len() {
        let mut early = commands.clone();
        early[i].clock -= 1;
        found += usize::from(check(&early[..=i], &LPDDR3_1600).is_err());
    }
    assert!(found * 2 > commands.len(), "{found} of {}", commands.len());
}
