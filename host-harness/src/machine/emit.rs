//! Cycle model of the emitter with its two write ports, `xy_emit`: what is left in them is flushed from
//! the cycle after the root is known.

use xylem_core::error::{BuildError, RegionName};
use xylem_core::node::{Bvh2Node, LeafEntry, NodeFormat, Tree};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::probe::Stage;
use xylem_core::sort::Item;

use super::emitter::{EmitterUnit, Inputs};
use super::port::PortError;
use super::writer::Writer;

/// The emitter between the merge's FIFO and the memory port.
#[derive(Debug)]
pub struct EmitUnit {
    emitter: EmitterUnit,
    /// Writes 64-byte nodes.
    nodes: Writer,
    /// Writes leaf table entries.
    leaf_table: Writer,
    tree: Tree,
}

/// What the unit did in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Did {
    /// It took the item offered.
    pub accepted: bool,
    /// It did a stack operation or extended a leaf.
    pub worked: bool,
}

impl EmitUnit {
    /// A unit that has seen nothing.
    pub fn new(config: &BuildConfig, regions: &BuildRegions) -> Self {
        let writer = |region, name| Writer::new(region, name, Stage::Emit, config.write_burst);
        Self {
            emitter: EmitterUnit::new(config.max_leaf_size),
            nodes: writer(regions.nodes, RegionName::Nodes),
            leaf_table: writer(regions.leaf_table, RegionName::LeafTable),
            tree: Tree::empty(NodeFormat::Bvh2, regions.nodes, regions.leaf_table),
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
        if self.emitter.is_done() {
            self.nodes.flush();
            self.leaf_table.flush();
        }
        let outputs = self.emitter.tick(&Inputs {
            item,
            end,
            node_ready: self.nodes.is_ready(Bvh2Node::BYTES),
            entry_ready: self.leaf_table.is_ready(LeafEntry::BYTES),
        });
        if let Some(entry) = outputs.entry {
            self.leaf_table.push(image, &entry.to_bytes())?;
        }
        if let Some(node) = outputs.node {
            self.nodes.push(image, &node.to_bytes())?;
        }
        if self.emitter.is_done() {
            let [node_count, leaf_count, entry_count] = self.emitter.counts();
            let root = self.emitter.root();
            self.tree = Tree { root, node_count, leaf_count, entry_count, ..self.tree };
        }
        Ok(Did { accepted: outputs.item_ready && item.is_some(), worked: outputs.worked })
    }

    /// Ends the cycle of the writers.
    pub fn tick_writers(&mut self, image: &mut [u8]) {
        self.nodes.tick(image);
        self.leaf_table.tick(image);
    }

    /// Whether the root is known and all is sent.
    pub fn is_finished(&self) -> bool {
        self.emitter.is_done() && self.nodes.is_empty() && self.leaf_table.is_empty()
    }

    /// The writers of nodes and of the leaf table.
    pub fn writers(&self) -> [&Writer; 2] {
        [&self.nodes, &self.leaf_table]
    }

    /// The line that the writer of nodes (0) or of the leaf table (1) offers was taken.
    pub fn taken(&mut self, writer: usize) {
        match writer {
            0 => self.nodes.taken(),
            _ => self.leaf_table.taken(),
        }
    }

    /// The emitter between the writers.
    pub fn emitter(&self) -> &EmitterUnit {
        &self.emitter
    }

    /// The tree, once the root is known.
    pub fn tree(&self) -> Option<&Tree> {
        self.emitter.is_done().then_some(&self.tree)
    }
}
