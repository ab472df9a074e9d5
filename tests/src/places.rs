//! Where scenes and answers are found, which run is asked for, what is skipped.

use std::path::PathBuf;

use xylem::scene::{LoadOptions, Mesh, procedural};

/// Whether the long runs are asked for: `XYLEM_FULL=1`.
pub fn full() -> bool {
    is_set("XYLEM_FULL")
}

/// Whether results are to be written to `tests/RESULTS.md`: `XYLEM_RECORD=1`.
pub fn record() -> bool {
    is_set("XYLEM_RECORD")
}

fn is_set(name: &str) -> bool {
    std::env::var_os(name).is_some_and(|value| value != "0")
}

/// The folder that an environment variable names.
///
/// Without the variable, says that `test` is skipped and gives `None`.
///
/// # Panics
/// If the variable names no folder: a test must not pass because of a slip in its settings.
pub fn folder(variable: &str, test: &str) -> Option<PathBuf> {
    let Some(path) = std::env::var_os(variable).map(PathBuf::from) else {
        let wanted = match variable {
            "XYLEM_ORACLE" => "rays with known answers",
            _ => "meshes",
        };
        println!("skipped: {test}: no {wanted}; set {variable} to a folder of them");
        return None;
    };
    assert!(path.is_dir(), "{variable}={} is not a folder", path.display());
    Some(path)
}

/// The OBJ files of a folder, sorted by name.
pub fn meshes_in(folder: &PathBuf) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder is readable");
    let is_mesh = |path: &PathBuf| {
        let name = path.to_string_lossy();
        name.ends_with(".obj") || name.ends_with(".obj.gz")
    };
    let mut paths: Vec<_> = entries.flatten().map(|e| e.path()).filter(is_mesh).collect();
    paths.sort();
    paths
}

/// A procedural scene, computed; files of the same name do not count.
///
/// # Panics
/// If there is none of that name.
pub fn procedural(name: &str) -> Mesh {
    let soup = procedural::soup(name).unwrap_or_else(|| panic!("no procedural scene {name}"));
    let soup = soup.unwrap_or_else(|e| panic!("{e}"));
    soup.into_mesh(name, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The names of all procedural scenes, the generators with parameters that make them small.
pub fn small_scenes() -> Vec<String> {
    let small = |name: String| match name.as_str() {
        "sphereflake" => "sphereflake:1".to_owned(),
        "cornell" => "cornell:5".to_owned(),
        "terrain" => "terrain:5".to_owned(),
        "cloth" => "cloth:16".to_owned(),
        "flag" => "flag:frame=5,cells=32".to_owned(),
        "hair" => "hair:hairs=40,segments=8".to_owned(),
        _ => name,
    };
    procedural::names().map(small).collect()
}
