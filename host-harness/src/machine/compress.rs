//! Cycle model of the emitter with the streaming compressor behind it, `xy_emit` as it compresses.

use xylem_core::compress::{Compression, HeldNode};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::node::{Bvh2Node, LeafEntry, NodeFormat, Tree};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::probe::Stage;
use xylem_core::sort::Item;

use super::compressor::unit::{self, CompressorUnit};
use super::emit::Did;
use super::emitter::{self, EmitterUnit};
use super::port::PortError;
use super::writer::Writer;

/// The emitter and the compressor between the merge's FIFO and the memory port.
#[derive(Debug)]
pub struct CompressUnit<'a> {
    emitter: EmitterUnit,
    compressor: CompressorUnit<'a>,
    leaf_table: Writer,
    /// What the emitter gives the compressor in this cycle.
    link: Link,
    tree: Tree,
}

#[derive(Debug, Default)]
struct Link {
    node: Option<Bvh2Node>,
    end: bool,
}

impl<'a> CompressUnit<'a> {
    /// A unit that has seen nothing; `held` has [`Compression::held_nodes`] places.
    pub fn new(
        config: &BuildConfig,
        compression: Compression,
        regions: &BuildRegions,
        held: &'a mut [HeldNode],
    ) -> Self {
        let format = NodeFormat::Quantized(compression.quantization);
        Self {
            emitter: EmitterUnit::new(config.max_leaf_size),
            compressor: CompressorUnit::new(compression, regions.nodes, held),
            leaf_table: Writer::new(
                regions.leaf_table,
                RegionName::LeafTable,
                Stage::Emit,
                config.write_burst,
            ),
            link: Link::default(),
            tree: Tree::empty(format, regions.nodes, regions.leaf_table),
        }
    }

    /// Runs one cycle in which `item` is offered; with `end`, no item follows.
    ///
    /// # Errors
    /// [`BuildError::RegionFull`].
    pub fn tick(
        &mut self,
        item: Option<&Item>,
        end: bool,
        image: &mut [u8],
    ) -> Result<Did, BuildError<PortError>> {
        self.link.end = self.emitter.is_done();
        if self.link.end {
            self.leaf_table.flush();
        }
        let outputs = self.emitter.tick(&emitter::Inputs {
            item,
            end,
            node_ready: self.compressor.is_ready(),
            entry_ready: self.leaf_table.is_ready(LeafEntry::BYTES),
        });
        if let Some(entry) = outputs.entry {
            self.leaf_table.push(image, &entry.to_bytes())?;
        }
        self.link.node = outputs.node;
        if self.emitter.is_done() {
            let [node_count, leaf_count, entry_count] = self.emitter.counts();
            let root = self.emitter.root();
            self.tree = Tree { root, node_count, leaf_count, entry_count, ..self.tree };
        }
        Ok(Did { accepted: outputs.item_ready && item.is_some(), worked: outputs.worked })
    }

    /// Ends the cycle.
    ///
    /// # Errors
    /// [`BuildError`] of the compressor.
    pub fn end_cycle(&mut self, image: &mut [u8]) -> Result<(), BuildError<PortError>> {
        self.leaf_table.tick(image);
        let (node, end) = (self.link.node.as_ref(), self.link.end);
        let root = self.tree.root.as_ref().filter(|_| end);
        self.compressor.tick(&unit::Inputs { node, end, root }, image)
    }

    /// Whether the root is known and all is sent.
    pub fn is_finished(&self) -> bool {
        self.emitter.is_done() && self.compressor.is_done() && self.leaf_table.is_empty()
    }

    /// The emitter.
    pub fn emitter(&self) -> &EmitterUnit {
        &self.emitter
    }

    /// The compressor.
    pub fn compressor(&self) -> &CompressorUnit<'a> {
        &self.compressor
    }

    /// The compressor, to be told what became of its lines.
    pub fn compressor_mut(&mut self) -> &mut CompressorUnit<'a> {
        &mut self.compressor
    }

    /// The writer of the leaf table.
    pub fn leaf_table(&self) -> &Writer {
        &self.leaf_table
    }

    /// The line that the writer of the leaf table offers was taken.
    pub fn leaf_taken(&mut self) {
        self.leaf_table.taken();
    }

    /// The tree, once the root is known.
    pub fn tree(&self) -> Option<&Tree> {
        self.emitter.is_done().then_some(&self.tree)
    }
}
