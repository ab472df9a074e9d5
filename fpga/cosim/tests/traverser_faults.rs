//! Faults in the traversal unit's control, which the lockstep must see: a test bench that cannot fail
//! proves nothing.

use xylem::machine::traverser::TraverserConfig;
use xylem_core::node::NodeFormat;
use xylem_core::traverse::Query;
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::traverser;
use xylem_cosim::traverser::lockstep::{Pace, Stop, TraverserRtl};
use xylem_cosim::traverser::scenes::{FORMATS, Set, damaged};
use xylem_cosim::verilate::Mutation;

const fn fault(
    what: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> (&'static str, Mutation) {
    (what, Mutation { file, from, to })
}

const FAULTS: [(&str, Mutation); 14] = [
    fault(
        "ties go to the highest index",
        "xy_traverser.sv",
        "prim_q < holder_q",
        "prim_q > holder_q",
    ),
    fault(
        "the child that is entered last is searched first",
        "xy_traverser.sv",
        "$signed(first_entry_q) > $signed(verdict_entry)",
        "$signed(first_entry_q) < $signed(verdict_entry)",
    ),
    fault(
        "nodes behind the best hit are searched",
        "xy_traverser.sv",
        "$signed(popped_entry) <= $signed(t_max_q)",
        "1'b1",
    ),
    fault(
        "the first of any hits does not end the search",
        "xy_traverser.sv",
        "triangle_hit && any_i",
        "1'b0",
    ),
    fault(
        "entries are counted over all rays",
        "xy_traverser.sv",
        "entries_left_q <= entry_count_i;",
        "entries_left_q <= ray_q == '0 ? entry_count_i : entries_left_q;",
    ),
    fault(
        "nodes that are met too often are not noticed",
        "xy_traverser.sv",
        "|| nodes_left_q == '0 ||",
        "||",
    ),
    fault(
        "children outside of their node are not noticed",
        "xy_traverser.sv",
        "broken_q || verdict_outside || (first_hit_q",
        "(first_hit_q",
    ),
    fault(
        "boxes off the grid are not noticed",
        "xy_traverser.sv",
        "!quantized_i && corner_off_grid) broken_q <= 1'b1",
        "!quantized_i && corner_off_grid) broken_q <= broken_q",
    ),
    fault(
        "leaves do not end at their mark",
        "xy_traverser.sv",
        "leaf_ends = last_entry_q || count_q",
        "leaf_ends = count_q",
    ),
    fault(
        "leaves do not end at their count",
        "xy_traverser.sv",
        "last_entry_q || count_q == 8'd1",
        "last_entry_q",
    ),
    fault(
        "lines are told apart by their place only",
        "xy_line_cache.sv",
        "valid_q[index] && kept_tag == tag",
        "valid_q[index]",
    ),
    fault(
        "lines of the last job are still there",
        "xy_traverser.sv",
        ".clear_i     (clear_i || start_i)",
        ".clear_i     (clear_i)",
    ),
    fault(
        "a line is written one word early",
        "xy_hit_writer.sv",
        "full_q         <= lane_q == 3'd7",
        "full_q         <= lane_q == 3'd6",
    ),
    fault("rays are not checked", "xy_ray_load.sv", "good_o  = !bad_q && long_q", "good_o  = 1'b1"),
];

/// Runs what sees every fault; says what the first difference is.
fn exercise(rtl: &mut TraverserRtl) -> Result<(), String> {
    let mut random = Random::new(11);
    let pace = Pace { eager: 3, latency: 6, constant: false };
    let at = |error: Stop| error.to_string();
    for (name, count) in [("degenerate/identical", 3), ("cornell_box", 6), ("hair_small", 4)] {
        let set = Set::new(name, count, 11);
        for (_, format) in FORMATS {
            for query in [Query::Closest, Query::Any] {
                let (mut memory, job) = set.job(format, query);
                rtl.run(&mut memory, &job, pace, &mut random, None).map_err(at)?;
            }
        }
    }
    // A leaf of a 64-byte node ends at its count even where no entry is marked.
    let set = Set::new("cornell_box", 2, 11);
    let (mut memory, job) = set.job(NodeFormat::Bvh2, Query::Closest);
    let table = job.scene.tree.leaf_table.base.0 as usize;
    for entry in 0..job.scene.tree.entry_count as usize {
        memory.bytes_mut()[table + 4 * entry + 3] &= 0x7f;
    }
    rtl.run(&mut memory, &job, pace, &mut random, None).map_err(at)?;

    let set = Set::new("degenerate/two_triangles", 2, 11);
    for trial in 0..240 {
        let (memory, job) = set.job(FORMATS[trial % 3].1, Query::Closest);
        let (mut memory, job) = damaged(memory, job, &mut random);
        rtl.run(&mut memory, &job, pace, &mut random, None).map_err(at)?;
    }
    Ok(())
}

#[test]
fn every_fault_put_into_the_traverser_is_seen() {
    if !tools_for("every_fault_put_into_the_traverser_is_seen") {
        return;
    }
    let config = TraverserConfig::SMALL;
    let load = |mutation| {
        let library = traverser::build(config, mutation).unwrap_or_else(|error| panic!("{error}"));
        TraverserRtl::load(&library, config, 11).unwrap()
    };
    exercise(&mut load(None)).unwrap_or_else(|message| panic!("without fault: {message}"));
    for (what, mutation) in FAULTS {
        match exercise(&mut load(Some(mutation))) {
            Ok(()) => panic!("not seen: {what}"),
            Err(message) => println!("{what}: seen: {message:.60}"),
        }
    }
}
