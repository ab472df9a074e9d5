//! The multi-merge in gates against its cycle model.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use xylem::machine::multimerge::{Did, MultiMerge};
use xylem_core::mem::Region;
use xylem_core::num::{Grid, MortonCoder, MortonWidth};
use xylem_core::sort::{Item, ReadSchedule, RecordFormat};
use xylem_cosim::bench::{self, Bench, Stop, Waves};
use xylem_cosim::mergesort::{self, MergeSortConfig, Neighbours};
use xylem_cosim::pins;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::types::{record_bytes, split};
use xylem_cosim::verilate::{self, CosimError, Mutation, Unit};

fn build(config: MergeSortConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let parameters = [
        ("Capacity", config.capacity.into()),
        ("Burst", config.burst.into()),
        ("Fifo", config.fifo.into()),
        ("CodeWidth", config.code_bits.into()),
    ];
    let (top, files) = ("xy_multimerge", "multimerge.f");
    verilate::unit(&Unit { top, files, config: config.name, parameters: &parameters }, mutation)
}

pins!(Pins {
    clear_i, wide_i, start_i, start_runs_i, source_base_i, first_i, count_i, run_i, store_i, store_row_i,
    store_pair_i, rd_ready_i, rsp_valid_i, rsp_tag_i, rsp_data_i, item_ready_i;
    idle_o, rd_valid_o, rd_addr_o, rd_tag_o, item_valid_o, item_o, item_split_o,
});

/// A merge: sorted slots of `run` records from `first` on, in memory or to be stored.
struct Job {
    runs: bool,
    first: u32,
    run: u32,
    items: Vec<Item>,
    coder: MortonCoder,
    wide: bool,
}

const BASE: u32 = 128;

impl Job {
    fn draw(random: &mut Random, config: MergeSortConfig) -> Self {
        let piece = 2 * config.burst;
        let slots = u64::from(config.capacity / piece);
        let runs = random.below(3) > 0;
        let run = if runs { piece * (1 + random.below(5) as u32) } else { piece };
        // As many slots as there may be, or few; the last one whole, or not.
        let most = if random.below(2) == 0 { slots } else { 1 + random.below(slots) };
        let count = random.below(most * u64::from(run)) as u32 + 1;
        let wide = random.below(2) == 0;
        let width = if wide { MortonWidth::Bits63 } else { MortonWidth::Bits30 };
        let coder = MortonCoder::new(Grid::DEFAULT, width);
        let mut items = mergesort::primitives(random, count);
        for item in &mut items {
            item.code = coder.code(item.bounds.min, item.bounds.max);
        }
        items.chunks_mut(run as usize).for_each(|slot| slot.sort_by_key(|item| item.code));
        let first = if runs { piece * random.below(20) as u32 } else { 0 };
        Self { runs, first, run, items, coder, wide }
    }

    fn image(&self) -> Vec<u8> {
        let start = (BASE + 32 * self.first) as usize;
        let mut image = vec![0; (start + 32 * self.items.len()).next_multiple_of(64)];
        for (bytes, item) in image[start..].chunks_exact_mut(32).zip(&self.items) {
            RecordFormat::Box32.encode(item, bytes);
        }
        image
    }
}

#[derive(Debug, Default)]
struct Summary {
    merges: u64,
    records: u64,
    cycles: u64,
}

fn run(
    library: &Path,
    config: MergeSortConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    for _ in 0..config.capacity {
        bench.rtl.settle();
        if bench.rtl.is_set(pins.idle_o) {
            break;
        }
        bench.edge()?;
    }
    while bench.cycle() < cycles {
        let job = Job::draw(&mut random, config);
        merge(&mut bench, &pins, &mut random, config, &job)?;
        summary.merges += 1;
        summary.records += job.items.len() as u64;
    }
    summary.cycles = bench.cycle();
    Ok(summary)
}

fn merge(
    bench: &mut Bench,
    pins: &Pins,
    random: &mut Random,
    config: MergeSortConfig,
    job: &Job,
) -> Result<(), Stop> {
    let image = job.image();
    let slots = config.capacity / (2 * config.burst);
    let schedule = ReadSchedule::DoubleBuffer;
    let (capacity, burst) = (config.capacity, config.burst);
    let mut model = MultiMerge::new(capacity, burst, 0, slots, schedule, job.coder);
    let count = job.items.len() as u32;
    bench.rtl.set(pins.wide_i, job.wide);
    if !job.runs {
        for (row, pair) in job.items.chunks(2).enumerate() {
            bench.rtl.set(pins.store_i, true);
            bench.rtl.set(pins.store_row_i, row as u64);
            let bytes: Vec<u8> = pair.iter().flat_map(record_bytes).collect();
            bench.rtl.set_bytes(pins.store_pair_i, &bytes);
            bench.rtl.settle();
            bench.edge()?;
            model.store(2 * row as u32, pair);
        }
        bench.rtl.set(pins.store_i, false);
        model.start_pieces(0, count, job.run);
    } else {
        let source = Region::new(BASE, image.len() as u32);
        model.start_runs(source, job.first..job.first + count, job.run, false);
    }
    let neighbours = Neighbours::draw(random);
    let mut fifo: VecDeque<(u64, Item)> = VecDeque::new();
    // Lines under way: when they come, buffer, tag and address.
    let mut flying: Vec<(u64, u32, u64, u32)> = Vec::new();
    let (mut asked, mut done, mut taken) = (0, false, Vec::new());
    for cycle in 0.. {
        let now = bench.cycle();
        let start = cycle == 0;
        let mut ready = |stall| random.below(16) >= stall;
        let read_ready = ready(neighbours.read_stall);
        let item_ready = ready(neighbours.item_stall);
        let due = flying.iter().position(|(due, ..)| *due <= now);
        let come = due.map(|at| flying.remove(at));
        let rtl = &mut bench.rtl;
        rtl.set(pins.start_i, start);
        rtl.set(pins.start_runs_i, job.runs);
        rtl.set(pins.source_base_i, BASE);
        rtl.set(pins.first_i, job.first);
        rtl.set(pins.count_i, count);
        rtl.set(pins.run_i, job.run);
        rtl.set(pins.rd_ready_i, read_ready);
        rtl.set(pins.item_ready_i, item_ready);
        rtl.set(pins.rsp_valid_i, come.is_some());
        if let Some((_, _, tag, addr)) = come {
            rtl.set(pins.rsp_tag_i, tag);
            rtl.set_bytes(pins.rsp_data_i, &image[addr as usize..addr as usize + 64]);
        }
        rtl.settle();

        bench.expect(pins.idle_o, start || model.is_done() && fifo.is_empty())?;
        let request = model.request();
        bench.expect(pins.rd_valid_o, request.is_some())?;
        if let Some(request) = request {
            bench.expect(pins.rd_addr_o, request.addr + asked)?;
        }
        let front = fifo.front().filter(|(at, _)| *at <= now).map(|(_, item)| *item);
        bench.expect(pins.item_valid_o, front.is_some())?;
        if let Some(item) = front {
            bench.expect_bytes(pins.item_o, &record_bytes(&item))?;
            let before = taken.last().map_or(0, |last: &Item| last.code);
            bench.expect(pins.item_split_o, split(before, item.code))?;
        }
        if done {
            break;
        }

        let room = fifo.len() < config.fifo as usize;
        if !start && let Did::Output(item) = model.tick(room) {
            fifo.push_back((now + 2, item));
        }
        if item_ready && front.is_some() {
            taken.extend(fifo.pop_front().map(|(_, item)| item));
        }
        if let Some((_, buffer, ..)) = come {
            model.arrive(buffer, &image);
        }
        if let Some(request) = request
            && read_ready
        {
            let due = now + neighbours.latency + random.below(neighbours.jitter + 1);
            let tag = bench.rtl.get(pins.rd_tag_o);
            flying.push((due, request.buffer, tag, request.addr + asked));
            asked += 64;
            if asked >= request.bytes {
                model.requested();
                asked = 0;
            }
        }
        model.tick_requests();
        bench.edge()?;
        done = !start && model.is_done() && fifo.is_empty();
    }
    let mut expected = job.items.clone();
    expected.sort_by_key(|item| item.code);
    assert!(taken == expected, "cycle {}: not the stable order", bench.cycle());
    Ok(())
}

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    for (config, seeds, cycles) in
        [(MergeSortConfig::SMALL, 1..=3, 100_000), (MergeSortConfig::PAPER, 4..=4, 250_000)]
    {
        let library = build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in seeds {
            let name = format!("multimerge-{}-seed{seed}", config.name);
            let run = |waves| run(&library, config, seed, cycles, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            println!("{name}: {s:?}, delta 0");
            assert!(s.merges > 1 && s.records > 5000, "{s:?}");
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 8] = [
    (
        "a short burst counts for as many lines as it has",
        Mutation { file: "xy_bursts.sv", from: "(line_q == '0) ? ~last_q : '0", to: "'0" },
    ),
    (
        "a buffer is not emptied with a run's last record",
        Mutation {
            file: "xy_multimerge.sv",
            from: "runs_q && (look_ends_q || last)",
            to: "runs_q && look_ends_q",
        },
    ),
    (
        "a burst is asked for into the other buffer",
        Mutation {
            file: "xy_multimerge.sv",
            from: ".refill_buffer_i({slot, look_index_q[PlaceWidth-1]})",
            to: ".refill_buffer_i({slot, !look_index_q[PlaceWidth-1]})",
        },
    ),
    (
        "the second slot starts where the first one does",
        Mutation {
            file: "xy_multimerge.sv",
            from: "insert_first_q <= insert_first_q + run_q;",
            to: "insert_first_q <= insert_first_q;",
        },
    ),
    (
        "the code of the record that leaves is kept",
        Mutation {
            file: "xy_multimerge.sv",
            from: "inserting_q ? place[0] : !place[0];",
            to: "place[0];",
        },
    ),
    (
        "a first record is used before it is here",
        Mutation {
            file: "xy_multimerge.sv",
            from: "look_here_q  <= here;",
            to: "look_here_q  <= here || (inserting_q && rsp_valid_i);",
        },
    ),
    (
        "a split is from the last code looked at",
        Mutation {
            file: "xy_multimerge.sv",
            from: "else if (out_valid_q) before_q <= out_code_q;",
            to: "else before_q <= out_code_q;",
        },
    ),
    (
        "the first split is from the last merge",
        Mutation {
            file: "xy_multimerge.sv",
            from: "if (started_q) before_q <= '0;",
            to: "if (clear_i) before_q <= '0;",
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
        bench::must_see(what, build(config, Some(mutation)), |faulty| {
            run(faulty, config, 1, 100_000, None)
        });
    }
}
