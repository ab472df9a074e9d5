//! The FIFO in gates against a queue.

use std::collections::VecDeque;
use std::path::Path;

use xylem_cosim::bench::{Bench, Stop};
use xylem_cosim::pins;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::verilate::{self, CosimError, Mutation, Unit};

/// Whether the first word comes from memory or from a register.
const VARIANTS: [(&str, u64); 2] = [("read", 0), ("registered", 1)];

fn build(
    depth: u64,
    (variant, registered): (&str, u64),
    mutation: Option<Mutation>,
) -> Result<std::path::PathBuf, CosimError> {
    let parameters = [("Width", 64), ("Depth", depth), ("Registered", registered)];
    let config = format!("{variant}-depth{depth}");
    let (top, files) = ("xy_fifo", "fifo.f");
    verilate::unit(&Unit { top, files, config: &config, parameters: &parameters }, mutation)
}

pins!(Pins {
    clear_i, in_valid_i, in_data_i, out_ready_i;
    in_ready_o, out_valid_o, out_data_o,
});

/// Random words in and out for `cycles` cycles; gives how many went through, and in how many cycles the
/// FIFO was full.
fn run(library: &Path, depth: usize, seed: u64, cycles: u64) -> Result<(u64, u64), Stop> {
    let mut bench = Bench::load(library, seed, None)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut queue = VecDeque::new();
    let (mut through, mut full) = (0, 0);
    let (mut pause, mut stall) = (0, 0);
    let mut offered = None;
    while bench.cycle() < cycles {
        if random.below(200) == 0 {
            (pause, stall) = (random.below(4), random.below(4));
        }
        let clear = random.below(300) == 0;
        if offered.is_none() && random.below(4) >= pause {
            offered = Some(random.bits());
        }
        let ready = random.below(4) >= stall;
        bench.rtl.set(pins.clear_i, clear);
        bench.rtl.set(pins.in_valid_i, offered.is_some());
        bench.rtl.set(pins.in_data_i, offered.unwrap_or(0));
        bench.rtl.set(pins.out_ready_i, ready);
        bench.rtl.settle();
        bench.expect(pins.in_ready_o, queue.len() < depth)?;
        bench.expect(pins.out_valid_o, !queue.is_empty())?;
        if let Some(&word) = queue.front() {
            bench.expect(pins.out_data_o, word)?;
        }
        bench.edge()?;
        full += u64::from(queue.len() == depth);
        let room = queue.len() < depth;
        if ready && queue.pop_front().is_some() {
            through += 1;
        }
        if room {
            queue.extend(offered.take());
        }
        if clear {
            queue.clear();
        }
    }
    Ok((through, full))
}

#[test]
fn words_come_out_in_order_and_none_is_lost() {
    if !tools_for("words_come_out_in_order_and_none_is_lost") {
        return;
    }
    for variant in VARIANTS {
        for depth in [2, 4, 16] {
            let library = build(depth, variant, None).unwrap_or_else(|error| panic!("{error}"));
            for seed in 1..=2 {
                let name = format!("{}, depth {depth}, seed {seed}", variant.0);
                let (through, full) = run(&library, depth as usize, seed, 50_000)
                    .unwrap_or_else(|stop| panic!("{name}: {stop}"));
                println!("{name}: {through} words, {full} cycles full");
                assert!(through > 10_000 && full > 1000);
            }
        }
    }
}

/// Faults of both variants: what is wrong, and the text that makes it so.
const FAULTS: [(&str, &str, &str); 4] = [
    ("a word too many", "!= (AddrWidth + 1)'(Depth)", "<= (AddrWidth + 1)'(Depth)"),
    ("a word is taken twice", "if (pop) read_q", "if (pop && !push) read_q"),
    ("clear keeps a word", "end else if (clear_i) begin", "end else if (clear_i && !push) begin"),
    (
        "the last place is not written",
        ".write_i     (in_ready_o)",
        ".write_i     (in_ready_o && (write_q - read_q) != (AddrWidth + 1)'(Depth - 1))",
    ),
];

/// Faults of the word in the register.
const REGISTERED_FAULTS: [(&str, &str, &str); 4] = [
    (
        "the word behind the first one is always in memory",
        "more ? read_data : in_data_i",
        "valid_q ? read_data : in_data_i",
    ),
    ("the second word follows itself", "read_addr   = second[", "read_addr   = read_q["),
    ("the last word stays", "(pop ? more : valid_q)", "valid_q"),
    ("clear keeps the first word", "valid_q <= !clear_i && (push", "valid_q <= (push"),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    for variant in VARIANTS {
        let registered = variant.1 == 1;
        let own = if registered { &REGISTERED_FAULTS[..] } else { &[] };
        for &(what, from, to) in FAULTS.iter().chain(own) {
            let what = format!("{}: {what}", variant.0);
            let mutation = Mutation { file: "xy_fifo.sv", from, to };
            let faulty = build(4, variant, Some(mutation));
            let faulty = faulty.unwrap_or_else(|error| panic!("{what}: {error}"));
            match run(&faulty, 4, 3, 50_000) {
                Ok(passed) => panic!("not seen: {what}: {passed:?}"),
                Err(stop) => println!("{what}: seen in cycle {}", stop.cycle()),
            }
        }
    }
}
