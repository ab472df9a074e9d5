//! Where completed nodes go.

use super::{BuildConfig, BuildRegions};
use crate::compress::{Compressor, HeldNode, OpenWide, Place, SharedCompressor, WideCompressor};
use crate::error::{BuildError, RegionName};
use crate::mem::{BurstWriter, Bus};
use crate::node::{Bvh2Node, Child, NodeIndex, Subtree, Tree};
use crate::probe::{Probe, Stage};

/// The node port of an emitter: straight to memory, or through the compressor.
#[derive(Debug)]
pub(super) struct NodePort<'a> {
    /// Nodes pushed.
    count: u32,
    writer: Writer<'a>,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and nothing to put it on")]
enum Writer<'a> {
    Exact(BurstWriter),
    Quantized(Compressor<'a>),
    Shared(SharedCompressor),
    Wide(WideCompressor<'a>),
}

impl<'a> NodePort<'a> {
    pub fn new(
        config: &BuildConfig,
        regions: &BuildRegions,
        held: &'a mut [HeldNode],
        open: &'a mut [OpenWide],
    ) -> Self {
        let burst = config.write_burst as usize;
        let writer = match (config.compression, config.sharing) {
            (None, Some(sharing)) => {
                Writer::Shared(SharedCompressor::new(sharing, regions.nodes, burst))
            }
            (None, None) => Writer::Exact(BurstWriter::new(
                regions.nodes,
                RegionName::Nodes,
                Stage::Emit,
                burst,
            )),
            (Some(compression), _) if config.collapse => {
                Writer::Wide(WideCompressor::new(compression, regions.nodes, open))
            }
            (Some(compression), _) => {
                Writer::Quantized(Compressor::new(compression, regions.nodes, held))
            }
        };
        Self { count: 0, writer }
    }

    /// Takes the next node and returns what pointers to it say.
    #[inline]
    pub fn push<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        probe: &mut P,
    ) -> Result<NodeIndex, BuildError<B::Error>> {
        let index = NodeIndex(self.count);
        probe.built_node(node.children.each_ref());
        match &mut self.writer {
            Writer::Exact(writer) => node.write(writer.reserve(bus)?),
            Writer::Quantized(compressor) => {
                compressor.accept(bus, node, index, Place::Next, probe)?;
            }
            Writer::Shared(compressor) => compressor.accept(bus, node, index, probe)?,
            Writer::Wide(compressor) => compressor.accept(bus, node, index, probe)?,
        }
        self.count += 1;
        Ok(index)
    }

    /// Whether nodes go straight to memory.
    #[inline]
    pub const fn is_exact(&self) -> bool {
        matches!(self.writer, Writer::Exact(_))
    }

    /// Takes the next node by its children; only for a port that [is exact](NodePort::is_exact).
    #[inline(always)]
    pub fn push_exact<B: Bus>(
        &mut self,
        bus: &mut B,
        children: [&Subtree; 2],
    ) -> Result<(), BuildError<B::Error>> {
        let Writer::Exact(writer) = &mut self.writer else { return Err(BuildError::Internal) };
        Bvh2Node::write_children(children, writer.reserve(bus)?);
        self.count += 1;
        Ok(())
    }

    /// The subtree that was completed last is a cell, to be joined to others later.
    pub fn settle<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        match &mut self.writer {
            Writer::Exact(_) | Writer::Shared(_) | Writer::Wide(_) => Ok(()),
            Writer::Quantized(compressor) => compressor.settle(bus, probe),
        }
    }

    /// What comes now is written in `stage`; what came before has been.
    pub fn enter<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        stage: Stage,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        match &mut self.writer {
            Writer::Exact(writer) => {
                writer.flush(bus)?;
                writer.set_stage(stage);
            }
            Writer::Quantized(compressor) => compressor.enter(bus, stage, probe)?,
            // Comes after a top level only, which is neither shared nor collapsed.
            Writer::Shared(_) | Writer::Wide(_) => {}
        }
        probe.stage(stage);
        Ok(())
    }

    /// All nodes of `tree` have been pushed. Its count and its root become those of the nodes written, which
    /// are others than those pushed where nodes take several words or are collapsed.
    pub fn finish<B: Bus, P: Probe>(
        self,
        bus: &mut B,
        tree: &mut Tree,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        tree.node_count = match self.writer {
            Writer::Exact(mut writer) => {
                writer.flush(bus)?;
                self.count
            }
            Writer::Quantized(compressor) => {
                compressor.finish(bus, tree.root.as_ref(), probe)?;
                self.count
            }
            Writer::Shared(compressor) => {
                let words = compressor.words();
                compressor.finish(bus)?;
                words
            }
            Writer::Wide(compressor) => compressor.finish(bus, tree.root.as_ref(), probe)?,
        };
        // The root is written last, in all formats.
        if let Some(Subtree { child: Child::Inner(index), .. }) = &mut tree.root {
            *index = NodeIndex(tree.node_count.saturating_sub(1));
        }
        Ok(())
    }
}
