//! The units of traversal contexts in gates against the core.

use std::path::Path;

use xylem_cosim::bench::{self, Stop, Waves};
use xylem_cosim::context::{self, ContextConfig};
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

type Run = fn(&Path, ContextConfig, u64, u64, Waves) -> Result<u64, Stop>;

const UNITS: [(&str, Run); 3] = [
    ("xy_context", context::run_context),
    ("xy_encoder", context::run_encoder),
    ("xy_recoder", context::run_recoder),
];

const CONFIGS: [ContextConfig; 4] = [
    ContextConfig { bits: 6, margin: 1, min_scale: 0 },
    ContextConfig { bits: 6, margin: 0, min_scale: 3 },
    ContextConfig { bits: 4, margin: 3, min_scale: 0 },
    ContextConfig { bits: 8, margin: 2, min_scale: 15 },
];

#[test]
fn rtl_and_core_agree_on_any_box() {
    if !tools_for("rtl_and_core_agree_on_any_box") {
        return;
    }
    println!("| unit | bits | margin | minimum scale | inputs compared | differences |");
    println!("|---|---:|---:|---:|---:|---:|");
    for (seed, config) in (1..).zip(CONFIGS) {
        for (unit, run) in UNITS {
            let library =
                context::build(unit, config, None).unwrap_or_else(|error| panic!("{error}"));
            let name = format!("{unit}-bits{}", config.bits);
            let run = |waves| run(&library, config, seed, 100_000, waves);
            let compared =
                bench::with_waves(&name, run).unwrap_or_else(|stop| panic!("{name}: {stop}"));
            assert!(compared > 80_000, "{name}: {compared}");
            let ContextConfig { bits, margin, min_scale } = config;
            println!("| {unit} | {bits} | {margin} | {min_scale} | {compared} | 0 |");
        }
    }
}

/// Faults, each of which the unit's comparison must see.
const MUTATIONS: [(&str, &str, Mutation); 10] = [
    (
        "xy_context",
        "a box that rounding makes a cell too wide stays on the finer grid",
        Mutation {
            file: "xy_context.sv",
            from: "(span[axis] != '0) ? 5'd1 : 5'd0",
            to: "1'b0 ? 5'd1 : 5'd0",
        },
    ),
    (
        "xy_context",
        "a root has a margin",
        Mutation { file: "xy_context.sv", from: "exact1_q ? 5'd0", to: "1'b0 ? 5'd0" },
    ),
    (
        "xy_context",
        "lower bounds are not rounded",
        Mutation {
            file: "xy_context.sv",
            from: "lower[axis] = low2[axis] << scale2_q[axis]",
            to: "lower[axis] = lo2_q[axis]",
        },
    ),
    (
        "xy_encoder",
        "upper bounds at a cell's edge are not put outside",
        Mutation {
            file: "xy_encode.sv",
            from: "{low[axis][C-1], low[axis]} + 1'b1",
            to: "{low[axis][C-1], low[axis]}",
        },
    ),
    (
        "xy_encoder",
        "negative coordinates are divided toward zero",
        Mutation {
            file: "xy_encode.sv",
            from: "$signed(lo[axis]) >>> place_i.scale[axis]",
            to: "lo[axis] >> place_i.scale[axis]",
        },
    ),
    (
        "xy_encoder",
        "a child may leave its parent by one cell",
        Mutation {
            file: "xy_encode.sv",
            from: "below[axis] + width[axis] <= ",
            to: "below[axis] + width[axis] <= 1 + ",
        },
    ),
    (
        "xy_recoder",
        "a box that sticks out of its new context is not encoded again",
        Mutation {
            file: "xy_mismatch.sv",
            from: "$signed(new_upper[axis]) < $signed(old_upper[axis])",
            to: "1'b0",
        },
    ),
    (
        "xy_encoder",
        "relative coordinates are not counted anew",
        Mutation { file: "xy_mismatch.sv", from: "!modulo_i && ", to: "1'b0 && " },
    ),
    (
        "xy_recoder",
        "a full circle of modulo coordinates is taken for nothing",
        Mutation {
            file: "xy_decode.sv",
            from: "(Q + 1)'(less_one[axis]) + 1'b1",
            to: "(Q + 1)'(Bits'(less_one[axis] + 1'b1))",
        },
    ),
    (
        "xy_recoder",
        "a box is not cut to its parent's new one",
        Mutation {
            file: "xy_recoder.sv",
            from: "($signed(high[axis]) > $signed(last[axis]))",
            to: "1'b0",
        },
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    let config = CONFIGS[0];
    for (unit, what, mutation) in MUTATIONS {
        let run = UNITS.iter().find(|(name, _)| *name == unit).map(|(_, run)| run).unwrap();
        bench::must_see(what, context::build(unit, config, Some(mutation)), |faulty| {
            run(faulty, config, 11, 30_000, None)
        });
    }
}
