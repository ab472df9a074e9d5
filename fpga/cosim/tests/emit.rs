//! The emitter with its write ports in gates against its cycle model.

use xylem_cosim::bench;
use xylem_cosim::emit::{self, EmitConfig};
use xylem_cosim::emitter::Summary;
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    println!("{}", Summary::HEADER);
    for (config, seeds) in [(EmitConfig::SMALL, 1..=2), (EmitConfig::PAPER, 3..=4)] {
        let library = emit::build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in seeds {
            let name = format!("emit-{}-seed{seed}", config.name);
            let run = |waves| emit::run(&library, config, seed, 100_000, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            assert!(s.trees > 20 && s.nodes > 2_000, "{s:?}");
            println!("{}", s.row("emit lockstep", config.name, seed));
            assert_eq!(s.model_cycles, s.rtl_cycles);
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 4] = [
    (
        "done before all is sent",
        Mutation {
            file: "xy_emit.sv",
            from: "emitted && node_empty && leaf_empty",
            to: "emitted && node_empty",
        },
    ),
    (
        "the children of a node swapped",
        Mutation {
            file: "xy_bvh2_pack.sv",
            from: "coords = {right_i.box, left_i.box}",
            to: "coords = {left_i.box, right_i.box}",
        },
    ),
    (
        "coordinates without their sign",
        Mutation {
            file: "xy_bvh2_pack.sv",
            from: "{(32 - C) {coords[i][C-1]}}",
            to: "{(32 - C) {1'b0}}",
        },
    ),
    (
        "the unit does not stall while there is no room for an entry",
        Mutation {
            file: "xy_emitter.sv",
            from: "item_ready_o  = listens && node_ready_i && entry_ready_i",
            to: "item_ready_o  = listens && node_ready_i",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = EmitConfig::SMALL;
    for (what, mutation) in MUTATIONS {
        bench::must_see(what, emit::build(config, Some(mutation)), |faulty| {
            emit::run(faulty, config, 11, 30_000, None)
        });
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let section = table["emit"].as_table().unwrap();
    assert_eq!(section.len(), EmitConfig::ALL.len());
    for config in EmitConfig::ALL {
        let section = section[config.name].as_table().unwrap();
        assert_eq!(section["burst_lines"].as_integer(), Some(config.burst_lines.into()));
        assert_eq!(section["depth"].as_integer(), Some(config.depth.into()));
    }
}
