//! Why a command failed.

use std::io;
use std::path::PathBuf;

use xylem_core::error::BuildError;
use xylem_core::traverse::TraceError;
use xylem_firmware::job::JobError;

use crate::bus::MemoryError;
use crate::run::{RefitError, RunError};
use crate::scene::SceneError;
use crate::scene::rays::RayFileError;
use crate::soc::SocError;

/// Why a command failed. Messages say what, where and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CliError {
    /// The scene cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A ray or hit file cannot be used.
    #[error(transparent)]
    Rays(#[from] RayFileError),
    /// No computed scene has that name.
    #[error("no computed scene '{name}'; `xylem scene list` shows what there is")]
    NoGenerator {
        /// The name as given.
        name: String,
    },
    /// The tree cannot be built.
    #[error("{scene}: {source}{}", advice(source))]
    Build {
        /// The scene.
        scene: String,
        /// What the builder said.
        source: RunError,
    },
    /// A ray cannot be traced; a defect, as the tree has just been built.
    #[error("{scene}: {source} (a defect of the builder or the tracer; please report it)")]
    Trace {
        /// The scene.
        scene: String,
        /// What the tracer said.
        source: TraceError<MemoryError>,
    },
    /// A tree cannot be refitted.
    #[error("{scene}: {source}")]
    Refit {
        /// The scene.
        scene: String,
        /// What the refit said.
        source: RefitError,
    },
    /// A file cannot be written.
    #[error("{}: cannot write it: {source}; give a path in a folder you may write to", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// An image cannot be encoded.
    #[error("{}: cannot encode the image: {source}; choose another --size", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// What the encoder said.
        source: image::ImageError,
    },
    /// Standard output cannot be written to.
    #[error("standard output: cannot write to it: {0}; redirect it elsewhere")]
    Stdout(#[from] io::Error),
    /// The soft core did not do its job.
    #[error(transparent)]
    Soc(#[from] SocError),
    /// The soft core's job cannot be done, not even on the host.
    #[error("{scene}: {source}; take a smaller scene or another --format")]
    Job {
        /// The scene.
        scene: String,
        /// What the job said.
        source: JobError<MemoryError>,
    },
    /// A trace of memory requests cannot be replayed.
    #[error(transparent)]
    Requests(#[from] crate::dram::TraceError),
    /// Experiments had none of their models.
    #[error(
        "{ids}: none of the models is at hand; set XYLEM_SCENES to a folder with them, or run \
         scenes/fetch.sh"
    )]
    NoModels {
        /// The experiments.
        ids: String,
    },
    /// Options that do not go together.
    #[error("{0}")]
    Usage(String),
    /// Answers that must be equal are not.
    #[error("{0}")]
    Mismatch(String),
}

impl CliError {
    /// The exit code: 2 for wrong usage, 1 for everything else.
    pub(super) fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Build { source: RunError::Build(BuildError::Config(_)), .. } => 2,
            _ => 1,
        }
    }
}

/// What to do about a build that failed.
fn advice(error: &RunError) -> &'static str {
    match error {
        RunError::Build(BuildError::RegionFull { .. }) => {
            "; give the region more bytes (--region-limit) or take a smaller scene"
        }
        RunError::Build(BuildError::PointerOverflow) => "; take a smaller scene or --format bvh2",
        _ => "",
    }
}
