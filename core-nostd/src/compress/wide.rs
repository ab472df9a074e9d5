//! Wide trees, streamed: nodes of two children in, quantized nodes of up to four out as they come.
//!
//! # Which nodes are opened
//!
//! A wide node is a binary node with some of those below it opened, that is, replaced by their
//! children. Where nodes come bottom-up that is decided bottom-up: a binary node opens its children as
//! far as their own lists of children fit into four, the one of larger area first. A child that stays
//! closed becomes a wide node of what it opened itself. So the choice for a node depends on the subtree
//! under it alone and is never revised; no binary node is kept.
//!
//! # What is on chip
//!
//! The open lists of the subtrees that wait for their siblings, four parts each. With a
//! [treelet depth](super::Compression::treelet_depth) of 2 or more, closed nodes in a list stay on chip
//! too, until the node above them closes and its grid is guessed: P3's treelets (§4.3) of one layer.

use heapless::Vec;

use super::lines::{LineBuffer, MAX_LINES};
use super::repair::{Record, Repair, backtrack};
use super::{Compression, Placement, Repairs};
use crate::emit::MAX_DEPTH;
use crate::error::BuildError;
use crate::geom::Aabb;
use crate::mem::{Bus, Region};
use crate::node::{Bvh2Node, Child, NodeIndex, Subtree, WideNode};
use crate::probe::Probe;

/// A subtree whose root is not yet part of a wide node, in an on-chip stack of them.
#[derive(Clone, Debug)]
pub struct OpenWide {
    /// What pointers to the binary node at its root say.
    arrival: NodeIndex,
    parts: Parts,
    /// For each part what it consists of, if it is a node that has not been written.
    held: [Parts; WideNode::CHILDREN],
}

impl OpenWide {
    /// Something to fill storage with.
    pub const EMPTY: Self =
        Self { arrival: NodeIndex(0), parts: Vec::new(), held: [const { Vec::new() }; 4] };

    /// How many of these the compressor needs: one for each level of the binary tree.
    pub const STACK: usize = MAX_DEPTH + 1;

    fn leaf(subtree: &Subtree) -> Self {
        let mut open = Self::EMPTY;
        // There is room for four.
        let _ = open.parts.push(Part { subtree: *subtree, context: None });
        open
    }

    fn bounds(&self) -> Aabb {
        self.parts.iter().fold(Aabb::EMPTY, |bounds, part| bounds.union(&part.subtree.bounds))
    }

    /// Adds the parts of another list, if there is room for them.
    fn append(&mut self, other: &Self) -> Option<()> {
        for (part, held) in other.parts.iter().zip(&other.held) {
            let at = self.parts.len();
            self.parts.push(*part).ok()?;
            self.held[at] = held.clone();
        }
        Some(())
    }
}

/// Children of a wide node.
type Parts = Vec<Part, { WideNode::CHILDREN }>;

/// A child of a wide node: a leaf, or a node with the context that it was written in.
#[derive(Clone, Copy, Debug)]
struct Part {
    subtree: Subtree,
    context: Option<Placement>,
}

/// The streaming compressor of wide nodes: collapse, context estimation, mismatch detection and
/// backtracking.
///
/// Nodes come by [`WideCompressor::accept`] in the order of a depth-first walk, children before parents.
#[derive(Debug)]
pub struct WideCompressor<'a> {
    compression: Compression,
    lines: LineBuffer,
    /// Nodes written.
    written: u32,
    stack: &'a mut [OpenWide],
    /// How many lists are on the stack.
    open: usize,
}

impl<'a> WideCompressor<'a> {
    /// A compressor into `region`. `stack` has [`OpenWide::STACK`] places, and the parameters
    /// have been [checked](Compression::check).
    pub fn new(compression: Compression, region: Region, stack: &'a mut [OpenWide]) -> Self {
        let capacity = match compression.repairs {
            Repairs::InMemory => 2,
            Repairs::InLines(lines) => usize::from(lines).min(MAX_LINES),
        };
        let lines = LineBuffer::new(region, capacity);
        Self { compression, lines, written: 0, stack, open: 0 }
    }

    /// Takes a node. `arrival` is what pointers to it say.
    ///
    /// # Errors
    /// [`BuildError`]: a full region, a pointer of too many bits, the bus's; a box off the grid or
    /// a node that was read back damaged; nodes that are not in the order of a depth-first walk.
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        arrival: NodeIndex,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let [first, second] = &node.children;
        // The second child was completed last.
        let second_list = self.take(second)?;
        let first_list = self.take(first)?;
        let mut lists = [first_list, second_list];
        let [n, m] = [lists[0].parts.len(), lists[1].parts.len()];
        let larger = usize::from(first.bounds.half_area() < second.bounds.half_area());
        let close = if n + m <= WideNode::CHILDREN {
            [false, false]
        } else if lists[larger].parts.len() < WideNode::CHILDREN {
            [larger == 1, larger == 0]
        } else if lists[1 - larger].parts.len() < WideNode::CHILDREN {
            [larger == 0, larger == 1]
        } else {
            [true, true]
        };
        let mut opened = OpenWide { arrival, ..OpenWide::EMPTY };
        for (i, list) in lists.iter_mut().enumerate() {
            // A leaf is closed by nature.
            if close[i] && list.parts.len() > 1 {
                *list = self.close(bus, list, probe)?;
            }
            opened.append(list).ok_or(BuildError::Internal)?;
        }
        probe.stage(self.lines.stage);
        *self.stack.get_mut(self.open).ok_or(BuildError::Unsorted)? = opened;
        self.open += 1;
        Ok(())
    }

    /// Ends the stream; gives how many nodes were written, the root last. All nodes are then in the contexts
    /// that `root` gives.
    ///
    /// # Errors
    /// As [`WideCompressor::accept`].
    pub fn finish<B: Bus, P: Probe>(
        mut self,
        bus: &mut B,
        root: Option<&Subtree>,
        probe: &mut P,
    ) -> Result<u32, BuildError<B::Error>> {
        if let Some(root @ Subtree { bounds, child: Child::Inner(_) }) = root {
            let mut list = self.take(root)?;
            if self.open > 0 {
                return Err(BuildError::Unsorted);
            }
            let context = Placement::root(bounds, &self.compression.quantization);
            let context = context.ok_or(BuildError::CorruptNode { index: list.arrival.0 })?;
            self.settle(bus, &mut list, &context, probe)?;
            self.write(bus, &list.parts, &context, probe)?;
        }
        self.lines.flush(bus, probe)?;
        Ok(self.written)
    }

    /// The list of a child: itself, or what is on top of the stack.
    fn take<E>(&mut self, child: &Subtree) -> Result<OpenWide, BuildError<E>> {
        let Child::Inner(index) = child.child else { return Ok(OpenWide::leaf(child)) };
        let top = self.open.checked_sub(1).ok_or(BuildError::Unsorted)?;
        let list = self.stack.get(top).filter(|list| list.arrival == index);
        let list = list.ok_or(BuildError::Unsorted)?.clone();
        self.open = top;
        Ok(list)
    }

    /// Makes a list a node, on its guessed grid; gives the list of that node alone.
    fn close<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        list: &mut OpenWide,
        probe: &mut P,
    ) -> Result<OpenWide, BuildError<B::Error>> {
        let bounds = list.bounds();
        let Compression { quantization, margin, treelet_depth, .. } = &self.compression;
        let hold = *treelet_depth > 1;
        let context = Placement::estimate(&bounds, quantization, *margin);
        let context = context.ok_or(BuildError::CorruptNode { index: list.arrival.0 })?;
        self.settle(bus, list, &context, probe)?;
        let mut closed = OpenWide { arrival: list.arrival, ..OpenWide::EMPTY };
        let (index, context) = if hold {
            closed.held[0] = list.parts.clone();
            (list.arrival, None)
        } else {
            (self.write(bus, &list.parts, &context, probe)?, Some(context))
        };
        let subtree = Subtree { bounds, child: Child::Inner(index) };
        closed.parts.push(Part { subtree, context }).map_err(|_| BuildError::Internal)?;
        Ok(closed)
    }

    /// Writes the held nodes of a list in the contexts that `context`, that of the node over them, gives
    /// them.
    fn settle<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        list: &mut OpenWide,
        context: &Placement,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        for (part, held) in list.parts.iter_mut().zip(&list.held) {
            if held.is_empty() {
                continue;
            }
            let quantization = &self.compression.quantization;
            let Subtree { bounds, child } = part.subtree;
            let encoded = context.encode(&bounds, child, quantization);
            let (_, cells) = encoded.ok_or(BuildError::CorruptNode { index: list.arrival.0 })?;
            let below = context.child(&cells, quantization);
            part.subtree.child = Child::Inner(self.write(bus, held, &below, probe)?);
            part.context = Some(below);
        }
        Ok(())
    }

    /// Writes a node and repairs what is below it.
    fn write<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        parts: &Parts,
        context: &Placement,
        probe: &mut P,
    ) -> Result<NodeIndex, BuildError<B::Error>> {
        let Compression { quantization, repairs, .. } = self.compression;
        let index = NodeIndex(self.written);
        let mut node = WideNode::EMPTY;
        for (code, Part { subtree, context: old }) in node.children.iter_mut().zip(parts) {
            let encoded = context.encode(&subtree.bounds, subtree.child, &quantization);
            let (child, cells) = encoded.ok_or(BuildError::CorruptNode { index: index.0 })?;
            *code = Some(child);
            if subtree.child.words().0 > WideNode::MAX_POINTER {
                return Err(BuildError::PointerOverflow);
            }
            if let (&Some(old), Child::Inner(index)) = (old, subtree.child) {
                let repair = Repair { index, old, new: context.child(&cells, &quantization) };
                if repair.is_needed(&quantization) {
                    let through = repairs == Repairs::InMemory;
                    let lines = &mut self.lines;
                    backtrack::<WideNode, _, _>(bus, lines, through, &quantization, repair, probe)?;
                }
            }
        }
        let len = WideNode::len(&quantization);
        let offset = index.0.checked_mul(len).ok_or(BuildError::PointerOverflow)?;
        let bytes = node.to_bytes(quantization.bits);
        self.lines.put(bus, offset, &bytes[..len as usize], probe)?;
        probe.compress_node();
        self.written += 1;
        Ok(index)
    }
}
