//! Sweeps in a row, in lockstep.

use heapless::Vec;

use super::gate::Gate;
use super::sweep::{Decision, Sweep};
use super::{Cluster, MAX_CHAIN, PlocConfig, Port};
use crate::probe::Probe;

/// What passes from one unit of a chain to the next in a beat.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Token {
    /// Nothing.
    Bubble,
    /// The next cluster of the list.
    Cluster(Cluster),
    /// The end of the list.
    End,
}

/// The systolic chain of sweeps, with the gate behind the last.
///
/// [`Chain::start`] a list, then feed one token a [`Chain::beat`]: the clusters in order, one
/// [`Token::End`], and bubbles until a beat reports the end of the list at the other side.
///
/// A beat moves every unit by one step: each takes what the one before it put out in the beat
/// before. Units write in the order from the last to the first, which fixes the order of nodes:
/// children come before their parents because a parent is made in a later beat.
#[derive(Debug)]
pub struct Chain {
    sweeps: Vec<Sweep, { MAX_CHAIN as usize }>,
    /// What each sweep put out in the last beat.
    links: [Token; MAX_CHAIN as usize],
    gate: Gate,
    max_leaf_size: u32,
}

impl Chain {
    /// A chain for leaves of at most `max_leaf_size` primitives. A radius or a length out of range
    /// counts as the nearest one in it.
    pub fn new(config: &PlocConfig, max_leaf_size: u32) -> Self {
        let radius = config.radius.clamp(1, super::MAX_RADIUS);
        let units = 0..config.chain.clamp(1, MAX_CHAIN);
        Self {
            sweeps: units.map(|_| Sweep::new(radius)).collect(),
            links: [Token::Bubble; MAX_CHAIN as usize],
            gate: Gate::new(),
            max_leaf_size,
        }
    }

    /// Begins a list of `clusters`, which must be its length for the bounds to hold.
    pub fn start<P: Probe>(&mut self, clusters: u32, probe: &mut P) {
        self.sweeps.iter_mut().for_each(Sweep::start);
        self.gate.start(clusters);
        probe.ploc_pass(clusters);
    }

    /// Moves every unit by one step; returns whether the list has now left the chain.
    ///
    /// # Errors
    /// The port's own; the chain must then be given up.
    #[inline]
    pub fn beat<O: Port, P: Probe>(
        &mut self,
        input: Token,
        port: &mut O,
        probe: &mut P,
    ) -> Result<bool, O::Error> {
        let Self { sweeps, links, gate, max_leaf_size } = self;
        let max_leaf_size = *max_leaf_size;
        let last = sweeps.len() - 1;
        let ended = links[last] == Token::End;
        match links[last] {
            Token::Cluster(cluster) => gate.pass(cluster, max_leaf_size, port, probe)?,
            Token::End => gate.end(port, probe)?,
            Token::Bubble => {}
        }
        for (unit, sweep) in sweeps.iter_mut().enumerate().rev() {
            let token = if unit == 0 { input } else { links[unit - 1] };
            links[unit] = match sweep.step(token, probe) {
                Decision::Nothing => Token::Bubble,
                Decision::Pass(cluster) => Token::Cluster(cluster),
                Decision::Merge(a, b) => Token::Cluster(a.merge(b, max_leaf_size, port, probe)?),
                Decision::End => Token::End,
            };
        }
        probe.ploc_beat();
        Ok(ended)
    }
}
