//! The custom function unit in gates against the core.

use std::path::Path;

use xylem_cosim::bench::{self, Stop, Waves};
use xylem_cosim::cfu::{self, CfuRtl};
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::verilate::Mutation;

/// What a run compared.
#[derive(Debug)]
struct Compared {
    replaces: u64,
    /// Hit, missed, off the grid.
    boxes: [u64; 3],
    /// With both children inside, and not.
    nodes: [u64; 2],
    instructions: u64,
}

fn run(library: &Path, seed: u64, count: u64, waves: Waves) -> Result<Compared, Stop> {
    let unit = CfuRtl::load(library, seed, waves)?;
    let mut random = Random::new(seed);
    let replaces = cfu::check_heap(&unit, &mut random, count)?;
    let boxes = cfu::check_boxes(&unit, &mut random, count)?;
    let nodes = cfu::check_encoder(&unit, &mut random, count)?;
    Ok(Compared { replaces, boxes, nodes, instructions: unit.finish()? })
}

#[test]
fn instructions_do_the_core_s_steps_in_the_cycles_stated() {
    if !tools_for("instructions_do_the_core_s_steps_in_the_cycles_stated") {
        return;
    }
    let library = cfu::build(None).unwrap_or_else(|error| panic!("{error}"));
    println!("| seed | replaces | boxes hit, missed, off | nodes inside, outside | instructions |");
    println!("|---:|---:|---:|---:|---:|");
    for seed in 1..3 {
        let compared = bench::with_waves("xy_cfu", |waves| run(&library, seed, 20_000, waves));
        let Compared { replaces, boxes, nodes, instructions } =
            compared.unwrap_or_else(|stop| panic!("{stop}"));
        println!("| {seed} | {replaces} | {boxes:?} | {nodes:?} | {instructions} |");
        assert!(boxes.iter().all(|&count| count > 500), "{boxes:?}");
        assert!(nodes.iter().all(|&count| count > 1_000), "{nodes:?}");
    }
}

const fn fault(
    what: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> (&'static str, Mutation) {
    (what, Mutation { file, from, to })
}

const FAULTS: [(&str, Mutation); 10] = [
    fault(
        "the greater key stays",
        "xy_cfu.sv",
        "if (less) key_q <= other",
        "if (!less) key_q <= other",
    ),
    fault(
        "a match overwrites the rest's lower word with its upper one",
        "xy_cfu.sv",
        "KeyMeet:  answer = greater[31:0]",
        "KeyMeet:  answer = greater[63:32]",
    ),
    fault(
        "a box is off the grid if its last axis is",
        "xy_cfu.sv",
        "(off_q && axis != 2'd0)",
        "1'b0",
    ),
    fault(
        "entry times are not negative",
        "xy_cfu.sv",
        "32'(signed'(entry[T-1:32]))",
        "32'(entry[T-1:32])",
    ),
    fault(
        "a verdict does not wait",
        "xy_cfu.sv",
        "op == Verdict && testing_q && !verdict_valid",
        "1'b0",
    ),
    fault("a verdict comes a cycle late", "xy_cfu.sv", "testing_q && !verdict_valid", "testing_q"),
    fault("a child does not settle", "xy_cfu.sv", "settling_q <= 2'd2", "settling_q <= 2'd1"),
    fault(
        "children off the grid are encoded",
        "xy_cfu.sv",
        "contained && off_axis_q == '0",
        "contained",
    ),
    fault(
        "children keep their parent's grid",
        "xy_cfu.sv",
        "child.cells[axis], child.scale[axis]",
        "parent_q.cells[axis], parent_q.scale[axis]",
    ),
    fault(
        "a response is lost while the core is stuck",
        "xy_cfu.sv",
        "else if (rsp_ready_i) rsp_valid_o",
        "else rsp_valid_o",
    ),
];

#[test]
fn every_fault_put_into_the_rtl_is_seen() {
    if !tools_for("every_fault_put_into_the_rtl_is_seen") {
        return;
    }
    for (what, mutation) in FAULTS {
        bench::must_see(what, cfu::build(Some(mutation)), |faulty| run(faulty, 11, 2_000, None));
    }
}
