//! The `xylem` command as its users meet it: results, messages and exit codes.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

/// A triangle, for scenes that need one.
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A folder that the command runs in, with no scenes but its own.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn with(self, name: &str, contents: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), contents).expect("a file in a temporary folder");
        self
    }

    fn with_rays(self, name: &str, rays: &[[f32; 8]]) -> Self {
        let bytes: Vec<u8> = rays.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        self.with(name, bytes)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xylem"));
        command.args(arguments).current_dir(self.0.path()).env_remove("XYLEM_SCENES");
        command
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        Ran(self.command(arguments).output().expect("the command runs"))
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a temporary folder").flatten();
        let mut names: Vec<_> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

/// What a run left behind.
struct Ran(Output);

impl Ran {
    fn code(&self) -> Option<i32> {
        self.0.status.code()
    }

    fn out(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).expect("UTF-8 on standard output")
    }

    /// Standard error with line breaks as spaces: messages are wrapped.
    fn message(&self) -> String {
        let text = String::from_utf8(self.0.stderr.clone()).expect("UTF-8 on standard error");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Asserts that the run failed with code 1, printed nothing and said `parts`.
    #[track_caller]
    fn fails(&self, parts: &[&str]) {
        self.fails_with(1, parts);
    }

    #[track_caller]
    fn fails_with(&self, code: i32, parts: &[&str]) {
        let message = self.message();
        assert_eq!(self.code(), Some(code), "{message}");
        assert_eq!(self.out(), "", "nothing on standard output");
        assert!(message.starts_with("error: "), "{message}");
        for part in parts {
            assert!(message.contains(part), "'{part}' is not in: {message}");
        }
    }

    /// Asserts that the run succeeded with one JSON object and nothing else, and returns it.
    #[track_caller]
    fn json(&self) -> Value {
        assert_eq!(self.code(), Some(0), "{}", self.message());
        assert_eq!(self.message(), "", "nothing on standard error");
        let value: Value = serde_json::from_str(&self.out()).expect("one JSON value");
        assert!(value.is_object(), "{value}");
        value
    }
}

fn number(json: &Value, key: &str) -> f64 {
    json[key].as_f64().unwrap_or_else(|| panic!("{key} in {json}"))
}

fn whole(json: &Value, key: &str) -> u64 {
    json[key].as_u64().unwrap_or_else(|| panic!("{key} in {json}"))
}

// ---- Bad scenes -------------------------------------------------------------------------------

#[test]
fn a_missing_file_is_named_with_what_was_looked_for() {
    let place = Place::new();
    place.run(&["build", "nowhere.obj"]).fails(&[
        "no scene 'nowhere.obj'; looked for nowhere.obj",
        "give a path to an OBJ file, or run `xylem scene list`",
    ]);
    place.run(&["build", "sphereflak"]).fails(&["did you mean sphereflake?"]);
}

#[test]
fn an_empty_file_is_refused() {
    let place = Place::new().with("empty.obj", "");
    place
        .run(&["build", "empty.obj"])
        .fails(&["empty.obj: the file is empty; give a Wavefront OBJ"]);
}

#[test]
fn a_scene_without_faces_is_refused() {
    let place = Place::new().with("points.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n");
    place.run(&["build", "points.obj"]).fails(&[
        "points.obj: no faces with three or more vertices",
        "export the mesh with its faces",
    ]);
}

#[test]
fn an_index_out_of_range_is_refused_at_its_line() {
    let place = Place::new().with("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
    place.run(&["build", "bad.obj"]).fails(&[
        "bad.obj:5: face refers to vertex 4, but the file has 3 vertices",
        "correct the index",
    ]);
    let place = Place::new().with("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n");
    place.run(&["build", "bad.obj"]).fails(&["bad.obj:4: face refers to vertex -4"]);
}

#[test]
fn vertices_that_are_no_finite_numbers_are_refused_at_their_line() {
    for (value, says) in
        [("nan", "is not a finite"), ("inf", "is not a finite"), ("1e99", "is not a finite")]
    {
        let text = format!("v 0 0 0\nv 1 {value} 0\nv 0 1 0\nf 1 2 3\n");
        let place = Place::new().with("bad.obj", text);
        place.run(&["build", "bad.obj"]).fails(&["bad.obj:2: ", says, "repair the mesh"]);
    }
    let place = Place::new().with("bad.obj", "v 0 zero 0\nf 1 1 1\n");
    place.run(&["build", "bad.obj"]).fails(&["bad.obj:1: 'v 0 zero 0' is not a vertex"]);
}

#[test]
fn damaged_gzip_data_is_refused() {
    let place = Place::new().with("bad.obj.gz", [0x1f, 0x8b, 8, 0, 1, 2, 3]);
    place.run(&["build", "bad.obj.gz"]).fails(&["bad.obj.gz: damaged gzip data", "fetch or pack"]);
}

// ---- Odd scenes that are fine -----------------------------------------------------------------

#[test]
fn quads_and_polygons_are_fanned() {
    let pentagon = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4\nf 1 2 3 4 5\nf 1 2\n";
    let place = Place::new().with("poly.obj", pentagon);
    let info = place.run(&["scene", "info", "poly.obj", "--json"]).json();
    assert_eq!((whole(&info, "triangles"), whole(&info, "faces_fanned")), (5, 2));
    assert_eq!(whole(&info, "faces_skipped"), 1);
    let build = place.run(&["build", "poly.obj", "--json"]).json();
    assert_eq!(whole(&build, "primitives"), 5);
}

#[test]
fn negative_indices_and_crlf_give_the_same_scene() {
    let plain = Place::new().with("a.obj", TRIANGLE);
    let odd = Place::new().with("a.obj", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf -3 -2 -1\r\n");
    let info = |place: &Place| place.run(&["scene", "info", "a.obj", "--json"]).json();
    assert_eq!(info(&plain), info(&odd));
    assert_eq!(whole(&info(&odd), "triangles"), 1);
}

#[test]
fn every_degenerate_scene_builds_in_every_format() {
    let place = Place::new();
    let list = place.run(&["scene", "list", "--json"]).json();
    let scenes = list["degenerate"].as_array().expect("a list");
    assert!(scenes.len() >= 8);
    for scene in scenes {
        let name = scene["name"].as_str().expect("a name");
        for format in [&["--format", "bvh2"], &["--coords", "relative"], &["--coords", "modulo"]] {
            let ran = place.run(&[["build", name, "--json"].as_slice(), format].concat());
            if name == "degenerate/empty" {
                ran.fails(&["empty.obj: no faces"]);
                continue;
            }
            let json = ran.json();
            assert!(whole(&json, "leaves") <= whole(&json, "primitives"), "{name}");
        }
    }
}

// ---- Regions ----------------------------------------------------------------------------------

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

// ---- Bad rays ---------------------------------------------------------------------------------

/// Straight through the middle of [`TRIANGLE`].
const GOOD: [f32; 8] = [0.25, 0.25, 1.0, 0.0, 0.0, -1.0, 0.0, f32::INFINITY];

fn with_component(index: usize, value: f32) -> [f32; 8] {
    let mut ray = GOOD;
    ray[index] = value;
    ray
}

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

// ---- Outputs ----------------------------------------------------------------------------------

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
fn outputs_that_cannot_be_written_are_refused_before_the_work() {
    let place = Place::new().with("a.obj", TRIANGLE).with_rays("a.rays", &[GOOD]);
    let says = ["cannot write it", "give a path in a folder you may write to"];
    let hits = ["trace", "a.obj", "--rays", "a.rays", "--hits", "no/a.hits"];
    place.run(&hits).fails(&[&["no/a.hits: "], says.as_slice()].concat());
    let picture = ["render", "a.obj", "--out", "no/a.png"];
    place.run(&picture).fails(&[&["no/a.png: "], says.as_slice()].concat());
    let obj = ["scene", "generate", "cornell", "--out", "no/a.obj"];
    place.run(&obj).fails(&[&["no/a.obj: "], says.as_slice()].concat());
    // A file is no folder.
    place.run(&["--out", "a.obj"]).fails(&[&["a.obj: "], says.as_slice()].concat());
    assert_eq!(place.files(), ["a.obj", "a.rays"]);
}

#[test]
fn a_failed_run_leaves_an_earlier_output_as_it_was() {
    let place = Place::new().with("a.obj", TRIANGLE).with("a.rays", [0; 31]).with("a.hits", "old");
    place.run(&["trace", "a.obj", "--rays", "a.rays", "--hits", "a.hits"]).fails(&["a.rays: 31"]);
    assert_eq!(fs::read(place.path("a.hits")).expect("the file"), b"old");
    assert_eq!(place.files(), ["a.hits", "a.obj", "a.rays"]);
}

#[test]
fn pictures_are_png_files_of_the_asked_size() {
    let place = Place::new();
    let shaded = ["render", "cornell", "--size", "40x30", "--samples", "1", "--out", "a.png"];
    let json = place.run(&[shaded.as_slice(), &["--json"]].concat()).json();
    assert_eq!((whole(&json, "width"), whole(&json, "height")), (40, 30));
    assert!(json.get("heatmap").is_none());
    let picture = image::open(place.path("a.png")).expect("a PNG file").to_rgb8();
    assert_eq!(picture.dimensions(), (40, 30));
    let colours: std::collections::HashSet<_> = picture.pixels().collect();
    assert!(colours.len() > 50, "{} colours", colours.len());
    for map in ["nodes", "tris", "boxes"] {
        let heat = ["render", "cornell", "--size", "400x30", "--heatmap", map, "--out", "b.png"];
        let json = place.run(&[heat.as_slice(), &["--json", "--format", "cbvh"]].concat()).json();
        assert!(number(&json, "mean_per_ray") > 0.1);
        // The legend is below.
        assert!(whole(&json, "height") > 30);
    }
}

#[test]
fn a_generated_scene_reads_back_as_the_same_scene() {
    let place = Place::new();
    for file in ["t.obj", "t.obj.gz"] {
        let json = place.run(&["scene", "generate", "terrain:5", "--out", file, "--json"]).json();
        assert_eq!(whole(&json, "triangles"), 2048);
        let (a, b) = (["build", "terrain:5", "--json"], ["build", file, "--json"]);
        let (a, b) = (place.run(&a).json(), place.run(&b).json());
        for key in ["leaves", "sah_cost", "depth", "total_bytes", "stages"] {
            assert_eq!(a[key], b[key], "{file}: {key}");
        }
    }
    place
        .run(&["scene", "generate", "mountain", "--out", "m.obj"])
        .fails(&["no computed scene 'mountain'", "xylem scene list"]);
    let range = place.run(&["scene", "generate", "terrain:99", "--out", "m.obj"]);
    range.fails(&["levels = 99 is not in 1 to 11"]);
    assert_eq!(place.files(), ["t.obj", "t.obj.gz"]);
}

#[test]
fn the_bare_command_leaves_a_report_with_pictures() {
    let place = Place::new();
    let json = place
        .run(&["--scene", "sphereflake:1", "--size", "160x120", "--out", "report", "--json"])
        .json();
    assert_eq!((whole(&json, "differences"), whole(&json, "mismatches")), (0, 0));
    assert!(whole(&json, "compared") > 20_000 && whole(&json, "checked") > 1000);
    let html = fs::read_to_string(place.path("report/index.html")).expect("the page");
    assert_eq!(html.matches("<img src=\"data:image/png;base64,").count(), 3);
    for part in ["<svg", "modelled", "measured", "counted", "SAH cost", env!("CARGO_PKG_VERSION")] {
        assert!(html.contains(part), "{part}");
    }
    for name in ["shaded.png", "nodes-bvh2.png", "nodes-cbvh.png"] {
        let picture = image::open(place.path("report").join(name)).expect("a PNG file");
        assert_eq!(picture.width(), 160);
    }
    let text = place.run(&["--scene", "cornell", "--size", "32x24"]);
    assert_eq!(text.code(), Some(0));
    let out = text.out();
    assert!(out.lines().all(|line| line.chars().count() <= 100), "{out}");
    assert!(out.contains("xylem-report/index.html") && out.contains("0 differ"), "{out}");
}

// ---- The soft core ----------------------------------------------------------------------------

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

// ---- The command line -------------------------------------------------------------------------

#[test]
fn wrong_usage_exits_with_2_and_says_what_is_right() {
    let place = Place::new().with("a.obj", TRIANGLE);
    let cases: &[(&[&str], &str)] = &[
        (&["build"], "<SCENE>"),
        (&["build", "a.obj", "--format", "mbvh4"], "[possible values: bvh2, cbvh, cbvh4, cbvh8]"),
        (&["build", "a.obj", "--engine", "gates"], "[possible values: function, cycle]"),
        (&["build", "a.obj", "--compress", "sideways"], "[possible values: topdown, bottomup]"),
        (&["build", "a.obj", "--memory", "dram"], "[possible values: ideal, slow, medium"),
        (&["build", "a.obj", "--format", "bvh2", "--coords", "modulo"], "use --format cbvh"),
        (&["build", "a.obj", "--max-leaf", "256"], "1..=255"),
        (&["build", "a.obj", "--capacity", "1000"], "capacity M must be a power of two"),
        (&["build", "a.obj", "--burst", "3"], "burst B must be a power of two"),
        (&["build", "a.obj", "--record", "pair8", "--morton", "63"], "30-bit Morton codes"),
        (&["build", "a.obj", "--emitter", "sah"], "[possible values: lbvh, ploc]"),
        (&["build", "a.obj", "--radius", "8"], "about --emitter ploc"),
        (&["build", "a.obj", "--emitter", "ploc", "--radius", "17"], "1..=16"),
        (&["build", "a.obj", "--emitter", "ploc", "--chain", "0"], "1..=8"),
        (&["build", "a.obj", "--region-limit", "leaves=4"], "there is no region 'leaves'"),
        (&["trace", "a.obj"], "--rays <FILE>"),
        (&["render", "a.obj", "--out", "a.png", "--size", "4"], "as 640x480"),
        (&["soc", "a.obj", "--engine", "gates"], "[possible values: sim, qemu, picorv32]"),
        (&["soc", "a.obj", "--engine", "qemu", "--memory", "slow"], "--engine sim only"),
        (&["soc", "a.obj", "--cells", "2049"], "more than the firmware's 2048"),
        (&["soc", "a.obj", "--emitter", "ploc"], "with --emitter lbvh only"),
        (&["soc", "a.obj", "--compress", "bottomup"], "--compress topdown"),
        (&["soc", "a.obj", "--format", "cbvh8"], "--format cbvh or bvh2"),
        (&["soc", "a.obj", "--key", "b.obj"], "--animate"),
        (&["soc", "a.obj", "--animate", "0"], "1..=1024"),
        (&["soc", "a.obj", "--animate", "2", "--rebuild-at", "1e9"], "from 0 to 65535"),
        (&["--out", "x", "build", "a.obj"], "belong to the bare `xylem`"),
        (&["bulid"], "build"),
    ];
    for (arguments, says) in cases {
        place.run(arguments).fails_with(2, &[says]);
    }
    assert_eq!(place.files(), ["a.obj"]);
}

#[test]
fn help_fits_100_columns_and_gives_examples() {
    let place = Place::new();
    let commands: &[&[&str]] = &[
        &[],
        &["build"],
        &["trace"],
        &["render"],
        &["soc"],
        &["scene"],
        &["scene", "list"],
        &["scene", "generate"],
        &["scene", "info"],
    ];
    for command in commands {
        for help in ["-h", "--help"] {
            let ran = place.run(&[command, [help].as_slice()].concat());
            assert_eq!(ran.code(), Some(0));
            let out = ran.out();
            let long: Vec<_> = out.lines().filter(|l| l.chars().count() > 100).collect();
            assert!(long.is_empty(), "{command:?}: {long:?}");
            assert!(out.contains("Examples:") || command.len() == 2, "{command:?}");
        }
    }
    // Paths stand on lines of their own, as long as they are.
    let list = place.run(&["scene", "list"]).out();
    let fits = |line: &str| line.chars().count() <= 100 || line.trim_start().starts_with('/');
    assert!(list.lines().all(fits), "{list}");
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let place = Place::new();
    let mut child = place
        .command(&["scene", "list", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command runs");
    drop(child.stdout.take());
    let ran = Ran(child.wait_with_output().expect("the command ends"));
    assert_eq!((ran.code(), ran.message().as_str()), (Some(0), ""));
}

#[test]
fn text_lines_fit_100_columns() {
    let place = Place::new().with("a.obj", TRIANGLE).with_rays("a.rays", &[GOOD]);
    for arguments in [
        &["build", "terrain:6", "--format", "cbvh"][..],
        &["trace", "a.obj", "--rays", "a.rays", "--check"],
        &["scene", "info", "cornell"],
    ] {
        let ran = place.run(arguments);
        assert_eq!(ran.code(), Some(0), "{}", ran.message());
        assert!(BufReader::new(ran.out().as_bytes()).lines().count() >= 4);
        assert!(ran.out().lines().all(|line| line.chars().count() <= 100), "{}", ran.out());
    }
}

// ---- Published numbers ------------------------------------------------------------------------

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
fn scenes_are_found_by_name_in_the_folders_of_xylem_scenes() {
    let place = Place::new().with("mine.obj", TRIANGLE);
    let elsewhere = Place::new();
    let folder: &Path = place.0.path();
    let output = elsewhere
        .command(&["scene", "info", "mine", "--json"])
        .env("XYLEM_SCENES", folder)
        .output()
        .expect("the command runs");
    assert_eq!(whole(&Ran(output).json(), "triangles"), 1);
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

#[test]
fn a_trace_of_requests_is_replayed_and_its_bytes_clocks_and_energy_are_told() {
    // One read of a closed row: 34 clocks of 1.25 ns; two dies, of which each activates once.
    let place = Place::new().with("one.trace", "0x1f40 R\n");
    let json = place.run(&["dram", "--trace", "one.trace", "--json"]).json();
    let keys = ["mem_cycles", "bytes", "row_hits", "row_misses", "row_conflicts"];
    assert_eq!(keys.map(|key| whole(&json, key)), [34, 64, 0, 1, 0]);
    assert!((number(&json, "gb_per_s") - 64.0 / (34.0 * 1.25)).abs() < 1e-9);
    assert!(number(&json, "energy_pj") > 2.0 * (2943.0 + 1317.0));
    assert!(json["energy"]["source"].as_str().is_some_and(|text| text.contains("DRAMPower")));
    let unpowered = ["dram", "--trace", "one.trace", "--memory", "p1-16", "--json"];
    assert!(place.run(&unpowered).json()["energy_pj"].is_null());
}

#[test]
fn bad_traces_of_requests_are_refused_at_their_line() {
    let place = Place::new().with("bad.trace", "0x0 R\n0x40 Q\n").with("empty.trace", "# none\n");
    place.run(&["dram", "--trace", "bad.trace"]).fails(&["bad.trace:2:", "0x40 Q", "neither R"]);
    place.run(&["dram", "--trace", "empty.trace"]).fails(&["empty.trace", "no request"]);
    place.run(&["dram", "--trace", "none.trace"]).fails(&["none.trace", "cannot read it"]);
    let unknown = ["dram", "--trace", "bad.trace", "--memory", "quick"];
    place.run(&unknown).fails_with(2, &["quick", "slow", "p1-32"]);
}

#[test]
fn experiments_without_models_run_and_the_others_say_what_is_missing() {
    let place = Place::new();
    let table = place.run(&["reproduce", "p1-table1", "p2-table1", "--json"]).json();
    let experiments = table["experiments"].as_array().expect("experiments");
    assert_eq!(experiments.len(), 2);
    let row = &experiments[1]["tables"][0]["rows"][4]["total_bytes"];
    let found = ["ours", "paper", "deviation_percent"].map(|key| number(row, key));
    assert_eq!(found, [164.0, 164.0, 0.0]);
    assert!(place.files().is_empty(), "tables alone leave no files");

    let figure = place.run(&["reproduce", "p1-fig4", "--out", "out"]);
    assert_eq!(figure.code(), Some(1));
    let message = figure.message();
    for part in ["p1-fig4", "none of the models is at hand", "XYLEM_SCENES", "scenes/fetch.sh"] {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
    assert!(figure.out().contains("no mesh 'sibenik'"), "{}", figure.out());
    let page = fs::read_to_string(place.path("out/index.html")).expect("a page");
    assert!(page.contains("P1 Fig. 4") && page.contains("Missing: Sibenik"));
}

#[test]
fn experiments_are_listed_and_unknown_ones_refused() {
    let place = Place::new();
    let list = place.run(&["reproduce", "--list", "--json"]).json();
    let ids: Vec<_> =
        list["experiments"].as_array().expect("a list").iter().map(|e| e["id"].as_str()).collect();
    assert!(ids.contains(&Some("p2-table6")) && ids.len() >= 11, "{ids:?}");
    assert!(place.run(&["reproduce"]).out().contains("P2 Table VI"));
    place.run(&["reproduce", "p9-table1"]).fails_with(2, &["p9-table1"]);
    place.run(&["reproduce", "--all", "p1-table1"]).fails_with(2, &["--all"]);
}
