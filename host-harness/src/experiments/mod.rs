//! The papers' tables and figures again: ours beside theirs.
//!
//! A file here is one table or figure. It builds what it needs in a [`Lab`], which keeps builds for
//! the next experiment, and gives an [`Outcome`]: tables of [`Value`]s, charts, and notes on why
//! numbers differ. The papers' numbers are in [`paper`] and meet ours in a [`Value`] and nowhere
//! before.
//!
//! Models are named as the papers name them ([`scenes`]). One that is not at hand is listed as
//! missing.

mod beyond;
mod lab;
mod outcome;
mod p1_fig4;
mod p1_fig5;
mod p1_table1;
mod p1_table2;
mod p1_table3;
mod p2_fig6;
mod p2_table1;
mod p2_table2;
mod p2_table3;
mod p2_table6;
mod p2_table7;
mod p3_fig1;
mod p3_fig10;
mod p3_fig7;
mod p3_quality;
mod p3_table1;
mod p3_table2;
mod p3_table3;
pub mod paper;
mod rounding;
pub mod scenes;
mod setup;
mod shared_plane;
mod utilisation;
mod wide;

use xylem_core::traverse::TraceError;

use crate::bus::MemoryError;
use crate::run::{RefitError, RunError};
use crate::scene::SceneError;

pub use lab::{BinnedSah, Built, Lab, Loaded};
pub use outcome::{Chart, Column, Missing, Outcome, Row, Table, Value};

/// A published table or figure that can be made again.
#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// What the command line calls it.
    pub id: &'static str,
    /// Where it was published: `P2 Table VI`.
    pub place: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// Whether it is about the papers' models.
    pub needs_scenes: bool,
    run: fn(&Lab<'_>, &mut Outcome) -> Result<(), ExperimentError>,
}

/// All experiments, in the papers' order.
pub const EXPERIMENTS: &[Experiment] = &[
    p1_table1::EXPERIMENT,
    p1_table2::EXPERIMENT,
    p1_table3::EXPERIMENT,
    p1_fig4::EXPERIMENT,
    p1_fig5::EXPERIMENT,
    p2_table1::EXPERIMENT,
    p2_table2::EXPERIMENT,
    p2_table3::EXPERIMENT,
    p2_table6::EXPERIMENT,
    p2_table7::EXPERIMENT,
    p2_fig6::EXPERIMENT,
    p3_table1::EXPERIMENT,
    p3_table2::EXPERIMENT,
    p3_table3::EXPERIMENT,
    p3_fig1::EXPERIMENT,
    p3_fig7::EXPERIMENT,
    p3_fig10::EXPERIMENT,
    p3_table2::FIGURE,
    p3_quality::EXPERIMENT,
    shared_plane::EXPERIMENT,
    wide::EXPERIMENT,
];

/// What [`DoyleModel::PAPER`](crate::baseline::DoyleModel::PAPER) is, in words.
const DOYLE_MODEL: &str = "Binned SAH hardware: P2 §6.1's model of it, 8192 boxes of 28 bytes on \
                           chip, over a binned SAH tree of 16 bins.";

/// Why an experiment stopped. A model that is not there stops none.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A model is there and cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A build failed.
    #[error("{scene}: {source}")]
    Build {
        /// The model.
        scene: String,
        /// What the builder said.
        source: RunError,
    },
    /// A refit failed.
    #[error("{scene}: {source}")]
    Refit {
        /// The model.
        scene: String,
        /// What was said.
        source: RefitError,
    },
    /// A tree could not be traced.
    #[error("{scene}: {source}")]
    Trace {
        /// The model.
        scene: String,
        /// What the search said.
        source: TraceError<MemoryError>,
    },
}

impl Experiment {
    /// The experiment of that id.
    pub fn by_id(id: &str) -> Option<&'static Self> {
        EXPERIMENTS.iter().find(|experiment| experiment.id == id)
    }

    /// Makes it.
    ///
    /// # Errors
    /// [`ExperimentError`].
    pub fn run(&self, lab: &Lab<'_>) -> Result<Outcome, ExperimentError> {
        let mut outcome = Outcome::new(self);
        (self.run)(lab, &mut outcome)?;
        Ok(outcome)
    }
}
