//! The hierarchy emitter in gates against its cycle model.

use xylem_cosim::bench;
use xylem_cosim::emitter::{self, EmitterConfig, Summary};
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    println!("{}", Summary::HEADER);
    for (config, seeds) in [(EmitterConfig::WIDE, 1..=3), (EmitterConfig::NARROW, 4..=5)] {
        let library = emitter::build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in seeds {
            let name = format!("emitter-{}-seed{seed}", config.name);
            let run = |waves| emitter::run(&library, config, seed, 100_000, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            assert_eq!(s.model_cycles, s.rtl_cycles);
            assert!(s.trees > 100 && s.nodes > 10_000, "{s:?}");
            println!("{}", s.row("emitter lockstep", config.name, seed));
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 8] = [
    (
        "subtrees of one level are not joined",
        Mutation {
            file: "xy_emitter.sv",
            from: "(top.level <= current.level)",
            to: "(top.level < current.level)",
        },
    ),
    (
        "leaf bits rank with code bits",
        Mutation {
            file: "xy_emitter.sv",
            from: "LevelWidth'(code_bit) + LevelWidth'(CodeLevel)",
            to: "LevelWidth'(code_bit)",
        },
    ),
    (
        "a leaf may have one primitive too many",
        Mutation {
            file: "xy_emitter.sv",
            from: "open_size_q < max_leaf_i",
            to: "open_size_q <= max_leaf_i",
        },
    ),
    (
        "a leaf's box is that of its last primitive",
        Mutation {
            file: "xy_emitter.sv",
            from: "open_box_q  <= grown_box;",
            to: "open_box_q  <= item_i.box;",
        },
    ),
    (
        "an entry leaves before there is room for the node",
        Mutation {
            file: "xy_emitter.sv",
            from: "entry_valid_o = listens && node_ready_i && open_valid_q",
            to: "entry_valid_o = listens && open_valid_q",
        },
    ),
    (
        "coordinates are compared without their sign",
        Mutation {
            file: "xy_union.sv",
            from: "$signed(hi_a[axis]) < $signed(hi_b[axis])",
            to: "hi_a[axis] < hi_b[axis]",
        },
    ),
    (
        "an entry just pushed down is read from memory",
        Mutation {
            file: "xy_stack.sv",
            from: "below = held_valid_q ? held_q : read_data",
            to: "below = read_data",
        },
    ),
    (
        "clear leaves the stack as it is",
        Mutation {
            file: "xy_stack.sv",
            from: "if (clear_i) count_d = '0;",
            to: "if (clear_i) count_d = count_q;",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = EmitterConfig::WIDE;
    for (what, mutation) in MUTATIONS {
        bench::must_see(what, emitter::build(config, Some(mutation)), |faulty| {
            emitter::run(faulty, config, 11, 30_000, None)
        });
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let section = table["emitter"].as_table().unwrap();
    assert_eq!(section.len(), EmitterConfig::ALL.len());
    for config in EmitterConfig::ALL {
        let bits = section[config.name]["code_bits"].as_integer();
        assert_eq!(bits, Some(config.code_bits.into()), "{}", config.name);
    }
}
