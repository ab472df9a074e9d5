//! What can go wrong when a program runs on an engine.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;
use std::time::Duration;

use super::{Engine, Line};

/// Why a run gave no outcome.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SocError {
    /// The program's file does not exist.
    #[error("no firmware at {path}; build it with `tests/firmware.sh build`")]
    NotBuilt {
        /// Where it was looked for.
        path: PathBuf,
    },
    /// A file could not be read or written, or a program not be run.
    #[error("{what}: {error}")]
    Io {
        /// What was tried.
        what: String,
        /// What the system said.
        error: io::Error,
    },
    /// The program's file is not one that this machine can load.
    #[error("{path} is no program for the soft core: {what}")]
    Elf {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// The scene does not fit into a blob or into memory.
    #[error(
        "the scene needs {needed} bytes, the soft core's memory holds {size}; use a smaller one"
    )]
    TooLarge {
        /// Bytes that the scene needs.
        needed: u64,
        /// Bytes that there are.
        size: u32,
    },
    /// A frame of an animation has more or fewer triangles than the first one.
    #[error(
        "frame {frame} has {triangles} triangles, frame 0 has {first}; frames move the same ones"
    )]
    Frames {
        /// Triangles of the first frame.
        first: usize,
        /// The frame.
        frame: usize,
        /// Its triangles.
        triangles: usize,
    },
    /// An engine's tool is not installed.
    #[error("{engine} needs {tool}; {hint}")]
    ToolMissing {
        /// The engine.
        engine: Engine,
        /// What is missing.
        tool: String,
        /// How to get it.
        hint: String,
    },
    /// There is no accelerator beside the core of this engine.
    #[error(
        "{engine} has no accelerator beside its core; use sim for the model or picorv32 for the RTL"
    )]
    NoAccelerator {
        /// The engine.
        engine: Engine,
    },
    /// The engine itself could not be built.
    #[error("{engine} could not be built: {what}")]
    Build {
        /// The engine.
        engine: Engine,
        /// What the tool said.
        what: String,
    },
    /// The job returned an error; the log says which.
    #[error("the program on {engine} ended with code {code}{}", tail(log))]
    Failed {
        /// The engine.
        engine: Engine,
        /// The program's exit code: 1 the job failed, 2 a panic, 3 a trap, 4 the accelerator failed.
        code: u8,
        /// The log up to the end.
        log: Vec<Line>,
    },
    /// The core stopped in a state from which it cannot go on.
    #[error("the program on {engine} crashed: {what}{}", tail(log))]
    Crash {
        /// The engine.
        engine: Engine,
        /// What happened.
        what: String,
        /// The log up to the crash.
        log: Vec<Line>,
    },
    /// The program did not end in time.
    #[error("the program on {engine} did not end within {after:.1?}{}", tail(log))]
    TimeOut {
        /// The engine.
        engine: Engine,
        /// The time that it was given.
        after: Duration,
        /// The log so far.
        log: Vec<Line>,
    },
    /// The program ended well but reported nothing that this harness understands.
    #[error("the program on {engine} ended without a report; rebuild it{}", tail(log))]
    NoReport {
        /// The engine.
        engine: Engine,
        /// The log.
        log: Vec<Line>,
    },
    /// The log is not what the program's own tables describe.
    #[error("the log cannot be decoded: {what}; is it the log of this program?")]
    Log {
        /// What the decoder said.
        what: String,
    },
}

impl SocError {
    /// Wraps an I/O error with what was tried.
    pub(super) fn io(what: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |error| Self::Io { what, error }
    }

    /// The log that a failed run left.
    pub fn log(&self) -> &[Line] {
        match self {
            Self::Failed { log, .. }
            | Self::Crash { log, .. }
            | Self::TimeOut { log, .. }
            | Self::NoReport { log, .. } => log,
            _ => &[],
        }
    }
}

/// The end of a log, for an error message.
fn tail(log: &[Line]) -> String {
    let mut text = String::new();
    let from = log.len().saturating_sub(5);
    let _ = match log.len() {
        0 => write!(text, "; it logged nothing"),
        _ => write!(text, "; it logged last:"),
    };
    for line in &log[from..] {
        let _ = write!(text, "\n  {line}");
    }
    text
}
