//! Streaming compression: nodes in, children before parents; quantized pairs out as they come (P3 §4).

use heapless::Vec;

use super::Placement;
use super::lines::{LINE, LineBuffer, MAX_LINES};
use super::repair::{Repair, backtrack};
use super::treelet::{Below, HeldNode, MAX_TREELET_DEPTH, Place, Treelet};
use crate::emit::MAX_DEPTH;
use crate::error::{BuildError, ConfigError};
use crate::geom::Aabb;
use crate::mem::{Bus, Region};
use crate::node::{
    Bvh2Node, Child, NodeIndex, Quantization, QuantizedChild, QuantizedPair, Subtree,
};
use crate::probe::{Probe, Stage};

/// How to compress a stream of nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Compression {
    /// The format of the nodes.
    pub quantization: Quantization,
    /// Nodes on the way from a treelet's root to its lowest nodes, 1 to 4 (P3 §4.3). With 1 every node
    /// is written at once.
    pub treelet_depth: u8,
    /// How much coarser a parent's grid is expected to be, as a power of two, 0 to 3: see
    /// [`Placement::estimate`].
    pub margin: u8,
    /// How nodes are repaired.
    pub repairs: Repairs,
}

/// How nodes whose context has changed are encoded again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Repairs {
    /// P3's: each is a read and a write of a line of 64 bytes.
    InMemory,
    /// The last lines stay on chip, this many; a repair of a node in one of them costs nothing.
    InLines(u8),
}

impl Compression {
    /// Modulo coordinates and one layer of treelets, as in P3; repairs in memory.
    pub const DEFAULT: Self = Self {
        quantization: Quantization::MODULO,
        treelet_depth: 2,
        margin: Self::MARGIN,
        repairs: Repairs::InMemory,
    };

    /// The margin with the fewest repairs on scanned meshes and buildings alike: a parent is about
    /// twice as long on the axis of its split.
    pub const MARGIN: u8 = 1;

    /// How many [`HeldNode`]s the compressor needs: a treelet without its lowest layer for every level
    /// of the tree.
    pub const fn held_nodes(&self) -> usize {
        self.slots() * (MAX_DEPTH + 1)
    }

    /// Nodes of a treelet that stay on chip.
    const fn slots(&self) -> usize {
        // Whatever the depth is; it may not have been checked.
        (1 << (self.treelet_depth.saturating_sub(1) & 7)) - 1
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ConfigError`] naming the parameter.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.quantization.check()?;
        let lines = match self.repairs {
            Repairs::InMemory => true,
            Repairs::InLines(lines) => (2..=MAX_LINES).contains(&usize::from(lines)),
        };
        let depth = (1..=Self::MAX_TREELET_DEPTH).contains(&self.treelet_depth);
        if !depth || self.margin > Self::MAX_MARGIN || !lines {
            return Err(ConfigError::Compression);
        }
        Ok(())
    }

    fn estimate(&self, bounds: &Aabb) -> Option<Placement> {
        Placement::estimate(bounds, &self.quantization, self.margin)
    }

    /// The largest margin.
    pub const MAX_MARGIN: u8 = 3;

    /// The deepest treelets.
    pub const MAX_TREELET_DEPTH: u8 = MAX_TREELET_DEPTH;
}

/// The streaming compressor: context estimation, treelets, mismatch detection, and backtracking.
///
/// Nodes come by [`Compressor::accept`], children before parents. A treelet is the upper part of a
/// subtree, whose nodes are still on chip; treelets wait on a stack, as subtrees do in the hierarchy
/// emitter. When a node arrives, the treelets of its children become part of its own, and its lowest
/// layer, encoded from the root down, leaves. Only the root's context is a [guess](Placement::estimate). A
/// child in memory whose context is not the one that its parent now gives it is
/// [repaired](Repairs).
///
/// With treelets of depth 1 nodes may come in any order that has children first: the context
/// of a node that was written is found from its box again, so that nothing is kept of it. Deeper
/// treelets need the order of a depth-first walk, where the children of a node are the last subtrees
/// without a parent.
#[derive(Debug)]
pub struct Compressor<'a> {
    encoder: Encoder,
    /// The treelet at work.
    treelet: Treelet,
    /// The treelets on the stack, [`Compression::slots`] places each. The children of the node in place
    /// `s`, counted from 1, are in `2s` and `2s + 1`.
    held: &'a mut [HeldNode],
    /// What pointers to each treelet's root say.
    roots: Vec<NodeIndex, { MAX_DEPTH + 1 }>,
}

impl<'a> Compressor<'a> {
    /// A compressor into `region`. `held` has [`Compression::held_nodes`] places, and the parameters
    /// have been [checked](Compression::check).
    pub fn new(compression: Compression, region: Region, held: &'a mut [HeldNode]) -> Self {
        let capacity = match compression.repairs {
            Repairs::InMemory => 2,
            Repairs::InLines(lines) => lines.into(),
        };
        let encoder = Encoder { compression, lines: LineBuffer::new(region, capacity), written: 0 };
        Self { encoder, treelet: Treelet::EMPTY, held, roots: Vec::new() }
    }

    /// Writes what is held in lines; nodes that come now are written in `stage`.
    ///
    /// # Errors
    /// [`BuildError::Bus`].
    pub fn enter<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        stage: Stage,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.encoder.lines.flush(bus, probe)?;
        self.encoder.lines.stage = stage;
        Ok(())
    }

    /// Takes a node. `arrival` is what pointers to it say, and in [`Place::Next`] the number of nodes
    /// before it; its own pointers are those of nodes that came before it.
    ///
    /// # Errors
    /// [`BuildError`]: a full region, a pointer of too many bits, the bus's; a box off the grid or
    /// a node that was read back damaged; nodes in an order that deep treelets do not allow.
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        arrival: NodeIndex,
        place: Place,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let Self { encoder, treelet, held, roots } = self;
        let compression = encoder.compression;
        let kept = compression.slots();
        let corrupt = BuildError::CorruptNode { index: arrival.0 };
        let bounds = node.children[0].bounds.union(&node.children[1].bounds);
        let context = compression.estimate(&bounds).ok_or(corrupt)?;
        treelet.clear();
        let mut below = [Below::Leaf; 2];
        let (mut taken, mut at_first) = (0, None);
        for (i, child) in node.children.iter().enumerate() {
            let Child::Inner(index) = child.child else { continue };
            let recent = roots.len().saturating_sub(2);
            below[i] = match roots[recent..].iter().position(|root| *root == index) {
                // A subtree has one parent and is one child of it.
                Some(at) if at_first == Some(at) => return Err(corrupt),
                Some(at) => {
                    treelet.add(i, slots(held, kept, recent + at));
                    (taken, at_first) = (taken + 1, Some(at));
                    Below::Held
                }
                // It is in memory in the context that was estimated for it.
                None => match compression.estimate(&child.bounds) {
                    Some(old) => Below::Written(old),
                    None => return Err(BuildError::CorruptNode { index: index.0 }),
                },
            };
        }
        treelet.nodes[1] = HeldNode { node: *node, place, below };
        treelet
            .place(context, &compression.quantization)
            .ok_or(BuildError::CorruptNode { index: arrival.0 })?;
        let lowest = 1 << (compression.treelet_depth - 1);
        for at in lowest..2 * lowest {
            encoder.write(bus, treelet, at, probe)?;
        }
        probe.stage(encoder.lines.stage);
        if lowest > 1 {
            roots.truncate(roots.len() - taken);
            roots.push(arrival).map_err(|_| BuildError::Unsorted)?;
            let top = roots.len() - 1;
            let slots = held.get_mut(top * kept..(top + 1) * kept);
            slots.ok_or(BuildError::Internal)?.copy_from_slice(&treelet.nodes[1..=kept]);
        }
        Ok(())
    }

    /// Writes the treelet that is held, if any, so that its root's index is the one that pointers to
    /// it have. Call when one subtree is complete and may be moved.
    ///
    /// # Errors
    /// As [`Compressor::accept`].
    pub fn settle<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.write_held(bus, None, probe)
    }

    /// Ends the stream. All nodes are then written in the contexts that `root` gives.
    ///
    /// # Errors
    /// As [`Compressor::accept`].
    pub fn finish<B: Bus, P: Probe>(
        mut self,
        bus: &mut B,
        root: Option<&Subtree>,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        if let Some(Subtree { bounds, child: Child::Inner(index) }) = root {
            let compression = self.encoder.compression;
            let corrupt = BuildError::CorruptNode { index: index.0 };
            let (Some(old), Some(new)) =
                (compression.estimate(bounds), Placement::root(bounds, &compression.quantization))
            else {
                return Err(corrupt);
            };
            if self.roots.is_empty() {
                self.encoder.repair(bus, Repair { index: *index, old, new }, probe)?;
            } else {
                self.write_held(bus, Some(new), probe)?;
            }
        }
        self.encoder.lines.flush(bus, probe)
    }

    /// Writes all treelets; the first one's root in context `root`, if that is given.
    fn write_held<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        mut root: Option<Placement>,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let Self { encoder, treelet, held, roots } = self;
        let compression = encoder.compression;
        for (stacked, arrival) in roots.iter().enumerate() {
            let corrupt = BuildError::CorruptNode { index: arrival.0 };
            treelet.clear();
            let slots = slots(held, compression.slots(), stacked);
            treelet.nodes[1..=slots.len()].copy_from_slice(slots);
            let [a, b] = treelet.nodes[1].node.children;
            let context = root.take().or_else(|| compression.estimate(&a.bounds.union(&b.bounds)));
            let placed =
                context.and_then(|context| treelet.place(context, &compression.quantization));
            placed.ok_or(corrupt)?;
            for layer in (0..compression.treelet_depth - 1).rev() {
                for at in 1 << layer..2 << layer {
                    let index = encoder.write(bus, treelet, at, probe)?;
                    if at == 1 && index != Some(*arrival) {
                        // More than one subtree was left: not the order of a depth-first walk.
                        return Err(BuildError::Unsorted);
                    }
                }
            }
        }
        roots.clear();
        probe.stage(encoder.lines.stage);
        Ok(())
    }
}

/// The places of a treelet on the stack.
fn slots(held: &[HeldNode], kept: usize, stacked: usize) -> &[HeldNode] {
    held.get(stacked * kept..(stacked + 1) * kept).unwrap_or_default()
}

/// Encodes the nodes of treelets into memory.
#[derive(Debug)]
struct Encoder {
    compression: Compression,
    lines: LineBuffer,
    /// Nodes written to the next place.
    written: u32,
}

impl Encoder {
    /// Writes a node of a treelet, if there is one at `at`, repairs what is below, and tells the node
    /// above.
    fn write<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        treelet: &mut Treelet,
        at: usize,
        probe: &mut P,
    ) -> Result<Option<NodeIndex>, BuildError<B::Error>> {
        let Some(context) = treelet.contexts[at] else { return Ok(None) };
        let quantization = self.compression.quantization;
        let HeldNode { node, place, below } = treelet.nodes[at];
        let index = match place {
            Place::At(index) => index,
            Place::Next => NodeIndex(self.written),
        };
        let mut pair = QuantizedPair { children: [QuantizedChild::EMPTY; 2] };
        for (i, child) in node.children.iter().enumerate() {
            let encoded = context.encode(&child.bounds, child.child, &quantization);
            let (code, cells) = encoded.ok_or(BuildError::CorruptNode { index: index.0 })?;
            pair.children[i] = code;
            let (Child::Inner(NodeIndex(pointer)) | Child::Leaf { first: pointer, .. }) =
                child.child;
            if pointer > QuantizedPair::MAX_POINTER {
                return Err(BuildError::PointerOverflow);
            }
            if let Below::Written(old) = below[i]
                && let Child::Inner(index) = child.child
            {
                let new = context.child(&cells, &quantization);
                self.repair(bus, Repair { index, old, new }, probe)?;
            }
        }
        let len = quantization.node_bytes();
        let offset = index.0.checked_mul(len).ok_or(BuildError::PointerOverflow)?;
        let bytes = pair.to_bytes(quantization.bits);
        self.lines.put(bus, offset, &bytes[..len as usize], probe)?;
        probe.compress_node();
        if place == Place::Next {
            self.written += 1;
            let ends_line = offset / LINE < (offset + len) / LINE;
            if self.compression.repairs == Repairs::InMemory && ends_line {
                // Nothing more comes for it.
                self.lines.release(bus, offset, 1, probe)?;
            }
        }
        if at > 1 {
            let (parent, side) = (&mut treelet.nodes[at / 2], at % 2);
            parent.below[side] = Below::Written(context);
            parent.node.children[side].child = Child::Inner(index);
        }
        Ok(Some(index))
    }

    fn repair<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        repair: Repair,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let Compression { quantization, repairs, .. } = &self.compression;
        if !repair.is_needed(quantization) {
            return Ok(());
        }
        let through = *repairs == Repairs::InMemory;
        backtrack::<QuantizedPair, _, _>(bus, &mut self.lines, through, quantization, repair, probe)
    }
}
