//! The streaming compressor: what it did, and how long that takes.

pub mod unit;

use xylem_core::emit::MAX_DEPTH;
use xylem_core::probe::Probe;

/// Cycles of the compressor behind the emitter. New nodes pass it one a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompressorTiming {
    /// To encode a node again, once its line is here: decode, align and round, encode, and check the
    /// contexts of the two children.
    pub repair: u64,
}

impl Default for CompressorTiming {
    fn default() -> Self {
        Self { repair: 4 }
    }
}

/// What the streaming compressor reported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompressorEvents {
    /// Nodes encoded for the first time.
    pub nodes: u64,
    /// Nodes encoded again, by how many levels they were below the node that asked for it, less one
    /// (P3 Fig. 7).
    pub backtracks_by_depth: [u64; MAX_DEPTH],
}

impl Default for CompressorEvents {
    fn default() -> Self {
        Self { nodes: 0, backtracks_by_depth: [0; MAX_DEPTH] }
    }
}

impl CompressorEvents {
    /// Nodes encoded again.
    pub fn backtracks(&self) -> u64 {
        self.backtracks_by_depth.iter().sum()
    }
}

impl Probe for CompressorEvents {
    fn compress_node(&mut self) {
        self.nodes += 1;
    }
    fn backtrack(&mut self, depth: u8) {
        // Depths count from 1, and none is deeper than the tree.
        let last = MAX_DEPTH - 1;
        self.backtracks_by_depth[usize::from(depth).saturating_sub(1).min(last)] += 1;
    }
}
