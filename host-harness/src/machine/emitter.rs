//! Cycle model of the hierarchy emitter with its two write ports (P2 §5.4).
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one stack operation, or one primitive into the open leaf, a cycle |
//! | Input | a primitive is taken in the cycle of the first operation that it causes |
//! | Stalls | while the node writer has no room for a node, or the leaf table writer for an entry |
//!
//! What it computes is `xylem_core::emit::Emitter`; this adds when.

use xylem_core::emit::{Emitter, Step};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::node::{Bvh2Node, LeafEntry, NodeFormat, Tree};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::probe::Stage;
use xylem_core::sort::Item;

use super::port::PortError;
use super::writer::Writer;

/// The emitter between the merge's FIFO and the memory port.
#[derive(Debug)]
pub struct EmitterUnit {
    emitter: Emitter,
    /// Writes 64-byte nodes.
    pub nodes: Writer,
    /// Writes leaf table entries.
    pub leaf_table: Writer,
    tree: Tree,
    ended: bool,
    finished: bool,
}

/// What the unit did in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Did {
    /// It took the item offered.
    pub accepted: bool,
    /// It did a stack operation or extended a leaf.
    pub worked: bool,
}

impl EmitterUnit {
    /// A unit that has seen nothing.
    pub fn new(config: &BuildConfig, regions: &BuildRegions) -> Self {
        let writer = |region, name| Writer::new(region, name, Stage::Emit, config.write_burst);
        Self {
            emitter: Emitter::new(config.max_leaf_size),
            nodes: writer(regions.nodes, RegionName::Nodes),
            leaf_table: writer(regions.leaf_table, RegionName::LeafTable),
            tree: Tree::empty(NodeFormat::Bvh2, regions.nodes, regions.leaf_table),
            ended: false,
            finished: false,
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
        let mut did = Did { accepted: false, worked: false };
        if self.finished || !self.nodes.is_ready(Bvh2Node::BYTES) {
            return Ok(did);
        }
        if self.emitter.is_ready() && self.leaf_table.is_ready(LeafEntry::BYTES) {
            let mut entry = None;
            if let Some(item) = item {
                entry = self.emitter.accept(item, &mut ()).map_err(|_| BuildError::Internal)?;
                self.tree.entry_count += 1;
                did = Did { accepted: true, worked: true };
            } else if end && !self.ended {
                self.ended = true;
                entry = self.emitter.finish();
                // Nothing was ever accepted.
                self.finished = entry.is_none();
            }
            if let Some(entry) = entry {
                self.leaf_table.push(image, &entry.to_bytes())?;
            }
        }
        match self.emitter.step(&mut ()) {
            Step::Idle => {}
            Step::Push | Step::JoinLeaves { .. } | Step::Cell(_) => did.worked = true,
            Step::Node(node) => {
                self.nodes.push(image, &node.to_bytes())?;
                did.worked = true;
            }
            Step::Root(root) => {
                self.tree.root = Some(root);
                self.finished = true;
            }
        }
        if self.finished {
            self.tree.node_count = self.emitter.nodes();
            self.tree.leaf_count = self.emitter.leaves();
        }
        Ok(did)
    }

    /// Whether the root is known.
    pub fn is_finished(&self) -> bool {
        self.finished
    }

    /// The tree so far.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }
}
