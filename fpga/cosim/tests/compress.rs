//! The emitter with the streaming compressor in gates against its cycle model.

use xylem_cosim::bench;
use xylem_cosim::compress::{self, CompressConfig, Summary};
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    println!("{}", Summary::HEADER);
    for (first, config) in (1..).step_by(2).zip(CompressConfig::ALL) {
        let library = compress::build(config, None).unwrap_or_else(|error| panic!("{error}"));
        for seed in first..first + 2 {
            let name = format!("compress-{}-seed{seed}", config.name);
            let run = |waves| compress::run(&library, config, seed, 100_000, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            println!("{}", s.row("compress lockstep", config.name, seed));
            assert!(s.trees > 20 && s.nodes > 2_000 && s.repairs > 20 && s.full > 0, "{s:?}");
            assert_eq!(s.model_cycles, s.rtl_cycles);
        }
    }
}

/// Faults, each of which the lockstep must see without treelets.
const MUTATIONS: [(&str, Mutation); 10] = [
    (
        "the open line is not sent before it is read",
        Mutation {
            file: "xy_backtrack.sv",
            from: "held   = open_i && (open_addr_i == addr)",
            to: "held   = open_i && (open_addr_i == addr) && 1'b0",
        },
    ),
    (
        "a line is read while another is being sent",
        Mutation {
            file: "xy_backtrack.sv",
            from: "(state_q == Request) && !held && !sending_i",
            to: "(state_q == Request) && !held",
        },
    ),
    (
        "child 1 is repaired before child 0",
        Mutation {
            file: "xy_compressor.sv",
            from: "index_i    (wanted[0] ? child0.index",
            to: "index_i    (wanted == 2'b01 ? child0.index",
        },
    ),
    (
        "what is below child 1 is forgotten where child 0 needs a repair too",
        Mutation { file: "xy_backtrack.sv", from: "(below == '1);", to: "(below == '1) && 1'b0;" },
    ),
    (
        "the repaired pair goes to the wrong place of its line",
        Mutation {
            file: "xy_backtrack.sv",
            from: "wr_data_o[128*i+:128] = recoded;",
            to: "wr_data_o[127:0] = recoded;",
        },
    ),
    (
        "a line is written behind its region",
        Mutation { file: "xy_backtrack.sv", from: "(rest < 32'd64)", to: "1'b0" },
    ),
    (
        "pairs after a flush go to the next line",
        Mutation {
            file: "xy_pair_writer.sv",
            from: "first_q <= full_d ? 2'd0 : next_d[1:0];",
            to: "first_q <= 2'd0;",
        },
    ),
    (
        "the root stays in the context that was estimated",
        Mutation { file: "xy_compressor.sv", from: ".exact_i(item_exact)", to: ".exact_i(1'b0)" },
    ),
    (
        "leaves are repaired",
        Mutation {
            file: "xy_compressor.sv",
            from: "needed) & ~leaf & ~repaired_q",
            to: "needed) & ~repaired_q",
        },
    ),
    (
        "nodes are taken while one is repaired",
        Mutation {
            file: "xy_compressor.sv",
            from: "node_ready_o = (!in_valid_q || enable) && !end_i",
            to: "node_ready_o = !end_i",
        },
    ),
];

/// Faults, each of which the lockstep must see with treelets.
const TREELET_MUTATIONS: [(&str, Mutation); 4] = [
    (
        "both children's treelets are the last one",
        Mutation {
            file: "xy_treelet.sv",
            from: "left_entry  = inner[1] ? under : top",
            to: "left_entry  = top",
        },
    ),
    (
        "pointers to nodes that have left stay as they were",
        Mutation {
            file: "xy_treelet.sv",
            from: "[k&1][IndexLsb+:32] = number[k]",
            to: "[k&1][IndexLsb+:32] = kept[0][0][IndexLsb+:32]",
        },
    ),
    (
        "a treelet just pushed down is read from memory",
        Mutation {
            file: "xy_treelet_stack.sv",
            from: "under_o = held_valid_q ? held_q : read_data",
            to: "under_o = read_data",
        },
    ),
    (
        "what was written is taken to be in the context of the treelet's root",
        Mutation {
            file: "xy_compressor.sv",
            from: ".box_i(item_path[1]), .exact_i(1'b0)",
            to: ".box_i(item_path[0]), .exact_i(1'b0)",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let single = MUTATIONS.map(|mutation| (CompressConfig::SINGLE, mutation));
    let treelets = TREELET_MUTATIONS.map(|mutation| (CompressConfig::SMALL, mutation));
    for (config, (what, mutation)) in single.into_iter().chain(treelets) {
        bench::must_see(what, compress::build(config, Some(mutation)), |faulty| {
            compress::run(faulty, config, 11, 60_000, None)
        });
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let section = table["compress"].as_table().unwrap();
    assert_eq!(section.len(), CompressConfig::ALL.len());
    for config in CompressConfig::ALL {
        let section = section[config.name].as_table().unwrap();
        for (key, value) in [
            ("burst_lines", config.burst_lines),
            ("depth", config.depth.into()),
            ("bits", config.bits.into()),
            ("margin", config.margin.into()),
            ("min_scale", config.min_scale.into()),
        ] {
            assert_eq!(section[key].as_integer(), Some(value.into()), "{}: {key}", config.name);
        }
    }
}
