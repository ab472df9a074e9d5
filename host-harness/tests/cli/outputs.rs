//! Files that runs leave: pictures, scenes, the report.

use std::fs;

use super::place::{GOOD, Place, TRIANGLE, number, whole};

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
