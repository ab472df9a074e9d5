//! The insertion sorters in gates against their cycle model.

use std::path::{Path, PathBuf};

use glam::IVec3;
use xylem::machine::sorter::Sorters;
use xylem_core::geom::Aabb;
use xylem_core::num::{Grid, MortonCoder, MortonWidth};
use xylem_core::sort::Item;
use xylem_cosim::bench::{self, Bench, Stop, Waves};
use xylem_cosim::pins;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::types::record_bytes;
use xylem_cosim::verilate::{self, CosimError, Mutation, Unit};

/// Name, sorters, records of a piece.
const CONFIGS: [(&str, u32, u32); 2] = [("small", 2, 8), ("paper", 8, 32)];

fn build(
    (config, sorters, piece): (&str, u32, u32),
    mutation: Option<Mutation>,
) -> Result<PathBuf, CosimError> {
    let parameters = [("Sorters", sorters.into()), ("Piece", piece.into()), ("CodeWidth", 63)];
    let (top, files) = ("xy_sorters", "sorters.f");
    verilate::unit(&Unit { top, files, config, parameters: &parameters }, mutation)
}

pins!(Pins {
    clear_i, wide_i, in_valid_i, in_two_i, in_last_i, in_pair_i, out_ready_i;
    in_ready_o, out_valid_o, out_two_o, out_pair_o,
});

/// Pairs of records, and whether they are the last of all.
fn draw(random: &mut Random, coder: &MortonCoder, spread: u32) -> (Vec<Item>, bool) {
    let last = random.below(40) == 0;
    let count = if last { 1 + random.below(2) } else { 2 };
    let mut item = || {
        let at = IVec3::from_array([0; 3].map(|_| random.bits() as i32 >> (32 - spread)));
        let bounds = Aabb::new(at, at);
        let code = coder.code(bounds.min, bounds.max);
        Item { code, bounds, reference: random.bits() as u32 >> 1 }
    };
    ((0..count).map(|_| item()).collect(), last)
}

/// Sorts pieces for `cycles` cycles; gives how many records came out.
fn run(
    library: &Path,
    (_, sorters, piece): (&str, u32, u32),
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<u64, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut sorted = 0;
    while bench.cycle() < cycles {
        let width = [MortonWidth::Bits30, MortonWidth::Bits63][random.below(2) as usize];
        let coder = MortonCoder::new(Grid::DEFAULT, width);
        let spread = [24, 15, 4][random.below(3) as usize];
        let (pause, stall) = (random.below(16), random.below(16));
        let mut model = Sorters::new(sorters, piece);
        let mut offered = None;
        bench.rtl.set(pins.wide_i, width == MortonWidth::Bits63);
        let end = 1 + random.below(4000);
        for now in 0..=end {
            if offered.is_none() && random.below(16) >= pause {
                offered = Some(draw(&mut random, &coder, spread));
            }
            let (ready, clear) = (random.below(16) >= stall, now == end);
            let (pair, last) = offered.clone().unwrap_or_default();
            let rtl = &mut bench.rtl;
            rtl.set(pins.clear_i, clear);
            rtl.set(pins.in_valid_i, !pair.is_empty());
            rtl.set(pins.in_two_i, pair.len() == 2);
            rtl.set(pins.in_last_i, last);
            rtl.set_bytes(pins.in_pair_i, &pair.iter().flat_map(record_bytes).collect::<Vec<_>>());
            rtl.set(pins.out_ready_i, ready);
            rtl.settle();

            let room = model.is_ready();
            bench.expect(pins.in_ready_o, room)?;
            let mut after = model.clone();
            let out = after.deliver();
            bench.expect(pins.out_valid_o, out.is_some())?;
            if let Some((items, given)) = out {
                bench.expect(pins.out_two_o, given == 2)?;
                let expected: Vec<u8> = items[..given].iter().flat_map(record_bytes).collect();
                let bytes = bench.rtl.bytes(pins.out_pair_o);
                assert_eq!(bytes[..expected.len()], expected, "cycle {}", bench.cycle());
            }
            bench.edge()?;
            if room && offered.take().is_some() {
                for (at, item) in pair.iter().enumerate() {
                    model.accept(*item, last && at + 1 == pair.len());
                }
            }
            if ready && model.deliver().is_some() {
                sorted += out.map_or(0, |(_, given)| given as u64);
            }
            model.tick();
        }
    }
    Ok(sorted)
}

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    for config in CONFIGS {
        let library = build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in 1..=2 {
            let name = format!("sorters-{}-seed{seed}", config.0);
            let run = |waves| run(&library, config, seed, 60_000, waves);
            let sorted = bench::with_waves(&name, run);
            let sorted = sorted.unwrap_or_else(|stop| panic!("{name}: {stop}"));
            println!("{name}: {sorted} records in 60000 cycles, delta 0");
            assert!(sorted > 10_000, "{sorted}");
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 8] = [
    (
        "equal codes change places",
        Mutation {
            file: "xy_sorter.sv",
            from: "code < read_code[b];",
            to: "code <= read_code[b];",
        },
    ),
    (
        "the lowest record is not compared with",
        Mutation {
            file: "xy_sorter.sv",
            from: "lowest   = below_q == '0",
            to: "lowest   = below_q <= 1",
        },
    ),
    (
        "sorting goes on while records come in",
        Mutation {
            file: "xy_sorter.sv",
            from: "works    = !accept && !giving_q",
            to: "works    = !giving_q",
        },
    ),
    (
        "sorting goes on while records leave",
        Mutation {
            file: "xy_sorter.sv",
            from: "works    = !accept && !giving_q",
            to: "works    = !accept",
        },
    ),
    (
        "a piece is handed out a comparison early",
        Mutation {
            file: "xy_sorter.sv",
            from: "complete_q && !compare_q && !more_q",
            to: "complete_q && !more_q",
        },
    ),
    (
        "neighbours in different rows change places in one",
        Mutation {
            file: "xy_sorter.sv",
            from: "below_row + RowWidth'(below_odd)",
            to: "below_row",
        },
    ),
    (
        "a piece follows in the row that leaves",
        Mutation {
            file: "xy_sorter.sv",
            from: "(taken_q[PlaceWidth-1:1] < out_row_q)",
            to: "(taken_q[PlaceWidth-1:1] <= out_row_q)",
        },
    ),
    (
        "the last piece does not end",
        Mutation {
            file: "xy_sorters.sv",
            from: "if (in_last_i || (in_row_q == '1))",
            to: "if (in_row_q == '1)",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = CONFIGS[0];
    for (what, mutation) in MUTATIONS {
        bench::must_see(what, build(config, Some(mutation)), |faulty| {
            run(faulty, config, 3, 60_000, None)
        });
    }
}
