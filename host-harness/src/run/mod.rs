//! Whole runs of the core on simulated memory: lay out, build, compress, refit, trace.

mod build;
mod clocked;
mod layout;
mod reference;
mod refit;
mod trace;
mod watch;

pub use build::{Buffers, BuildOptions, BuildRun, RunError, build, check, job, load};
pub use clocked::{ClockedRun, MemoryRun};
pub use layout::Layout;
pub use reference::{Answer, Reference};
pub use refit::{RefitError, RefitMethod, RefitRun, refit};
pub use trace::{Sums, TraceCounts, TraceRun, trace, trace_by};
