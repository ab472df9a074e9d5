//! The burst writer in gates against its cycle model.

use std::path::Path;

use xylem::machine::port::LINE_BYTES;
use xylem::machine::writer::Writer;
use xylem_core::error::RegionName;
use xylem_core::mem::Region;
use xylem_core::probe::Stage;
use xylem_cosim::bench::{self, Bench, Stop, Waves};
use xylem_cosim::pins;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::verilate::{self, CosimError, Mutation, Unit};

/// Name, bits of a record, lines of a burst.
const CONFIGS: [(&str, u64, u64); 5] = [
    ("runs", 256, 8),
    ("nodes", 512, 8),
    ("leaf_table", 32, 8),
    ("pairs", 128, 1),
    ("three_lines", 256, 3),
];

fn build(
    (config, bits, lines): (&str, u64, u64),
    mutation: Option<Mutation>,
) -> Result<std::path::PathBuf, CosimError> {
    let parameters = [("RecordBits", bits), ("BurstLines", lines)];
    let (top, files) = ("xy_burst_writer", "burst_writer.f");
    verilate::unit(&Unit { top, files, config, parameters: &parameters }, mutation)
}

pins!(Pins {
    clear_i, start_i, region_base_i, region_size_i, in_valid_i, in_record_i, flush_i, wr_ready_i;
    in_ready_o, empty_o, error_o, wr_valid_o, wr_addr_o, wr_data_o, wr_strb_o, wr_last_o,
});

#[derive(Debug, Default)]
struct Summary {
    regions: u64,
    full: u64,
    records: u64,
    lines: u64,
    cycles: u64,
}

/// Fills region after region, some of them too short, for at least `cycles` cycles.
fn run(
    library: &Path,
    (_, bits, lines): (&str, u64, u64),
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    let bytes = (bits / 8) as usize;
    while bench.cycle() < cycles {
        let most = [2, 40, 400][random.below(3) as usize];
        let records = random.below(1 + most);
        let base = 64 * (1 + random.below(4)) as u32;
        let needed = records as u32 * bytes as u32;
        let size = match random.below(3) {
            0 => random.below(u64::from(needed) + 1) as u32,
            1 => needed,
            _ => needed + random.below(200) as u32,
        };
        fill(
            &mut bench,
            &pins,
            &mut random,
            Region::new(base, size),
            (bytes, lines as u32 * LINE_BYTES),
            records,
            &mut summary,
        )?;
        if random.below(4) == 0 {
            bench.rtl.set(pins.clear_i, true);
            bench.rtl.settle();
            bench.edge()?;
            bench.rtl.set(pins.clear_i, false);
        }
    }
    summary.cycles = bench.cycle();
    Ok(summary)
}

fn fill(
    bench: &mut Bench,
    pins: &Pins,
    random: &mut Random,
    region: Region,
    (bytes, burst): (usize, u32),
    mut records: u64,
    summary: &mut Summary,
) -> Result<(), Stop> {
    let mut writer = Writer::new(region, RegionName::Nodes, Stage::Emit, burst);
    let end = (region.base.0 + region.size) as usize + 1024;
    let (mut model, mut memory) = (vec![0xa5; end], vec![0xa5; end]);
    let (pause, stall) = (random.below(4), random.below(4));
    let mut error = false;
    let mut offered: Option<Vec<u8>> = None;
    bench.rtl.set(pins.start_i, true);
    bench.rtl.set(pins.region_base_i, region.base.0);
    bench.rtl.set(pins.region_size_i, region.size);
    bench.rtl.set(pins.wr_ready_i, false);
    bench.rtl.settle();
    bench.edge()?;
    bench.rtl.set(pins.start_i, false);
    summary.regions += 1;
    loop {
        if offered.is_none() && records > 0 && random.below(4) >= pause {
            offered = Some((0..bytes).map(|_| random.bits() as u8).collect());
            records -= 1;
        }
        let flush = records == 0 && offered.is_none();
        let ready = random.below(4) >= stall;
        let rtl = &mut bench.rtl;
        rtl.set(pins.in_valid_i, offered.is_some());
        rtl.set_bytes(pins.in_record_i, offered.as_deref().unwrap_or(&[]));
        rtl.set(pins.flush_i, flush);
        rtl.set(pins.wr_ready_i, ready);
        rtl.settle();

        bench.expect(pins.in_ready_o, writer.is_ready(bytes))?;
        bench.expect(pins.error_o, error)?;
        let empty = writer.is_empty();
        bench.expect(pins.empty_o, empty)?;
        let line = writer.offer();
        bench.expect(pins.wr_valid_o, line.is_some())?;
        if let Some(line) = line {
            let (len, last) = writer.line();
            bench.expect(pins.wr_addr_o, line.addr)?;
            bench.expect(pins.wr_strb_o, u64::MAX >> (64 - len))?;
            bench.expect(pins.wr_last_o, last)?;
            let at = line.addr as usize;
            let data = bench.rtl.bytes(pins.wr_data_o);
            memory[at..at + len as usize].copy_from_slice(&data[..len as usize]);
            if ready {
                assert_eq!(memory[at..at + len as usize], model[at..at + len as usize]);
                writer.taken();
                summary.lines += 1;
            }
        }
        if empty && flush {
            break;
        }
        if flush || error {
            writer.flush();
        }
        if writer.is_ready(bytes)
            && let Some(record) = offered.take()
        {
            // After an error records are taken and dropped; what came before leaves.
            error = error || writer.push(&mut model, &record).is_err();
            summary.records += u64::from(!error);
        }
        bench.edge()?;
        writer.tick(&mut model);
    }
    summary.full += u64::from(error);
    let outside = |image: &[u8]| {
        let (before, rest) = image.split_at(region.base.0 as usize);
        before.iter().chain(&rest[region.size as usize..]).all(|&byte| byte == 0xa5)
    };
    assert!(memory == model && outside(&memory), "{region:?}");
    Ok(())
}

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    for config in CONFIGS {
        let library = build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in 1..=2 {
            let name = format!("burst_writer-{}-seed{seed}", config.0);
            let run = |waves| run(&library, config, seed, 50_000, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            println!("{name}: {s:?}");
            assert!(s.regions > 100 && s.full > 10 && s.lines > 1000, "{s:?}");
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, &str, &str); 7] = [
    ("a burst leaves a cycle late", "(waits || (in_valid_i && ends))", "waits"),
    (
        "a burst pushes the one being sent away",
        "assign hand_over  = (!sending_q || sent)",
        "assign hand_over  = (!sending_q || wr_ready_i)",
    ),
    (
        "the region ends a record late",
        "fits_q <= left_q >= BytesTwo;",
        "fits_q <= left_q >= Bytes;",
    ),
    (
        "a record too many is written",
        "{RecordBytes{records_q > Place}}",
        "{RecordBytes{records_q + 1'b1 > Place}}",
    ),
    ("the burst being filled is sent", "({!half_q, line_q})", "({half_q, line_q})"),
    ("the last line comes a line late", "records_q <= PerLine", "records_q < PerLine"),
    ("an error leaves the rest behind", "((flush_i || error_q) &&", "((flush_i) &&"),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = CONFIGS[4];
    for (what, from, to) in MUTATIONS {
        let mutation = Mutation { file: "xy_burst_writer.sv", from, to };
        bench::must_see(what, build(config, Some(mutation)), |faulty| {
            run(faulty, config, 3, 50_000, None)
        });
    }
}
