//! What the streaming builder is compared with: builders and traffic models of others, on the host.
//!
//! - [`sweep`]: the full SAH sweep, against which tree costs are normalised (P2 §6).
//!
//! Nothing here is part of the design: these builders allocate, and their trees stay on the host.

mod sweep;
mod tree;

pub use sweep::{SweepLeaves, sweep};
pub use tree::HostTree;
