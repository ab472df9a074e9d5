//! The heap in gates against its cycle model.

use std::fs;

use xylem::machine::heap::{HeapConfig, HeapEntry, HeapModel, HeapOp};
use xylem_cosim::heap::lockstep::{self, Stop, Summary};
use xylem_cosim::heap::{self, HeapRtl};
use xylem_cosim::verilate::{self, Mutation};
use xylem_cosim::{table, tools_for};

fn library(config: HeapConfig) -> std::path::PathBuf {
    heap::build(config, None).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    let runs = [
        (HeapConfig::PAPER, 1..=4, 250_000),
        (HeapConfig::SMALL, 5..=8, 100_000),
        (HeapConfig::WIDE, 9..=10, 100_000),
    ];
    let waves = lockstep::waves_folder();
    let mut table = vec![Summary::HEADER.to_owned()];
    for (config, seeds, operations) in runs {
        let library = library(config);
        for seed in seeds {
            let summary = lockstep::run(&library, config, seed, operations, waves.as_deref())
                .unwrap_or_else(|stop| panic!("heap {}, seed {seed}: {stop}", config.name));
            assert_eq!(summary.operations, operations);
            assert_eq!(summary.model_cycles, summary.rtl_cycles);
            assert!(summary.rejected > 0, "no operation was illegal: {summary:?}");
            table.push(summary.row("heap lockstep", config, seed));
        }
    }
    table::write("heap", &table).unwrap();
}

#[test]
fn rtl_merges_one_entry_every_two_cycles() {
    if !tools_for("rtl_merges_one_entry_every_two_cycles") {
        return;
    }
    let config = HeapConfig::PAPER;
    let capacity = config.capacity() as u64;
    let mut rtl = HeapRtl::load(&library(config), 1).unwrap();
    for slot in (0..capacity).rev() {
        let first = HeapEntry { key: slot, slot: slot as u32 };
        assert!(rtl.tick(Some(HeapOp::Insert(first))).unwrap().ready);
        assert!(!rtl.tick(None).unwrap().ready);
    }
    // Every run's successor is `capacity` above: the merge yields 0, 1, 2, ...
    let mut top = rtl.tick(None).unwrap().top.unwrap();
    for key in 0..4 * capacity {
        assert_eq!(top.key, key);
        let next = HeapEntry { key: top.key + capacity, slot: top.slot };
        assert!(rtl.tick(Some(HeapOp::Replace(next))).unwrap().ready);
        let outputs = rtl.tick(None).unwrap();
        assert!(!outputs.ready);
        top = outputs.top.unwrap();
    }
}

/// Faults, each of which the lockstep must see: a test bench that cannot fail proves nothing.
const MUTATIONS: [(&str, Mutation); 7] = [
    (
        "the greater child goes up",
        Mutation {
            file: "xy_heap_stage.sv",
            from: ".a_i(right_i), .b_i(left_i)",
            to: ".a_i(left_i), .b_i(right_i)",
        },
    ),
    (
        "slots do not decide between equal keys",
        Mutation {
            file: "xy_heap.sv",
            from: ".a_i(left[0]), .b_i(entry)",
            to: ".a_i({left[0][EntryWidth-1:SlotWidth], op_slot_i}), .b_i(entry)",
        },
    ),
    (
        "a level's last write is not bypassed",
        Mutation {
            file: "xy_heap_ram.sv",
            from: "right_vacant_q ? '1 : (right_held_q ? held_entry_q : right_q)",
            to: "right_vacant_q ? '1 : right_q",
        },
    ),
    (
        "block memory's collision is not bypassed",
        Mutation {
            file: "xy_heap_ram.sv",
            from: "bank_data[b] = (held_pos_q == {Bank, row_i}) ? held_entry_q : read_data",
            to: "bank_data[b] = read_data",
        },
    ),
    (
        "vacant places are taken for entries after a clear",
        Mutation {
            file: "xy_heap_ram.sv",
            from: "else if (clear_i) fill_q <= '0;",
            to: "else if (clear_i && !write_q) fill_q <= fill_q;",
        },
    ),
    (
        "an error changes the count",
        Mutation { file: "xy_heap.sv", from: "if (taken && !full) begin", to: "if (taken) begin" },
    ),
    (
        "operations are taken every cycle",
        Mutation { file: "xy_heap.sv", from: "ready_q <= !taken;", to: "ready_q <= 1'b1;" },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    // The last level in block memory, so that a small heap has every kind of storage.
    let config = HeapConfig { levels: 5, slot_bits: 5, block_level: 4, ..HeapConfig::SMALL };
    let sound = heap::build(config, None).unwrap_or_else(|error| panic!("{error}"));
    lockstep::run(&sound, config, 11, 50_000, None)
        .unwrap_or_else(|stop| panic!("without fault: {stop}"));
    let waves = verilate::target_folder().join("waves");
    fs::create_dir_all(&waves).unwrap();
    let file = waves.join("heap-small-seed11.vcd");
    for (what, mutation) in MUTATIONS {
        let _ = fs::remove_file(&file);
        let faulty =
            heap::build(config, Some(mutation)).unwrap_or_else(|error| panic!("{what}: {error}"));
        match lockstep::run(&faulty, config, 11, 50_000, Some(&waves)) {
            Ok(summary) => panic!("not seen: {what}: {summary:?}"),
            Err(Stop::Rtl { error, cycle }) => println!("{what}: seen in cycle {cycle}: {error}"),
            Err(stop) => println!("{what}: seen in cycle {}", stop.cycle()),
        }
        let recorded = fs::read_to_string(&file).unwrap();
        assert!(recorded.contains("op_ready_o"), "{what}: no waveform in {}", file.display());
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let heaps = table["heap"].as_table().unwrap();
    assert_eq!(heaps.len(), HeapConfig::ALL.len());
    for config in HeapConfig::ALL {
        let values = heaps[config.name].as_table().unwrap();
        for (key, value) in [
            ("levels", config.levels),
            ("key_bits", config.key_bits),
            ("slot_bits", config.slot_bits),
            ("block_level", config.block_level),
        ] {
            assert_eq!(values[key].as_integer(), Some(value.into()), "{}: {key}", config.name);
        }
        assert_eq!(HeapModel::new(config).config().capacity(), 1 << config.levels);
    }
}
