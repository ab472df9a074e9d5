//! A folder to run the command in, and what a run leaves behind.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// A triangle, for scenes that need one.
pub const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// Straight through the middle of [`TRIANGLE`].
pub const GOOD: [f32; 8] = [0.25, 0.25, 1.0, 0.0, 0.0, -1.0, 0.0, f32::INFINITY];

pub fn with_component(index: usize, value: f32) -> [f32; 8] {
    let mut ray = GOOD;
    ray[index] = value;
    ray
}

/// A folder that the command runs in, with no scenes but its own.
pub struct Place(pub TempDir);

impl Place {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn with(self, name: &str, contents: impl AsRef<[u8]>) -> Self {
        fs::write(self.path(name), contents).expect("a file in a temporary folder");
        self
    }

    pub fn with_rays(self, name: &str, rays: &[[f32; 8]]) -> Self {
        let bytes: Vec<u8> = rays.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        self.with(name, bytes)
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xylem"));
        command.args(arguments).current_dir(self.0.path()).env_remove("XYLEM_SCENES");
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Ran {
        Ran(self.command(arguments).output().expect("the command runs"))
    }

    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a temporary folder").flatten();
        let mut names: Vec<_> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

/// What a run left behind.
pub struct Ran(pub Output);

impl Ran {
    pub fn code(&self) -> Option<i32> {
        self.0.status.code()
    }

    pub fn out(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).expect("UTF-8 on standard output")
    }

    /// Standard error with line breaks as spaces: messages are wrapped.
    pub fn message(&self) -> String {
        let text = String::from_utf8(self.0.stderr.clone()).expect("UTF-8 on standard error");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Asserts that the run failed with code 1, printed nothing and said `parts`.
    #[track_caller]
    pub fn fails(&self, parts: &[&str]) {
        self.fails_with(1, parts);
    }

    #[track_caller]
    pub fn fails_with(&self, code: i32, parts: &[&str]) {
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
    pub fn json(&self) -> Value {
        assert_eq!(self.code(), Some(0), "{}", self.message());
        assert_eq!(self.message(), "", "nothing on standard error");
        let value: Value = serde_json::from_str(&self.out()).expect("one JSON value");
        assert!(value.is_object(), "{value}");
        value
    }
}

pub fn number(json: &Value, key: &str) -> f64 {
    json[key].as_f64().unwrap_or_else(|| panic!("{key} in {json}"))
}

pub fn whole(json: &Value, key: &str) -> u64 {
    json[key].as_u64().unwrap_or_else(|| panic!("{key} in {json}"))
}
