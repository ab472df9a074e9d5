//! What a run prints and draws: numbers as text and JSON, pictures, a page of HTML.
//!
//! A quantity that was not measured is absent, never 0; one that comes from a model says so.

mod accelerated;
mod build;
pub mod chart;
mod clocked;
pub mod colour;
mod compression;
mod dram;
mod heat;
pub mod html;
mod picture;
mod reproduce;
mod shade;
mod soc;
mod summary;
mod table;
pub mod timeline;
mod trace;
pub mod units;
mod view;
mod wrap;

pub use accelerated::{SocAccelerated, SocPart};
pub use build::{BuildReport, RegionReport, StageReport, stage_name};
pub use clocked::{ClockedReport, MemoryReport, UnitReport};
pub use compression::CompressionReport;
pub use dram::DramReport;
pub use heat::HeatMap;
pub use picture::{LETTER, Picture};
pub use reproduce::ReproduceReport;
pub use shade::Shading;
pub use soc::{SocFrame, SocOutput, SocReport, SocStage};
pub use summary::{Pictures, RaySetReport, Summary, TreeReport};
pub use table::Table;
pub use trace::{MethodReport, MultipliersReport, TraceReport};
pub use view::close_up;
pub use wrap::wrap;
