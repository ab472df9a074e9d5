//! What a run prints and draws: numbers as text and JSON, pictures, a page of HTML.
//!
//! A quantity that was not measured is absent, never 0; one that comes from a model says so.

mod build;
mod table;
mod trace;
pub mod units;

pub use build::{BuildReport, RegionReport, StageReport, stage_name};
pub use table::Table;
pub use trace::TraceReport;
