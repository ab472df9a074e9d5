//! `xylem soc`: the soft core and its animations.

use super::place::{Place, Ran, whole};

#[test]
fn a_soft_core_without_its_program_says_how_to_build_it() {
    let output = Place::new()
        .command(&["soc", "cornell"])
        .env("XYLEM_FIRMWARE", "/nowhere/firmware")
        .output()
        .expect("the command runs");
    Ran(output).fails(&["no firmware at /nowhere/firmware", "tests/firmware.sh build"]);
}

#[test]
fn the_soft_core_gives_the_hosts_digest_and_cycles_by_stage() {
    if let Err(missing) = xylem::soc::firmware_elf() {
        assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{missing}");
        println!("skipped: the_soft_core_gives_the_hosts_digest_and_cycles_by_stage: {missing}");
        return;
    }
    let place = Place::new();
    let options = ["--size", "8x6", "--format", "cbvh", "--memory", "slow", "--json"];
    let json = place.run(&[["soc", "cornell"].as_slice(), &options].concat()).json();
    assert_eq!(json["digest"], json["host_digest"]);
    assert_eq!((whole(&json, "primitives"), whole(&json, "rays")), (32, 48));
    let stages = json["stages"].as_array().expect("stages");
    assert_eq!(stages.len(), 5);
    let sum: u64 = stages.iter().map(|stage| whole(stage, "cycles")).sum();
    assert!(sum > 0 && sum < whole(&json, "cycles"));
    assert!(json.get("cells").is_none());
    let options = ["--size", "8x6", "--top-level", "atrbvh", "--bins", "8", "--json"];
    let json = place.run(&[["soc", "cornell"].as_slice(), &options].concat()).json();
    assert_eq!(json["digest"], json["host_digest"]);
    assert_eq!((json["top_level"].as_str(), whole(&json, "bins")), (Some("atrbvh"), 8));
    assert!(whole(&json, "cells") > 1 && whole(&json, "cells") <= whole(&json, "leaves"));
    let stages = json["stages"].as_array().expect("stages");
    let top = stages.iter().find(|stage| stage["stage"] == "top_level").expect("its cycles");
    assert!(whole(top, "cycles") > 0);
    let text = place.run(&["soc", "cornell", "--size", "8x6"]);
    assert!(text.out().contains(": equal"), "{}{}", text.out(), text.message());
    assert!(text.out().lines().all(|line| line.chars().count() <= 100), "{}", text.out());
}

#[test]
fn an_accelerator_is_compared_with_the_software_part_by_part() {
    let test = "an_accelerator_is_compared_with_the_software_part_by_part";
    if let Err(missing) = xylem::soc::firmware_elf() {
        assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{missing}");
        println!("skipped: {test}: {missing}");
        return;
    }
    let place = Place::new();
    let scene = ["soc", "cornell", "--size", "2x2", "--accelerator", "model"];
    let json = place.run(&[scene.as_slice(), &["--json"]].concat()).json();
    let accelerator = &json["accelerator"];
    assert_eq!(
        (accelerator["equal"].as_bool(), whole(accelerator, "latency_cycles")),
        (Some(true), 10)
    );
    let parts = accelerator["parts"].as_array().expect("parts");
    let names: Vec<_> = parts.iter().map(|part| part["part"].as_str().expect("a name")).collect();
    // It reads triangles, so the core has no boxes to prepare.
    assert_eq!(names, ["build", "build compressed", "trace"]);
    assert!(parts.iter().all(|part| part["equal"] == true), "{parts:?}");
    assert!(accelerator.get("in_software").is_none() && whole(&json, "treelet_depth") == 2);
    let build = &parts[0];
    let speedup = build["speedup"].as_f64().expect("a speed-up");
    let ratio = whole(build, "software_cycles") as f64 / whole(build, "cycles") as f64;
    assert!((speedup - ratio).abs() < 0.01 && speedup > 10.0, "{build}");
    assert!(whole(build, "busy_cycles") < whole(build, "cycles"));
    let text = place.run(&scene);
    assert!(text.out().contains("`paper` (cycle model)"), "{}", text.out());
    let other = ["--format", "cbvh", "--treelet-depth", "1", "--json"];
    let json = place.run(&[scene.as_slice(), &other].concat()).json();
    assert_eq!((whole(&json, "treelet_depth"), json["digest"] == json["host_digest"]), (1, true));
    assert_eq!(json["accelerator"]["in_software"][0], "build compressed");
    assert!(text.out().lines().all(|line| line.chars().count() <= 100), "{}", text.out());
    assert!(place.run(&["soc", "cornell", "--json"]).json().get("accelerator").is_none());
}

#[test]
fn an_animation_reports_what_was_done_in_each_frame() {
    let test = "an_animation_reports_what_was_done_in_each_frame";
    if let Err(missing) = xylem::soc::firmware_elf() {
        assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{missing}");
        println!("skipped: {test}: {missing}");
        return;
    }
    let place = Place::new();
    let scene = ["soc", "flag:cells=6", "--size", "6x4", "--animate", "5"];
    let with = |more: &[&str]| place.run(&[scene.as_slice(), more].concat());
    let json = with(&["--rebuild-at", "0.96", "--key", "flag:cells=6,frame=16", "--json"]).json();
    assert_eq!(json["digest"], json["host_digest"]);
    let frames = json["frames"].as_array().expect("frames");
    assert_eq!((frames.len(), frames[0]["update"].as_str()), (5, Some("rebuild")));
    assert!(frames[0].get("sah_refitted").is_none());
    for frame in frames {
        let rebuilt = frame["update"] == "rebuild";
        assert_eq!(whole(frame, "build_cycles") > 0, rebuilt, "{frame}");
        assert_eq!(whole(frame, "refit_cycles") > 0, whole(frame, "frame") > 0, "{frame}");
        assert!(rebuilt || frame["sah"] == frame["sah_refitted"], "{frame}");
        assert_eq!(frame["fresh_hits_equal"], true, "{frame}");
    }
    assert!(frames[1..].iter().any(|frame| frame["update"] == "rebuild"), "{json}");
    let text = with(&["--rebuild-price", "1000", "--format", "cbvh"]);
    assert_eq!(text.code(), Some(0), "{}", text.message());
    assert!(text.out().contains("built in 1 of 5 frames"), "{}", text.out());
    assert!(text.out().lines().all(|line| line.chars().count() <= 100), "{}", text.out());
    with(&["--key", "cornell"]).fails(&["cornell: it has other triangles than flag:cells=6"]);
}
