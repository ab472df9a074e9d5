//! What the streaming builder is compared with: builders and traffic models of others, on the host.
//!
//! - [`sweep`]: the full SAH sweep, against which tree costs are normalised (P2 §6).
//! - [`binned`]: binned SAH over all primitives, and [`DoyleModel`]: what the hardware for it moves.
//! - [`PrimitiveTraffic`]: what sorting moves, GPU-style and with multi-merges.
//! - [`shared_top_down`]: shared-plane nodes from the root down.
//!
//! Nothing here is part of the design: these builders allocate, and their trees stay on the host.

mod binned;
mod doyle;
mod gpu_lbvh;
mod shared;
mod sweep;
mod tree;

pub use binned::binned;
pub use doyle::{DoyleModel, DoyleTraffic};
pub use gpu_lbvh::{PrimitiveTraffic, Sort, Sorted};
pub use shared::{SharedTopDown, shared_top_down};
pub use sweep::{SweepLeaves, sweep};
pub use tree::HostTree;
