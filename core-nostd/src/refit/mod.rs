//! Refitting: new boxes for a tree whose triangles have moved.
//!
//! [`refit`] is Wald's algorithm (Wald et al. 2007; P3 §5.2) over a tree of any format and any order
//! of nodes: it reads the topology once, takes exact boxes from the triangles, and hands each node
//! on as soon as its children are done. What becomes of it is the sink's business: 64-byte nodes go
//! back to their places ([`InPlace`]).
//!
//! A refitted tree has the old splits and gets worse as the scene moves on. The walk measures the
//! tree's SAH cost as nodes pass ([`CostMeter`]), and [`Upkeep`] decides from it when to rebuild.

mod cost;
mod in_place;
mod lines;
mod upkeep;
mod walk;

pub use cost::CostMeter;
pub use in_place::{InPlace, refit_in_place};
pub use upkeep::{Factor, RebuildRule, Update, Upkeep};
pub use walk::{RefitSink, Refitted, refit};

#[cfg(test)]
mod tests;
