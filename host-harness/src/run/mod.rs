//! Whole runs of the core on simulated memory: lay out, build, compress, trace.

mod build;
mod layout;
mod reference;
mod trace;

pub use build::{BuildOptions, BuildRun, RunError, build};
pub use layout::Layout;
pub use reference::{Answer, Reference};
pub use trace::{Sums, TraceCounts, TraceRun, trace};
