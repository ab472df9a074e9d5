//! The hierarchy emitter in gates against its cycle model.

use xylem_cosim::bench;
use xylem_cosim::emitter::{self, Summary};
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

#[test]
fn rtl_and_model_agree_in_every_output_of_every_cycle() {
    if !tools_for("rtl_and_model_agree_in_every_output_of_every_cycle") {
        return;
    }
    println!("{}", Summary::HEADER);
    let library = emitter::build(None).unwrap_or_else(|error| panic!("{error}"));
    for (code_bits, seeds) in [(63, 1..=3), (30, 4..=5)] {
        for seed in seeds {
            let name = format!("emitter-{code_bits}-seed{seed}");
            let run = |waves| emitter::run(&library, code_bits, seed, 100_000, waves);
            let s = bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            assert_eq!(s.model_cycles, s.rtl_cycles);
            assert!(s.trees > 100 && s.nodes > 10_000, "{s:?}");
            let codes = format!("{code_bits}-bit codes");
            println!("{}", s.row("emitter lockstep", &codes, seed));
        }
    }
}

/// Faults, each of which the lockstep must see.
const MUTATIONS: [(&str, Mutation); 10] = [
    (
        "subtrees of one level are not joined",
        Mutation {
            file: "xy_emitter.sv",
            from: "? !(code_level < top.level) : !(leaf_level < top.level)",
            to: "? (top.level < code_level) : (top.level < leaf_level)",
        },
    ),
    (
        "a subtree that waits is joined by the item's level",
        Mutation {
            file: "xy_emitter.sv",
            from: "if (pending_valid_q) joins = !(pending_q.level < top.level);",
            to: "",
        },
    ),
    (
        "the level between leaves is that before the last one",
        Mutation {
            file: "xy_emitter.sv",
            from: "leaves_next ^ (leaves_q + 32'd2)",
            to: "leaves_next ^ leaves_q",
        },
    ),
    (
        "leaf bits rank with code bits",
        Mutation {
            file: "xy_emitter.sv",
            from: "{item_split_i.index[5], !item_split_i.index[5], item_split_i.index[4:0]}",
            to: "LevelWidth'(item_split_i.index)",
        },
    ),
    (
        "a leaf may have one primitive too many",
        Mutation {
            file: "xy_emitter.sv",
            from: "open_size_q + 8'd1 < max_leaf_i",
            to: "open_size_q < max_leaf_i",
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
    for (what, mutation) in MUTATIONS {
        bench::must_see(what, emitter::build(Some(mutation)), |faulty| {
            emitter::run(faulty, 63, 11, 30_000, None)
        });
    }
}
