//! Where completed nodes go.

use super::{BuildConfig, BuildRegions};
use crate::compress::{Compressor, HeldNode, Place, SharedCompressor};
use crate::error::{BuildError, RegionName};
use crate::mem::{BurstWriter, Bus};
use crate::node::{Bvh2Node, Child, NodeIndex, Subtree};
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
}

impl<'a> NodePort<'a> {
    pub fn new(config: &BuildConfig, regions: &BuildRegions, held: &'a mut [HeldNode]) -> Self {
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

    /// What [`Tree::node_count`](crate::node::Tree::node_count) is to be.
    pub const fn count(&self) -> u32 {
        match &self.writer {
            Writer::Shared(compressor) => compressor.words(),
            _ => self.count,
        }
    }

    /// The root as the tree's descriptor has it; as the port gave it, unless nodes take several words.
    pub fn locate(&self, root: Subtree) -> Subtree {
        match (&self.writer, root.child) {
            (Writer::Shared(compressor), Child::Inner(_)) => {
                let last = NodeIndex(compressor.words().saturating_sub(1));
                Subtree { child: Child::Inner(last), ..root }
            }
            _ => root,
        }
    }

    /// The subtree that was completed last is a cell, to be joined to others later.
    pub fn settle<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        match &mut self.writer {
            Writer::Exact(_) | Writer::Shared(_) => Ok(()),
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
            // Comes after a top level only, which is not shared.
            Writer::Shared(_) => {}
        }
        probe.stage(stage);
        Ok(())
    }

    /// All nodes of the tree with `root` have been pushed.
    pub fn finish<B: Bus, P: Probe>(
        self,
        bus: &mut B,
        root: Option<&Subtree>,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        match self.writer {
            Writer::Exact(mut writer) => writer.flush(bus),
            Writer::Quantized(compressor) => compressor.finish(bus, root, probe),
            Writer::Shared(compressor) => compressor.finish(bus),
        }
    }
}
