//! Refits whose nodes go back to where they were.

use super::{RefitSink, Refitted, refit};
use crate::compress::{Compression, Compressor, HeldNode, Place};
use crate::error::{BuildError, ConfigError, RegionName};
use crate::mem::{Bus, Region};
use crate::node::{Bvh2Node, NodeFormat, NodeIndex, Tree};
use crate::probe::{Probe, Stage};
use crate::quality::SahCost;

/// Refits a tree in its place and format; see [`refit`]. Returns the tree with its new root box, and its
/// SAH cost.
///
/// Quantized nodes go through the streaming compressor (P3 §4), which repairs those that came before by
/// `compression`; what that says of the format is ignored for what the tree says. `held` has
/// [`Compression::held_nodes`] places. Nodes of 64 bytes need neither.
///
/// # Errors
/// As [`refit`], and [`ConfigError::Compression`] for parameters out of range or too little storage.
pub fn refit_in_place<B: Bus, P: Probe>(
    bus: &mut B,
    tree: &Tree,
    triangles: (Region, u32),
    compression: &Compression,
    held: &mut [HeldNode],
    probe: &mut P,
) -> Result<(Tree, SahCost), BuildError<B::Error>> {
    let Refitted { root, cost } = match tree.format {
        NodeFormat::Bvh2 => refit(bus, tree, triangles, &mut InPlace { nodes: tree.nodes }, probe)?,
        NodeFormat::Wide(_) | NodeFormat::Shared(_) => return Err(ConfigError::RefitFormat.into()),
        NodeFormat::Quantized(quantization) => {
            let compression = Compression { quantization, ..*compression };
            compression.check()?;
            if compression.held_nodes() > held.len() {
                return Err(ConfigError::Compression.into());
            }
            let mut compressor = Compressor::new(compression, tree.nodes, held);
            compressor.enter(bus, Stage::Refit, probe)?;
            let mut sink = Quantizing(compressor);
            let done = refit(bus, tree, triangles, &mut sink, probe)?;
            sink.0.finish(bus, done.root.as_ref(), probe)?;
            done
        }
    };
    Ok((Tree { root, ..*tree }, cost))
}

/// The sink that writes 64-byte nodes to their places.
#[derive(Clone, Copy, Debug)]
pub struct InPlace {
    /// The region of the nodes: that of the tree itself if it has this format, or another one.
    pub nodes: Region,
}

impl RefitSink for InPlace {
    #[inline]
    fn node<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        index: NodeIndex,
        _: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let addr = self.nodes.record(index.0, Bvh2Node::BYTES as u32);
        let addr = addr.ok_or(BuildError::RegionFull {
            region: RegionName::Nodes,
            needed: (u64::from(index.0) + 1) * Bvh2Node::BYTES as u64,
            available: self.nodes.size,
        })?;
        let failed = |error| BuildError::Bus { stage: Stage::Refit, addr, error };
        bus.write(addr, &node.to_bytes()).map_err(failed)
    }
}

/// The sink that quantizes nodes and writes them to their places.
struct Quantizing<'a>(Compressor<'a>);

impl RefitSink for Quantizing<'_> {
    #[inline]
    fn node<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        index: NodeIndex,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.0.accept(bus, node, index, Place::At(index), probe)
    }
}
