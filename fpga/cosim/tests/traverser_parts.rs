//! The parts of the traversal unit in gates against the functions of the core that they compute.

use xylem_cosim::rtl::Rtl;
use xylem_cosim::tools_for;
use xylem_cosim::traverser;
use xylem_cosim::traverser::parts::{check_boxes, check_reciprocals, check_triangles};
use xylem_cosim::verilate::Mutation;

fn load(top: &'static str, mutation: Option<Mutation>, seed: u32) -> Rtl {
    let library = traverser::build_part(top, mutation).unwrap_or_else(|error| panic!("{error}"));
    Rtl::load(&library, seed).unwrap()
}

#[test]
fn reciprocals_are_those_of_the_core_and_take_the_cycles_stated() {
    if !tools_for("reciprocals_are_those_of_the_core_and_take_the_cycles_stated") {
        return;
    }
    let mut rtl = load("xy_reciprocal", None, 1);
    check_reciprocals(&mut rtl, 1, 20_000).unwrap();
}

#[test]
fn box_tests_are_those_of_the_core() {
    if !tools_for("box_tests_are_those_of_the_core") {
        return;
    }
    for seed in 0..4 {
        let mut rtl = load("xy_box_test", None, seed);
        let [hits, misses, outside] = check_boxes(&mut rtl, seed.into(), 40_000).unwrap();
        println!(
            "boxes, seed {seed}: {hits} hit, {misses} missed, {outside} outside of their node"
        );
        assert!(hits > 5_000 && misses > 5_000 && outside > 500);
    }
}

#[test]
fn triangle_tests_are_those_of_the_core_and_take_the_cycles_stated() {
    if !tools_for("triangle_tests_are_those_of_the_core_and_take_the_cycles_stated") {
        return;
    }
    for seed in 0..4 {
        let mut rtl = load("xy_triangle_test", None, seed);
        let [hits, outside, missed, off] = check_triangles(&mut rtl, seed.into(), 20_000).unwrap();
        println!(
            "triangles, seed {seed}: {hits} hit, {outside} outside the interval, {missed} missed, {off} off the grid"
        );
        assert!(hits > 2_000 && outside > 1_000 && missed > 5_000 && off > 100);
    }
}

/// What is put into the RTL, and the text that it takes the place of.
type Fault = (&'static str, Mutation);

const fn fault(
    what: &'static str,
    file: &'static str,
    from: &'static str,
    to: &'static str,
) -> Fault {
    (what, Mutation { file, from, to })
}

const RECIPROCAL_FAULTS: [Fault; 2] = [
    fault(
        "every mantissa is taken to be rounded",
        "xy_reciprocal.sv",
        "reciprocal_o.inexact  = rest_q != '0",
        "reciprocal_o.inexact  = 1'b1",
    ),
    fault(
        "a remainder equal to the divisor stays",
        "xy_reciprocal.sv",
        "bit_value  = !difference[31]",
        "bit_value  = !difference[31] && difference != '0",
    ),
];

const BOX_FAULTS: [Fault; 8] = [
    fault(
        "far planes are rounded down",
        "xy_box_test.sv",
        "far_carry  = step2_q || far_product_i[23:0] != '0",
        "far_carry  = step2_q",
    ),
    fault(
        "near planes behind the origin are rounded up",
        "xy_box_test.sv",
        "near_up = reciprocal_i.inexact && !step_i && near_x[31]",
        "near_up = 1'b0",
    ),
    fault(
        "a ray in a plane along which it moves misses",
        "xy_box_test.sv",
        "near_q[31] || near_q == '0 ? Before : After",
        "near_q[31] ? Before : After",
    ),
    fault(
        "a box that ends where the interval begins is hit",
        "xy_box_test.sv",
        "leave_q > t_min",
        "leave_q >= t_min",
    ),
    fault(
        "the child's first axis decides whether it is outside",
        "xy_box_test.sv",
        "outside_q <= axis3_q.outside || (outside_q && !axis3_q.first)",
        "if (axis3_q.first) outside_q <= axis3_q.outside",
    ),
    fault(
        "modulo widths are counted like relative ones",
        "xy_pair_decode.sv",
        "over  = high_i - low_i - {5'b0, modulo_i}",
        "over  = high_i - low_i",
    ),
    fault(
        "grids are finer than a grid unit",
        "xy_pair_decode.sv",
        "parent_i.scale < {2'b0, room} ? parent_i.scale[2:0] : room",
        "room",
    ),
    fault("times wrap", "xy_time_shift.sv", "!= '0) lost = 1'b1;", "!= '0) lost = 1'b0;"),
];

const TRIANGLE_FAULTS: [Fault; 7] = [
    fault(
        "the edge opposite to vertex 0 is not in the triangle",
        "xy_triangle_test.sv",
        "&& !rest[SumWidth-1];",
        "&& !rest[SumWidth-1] && rest != '0;",
    ),
    fault(
        "triangles are seen from one side only",
        "xy_triangle_test.sv",
        "turn   = group3_q == GroupDet ? sum_q[SumWidth-1] : flip_q",
        "turn   = group3_q == GroupDet && sum_q[SumWidth-1]",
    ),
    fault(
        "times are rounded down",
        "xy_triangle_test.sv",
        "{1'b0, quotient} + {38'b0, inexact}",
        "{1'b0, quotient}",
    ),
    fault(
        "the interval is open at its end",
        "xy_triangle_test.sv",
        "$signed(t_q) <= 39'(signed'(t_max_i))",
        "$signed(t_q) < 39'(signed'(t_max_i))",
    ),
    fault(
        "the identifier has to be on the grid",
        "xy_triangle_test.sv",
        "(off_b && word_index_i != 3'd4)",
        "off_b",
    ),
    fault(
        "upper halves of products count as unsigned",
        "xy_triangle_test.sv",
        "factors_b_o.b = {normal[CrossWidth-1], normal[CrossWidth-1:HalfWidth]}",
        "factors_b_o.b = {1'b0, normal[CrossWidth-1:HalfWidth]}",
    ),
    fault(
        "the dividend's lowest bits are lost",
        "xy_divider.sv",
        "{rest_q, low_q[7]}",
        "{rest_q, 1'b0}",
    ),
];

#[test]
fn every_fault_put_into_a_part_is_seen() {
    if !tools_for("every_fault_put_into_a_part_is_seen") {
        return;
    }
    let run = |top, faults: &[Fault], check: &dyn Fn(&mut Rtl) -> Result<(), String>| {
        for &(what, mutation) in faults {
            match check(&mut load(top, Some(mutation), 7)) {
                Ok(()) => panic!("not seen: {what}"),
                Err(message) => println!("{what}: seen: {message:.90}"),
            }
        }
    };
    run("xy_reciprocal", &RECIPROCAL_FAULTS, &|rtl| check_reciprocals(rtl, 7, 500));
    run("xy_box_test", &BOX_FAULTS, &|rtl| check_boxes(rtl, 7, 20_000).map(drop));
    run("xy_triangle_test", &TRIANGLE_FAULTS, &|rtl| check_triangles(rtl, 7, 5_000).map(drop));
}
