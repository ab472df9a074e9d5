//! The gate at the end of the chain: it bounds the length of lists, and with it memory, passes and
//! depth.

use super::sweep::SWEEP_DEPTH;
use super::{Cluster, Port};
use crate::probe::Probe;

/// The most clusters that a pass over `clusters` leaves, however they lie.
pub const fn list_bound(clusters: u32) -> u32 {
    let clusters = clusters as u64;
    let rest = clusters.saturating_sub(1);
    let bound = (3 * rest + slack(clusters)) / 4 + 1;
    if bound < clusters { bound as u32 } else { clusters as u32 }
}

/// What a gate may let through beyond its share.
const fn slack(clusters: u64) -> u64 {
    let half = clusters.saturating_sub(1) / 2;
    if half < 32 { half } else { 32 }
}

/// The gate.
///
/// A cluster that leaves costs 4 and pays 3 for each cluster of the pass's list in it (2 once the
/// tree is deep). One that the account does not cover waits for the next and merges with it. All
/// but the last one are covered, so `4 · (out − 1) <= 3 · (in − 1) + slack`.
#[derive(Debug)]
pub(super) struct Gate {
    account: u64,
    share: u64,
    waiting: Option<Cluster>,
    deepest: u8,
}

impl Gate {
    pub const fn new() -> Self {
        Self { account: 0, share: 0, waiting: None, deepest: 0 }
    }

    /// Begins a list of `clusters`.
    pub fn start(&mut self, clusters: u32) {
        let deep = self.deepest >= SWEEP_DEPTH;
        (self.share, self.account) = if deep { (2, 0) } else { (3, slack(clusters.into())) };
    }

    /// Lets a cluster through to the port, or keeps it.
    #[inline]
    pub fn pass<O: Port, P: Probe>(
        &mut self,
        mut cluster: Cluster,
        max_leaf_size: u32,
        port: &mut O,
        probe: &mut P,
    ) -> Result<(), O::Error> {
        if let Some(waiting) = self.waiting.take() {
            cluster = waiting.merge(cluster, max_leaf_size, port, probe)?;
        }
        let paid = self.account + self.share * u64::from(cluster.weight());
        match paid.checked_sub(4) {
            Some(rest) => {
                self.account = rest;
                self.release(cluster, port, probe)
            }
            None => {
                self.waiting = Some(cluster);
                Ok(())
            }
        }
    }

    /// Ends the list.
    pub fn end<O: Port, P: Probe>(&mut self, port: &mut O, probe: &mut P) -> Result<(), O::Error> {
        match self.waiting.take() {
            Some(cluster) => self.release(cluster, port, probe),
            None => Ok(()),
        }
    }

    #[inline]
    fn release<O: Port, P: Probe>(
        &mut self,
        cluster: Cluster,
        port: &mut O,
        probe: &mut P,
    ) -> Result<(), O::Error> {
        let cluster = cluster.settle(port, probe)?;
        self.deepest = self.deepest.max(cluster.depth());
        port.cluster(&cluster)
    }
}
