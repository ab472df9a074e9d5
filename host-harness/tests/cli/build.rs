//! `xylem build`: regions, engines, emitters and compressors.

use std::path::PathBuf;

use serde_json::Value;

use super::place::{Place, number, whole};

#[test]
fn a_scene_larger_than_a_region_names_the_region() {
    let place = Place::new();
    let needed = [
        ("primitives", "primitives", "16384"),
        ("runs-a", "runs A", "16384"),
        ("leaf-table", "leaf table", "2048"),
    ];
    for (limit, name, bytes) in needed {
        let limit = format!("{limit}=64");
        place.run(&["build", "terrain:4", "--region-limit", &limit]).fails(&[
            "terrain:4: ",
            &format!("region `{name}` is too small: {bytes} bytes needed, 64 available"),
            "give the region more bytes (--region-limit) or take a smaller scene",
        ]);
    }
    let nodes = ["build", "terrain:4", "--region-limit", "nodes=640"];
    place.run(&nodes).fails(&["region `nodes` is too small", "640 available"]);
    let quantized =
        ["build", "terrain:4", "--format", "cbvh", "--region-limit", "quantized-nodes=64"];
    place.run(&quantized).fails(&["region `quantized nodes` is too small", "64 available"]);
    // Two passes of the merge need the second run region.
    let runs = ["build", "terrain:4", "--capacity", "16", "--burst", "4"];
    assert_eq!(place.run(&runs).code(), Some(0));
    let limited = [runs.as_slice(), &["--region-limit", "runs-b=1024"]].concat();
    place.run(&limited).fails(&["region `runs B` is too small", "1024 available"]);
    // Large enough is fine.
    let enough = ["build", "terrain:4", "--json", "--region-limit", "nodes=65536"];
    assert_eq!(whole(&place.run(&enough).json(), "primitives"), 512);
}

/// The folder of the scanned meshes if it has `file`; says so if not.
fn scanned(test: &str, file: &str) -> Option<PathBuf> {
    let folders = std::env::var_os("XYLEM_SCENES").unwrap_or_default();
    let found = std::env::split_paths(&folders).map(|f| f.join(file)).find(|f| f.is_file());
    if found.is_none() {
        let missing = format!(
            "skipped: {test}: no {file} in $XYLEM_SCENES; get it with \
                               scenes/fetch.sh and set XYLEM_SCENES to its folder"
        );
        println!("{missing}");
    }
    found
}

#[test]
fn the_bunny_builds_with_the_published_leaves_and_traffic() {
    let test = "the_bunny_builds_with_the_published_leaves_and_traffic";
    let Some(bunny) = scanned(test, "bunny.obj.gz") else { return };
    let bunny = bunny.to_str().expect("a path in UTF-8");
    let json = Place::new().run(&["build", bunny, "--format", "bvh2", "--json"]).json();
    assert_eq!(whole(&json, "primitives"), 69_451);
    let leaves = number(&json, "leaves");
    assert!((leaves / 65_362.0 - 1.0).abs() <= 0.01, "{leaves}");
    let mib = number(&json, "total_bytes") / f64::from(1 << 20);
    assert!((10.55..=10.70).contains(&mib), "{mib}");
    assert!(number(&json, "leaf_size_mean") > 1.0 && number(&json, "sah_cost") > 1.0);
    let stages = json["stages"].as_array().expect("stages");
    for (of_stage, total) in [
        ("read_bytes", "read_bytes"),
        ("write_bytes", "write_bytes"),
        ("bytes", "total_bytes"),
        ("cycles", "build_cycles"),
    ] {
        let sum: u64 = stages.iter().map(|stage| whole(stage, of_stage)).sum();
        assert_eq!(sum, whole(&json, total), "{of_stage}");
    }
    let clock = number(&json, "clock_mhz") * 1e3;
    assert!((number(&json, "time_ms") - number(&json, "build_cycles") / clock).abs() < 1e-9);
}

#[test]
fn the_clustering_emitter_is_named_with_its_shape_and_makes_a_cheaper_tree() {
    let place = Place::new();
    let lbvh = place.run(&["build", "sphereflake:2", "--json"]).json();
    assert_eq!((&lbvh["emitter"], lbvh.get("radius")), (&Value::from("lbvh"), None));
    let arguments = ["build", "sphereflake:2", "--emitter", "ploc", "--radius", "4", "--json"];
    let ploc = place.run(&arguments).json();
    assert_eq!(ploc["emitter"], "ploc");
    assert_eq!((whole(&ploc, "radius"), whole(&ploc, "chain")), (4, 4));
    assert_eq!(ploc["primitives"], lbvh["primitives"]);
    assert!(number(&ploc, "sah_cost") < number(&lbvh, "sah_cost"));
}

#[test]
fn the_clocked_builder_builds_the_same_tree_and_says_what_its_units_did() {
    let place = Place::new();
    let function = place.run(&["build", "terrain:6", "--json"]).json();
    for memory in ["ideal", "slow", "p1-32"] {
        let arguments = ["build", "terrain:6", "--engine", "cycle", "--memory", memory, "--json"];
        let cycle = place.run(&arguments).json();
        for key in ["primitives", "leaves", "nodes", "total_bytes", "sah_cost"] {
            assert_eq!(cycle[key], function[key], "{memory}: {key}");
        }
        let stages = cycle["stages"].as_array().unwrap();
        let cycles: u64 = stages.iter().map(|stage| whole(stage, "cycles")).sum();
        assert_eq!(cycles, whole(&cycle, "build_cycles"), "{memory}");
        assert_eq!(cycle["units"].as_array().unwrap().len(), 5, "{memory}");
        assert_eq!(cycle.get("dram").is_none(), memory == "ideal", "{memory}");
    }
}

#[test]
fn a_streamed_tree_is_as_good_as_a_compressed_one_and_its_repairs_are_counted() {
    let place = Place::new();
    let build = |options: &[&str]| {
        let words = ["build", "terrain:6", "--input", "triangle", "--coords", "relative", "--json"];
        place.run(&[words.as_slice(), options].concat()).json()
    };
    let pass = build(&["--compress", "topdown"]);
    assert_eq!((pass["compress"].as_str(), pass.get("backtracks")), (Some("topdown"), None));
    for engine in ["function", "cycle"] {
        let streamed = build(&["--compress", "bottomup", "--engine", engine, "--memory", "p3"]);
        assert_eq!(streamed["compress"], "bottomup");
        assert_eq!(streamed["node_bytes"], pass["node_bytes"]);
        assert_eq!(streamed["sah_cost"], pass["sah_cost"]);
        let repairs = whole(&streamed, "backtracks");
        let by_depth = streamed["backtracks_by_depth"].as_array().unwrap();
        assert!(repairs > 0);
        assert_eq!(by_depth.iter().map(|count| count.as_u64().unwrap()).sum::<u64>(), repairs);
        let stages = streamed["stages"].as_array().unwrap();
        let compress = stages.iter().find(|stage| stage["stage"] == "compress").unwrap();
        assert!(whole(compress, "bytes").abs_diff(128 * repairs) < 256, "{engine}");
        let held = build(&["--held-lines", "16", "--engine", engine, "--memory", "p3"]);
        assert!(whole(&held, "total_bytes") < whole(&streamed, "total_bytes"));
        let treelets = build(&["--treelet-depth", "4", "--engine", engine]);
        assert!(whole(&treelets, "backtracks") < repairs);
    }
    let clocked = build(&["--compress", "topdown", "--engine", "cycle", "--memory", "p3"]);
    assert_eq!(clocked["total_bytes"], pass["total_bytes"]);
    for bits in ["4", "5", "7", "8"] {
        let json = build(&["--quant-bits", bits, "--min-scale", "3", "--compress", "bottomup"]);
        let bytes = if bits > "6" { 20 } else { 16 };
        assert_eq!(whole(&json, "node_bytes"), bytes * whole(&json, "nodes"), "{bits}");
    }
}

#[test]
fn sizes_of_the_clocked_builder_need_it_and_it_says_what_it_cannot_do() {
    let place = Place::new();
    let refused: [(&[&str], &str); 6] = [
        (&["--sorters", "4"], "--engine cycle"),
        (&["--compress", "topdown", "--treelet-depth", "2"], "--compress bottomup"),
        (&["--format", "bvh2", "--margin", "0"], "--format cbvh"),
        (&["--engine", "cycle", "--record", "pair8"], "32-byte boxes"),
        (&["--engine", "cycle", "--burst", "1"], "at least 2 records"),
        (&["--engine", "cycle", "--top-level", "atrbvh"], "function engine"),
    ];
    for (options, message) in refused {
        place.run(&[&["build", "terrain:4"], options].concat()).fails_with(2, &[message]);
    }
}
