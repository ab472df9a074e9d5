//! Shared-plane nodes as they leave the emitter.

use heapless::Vec;

use super::shared::OpenNode;
use crate::emit::MAX_DEPTH;
use crate::error::{BuildError, RegionName};
use crate::mem::{BurstWriter, Bus, Region};
use crate::node::{Bvh2Node, Child, NodeIndex, Sharing};
use crate::probe::{Probe, Stage};

/// Writes shared-plane nodes in the order of a depth-first walk, children before parents. Memory is
/// written once, in order, and never read.
///
/// What waits for its parent is kept on a stack of [`MAX_DEPTH`] + 1 entries of a pointer, three
/// scales, six planes' grids (45 bits) and two counts.
#[derive(Debug)]
pub struct SharedCompressor {
    sharing: Sharing,
    writer: BurstWriter,
    /// Nodes without a parent, with what pointers to them say.
    open: Vec<(NodeIndex, OpenNode), { MAX_DEPTH + 1 }>,
    words: u32,
}

impl SharedCompressor {
    /// A compressor into `region` that writes bursts of so many bytes.
    pub const fn new(sharing: Sharing, region: Region, burst: usize) -> Self {
        let writer = BurstWriter::new(region, RegionName::QuantizedNodes, Stage::Emit, burst);
        Self { sharing, writer, open: Vec::new(), words: 0 }
    }

    /// Takes a node. `arrival` is what pointers to it say.
    ///
    /// # Errors
    /// [`BuildError`]: a full region, more than 2^30 words, the bus's; a box off the grid; nodes in
    /// another order.
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        arrival: NodeIndex,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let mut children = [OpenNode::leaf(0); 2];
        for (child, open) in node.children.iter().zip(&mut children).rev() {
            *open = match child.child {
                Child::Leaf { count, .. } => OpenNode::leaf(count),
                Child::Inner(index) => match self.open.pop() {
                    Some((last, open)) if last == index => open,
                    _ => return Err(BuildError::Unsorted),
                },
            };
        }
        let corrupt = BuildError::CorruptNode { index: arrival.0 };
        let (words, open) = OpenNode::join(node, &children, &self.sharing).ok_or(corrupt)?;
        // Extensions are in front of the node.
        for word in words.iter().rev() {
            self.writer.push(bus, &word.to_le_bytes())?;
        }
        probe.compress_node();
        self.words += words.len() as u32;
        self.open.push((arrival, open)).map_err(|_| BuildError::Unsorted)
    }

    /// How many words have been written.
    pub const fn words(&self) -> u32 {
        self.words
    }

    /// Ends the stream.
    ///
    /// # Errors
    /// [`BuildError::Bus`].
    pub fn finish<B: Bus>(mut self, bus: &mut B) -> Result<(), BuildError<B::Error>> {
        self.writer.flush(bus)
    }
}
