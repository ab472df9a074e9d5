//! Cycle model of the hierarchy emitter, `xy_emitter` (P2 §5.4).
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one stack operation, or one primitive into the open leaf, a cycle |
//! | Input | a primitive is taken in the cycle of the first operation that it causes |
//! | Stalls | while there is no room for a node; for a primitive, also while there is none for an entry |
//!
//! What it computes is `xylem_core::emit::Emitter`; this adds when.

use xylem_core::emit::{Emitter, Step};
use xylem_core::node::{Bvh2Node, LeafEntry, Subtree};
use xylem_core::sort::Item;

/// The emitter between the merge's FIFO and whatever takes its nodes and leaf table entries.
#[derive(Clone, Debug)]
pub struct EmitterUnit {
    emitter: Emitter,
    root: Option<Subtree>,
    entries: u32,
    ended: bool,
    done: bool,
}

/// What the unit sees in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Inputs<'a> {
    /// The primitive offered.
    pub item: Option<&'a Item>,
    /// Without an item: none follows.
    pub end: bool,
    /// Whether a node would be taken.
    pub node_ready: bool,
    /// Whether a leaf table entry would be taken.
    pub entry_ready: bool,
}

/// What the unit does in a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Outputs {
    /// An item would be taken, and is if there is one.
    pub item_ready: bool,
    /// The node that leaves.
    pub node: Option<Bvh2Node>,
    /// The leaf table entry that leaves.
    pub entry: Option<LeafEntry>,
    /// It did a stack operation or extended a leaf.
    pub worked: bool,
}

impl EmitterUnit {
    /// A unit that has seen nothing, for leaves of at most `max_leaf_size` primitives.
    pub fn new(max_leaf_size: u32) -> Self {
        let emitter = Emitter::new(max_leaf_size);
        Self { emitter, root: None, entries: 0, ended: false, done: false }
    }

    /// Runs one cycle.
    pub fn tick(&mut self, inputs: &Inputs<'_>) -> Outputs {
        let mut outputs = Outputs::default();
        if self.done || !inputs.node_ready {
            return outputs;
        }
        if self.emitter.is_ready() && inputs.entry_ready {
            outputs.item_ready = true;
            if let Some(item) = inputs.item {
                // It is ready.
                outputs.entry = self.emitter.accept(item, &mut ()).unwrap_or(None);
                outputs.worked = true;
                self.entries += 1;
            } else if inputs.end && !self.ended {
                self.ended = true;
                outputs.entry = self.emitter.finish();
                // Nothing was ever accepted.
                self.done = outputs.entry.is_none();
            }
        }
        match self.emitter.step(&mut ()) {
            Step::Idle => {}
            Step::Push | Step::JoinLeaves { .. } | Step::Cell(_) => outputs.worked = true,
            Step::Node(node) => {
                outputs.node = Some(node);
                outputs.worked = true;
            }
            Step::Root(root) => {
                self.root = Some(root);
                self.done = true;
            }
        }
        outputs
    }

    /// The node and the entry that it offers in a cycle, taken or not.
    pub fn offers(&self, inputs: &Inputs<'_>) -> (Option<Bvh2Node>, Option<LeafEntry>) {
        // Each as if its own channel were ready, on a copy.
        let node = self.clone().tick(&Inputs { node_ready: true, ..*inputs }).node;
        (node, self.clone().tick(&Inputs { entry_ready: true, ..*inputs }).entry)
    }

    /// Whether the root is known: nothing leaves any more.
    pub fn is_done(&self) -> bool {
        self.done
    }

    /// The whole tree, when it is done; `None` for no primitives.
    pub fn root(&self) -> Option<Subtree> {
        self.root
    }

    /// Nodes, leaves and leaf table entries so far.
    pub fn counts(&self) -> [u32; 3] {
        [self.emitter.nodes(), self.emitter.leaves(), self.entries]
    }
}
