//! The walk over a tree: topology in, exact nodes out.

use heapless::Vec;

use super::CostMeter;
use super::lines::Lines;
use crate::emit::MAX_DEPTH;
use crate::error::{BuildError, ConfigError, RegionName};
use crate::geom::{Aabb, Triangle};
use crate::mem::{Bus, Region};
use crate::node::{
    Bvh2Node, Bvh2View, Child, LeafEntry, MAX_LEAF_SIZE, NodeFormat, NodeIndex, QuantizedPair,
    QuantizedView, Subtree, Tree,
};
use crate::num::Grid;
use crate::probe::{Probe, Stage};
use crate::quality::SahCost;

/// Whoever takes the refitted nodes.
pub trait RefitSink {
    /// Takes a finished node and its index, which is the old one. Its children came before it. Leaves
    /// have their sizes, also where the format that they were read from does not say them.
    ///
    /// # Errors
    /// [`BuildError`] if the node could not be kept.
    fn node<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        node: &Bvh2Node,
        index: NodeIndex,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>>;
}

/// What [`refit`] found.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Refitted {
    /// The root with its new box, or `None` for the tree of no primitives.
    pub root: Option<Subtree>,
    /// The SAH cost of the tree as it is now; 0 for no primitives.
    pub cost: SahCost,
}

/// Lines of nodes that are held. LBVH trees need one; in trees whose order differs, near relatives
/// share some.
const NODE_LINES: usize = 8;

/// Lines of the leaf table that are held: more than the largest leaf lies in, so that a leaf that is
/// read forwards and its neighbour before it cost each line once.
const TABLE_LINES: usize = 32;

/// A node whose children are not both done.
#[derive(Clone, Copy, Debug)]
struct Frame {
    index: NodeIndex,
    children: [Child; 2],
    /// The second child, which is done first.
    second: Option<Subtree>,
}

/// Computes the boxes of `tree` anew from `triangle_count` records of 40 bytes in `triangles`, and
/// hands every node to `sink`, children first. Indices and pointers stay as they are.
///
/// The tree is walked from the root with the second child first, which in a tree in the emitter's
/// order reads nodes and leaf table backwards and without gaps. Each node, leaf table entry and
/// triangle is read once, nodes and entries in lines of 64 bytes. The memory
/// for it: [`MAX_DEPTH`] unfinished nodes and 40 lines.
///
/// # Errors
/// [`BuildError`]: a format whose nodes change their size with their boxes
/// ([`ConfigError::RefitFormat`]); a region that is smaller than the tree says, before anything is read; a bus error;
/// a triangle off the grid ([`BuildError::InvalidPrimitive`]); or memory that holds no tree
/// ([`BuildError::CorruptNode`], [`BuildError::CorruptLeaf`]). Every node and every entry is visited at
/// most once, whatever is in memory. What was handed to the sink before the error stays there: the
/// tree is then to be built anew.
pub fn refit<B: Bus, S: RefitSink, P: Probe>(
    bus: &mut B,
    tree: &Tree,
    (triangles, triangle_count): (Region, u32),
    sink: &mut S,
    probe: &mut P,
) -> Result<Refitted, BuildError<B::Error>> {
    let mut source = Source::new(tree, triangles, triangle_count)?;
    let Some(root) = tree.root else { return Ok(Refitted::default()) };
    probe.stage(Stage::Refit);
    let mut meter = CostMeter::new();
    let mut stack = Vec::<Frame, MAX_DEPTH>::new();
    let mut next = root.child;
    let root = 'walk: loop {
        let mut done = match next {
            Child::Leaf { first, count } => source.leaf(bus, first, count)?,
            Child::Inner(index) => {
                let children = source.children(bus, index)?;
                let frame = Frame { index, children, second: None };
                stack.push(frame).map_err(|_| BuildError::CorruptNode { index: index.0 })?;
                next = children[1];
                continue;
            }
        };
        loop {
            let Some(frame) = stack.last_mut() else { break 'walk done };
            let Some(second) = frame.second else {
                frame.second = Some(done);
                next = frame.children[0];
                break;
            };
            let index = frame.index;
            stack.pop();
            let node = Bvh2Node { children: [done, second] };
            meter.node(node.children.each_ref());
            sink.node(bus, &node, index, probe)?;
            done =
                Subtree { bounds: done.bounds.union(&second.bounds), child: Child::Inner(index) };
        }
    };
    source.check_all_visited()?;
    Ok(Refitted { root: Some(root), cost: meter.cost(&root) })
}

/// The tree and the triangles as they are read, and what may still be visited.
#[derive(Debug)]
struct Source<'a> {
    tree: &'a Tree,
    nodes: Lines<NODE_LINES>,
    table: Lines<TABLE_LINES>,
    triangles: Region,
    triangle_count: u32,
    nodes_left: u32,
    entries_left: u32,
}

impl<'a> Source<'a> {
    fn new<E>(
        tree: &'a Tree,
        triangles: Region,
        triangle_count: u32,
    ) -> Result<Self, BuildError<E>> {
        let used = |region: Region, name, count: u32, bytes: u32| {
            let needed = u64::from(count) * u64::from(bytes);
            // What lies beyond the last address is no memory.
            let region = Region { size: region.size.min(u32::MAX - region.base.0), ..region };
            if needed > u64::from(region.size) {
                let available = region.size;
                return Err(BuildError::RegionFull { region: name, needed, available });
            }
            Ok(Region { size: needed as u32, ..region })
        };
        let name = match tree.format {
            NodeFormat::Bvh2 => RegionName::Nodes,
            NodeFormat::Quantized(quantization) => {
                quantization.check()?;
                RegionName::QuantizedNodes
            }
            NodeFormat::Wide(_) | NodeFormat::Shared(_) => {
                return Err(ConfigError::RefitFormat.into());
            }
        };
        let nodes = used(tree.nodes, name, tree.node_count, tree.format.bytes())?;
        let entry = LeafEntry::BYTES as u32;
        let table = used(tree.leaf_table, RegionName::LeafTable, tree.entry_count, entry)?;
        let bytes = Triangle::BYTES as u32;
        let triangles = used(triangles, RegionName::Triangles, triangle_count, bytes)?;
        Ok(Self {
            tree,
            nodes: Lines::new(nodes),
            table: Lines::new(table),
            triangles,
            triangle_count,
            nodes_left: tree.node_count,
            entries_left: tree.entry_count,
        })
    }

    /// The pointers of a node.
    fn children<B: Bus>(
        &mut self,
        bus: &mut B,
        index: NodeIndex,
    ) -> Result<[Child; 2], BuildError<B::Error>> {
        let corrupt = BuildError::CorruptNode { index: index.0 };
        let failed = |(addr, error)| BuildError::Bus { stage: Stage::Refit, addr, error };
        self.nodes_left = self.nodes_left.checked_sub(1).ok_or(corrupt)?;
        let children = match self.tree.format {
            NodeFormat::Bvh2 => {
                // A line by itself, and read but once.
                let addr = self.tree.nodes.record(index.0, Bvh2Node::BYTES as u32);
                let addr = addr.filter(|_| index.0 < self.tree.node_count).ok_or(corrupt)?;
                let mut bytes = [0; Bvh2Node::BYTES];
                bus.read(addr, &mut bytes).map_err(|error| failed((addr, error)))?;
                let view = Bvh2View::new(&bytes);
                [view.child(0).ok_or(corrupt)?, view.child(1).ok_or(corrupt)?]
            }
            NodeFormat::Quantized(quantization) => {
                let mut bytes = [0; QuantizedPair::MAX_BYTES];
                let pair = &mut bytes[..quantization.node_bytes() as usize];
                if !self.nodes.read(bus, index.0, pair).map_err(failed)? {
                    return Err(corrupt);
                }
                let view = QuantizedView::new(&bytes, quantization.bits);
                [view.child(0).child, view.child(1).child]
            }
            NodeFormat::Wide(_) | NodeFormat::Shared(_) => {
                return Err(ConfigError::RefitFormat.into());
            }
        };
        // Nodes are written children first.
        let first = |child: &Child| !matches!(child, Child::Inner(child) if *child >= index);
        if children.iter().all(first) { Ok(children) } else { Err(corrupt) }
    }

    /// A leaf with its box and size.
    fn leaf<B: Bus>(
        &mut self,
        bus: &mut B,
        first: u32,
        count: u32,
    ) -> Result<Subtree, BuildError<B::Error>> {
        let mut bounds = Aabb::EMPTY;
        for size in 1..=count.min(MAX_LEAF_SIZE) {
            let entry = first.saturating_add(size - 1);
            let corrupt = BuildError::CorruptLeaf { entry };
            let failed = |(addr, error)| BuildError::Bus { stage: Stage::Refit, addr, error };
            self.entries_left = self.entries_left.checked_sub(1).ok_or(corrupt)?;
            let mut bytes = [0; LeafEntry::BYTES];
            if !self.table.read(bus, entry, &mut bytes).map_err(failed)? {
                return Err(corrupt);
            }
            let LeafEntry { primitive, last } = LeafEntry::from_bytes(bytes);

            let addr = self.triangles.record(primitive.0, Triangle::BYTES as u32);
            let addr = addr.filter(|_| primitive.0 < self.triangle_count).ok_or(corrupt)?;
            let mut bytes = [0; Triangle::BYTES];
            bus.read(addr, &mut bytes).map_err(|error| failed((addr, error)))?;
            let triangle = Triangle::from_bytes(&bytes);
            if !triangle.vertices.iter().all(|&v| Grid::DEFAULT.contains(v)) {
                return Err(BuildError::InvalidPrimitive { index: primitive });
            }
            bounds = bounds.union(&triangle.bounds());
            if last {
                if count != Child::TO_MARK && count != size {
                    return Err(corrupt);
                }
                return Ok(Subtree { bounds, child: Child::Leaf { first, count: size } });
            }
        }
        // No mark where there should be one, or no entry at all.
        Err(BuildError::CorruptLeaf { entry: first })
    }

    /// Fails if parts of the tree were not reached.
    fn check_all_visited<E>(&self) -> Result<(), BuildError<E>> {
        match (self.nodes_left, self.entries_left) {
            (0, 0) => Ok(()),
            (0, _) => Err(BuildError::CorruptLeaf { entry: self.tree.entry_count - 1 }),
            _ => Err(BuildError::CorruptNode { index: self.tree.node_count - 1 }),
        }
    }
}
