//! The primitive reader in gates against its cycle model.

use std::path::{Path, PathBuf};

use xylem::machine::reader::Reader;
use xylem_core::mem::Region;
use xylem_core::num::MortonWidth;
use xylem_core::sort::{InputFormat, Item};
use xylem_cosim::bench::{self, Bench, Stop, Waves};
use xylem_cosim::mergesort::{self, MergeSortConfig};
use xylem_cosim::pins;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::types::record_bytes;
use xylem_cosim::verilate::{self, CosimError, Mutation, Unit};

fn build(room: u32, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let config = format!("room{room}");
    let parameters = [("Room", room.into())];
    let (top, files) = ("xy_reader", "reader.f");
    verilate::unit(&Unit { top, files, config: &config, parameters: &parameters }, mutation)
}

pins!(Pins {
    clear_i, start_i, base_i, count_i, triangles_i, rd_ready_i, rsp_valid_i, rsp_tag_i, rsp_data_i, pair_ready_i;
    rd_valid_o, rd_addr_o, rd_tag_o, pair_valid_o, pair_two_o, pair_last_o, pair_o, done_o, error_o,
    error_index_o,
});

/// Bytes of records, some of which may be none: off the grid, inverted, or with a reference too high.
fn input(random: &mut Random, format: InputFormat, count: u32) -> Vec<u8> {
    let stride = format.bytes() as usize;
    let mut image = vec![0; 64 + (stride * count as usize).next_multiple_of(64)];
    let items = mergesort::primitives(random, count);
    for (bytes, item) in image[64..].chunks_exact_mut(stride).zip(&items) {
        mergesort::encode(item, format, bytes);
        if format == InputFormat::Box32 {
            bytes[28..].copy_from_slice(&(random.bits() as u32).to_le_bytes());
        }
    }
    if random.below(3) == 0 && count > 0 {
        let at = 64 + stride * random.below(count.into()) as usize;
        let record = &mut image[at..at + stride];
        let axis = 4 * random.below(3) as usize;
        match random.below(4) {
            _ if format == InputFormat::Triangle40 => {
                let at = axis + 12 * random.below(3) as usize;
                let beyond = (1 << 23) + (random.below(1 << 23) * random.below(2)) as i32;
                let coordinate = if random.below(2) == 0 { beyond } else { -beyond - 1 };
                record[at..at + 4].copy_from_slice(&coordinate.to_le_bytes());
            }
            0 => record[axis + 3] ^= 0x40,
            // Below the grid, by one or so much that one bit more would hold it.
            3 => {
                let lo = -(1 << 23) - 1 - random.below(1 << 23) as i32 * random.below(2) as i32;
                record[axis..axis + 4].copy_from_slice(&lo.to_le_bytes());
            }
            // The lower corner one above the upper one; off the grid at its upper end, which is as good.
            1 => {
                let hi: [u8; 4] = std::array::from_fn(|i| record[axis + 12 + i]);
                let lo = i32::from_le_bytes(hi) + 1;
                record[axis..axis + 4].copy_from_slice(&lo.to_le_bytes());
            }
            _ => record[27] |= 0x80,
        }
    }
    image
}

/// Reads input after input for `cycles` cycles; gives how many records came, and how many errors.
fn run(
    library: &Path,
    room: u32,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<(u64, u64), Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut build = MergeSortConfig::SMALL.machine(MortonWidth::Bits63).build;
    let (mut records, mut errors) = (0, 0);
    while bench.cycle() < cycles {
        let most = [3, 40, 600][random.below(3) as usize];
        let count = random.below(most) as u32;
        build.input = [InputFormat::Box32, InputFormat::Triangle40][random.below(2) as usize];
        let image = input(&mut random, build.input, count);
        let region = Region::new(64, build.input.bytes() * count);
        let mut model = Reader::new(region, build.decoder(), count, room);
        let (stall, pause) = (random.below(4), random.below(4));
        let (latency, jitter) = (1 + random.below(30), random.below(20));
        // Lines under way: when they come, tag and address.
        let mut flying: Vec<(u64, u64, u32)> = Vec::new();
        let mut failed = None;
        let rtl = &mut bench.rtl;
        rtl.set(pins.start_i, true);
        rtl.set(pins.base_i, 64u32);
        rtl.set(pins.count_i, count);
        rtl.set(pins.triangles_i, build.input == InputFormat::Triangle40);
        rtl.set(pins.rd_ready_i, false);
        rtl.set(pins.rsp_valid_i, false);
        rtl.settle();
        bench.edge()?;
        bench.rtl.set(pins.start_i, false);
        let mut after = 0;
        while after < 3 {
            let now = bench.cycle();
            let (rd_ready, pair_ready) = (random.below(4) >= stall, random.below(4) >= pause);
            let due = flying.iter().position(|(due, ..)| *due <= now);
            let come = due.map(|at| flying.remove(at));
            let rtl = &mut bench.rtl;
            rtl.set(pins.rd_ready_i, rd_ready);
            rtl.set(pins.pair_ready_i, pair_ready);
            rtl.set(pins.rsp_valid_i, come.is_some());
            if let Some((_, tag, addr)) = come {
                rtl.set(pins.rsp_tag_i, tag);
                rtl.set_bytes(pins.rsp_data_i, &image[addr as usize..addr as usize + 64]);
            }
            rtl.settle();

            bench.expect(pins.done_o, model.is_done())?;
            let offer = model.offer();
            bench.expect(pins.rd_valid_o, offer.is_some())?;
            if let Some(addr) = offer {
                bench.expect(pins.rd_addr_o, addr)?;
            }
            bench.expect(pins.error_o, failed.is_some())?;
            if let Some(index) = failed {
                bench.expect(pins.error_index_o, index)?;
            }
            let mut next = model.clone();
            let pair: Vec<_> = (0..2).map_while(|_| next.next(&image)).collect();
            let good: Result<Vec<Item>, _> = pair.into_iter().collect();
            bench.expect(pins.pair_valid_o, matches!(&good, Ok(pair) if !pair.is_empty()))?;
            if let Ok(pair) = &good
                && !pair.is_empty()
            {
                bench.expect(pins.pair_two_o, pair.len() == 2)?;
                bench.expect(pins.pair_last_o, next.is_done())?;
                let expected: Vec<u8> = pair.iter().flat_map(record_bytes).collect();
                let bytes = bench.rtl.bytes(pins.pair_o);
                assert_eq!(bytes[..expected.len()], expected, "cycle {now}");
                if pair_ready {
                    model = next;
                    records += pair.len() as u64;
                }
            }
            if let Err(index) = good {
                failed = Some(index.0);
            }
            if let Some((.., addr)) = come {
                model.arrive(addr);
            }
            if rd_ready && let Some(addr) = offer {
                let due = now + latency + random.below(jitter + 1);
                flying.push((due, bench.rtl.get(pins.rd_tag_o), addr));
                model.taken();
            }
            model.tick();
            bench.edge()?;
            let ended = (model.is_done() || failed.is_some()) && flying.is_empty();
            after += u64::from(ended && offer.is_none());
        }
        errors += u64::from(failed.is_some());
        // After an error lines are left over.
        if failed.is_some() || random.below(4) == 0 {
            bench.rtl.set(pins.clear_i, true);
            bench.rtl.set(pins.rsp_valid_i, false);
            bench.rtl.settle();
            bench.edge()?;
            bench.rtl.set(pins.clear_i, false);
        }
    }
    Ok((records, errors))
}

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    for room in [8, 32] {
        let library = build(room, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in 1..=2 {
            let name = format!("reader-room{room}-seed{seed}");
            let run = |waves| run(&library, room, seed, 60_000, waves);
            let result = bench::with_waves(&name, run);
            let (records, errors) = result.unwrap_or_else(|stop| panic!("{name}: {stop}"));
            println!("{name}: {records} records, {errors} errors in 60000 cycles, delta 0");
            assert!(records > 10_000 && errors > 20, "{records}, {errors}");
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 15] = [
    (
        "coordinates of 25 bits pass",
        Mutation {
            file: "xy_unpack.sv",
            from: "(words[i][31:W-1] == '1)",
            to: "(words[i][31:W] == '1)",
        },
    ),
    (
        "inverted boxes pass",
        Mutation { file: "xy_unpack.sv", from: "&& (&in_order) &&", to: "&& (|in_order) &&" },
    ),
    (
        "references of 32 bits pass",
        Mutation { file: "xy_unpack.sv", from: " && !bytes_i[223];", to: ";" },
    ),
    (
        "room for a line too many",
        Mutation {
            file: "xy_reader.sv",
            from: "(away == (TagWidth + 1)'(Room - 1))",
            to: "(away == (TagWidth + 1)'(Room))",
        },
    ),
    (
        "a line counts as here when its successor is",
        Mutation {
            file: "xy_reader.sv",
            from: "if (rsp_valid_i) here_q[rsp_tag_i] <= 1'b1;",
            to: "if (rsp_valid_i) here_q <= '1;",
        },
    ),
    (
        "the place of the second record is that of the first",
        Mutation {
            file: "xy_reader.sv",
            from: "index_q - 32'd2 + 32'(first_good_q)",
            to: "index_q - 32'd2",
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
        "the last line of triangles is not asked for if they end at its start",
        Mutation { file: "xy_reader.sv", from: "eighths + 32'd7", to: "eighths + 32'd6" },
    ),
    (
        "the fourth pair of triangles starts where the third does",
        Mutation { file: "xy_reader.sv", from: "both[384+From+:", to: "both[256+From+:" },
    ),
    (
        "a pair of triangles is taken from a line that has not come",
        Mutation {
            file: "xy_reader.sv",
            from: "&& (head_here || !needs_head)",
            to: "&& (head_here || triangles_i)",
        },
    ),
    (
        "the last triangle waits for a line after the one held",
        Mutation {
            file: "xy_reader.sv",
            from: "|| come_two || phase_q[1];",
            to: "|| come_two || 1'b1;",
        },
    ),
    (
        "the line held stays after eight triangles",
        Mutation {
            file: "xy_reader.sv",
            from: "if (phase_q == 2'd3) held_valid_q <= 1'b0;",
            to: "",
        },
    ),
    (
        "the second triangle has the first one's position",
        Mutation { file: "xy_reader.sv", from: "index_q + 32'(i)", to: "index_q" },
    ),
    (
        "the third vertex does not count for the lower corner",
        Mutation {
            file: "xy_unpack_triangle.sv",
            from: "low_c  = ab ? !ac : !bc",
            to: "low_c  = 1'b0",
        },
    ),
    (
        "the third vertex may be off the grid",
        Mutation { file: "xy_unpack_triangle.sv", from: "(&on_grid)", to: "(&on_grid[5:0])" },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    for (what, mutation) in MUTATIONS {
        let faulty = build(8, Some(mutation)).unwrap_or_else(|e| panic!("{what}: {e}"));
        let run = || run(&faulty, 8, 3, 60_000, None);
        match std::panic::catch_unwind(run) {
            Ok(Ok(passed)) => panic!("not seen: {what}: {passed:?}"),
            Ok(Err(stop)) => println!("{what}: seen in cycle {}", stop.cycle()),
            Err(_) => println!("{what}: seen in records"),
        }
    }
}
