//! Scenes as they come: found, refused, or odd and fine.

use std::path::Path;

use super::place::{Place, Ran, TRIANGLE, whole};

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
