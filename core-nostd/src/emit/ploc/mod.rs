//! The locally-ordered clustering emitter: a better tree from the same sorted stream.
//!
//! PLOC (Meister & Bittner, *Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
//! Construction*, 2017) repeats one sweep over a list of clusters in Morton order: every cluster
//! finds its nearest neighbour among the [`radius`](PlocConfig::radius) clusters before and after
//! it, and pairs that chose each other merge into a node. PLOCTree (Viitanen et al., 2018) makes a
//! sweep a streaming unit. Here several units form a systolic [`Chain`], fed by the multi-merge:
//!
//! ```text
//! sorted primitives ──► sweep ──► sweep ──► … ──► gate ──► list of clusters, 32 bytes each
//!                         │         │                │
//!                         └─────────┴────────────────┴──► nodes, leaf table entries
//! ```
//!
//! The list is written to memory once it has shrunk by the whole chain, and passes through the
//! chain again until one cluster is left. The lists are on chip as soon as they fit.
//!
//! # What a sweep computes
//!
//! A sweep is a function of its list; the window and the chain only decide when. The key of a pair
//! at positions `i` and `j` is the half area of the box around both, then `i xor j` in its low six
//! bits. A cluster's nearest neighbour is the partner of the lowest key.
//!
//! *A sweep over a list in which any pair may merge, merges.* Take a pair of the lowest key in the
//! whole list. Within a window of at most 2 · 31 + 1 positions `i xor j` differs for every partner,
//! so no two pairs with a common cluster have equal keys. Each of the two therefore has the other as
//! its only nearest neighbour. The exclusive or also pairs equal boxes off as neighbours, where the
//! lowest index would let but one pair of them merge.
//!
//! # Leaves
//!
//! A cluster of up to [`MAX_OPEN_LEAF`] primitives may be an *open* leaf, which carries references
//! instead of a pointer. Two open leaves merge into one if the SAH says so (`Ci` 1.2, `Cl` 0, `Ct`
//! 1): if `n · A <= 1.2 · A + n1 · A1 + n2 · A2`. Otherwise a leaf
//! is closed: its entries are written side by side, so that the leaf table is in the order of
//! closing. A list's record has room for two references; larger leaves are closed at the gate.
//!
//! # Bounds
//!
//! - **Length.** The gate at the end of the chain lets at most 3/4 of a list through, and nine
//!   clusters more; beyond that it merges neighbours by force. A pass over two clusters or more
//!   always shrinks the list. Real scenes keep far below that and never meet the gate.
//! - **Depth.** Sweeps make no node above [`SWEEP_DEPTH`] levels. Once a cluster is that deep, the
//!   gate lets half of each list through. That takes at most 31 passes of one forced level each, so
//!   no tree is deeper than [`MAX_DEPTH`](super::MAX_DEPTH).
//!
//! Every choice depends on the list alone, so the tree depends on the primitives,
//! [`PlocConfig`] and the largest leaf, not on the sorter or on where a list is kept.

mod chain;
mod cluster;
mod gate;
mod sweep;

#[cfg(test)]
mod tests;

pub use chain::{Chain, Token};
pub use cluster::{Cluster, MAX_OPEN_LEAF, Port};
pub use gate::list_bound;
pub use sweep::SWEEP_DEPTH;

use crate::error::ConfigError;

/// The widest search, in clusters to each side.
pub const MAX_RADIUS: u32 = 16;

/// The longest chain, in sweeps.
pub const MAX_CHAIN: u32 = 8;

/// The shape of the clustering emitter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct PlocConfig {
    /// How far a cluster looks for its nearest neighbour in each direction, 1 to [`MAX_RADIUS`].
    pub radius: u32,
    /// How many sweeps are chained on chip, 1 to [`MAX_CHAIN`].
    pub chain: u32,
}

impl PlocConfig {
    /// Eight clusters to each side and four sweeps: the SAH cost hardly falls for wider searches,
    /// and four sweeps leave about a third of a list (`tests/RESULTS.md` has the table).
    pub const DEFAULT: Self = Self { radius: 8, chain: 4 };

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ConfigError::Radius`] or [`ConfigError::Chain`].
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.radius == 0 || self.radius > MAX_RADIUS {
            return Err(ConfigError::Radius);
        }
        if self.chain == 0 || self.chain > MAX_CHAIN { Err(ConfigError::Chain) } else { Ok(()) }
    }

    /// Clusters that the windows of the whole chain hold.
    pub const fn window_clusters(&self) -> u32 {
        self.chain * (2 * self.radius + 1)
    }
}

impl Default for PlocConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
