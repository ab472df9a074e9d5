//! Where a scene's name is looked for.
//!
//! In order: the path itself; `scenes/` (in the working folder, else in the source tree that this
//! program was built from) with its `fetched/`; each folder of `$XYLEM_SCENES` (separated as in
//! `$PATH`). In each: the name as it is, with `.obj`, with `.obj.gz`. What is no file may be the name of
//! a [procedural] scene.

use std::path::{Path, PathBuf};

use super::error::SceneError;
use super::procedural::{self, Soup};

/// What a name stands for.
#[derive(Clone, PartialEq, Debug)]
pub enum Found {
    /// An OBJ file.
    File(PathBuf),
    /// A scene that has been computed.
    Procedural(Soup),
}

/// The folders that scenes are looked for in.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Library {
    /// The folders, in order of preference; the empty path stands for "as given".
    pub folders: Vec<PathBuf>,
}

impl Library {
    /// The folders of the module's description.
    pub fn new() -> Self {
        let scenes = scenes_folder();
        let fetched = scenes.join("fetched");
        let mut folders = vec![PathBuf::new(), scenes, fetched];
        if let Some(list) = std::env::var_os("XYLEM_SCENES") {
            folders.extend(std::env::split_paths(&list).filter(|p| !p.as_os_str().is_empty()));
        }
        Self { folders }
    }

    /// The scene that `name` stands for.
    ///
    /// # Errors
    /// [`SceneError::NotFound`] with the files tried and names like it, and
    /// [`SceneError::Parameter`] for a procedural scene with wrong parameters.
    pub fn find(&self, name: &str) -> Result<Found, SceneError> {
        let candidates = self.candidates(name);
        if let Some(found) = candidates.iter().find(|path| path.is_file()) {
            return Ok(Found::File(found.clone()));
        }
        if let Some(soup) = procedural::soup(name) {
            let wrong = |source| SceneError::Parameter { name: name.to_owned(), source };
            return soup.map(Found::Procedural).map_err(wrong);
        }
        Err(SceneError::NotFound {
            name: name.to_owned(),
            looked: candidates,
            near: near_names(name, &self.names()),
        })
    }

    /// Every file that `name` may stand for, in order.
    pub fn candidates(&self, name: &str) -> Vec<PathBuf> {
        let mut candidates = Vec::new();
        for folder in &self.folders {
            for suffix in ["", ".obj", ".obj.gz"] {
                // Joining an absolute path gives that path whatever the folder: name it once.
                let path = folder.join(format!("{name}{suffix}"));
                if !candidates.contains(&path) {
                    candidates.push(path);
                }
            }
        }
        candidates
    }

    /// The names of the scenes in the folders (without the working folder) and of the procedural
    /// ones, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self
            .folders
            .iter()
            .filter(|folder| !folder.as_os_str().is_empty())
            .flat_map(|folder| names_below(folder, folder, 2))
            .chain(procedural::names())
            .collect();
        names.sort();
        names.dedup();
        names
    }
}

impl Default for Library {
    fn default() -> Self {
        Self::new()
    }
}

/// The project's `scenes/`: in the working folder if there is one, else in the source tree.
pub fn scenes_folder() -> PathBuf {
    let here = PathBuf::from("scenes");
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("scenes");
    if !here.is_dir() && built.is_dir() { built } else { here }
}

/// OBJ files below `folder` by their path from `root`, without suffix.
fn names_below(root: &Path, folder: &Path, depth: usize) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names = Vec::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() && depth > 1 {
            names.extend(names_below(root, &path, depth - 1));
        }
        let Some(name) = path.strip_prefix(root).ok().and_then(|p| p.to_str()) else { continue };
        let stem = name.strip_suffix(".gz").unwrap_or(name).strip_suffix(".obj");
        names.extend(stem.map(str::to_owned));
    }
    names
}

/// The names most like `name`, at most three, best first.
fn near_names(name: &str, names: &[String]) -> Vec<String> {
    let wanted = name.rsplit('/').next().unwrap_or(name).to_lowercase();
    let wanted = wanted.strip_suffix(".gz").unwrap_or(&wanted);
    let wanted = wanted.strip_suffix(".obj").unwrap_or(wanted);
    let mut scored: Vec<(usize, &String)> = names
        .iter()
        .filter_map(|candidate| {
            let plain = candidate.rsplit('/').next().unwrap_or(candidate).to_lowercase();
            let distance = edit_distance(wanted, &plain);
            let close = distance <= wanted.len().div_ceil(3).min(3);
            let part = wanted.len() >= 3 && plain.contains(wanted);
            (close || part).then_some((distance, candidate))
        })
        .collect();
    scored.sort();
    scored.into_iter().take(3).map(|(_, candidate)| candidate.clone()).collect()
}

/// Levenshtein's distance: insertions, deletions and replacements between two words.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}
