//! `xylem trace`: rays in, hits out.

use std::fs;

use super::place::{GOOD, Place, Ran, TRIANGLE, whole, with_component};

fn trace(rays: &[[f32; 8]], more: &[&str]) -> Ran {
    let place = Place::new().with("a.obj", TRIANGLE).with_rays("a.rays", rays);
    place.run(&[["trace", "a.obj", "--rays", "a.rays"].as_slice(), more].concat())
}

#[test]
fn a_ray_file_of_a_wrong_length_is_refused() {
    let place = Place::new().with("a.obj", TRIANGLE).with("a.rays", [0; 70]);
    place.run(&["trace", "a.obj", "--rays", "a.rays", "--hits", "a.hits"]).fails(&[
        "a.rays: 70 bytes are 2 rays of 32 bytes and 6 left over",
        "the file is cut off or of another kind",
    ]);
    assert_eq!(place.files(), ["a.obj", "a.rays"]);
    place.run(&["trace", "a.obj", "--rays", "b.rays"]).fails(&["b.rays: cannot read it"]);
}

#[test]
fn rays_that_are_no_numbers_are_refused_by_index_and_component() {
    for (component, name) in (0..8).zip(["ox", "oy", "oz", "dx", "dy", "dz", "tmin", "tmax"]) {
        let rays = [GOOD, with_component(component, f32::NAN)];
        trace(&rays, &[])
            .fails(&[&format!("a.rays: ray 1: {name} is NaN"), "correct or leave out that ray"]);
    }
    trace(&[with_component(3, f32::INFINITY)], &[]).fails(&["a.rays: ray 0: dx is inf"]);
}

#[test]
fn zero_directions_and_empty_intervals_are_counted_misses() {
    let zero = [0.25, 0.25, 1.0, 0.0, -0.0, 0.0, 0.0, 9.0];
    let inverted = [0.25, 0.25, 1.0, 0.0, 0.0, -1.0, 9.0, 0.0];
    let behind = with_component(7, 0.5);
    let json = trace(&[GOOD, zero, inverted, zero, behind], &["--json", "--check"]).json();
    assert_eq!((whole(&json, "rays"), whole(&json, "hits")), (5, 1));
    assert_eq!((whole(&json, "zero_direction"), whole(&json, "empty_interval")), (2, 1));
    assert_eq!((whole(&json, "checked"), whole(&json, "mismatches")), (5, 0));
}

#[test]
fn zeros_of_either_sign_in_a_direction_hit_the_same() {
    for format in ["bvh2", "cbvh"] {
        for query in ["closest", "any"] {
            let negative = [0.25, 0.25, 1.0, -0.0, -0.0, -1.0, 0.0, f32::INFINITY];
            let options = ["--json", "--check", "--format", format, "--query", query];
            let json = trace(&[GOOD, negative], &options).json();
            assert_eq!((whole(&json, "hits"), whole(&json, "mismatches")), (2, 0));
        }
    }
}

#[test]
fn traversals_are_of_quantized_nodes_and_say_what_they_multiply() {
    let (quantized, all) = (["--json", "--format", "cbvh"], ["decompress", "point", "incremental"]);
    let bits = all.map(|traversal| {
        let options = [&quantized[..], &["--check", "--traversal", traversal]].concat();
        let json = trace(&[GOOD], &options).json();
        assert_eq!((whole(&json, "hits"), whole(&json, "mismatches")), (1, 0));
        assert_eq!(json["traversal"], traversal);
        assert_eq!(json["test_multipliers"]["count"], 12);
        assert_eq!(json.get("resume_multipliers").is_some(), traversal == "point");
        whole(&json, "stack_entry_bits")
    });
    assert!(bits[0] == bits[1] && bits[1] < bits[2], "{bits:?}");
    assert_eq!(trace(&[GOOD], &quantized).json()["traversal"], "incremental");
    assert!(trace(&[GOOD], &["--json"]).json().get("traversal").is_none());
    trace(&[GOOD], &["--traversal", "point"])
        .fails_with(2, &["--traversal is about quantized nodes", "use --format cbvh"]);
}

#[test]
fn no_rays_have_no_means() {
    let json = trace(&[], &["--json"]).json();
    assert_eq!(whole(&json, "rays"), 0);
    assert!(json.get("box_tests_per_ray").is_none() && json.get("host_rays_per_s").is_none());
}

#[test]
fn hits_are_written_in_the_documented_layout() {
    let place = Place::new()
        .with("a.obj", TRIANGLE)
        .with_rays("a.rays", &[with_component(0, 0.5), with_component(0, 7.0)]);
    place.run(&["trace", "a.obj", "--rays", "a.rays", "--hits", "a.hits", "--json"]).json();
    let bytes = fs::read(place.path("a.hits")).expect("the hits");
    let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).expect("four bytes");
    assert_eq!(bytes.len(), 32);
    assert_eq!(u32::from_le_bytes(word(0)), 0);
    let [t, u, v] = [4, 8, 12].map(|at| f32::from_le_bytes(word(at)));
    assert!((t - 1.0).abs() < 1e-6 && (u - 0.5).abs() < 1e-6 && (v - 0.25).abs() < 1e-6);
    assert_eq!(u32::from_le_bytes(word(16)), u32::MAX);
    assert_eq!(place.files(), ["a.hits", "a.obj", "a.rays"]);
}

#[test]
fn a_failed_run_leaves_an_earlier_output_as_it_was() {
    let place = Place::new().with("a.obj", TRIANGLE).with("a.rays", [0; 31]).with("a.hits", "old");
    place.run(&["trace", "a.obj", "--rays", "a.rays", "--hits", "a.hits"]).fails(&["a.rays: 31"]);
    assert_eq!(fs::read(place.path("a.hits")).expect("the file"), b"old");
    assert_eq!(place.files(), ["a.hits", "a.obj", "a.rays"]);
}
