//! Loading scenes and rays: what is accepted, what is refused and in which words, and that the
//! committed scenes are the ones that the generators give.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use xylem::scene::find::{Found, Library};
use xylem::scene::manifest::{Kind, Manifest, sha256};
use xylem::scene::{
    self, ConversionCounts, GridRay, Hit, LoadOptions, Mesh, SceneFrame, SceneRay, convert, obj,
    procedural, rays,
};
use xylem_core::geom::PrimIndex;
use xylem_core::num::Grid;
use xylem_core::traverse;

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n";

/// A file of this test's own in a folder that cargo clears.
fn file(name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scenes").join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, bytes).unwrap();
    path
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn parse(text: impl AsRef<[u8]>) -> Mesh {
    obj::parse(text.as_ref(), Path::new("m.obj"), &LoadOptions::default()).unwrap()
}

/// The message for a wrong OBJ text.
fn refusal(text: impl AsRef<[u8]>) -> String {
    obj::parse(text.as_ref(), Path::new("m.obj"), &LoadOptions::default()).unwrap_err().to_string()
}

/// The folder of reference data that an environment variable names; without it, says that the test
/// is skipped.
fn reference(test: &str, variable: &str) -> Option<PathBuf> {
    let folder = std::env::var_os(variable).map(PathBuf::from).filter(|f| f.is_dir());
    if folder.is_none() {
        println!("skipped: {test}: set {variable} to a folder of reference scenes (see scenes/)");
    }
    folder
}

#[test]
fn files_that_cannot_be_read_are_named() {
    let missing = Path::new("no/such/file.obj");
    let error = obj::load(missing, &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.starts_with("no/such/file.obj: cannot read it: "), "{error}");
    assert!(error.ends_with("check the path and its permissions"), "{error}");

    let cut = &gzip(CORNERS.repeat(99).as_bytes())[..40];
    let error = obj::load(&file("cut.obj.gz", cut), &LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("cut.obj.gz: damaged gzip data: "), "{error}");
    assert!(error.to_string().ends_with("fetch or pack the file again"), "{error}");
}

#[test]
fn files_without_a_mesh_are_refused() {
    let empty = "m.obj: the file is empty; give a Wavefront OBJ with 'v' and 'f' lines";
    assert_eq!(refusal(""), empty);
    let no_faces = "m.obj: no faces with three or more vertices (5 vertices, 0 points and lines); \
                    export the mesh with its faces";
    assert_eq!(refusal(CORNERS), no_faces);
    assert!(refusal("# only a comment\n").contains("(0 vertices, 0 points and lines)"));
    assert!(refusal(format!("{CORNERS}f 1\nf 1 2\n")).contains("(5 vertices, 2 points and lines)"));
}

#[test]
fn indices_out_of_range_are_found_by_line() {
    let message = |face: &str| refusal(format!("{CORNERS}f 1 2 3\n\n# comment\n{face}\n"));
    assert_eq!(
        message("f 1 2 6"),
        "m.obj:9: face refers to vertex 6, but the file has 5 vertices (indices run from 1, or from \
         -1 backwards); correct the index or restore the missing 'v' lines"
    );
    assert!(
        message("f 1 -6 2").starts_with("m.obj:9: face refers to vertex -6, but the file has 5")
    );
    assert!(message("f 0 1 2").starts_with("m.obj:9: face refers to vertex 0, "));
    assert!(message("f 1/1/1 2/2/2 77/1/1").starts_with("m.obj:9: face refers to vertex 77, "));
    // A negative index counts from where it stands, not from the end of the file.
    let early = refusal("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n");
    assert!(early.starts_with("m.obj:3: face refers to vertex -3, but the file has 2"), "{early}");
}

#[test]
fn numbers_that_are_none_are_found_by_line() {
    let vertex = |line: &str| refusal(format!("{CORNERS}{line}\nf 1 2 6\n"));
    assert_eq!(
        vertex("v 1 2 abc"),
        "m.obj:6: 'v 1 2 abc' is not a vertex; write 'v X Y Z' with three decimal numbers"
    );
    assert!(vertex("v 1 2").starts_with("m.obj:6: 'v 1 2' is not a vertex"));
    assert!(vertex("v").starts_with("m.obj:6: 'v' is not a vertex"));
    let face = refusal(format!("{CORNERS}f 1 2 3\nf 1 2 x\n"));
    assert_eq!(
        face,
        "m.obj:7: 'f 1 2 x' is not a face; write 'f A B C' with integers, or A/T/N groups"
    );
    let long = refusal(format!("{CORNERS}f 1 2 {}\n", "x".repeat(500)));
    assert!(long.len() < 200, "{long}");
    let latin = refusal([CORNERS.as_bytes(), b"v 1 2 \xe9\nf 1 2 3\n"].concat());
    assert!(latin.starts_with("m.obj:6: 'v 1 2 \u{fffd}' is not a vertex"), "{latin}");
}

#[test]
fn vertices_that_are_not_finite_are_found_by_line() {
    for bad in ["nan", "inf", "-inf", "NaN", "Infinity", "1e39", "-1e999"] {
        for line in [format!("v {bad} 0 0"), format!("v 0 {bad} 0"), format!("v 0 0 {bad}")] {
            let message = refusal(format!("{CORNERS}{line}\nf 1 2 3\nf 1 2 6\n"));
            let expect = format!(
                "m.obj:6: '{line}' has a coordinate that is not a finite 32-bit float; repair the mesh"
            );
            assert_eq!(message, expect);
        }
    }
    // A vertex that no face uses does not count.
    assert_eq!(parse(format!("{CORNERS}v nan 0 0\nf 1 2 3\n")).triangles.len(), 1);
}

#[test]
fn a_vertex_outside_a_given_frame_is_found_by_line() {
    let frame = SceneFrame::fit([0.0; 3], [1.0; 3], Grid::DEFAULT).unwrap();
    let options = LoadOptions { frame: Some(frame), ..LoadOptions::default() };
    let text = format!("{CORNERS}f 1 2 3\nv 0.5 1.5 0\nf 1 2 6\n");
    let error = obj::parse(text.as_bytes(), Path::new("m.obj"), &options).unwrap_err().to_string();
    assert!(
        error.starts_with("m.obj:7: vertex y = 1.5e0 is 5e-1 outside the grid frame"),
        "{error}"
    );
    let inside = obj::parse(format!("{CORNERS}f 1 2 3").as_bytes(), Path::new("m.obj"), &options);
    assert_eq!(inside.unwrap().frame, frame);
}

#[test]
fn polygons_are_fanned_from_their_first_vertex_in_file_order() {
    let mesh = parse(format!("{CORNERS}f 2 3 4\nf 1 2 3 4\nf 5 4 3 2 1\nf 1 2\nf 1 2 5\n"));
    let corner = |i: usize| -> Vec<usize> {
        let places = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let corners = mesh.corners(i).unwrap();
        corners.iter().map(|c| 1 + places.iter().position(|p| p == c).unwrap()).collect()
    };
    let faces: Vec<_> = (0..mesh.triangles.len()).map(corner).collect();
    let expect = [[2, 3, 4], [1, 2, 3], [1, 3, 4], [5, 4, 3], [5, 3, 2], [5, 2, 1], [1, 2, 5]];
    assert_eq!(faces, expect);
    assert_eq!((mesh.fanned, mesh.skipped), (2, 1));
    assert!(mesh.triangles.iter().enumerate().all(|(i, t)| t.id as usize == i));
}

#[test]
fn spellings_of_the_same_mesh_are_the_same_mesh() {
    let plain = parse(format!("{CORNERS}f 1 2 3\nf 1 3 4\nf 2 3 5\n"));
    let spellings = [
        format!("{CORNERS}f 1 2 3\nf 1 3 4\nf 2 3 5"),
        format!("{CORNERS}f -5 -4 -3\nf -5 -3 -2\nf -4 -3 -1\n"),
        format!("{CORNERS}f 1 2 3\nf 1 3 4\nf 2 3 5\n").replace('\n', "\r\n"),
        format!("{CORNERS}f  1\t2 3 \n\n   f 1 3 4 # face\nf 2 3 5#\n"),
        format!(
            "{CORNERS}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\nf 2/1 3/1 5/1\n"
        ),
        format!(
            "mtllib x.mtl\n{CORNERS}o a\nusemtl m\nf 1 2 3\ng b\nf 1 3 4\nusemtl n\ns 1\nf 2 3 5\n"
        ),
        format!("{CORNERS}l 1 2 3 4\nf 1 2 3\nf 1 3 4\np 1\nf 2 3 5\n"),
        format!("{}f 1 2 3\nf 1 3 4\nf 2 3 5\n", CORNERS.replace("0 0 1\n", "0 0 1 0.5 0.5 0.5\n")),
        // Faces may come before their vertices.
        format!("f 1 2 3\nf 1 3 4\nf 2 3 5\n{CORNERS}"),
    ];
    for text in spellings {
        assert_eq!(parse(&text), plain, "{text}");
    }
    let foreign = [b"# caf\xe9\n".as_slice(), CORNERS.as_bytes(), b"f 1 2 3\nf 1 3 4\nf 2 3 5\n"];
    assert_eq!(parse(foreign.concat()), plain);
}

#[test]
fn gzip_is_told_by_its_first_bytes_not_by_its_name() {
    let text = format!("{CORNERS}f 1 2 3\n");
    let plain = obj::load(&file("mesh.obj.gz", &text), &LoadOptions::default()).unwrap();
    let packed = file("packed.obj", gzip(text.as_bytes()));
    let packed = obj::load(&packed, &LoadOptions::default()).unwrap();
    assert_eq!(plain.triangles, packed.triangles);
    assert_eq!((plain.name.as_str(), packed.name.as_str()), ("mesh", "packed"));
}

#[test]
fn coordinates_at_the_ends_of_f32_load() {
    for scale in ["1e30", "1e-30", "1e-44", "3e38"] {
        let text = format!("v 0 0 0\nv {scale} 0 0\nv 0 -{scale} {scale}\nf 1 2 3\n");
        let mesh = parse(text);
        let [a, b, c] = mesh.triangles[0].vertices;
        let (low, high) = (Grid::DEFAULT.min(), Grid::DEFAULT.max());
        assert_eq!((a.x, a.y, a.z), (low, high, low), "{scale}");
        assert_eq!((b.x, c.y, c.z), (high, low, high), "{scale}");
    }
}

#[test]
fn duplicate_vertices_and_faces_stay() {
    let mesh = parse(format!("{CORNERS}{CORNERS}f 1 2 3\nf 6 7 8\nf 1 2 3\n"));
    assert_eq!(mesh.triangles.len(), 3);
    assert_eq!(mesh.positions.len(), 6);
    assert_eq!(mesh.triangles[0].vertices, mesh.triangles[2].vertices);
}

#[test]
fn names_are_looked_for_in_order_and_missing_ones_say_where() {
    let text = format!("{CORNERS}f 1 2 3\n");
    let first = file("first/wanted.obj.gz", "").parent().map(Path::to_owned).unwrap_or_default();
    let second = file("second/wanted.obj", &text).parent().map(Path::to_owned).unwrap_or_default();
    fs::remove_file(first.join("wanted.obj.gz")).unwrap();
    let library = Library { folders: vec![PathBuf::new(), first.clone(), second.clone()] };
    let found = |name: &str| library.find(name).unwrap();
    assert_eq!(found("wanted"), Found::File(second.join("wanted.obj")));
    fs::write(first.join("wanted.obj.gz"), gzip(text.as_bytes())).unwrap();
    assert_eq!(found("wanted"), Found::File(first.join("wanted.obj.gz")));
    let direct = second.join("wanted");
    let direct = direct.to_str().unwrap();
    assert_eq!(found(direct), Found::File(second.join("wanted.obj")));
    assert!(matches!(found("terrain:2"), Found::Procedural(_)));

    let error = library.find("wantde").unwrap_err().to_string();
    assert!(error.starts_with("no scene 'wantde'; looked for wantde, wantde.obj, wantde.obj.gz, "));
    assert!(error.contains(&second.join("wantde.obj").display().to_string()), "{error}");
    assert!(error.ends_with("; did you mean wanted?"), "{error}");
    let error = library.find("zzzzzzzzzzz").unwrap_err().to_string();
    assert!(error.ends_with("give a path to an OBJ file, or run `xylem scene list`"), "{error}");
    let error = scene::load("terrain:99", &LoadOptions::default()).unwrap_err().to_string();
    assert!(
        error.starts_with("terrain:99: levels = 99 is not in 1 to 11; write terrain:"),
        "{error}"
    );
}

#[test]
fn ray_and_hit_files_round_trip_packed_or_not() {
    let ray = SceneRay {
        origin: [1.0, -2.5, 1e-30],
        direction: [0.0, -0.0, 1e30],
        t_min: -1.0,
        t_max: f32::INFINITY,
    };
    let hit = Hit { prim: 7, t: 0.1, u: 0.25, v: 0.5 };
    for name in ["r.rays", "r.rays.gz"] {
        let path = file(name, "");
        rays::write_rays(&path, &[ray, ray]).unwrap();
        let back = rays::read_rays(&path).unwrap();
        assert_eq!(back, [ray, ray]);
        assert!(back[1].direction[1].is_sign_negative());
        rays::write_hits(&path, &[hit, Hit::MISS]).unwrap();
        assert_eq!(rays::read_hits(&path).unwrap(), [hit, Hit::MISS]);
        assert_eq!(fs::read(&path).unwrap()[..2] == [0x1f, 0x8b], name.ends_with(".gz"));
    }
    let bytes = rays::read_rays(&file("none.rays", "")).unwrap();
    assert!(bytes.is_empty());
}

#[test]
fn ray_files_of_a_wrong_length_say_how_long_they_are() {
    let error = rays::read_rays(&file("short.rays", [0; 70])).unwrap_err().to_string();
    let expect = "short.rays: 70 bytes are 2 rays of 32 bytes and 6 left over; the file is cut off or \
                  of another kind";
    assert!(error.ends_with(expect), "{error}");
    let error = rays::read_rays(&file("short.rays.gz", gzip(&[0; 33]))).unwrap_err().to_string();
    assert!(error.contains("33 bytes are 1 rays of 32 bytes and 1 left over"), "{error}");
    let error = rays::read_hits(&file("short.hits", [0; 15])).unwrap_err().to_string();
    assert!(error.contains("15 bytes are 0 hits of 16 bytes and 15 left over"), "{error}");
}

#[test]
fn rays_that_are_not_numbers_are_named() {
    let good = [0.0f32, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, f32::INFINITY];
    let names = ["ox", "oy", "oz", "dx", "dy", "dz", "tmin", "tmax"];
    for (component, name) in names.iter().enumerate() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut bad = good;
            bad[component] = value;
            let bytes: Vec<u8> = good.iter().chain(&bad).flat_map(|c| c.to_le_bytes()).collect();
            let result = rays::read_rays(&file("bad.rays", bytes));
            if component >= 6 && value.is_infinite() {
                // An interval may be open.
                assert!(result.is_ok(), "{name} {value}");
                continue;
            }
            let error = result.unwrap_err().to_string();
            let expect =
                format!("bad.rays: ray 1: {name} is {value}; origin and direction must be");
            assert!(error.contains(&expect), "{error}");
        }
    }
}

#[test]
fn an_unwritable_output_is_named_and_leaves_nothing() {
    let folder = file("no_folder", "").with_file_name("absent");
    let path = folder.join("out.hits");
    let error = rays::write_hits(&path, &[Hit::MISS]).unwrap_err().to_string();
    assert!(error.contains("absent/out.hits: cannot write it: "), "{error}");
    assert!(!folder.exists());
    // A folder in the way of the last step: what was written beside it goes again.
    let taken = file("taken/inner", "").parent().map(Path::to_owned).unwrap_or_default();
    assert!(rays::write_rays(&taken, &[]).is_err());
    assert!(!taken.with_file_name("taken.partial").exists());
}

#[test]
fn rays_that_hit_nothing_by_their_numbers_are_counted() {
    let mesh = scene::load("degenerate/one_triangle", &LoadOptions::default()).unwrap();
    let good = SceneRay {
        origin: [0.25, 0.25, 3.0],
        direction: [0.0, -0.0, -2.0],
        t_min: 0.0,
        t_max: f32::INFINITY,
    };
    let set = [
        good,
        SceneRay { direction: [0.0, -0.0, 0.0], ..good },
        SceneRay { t_min: 1.0, t_max: 0.5, ..good },
        SceneRay { origin: [0.25, 0.25, 1e9], direction: [0.0, 1.0, 0.0], ..good },
    ];
    let grid = convert::convert(&mesh.frame, &set).unwrap();
    let expect = ConversionCounts { core: 1, zero_direction: 1, empty_interval: 1, misses: 1 };
    assert_eq!(ConversionCounts::of(&grid), expect);
    let GridRay::Core { ray, .. } = grid[0] else { panic!("{:?}", grid[0]) };
    let hit = mesh.triangles[0].intersect(&ray, ray.t_max()).unwrap();
    // The plane is z = x / 4 + y / 2.
    let hit = grid[0].hit(Some(&traverse::Hit::new(PrimIndex(0), &hit)));
    assert!((hit.t - (3.0 - 0.1875) / 2.0).abs() < 1e-6, "{hit:?}");
    assert!((hit.u - 0.25).abs() < 1e-6 && (hit.v - 0.25).abs() < 1e-6, "{hit:?}");
}

/// With `XYLEM_UPDATE=1` the committed files are written anew instead of compared; the manifest's
/// numbers are then to be corrected by hand, as the failure says.
#[test]
fn committed_and_procedural_scenes_are_what_the_manifest_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let update = std::env::var_os("XYLEM_UPDATE").is_some_and(|v| v == "1");
    let mut wrong = Vec::new();
    let manifest = Manifest::bundled().unwrap();
    for entry in manifest.scenes.iter().filter(|entry| entry.kind != Kind::Fetched) {
        let generator = entry.generator.as_deref().unwrap_or_default();
        let text = procedural::obj_text(generator).unwrap().unwrap();
        let triangles = procedural::soup(generator).unwrap().unwrap().indices.len();
        let hash = sha256(text.as_bytes());
        if (entry.triangles, &entry.sha256) != (triangles, &hash) {
            wrong.push(format!("{}: triangles = {triangles} sha256 = \"{hash}\"", entry.name));
        }
        if entry.kind == Kind::Committed {
            let path = folder.join(format!("{}.obj", entry.name));
            if update {
                fs::write(&path, &text).unwrap();
            }
            assert_eq!(
                sha256(&fs::read(&path).unwrap()),
                hash,
                "{} is not what '{generator}' gives; run \
                 XYLEM_UPDATE=1 cargo test -p xylem-tests --test scenes",
                path.display()
            );
            assert!(text.len() < 300 << 10, "{} is too large to commit", entry.name);
        }
    }
    assert!(wrong.is_empty(), "correct in scenes/manifest.toml:\n{}", wrong.join("\n"));
}

#[test]
fn every_scene_of_the_project_is_in_the_manifest_and_loads() {
    let manifest = Manifest::bundled().unwrap();
    for name in procedural::names() {
        assert!(manifest.get(&name).is_some(), "{name} is not in scenes/manifest.toml");
    }
    for entry in manifest.scenes.iter().filter(|entry| entry.kind == Kind::Committed) {
        let loaded = scene::load(&entry.name, &LoadOptions::default());
        if entry.triangles == 0 {
            assert!(loaded.unwrap_err().to_string().contains("no faces"));
            continue;
        }
        let mesh = loaded.unwrap();
        assert_eq!(mesh.triangles.len(), entry.triangles, "{}", entry.name);
        let soup = procedural::soup(entry.generator.as_deref().unwrap()).unwrap().unwrap();
        let computed = soup.into_mesh(&mesh.name, &LoadOptions::default()).unwrap();
        assert_eq!(mesh.triangles, computed.triangles, "{} through its file", entry.name);
    }
}

#[test]
fn fetched_scenes_are_those_of_the_manifest() {
    let test = "fetched_scenes_are_those_of_the_manifest";
    let Some(folder) = reference(test, "XYLEM_SCENES") else { return };
    let mut seen = 0;
    let manifest = Manifest::bundled().unwrap();
    for entry in manifest.scenes.iter().filter(|entry| entry.kind == Kind::Fetched) {
        let path = folder.join(format!("{}.obj.gz", entry.name));
        if !path.is_file() {
            println!("skipped: {test}: no {}; run scenes/fetch.sh {}", path.display(), entry.name);
            continue;
        }
        let mesh = obj::load(&path, &LoadOptions::default()).unwrap();
        assert_eq!(mesh.triangles.len(), entry.triangles, "{}", entry.name);
        assert_eq!((mesh.fanned, mesh.skipped), (0, 0), "{}", entry.name);
        seen += 1;
    }
    println!("{seen} fetched scenes checked");
}

/// The known triangle of every ray with a stable answer is hit by the converted ray, at the known
/// time: within 4 grid units along the ray, or, at a grazing angle, within what moving the triangle's
/// plane by one unit explains (snapping moves a vertex by up to half a unit an axis, 0.87 in all, and
/// the origin by a 128th).
#[test]
fn known_hits_survive_the_conversion() {
    let Some(folder) = reference("known_hits_survive_the_conversion", "XYLEM_ORACLE") else {
        return;
    };
    for name in ["armadillo", "bunny", "cow", "fandisk", "sponza", "teapot"] {
        let path = folder.join(format!("{name}.obj.gz"));
        let mesh = obj::load(&path, &LoadOptions::default()).unwrap();
        for set in ["primary", "diffuse", "random"] {
            let at = |kind: &str| folder.join(format!("{name}.{set}.{kind}.gz"));
            let set_rays = rays::read_rays(&at("rays")).unwrap();
            let truth = rays::read_hits(&at("truth")).unwrap();
            let flags = obj::read_text(&at("flags")).unwrap();
            let grid = convert::convert(&mesh.frame, &set_rays).unwrap();
            assert_eq!(ConversionCounts::of(&grid).core, grid.len(), "{name} {set}");
            let (mut checked, mut grazing) = (0, 0);
            for (i, known) in truth.iter().enumerate() {
                if !known.is_hit() || flags[i] & 15 != 0 {
                    continue;
                }
                let ray = grid[i].core().unwrap();
                let triangle = &mesh.triangles[known.prim as usize];
                let found = triangle.intersect(ray, ray.t_max());
                let found = found.unwrap_or_else(|| panic!("{name} {set} ray {i} is lost"));
                let found = traverse::Hit::new(PrimIndex(known.prim), &found);
                let hit = grid[i].hit(Some(&found));
                let (error, slope) = time_error(&mesh, &set_rays[i], known, &hit);
                assert!(error <= 4.0 || error <= slope, "{name} {set} ray {i}: {error} {slope}");
                checked += 1;
                grazing += usize::from(error > 4.0);
            }
            println!("{name} {set}: {checked} known hits found, {grazing} of them grazing");
            assert!(checked > 0, "{name} {set}");
        }
    }
}

/// How far apart two hits of a ray are in grid units beyond 1e-6 of the distance, and by how much a
/// displacement of the triangle is magnified along the ray: 1 / cos of the angle to its normal.
fn time_error(mesh: &Mesh, ray: &SceneRay, known: &Hit, hit: &Hit) -> (f64, f64) {
    let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let direction = ray.direction.map(f64::from);
    let [a, b, c] = mesh.corners(known.prim as usize).unwrap().map(|p| p.map(f64::from));
    let sub = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let (s, t) = (sub(b, a), sub(c, a));
    let normal = [s[1] * t[2] - s[2] * t[1], s[2] * t[0] - s[0] * t[2], s[0] * t[1] - s[1] * t[0]];
    let along = (0..3).map(|i| normal[i] * direction[i]).sum::<f64>().abs();
    let slope = norm(normal) * norm(direction) / along;
    let apart = f64::from(known.t) - f64::from(hit.t);
    let beyond = apart.abs() - 1e-6 * f64::from(known.t.abs());
    (beyond * norm(direction) / mesh.frame.cell(), slope)
}
