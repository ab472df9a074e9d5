//! Well-formedness and quality of trees in memory.

use fixed::FixedU64;
use fixed::types::extra::U32;
use heapless::Vec;

use crate::compress::{Placement, SharedContext};
use crate::emit::MAX_DEPTH;
use crate::geom::{Aabb, Triangle};
use crate::mem::Bus;
use crate::node::{
    Bvh2Node, Bvh2View, Child, LeafEntry, NodeFormat, NodeIndex, Quantization, QuantizedChild,
    QuantizedPair, QuantizedView, SharedNode, SharedWords, Sharing, Subtree, Tree, WideNode,
    WideView,
};
use crate::traverse::{Scene, TraceError};

/// The SAH cost of a tree: UQ32.32, rounded down.
pub type SahCost = FixedU64<U32>;

/// What [`check`] measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Quality {
    /// Half the surface area of the root's box, in square grid units.
    pub root_area: u64,
    /// The sum of the half areas of all inner nodes.
    pub inner_area: u128,
    /// The sum over all leaves of half area times primitives.
    pub leaf_area: u128,
    /// Nodes on the longest way from the root to a leaf.
    pub depth: u32,
    /// Primitives in the largest leaf.
    pub largest_leaf: u32,
}

impl Quality {
    /// The SAH cost with `Ci` = 1.2 for a node, `Cl` = 0 for a leaf and `Ct` = 1 for a triangle (P2
    /// §6): the expected work of a random line through the root's box. Zero if that box has no area.
    pub fn sah_cost(&self) -> SahCost {
        let root = 5 * u128::from(self.root_area);
        // 6/5 and 1; areas are below 2^50 and counts below 2^32, so the shift cannot overflow.
        let sum = 6 * self.inner_area + 5 * self.leaf_area;
        SahCost::from_bits((sum << 32).checked_div(root).unwrap_or(0) as u64)
    }
}

/// Why a tree is not well formed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Malformed<E> {
    /// A node or an entry could not be read or is corrupt by itself.
    Unreadable(TraceError<E>),
    /// A child's box is not inside its parent's.
    ChildOutside {
        /// The parent.
        node: u32,
    },
    /// A primitive's box is not inside its leaf's.
    PrimitiveOutside {
        /// The leaf table entry.
        entry: u32,
    },
    /// A primitive is in two leaves.
    PrimitiveTwice {
        /// The leaf table entry that names it again.
        entry: u32,
    },
    /// Some primitives are in no leaf.
    PrimitivesMissing {
        /// How many.
        count: u32,
    },
    /// Nodes or leaf table entries are not part of the tree.
    Unreached {
        /// How many nodes.
        nodes: u32,
        /// How many entries.
        entries: u32,
    },
    /// `seen` has fewer bits than there are triangles.
    WorkspaceTooSmall,
}

impl<E> From<TraceError<E>> for Malformed<E> {
    fn from(error: TraceError<E>) -> Self {
        Self::Unreadable(error)
    }
}

/// A subtree still to be checked: the box that its parent gives it, and for quantized trees where
/// that puts the local grid.
#[derive(Clone, Copy)]
struct Pending {
    child: Child,
    bounds: Aabb,
    grid: Local,
    depth: u32,
}

/// Where a box is as its children see it.
#[derive(Clone, Copy)]
enum Local {
    Exact,
    Quantized(Placement, Quantization),
    Wide(Placement, Quantization),
    Shared(SharedContext, Sharing),
}

/// Walks a whole tree, checks that each triangle is in exactly one leaf and inside all boxes above
/// it, and measures the tree.
///
/// `seen` is a workspace of one bit a triangle; it is cleared first.
///
/// # Errors
/// The first fault met; see [`Malformed`].
pub fn check<B: Bus>(
    bus: &mut B,
    scene: &Scene,
    seen: &mut [u32],
) -> Result<Quality, Malformed<B::Error>> {
    let tree = &scene.tree;
    if (seen.len() as u64) * 32 < u64::from(scene.triangle_count) {
        return Err(Malformed::WorkspaceTooSmall);
    }
    seen.fill(0);
    let mut quality = Quality::default();
    let (mut nodes_left, mut entries_left) = (tree.node_count, tree.entry_count);
    let mut primitives_left = scene.triangle_count;
    // Three of four children wait for each level of the binary tree, at most.
    let mut stack = Vec::<Pending, { 3 * MAX_DEPTH + 1 }>::new();
    let mut next = match tree.root {
        None => None,
        Some(root) => {
            let corrupt = TraceError::CorruptNode { index: tree.node_count.saturating_sub(1) };
            let local = local(tree, &root).ok_or(corrupt)?;
            let bounds = match &local {
                Local::Exact => root.bounds,
                Local::Quantized(placement, _) | Local::Wide(placement, _) => placement.decoded(),
                Local::Shared(context, _) => context.bounds,
            };
            quality.root_area = bounds.half_area();
            Some(Pending { child: root.child, bounds, grid: local, depth: 1 })
        }
    };
    while let Some(pending) = next {
        match pending.child {
            Child::Inner(NodeIndex(index)) => {
                let corrupt = TraceError::CorruptNode { index };
                // Before anything is read, so that it ends.
                nodes_left = nodes_left.checked_sub(1).ok_or(corrupt)?;
                quality.inner_area += u128::from(pending.bounds.half_area());
                quality.depth = quality.depth.max(pending.depth);
                let (children, records) = read_children(bus, scene, index, &pending)?;
                nodes_left = nodes_left.checked_sub(records - 1).ok_or(corrupt)?;
                for child in children {
                    if !pending.bounds.contains(&child.bounds) {
                        return Err(Malformed::ChildOutside { node: index });
                    }
                    stack.push(child).map_err(|_| corrupt)?;
                }
            }
            Child::Leaf { first, count } => {
                let mut size = 0;
                while size < count {
                    let entry = first.saturating_add(size);
                    let corrupt = TraceError::CorruptLeaf { entry };
                    entries_left = entries_left.checked_sub(1).ok_or(corrupt)?;
                    let (leaf_entry, bounds) = read_entry(bus, scene, entry)?;
                    let index = leaf_entry.primitive.0;
                    let (word, bit) = (index as usize / 32, 1 << (index % 32));
                    if seen[word] & bit != 0 {
                        return Err(Malformed::PrimitiveTwice { entry });
                    }
                    seen[word] |= bit;
                    primitives_left -= 1;
                    if !pending.bounds.contains(&bounds) {
                        return Err(Malformed::PrimitiveOutside { entry });
                    }
                    size += 1;
                    if leaf_entry.last {
                        break;
                    }
                    if size == count {
                        // The mark and the size disagree.
                        return Err(corrupt.into());
                    }
                }
                quality.leaf_area += u128::from(pending.bounds.half_area()) * u128::from(size);
                quality.largest_leaf = quality.largest_leaf.max(size);
            }
        }
        next = stack.pop();
    }
    if nodes_left > 0 || entries_left > 0 {
        return Err(Malformed::Unreached { nodes: nodes_left, entries: entries_left });
    }
    match primitives_left {
        0 => Ok(quality),
        count => Err(Malformed::PrimitivesMissing { count }),
    }
}

/// The root as its children see it, unless its box is off the grid: areas would overflow.
fn local(tree: &Tree, root: &Subtree) -> Option<Local> {
    Some(match tree.format {
        NodeFormat::Bvh2 => {
            Placement::root(&root.bounds, &Quantization::RELATIVE)?;
            Local::Exact
        }
        NodeFormat::Quantized(quantization) => {
            Local::Quantized(Placement::root(&root.bounds, &quantization)?, quantization)
        }
        NodeFormat::Wide(quantization) => {
            Local::Wide(Placement::root(&root.bounds, &quantization)?, quantization)
        }
        NodeFormat::Shared(sharing) => {
            Local::Shared(SharedContext::root(root, tree.entry_count, &sharing)?, sharing)
        }
    })
}

type Children = Vec<Pending, { WideNode::CHILDREN }>;

/// The children of a node, and how many records it has.
fn read_children<B: Bus>(
    bus: &mut B,
    scene: &Scene,
    index: u32,
    parent: &Pending,
) -> Result<(Children, u32), TraceError<B::Error>> {
    let tree = &scene.tree;
    let corrupt = TraceError::CorruptNode { index };
    let mut read = |index: u32, bytes: &mut [u8]| {
        let addr = tree.nodes.record(index, tree.format.bytes());
        let addr = addr.filter(|_| index < tree.node_count).ok_or(corrupt)?;
        bus.read(addr, bytes).map_err(|error| TraceError::Bus { addr, error })
    };
    let depth = parent.depth + 1;
    match &parent.grid {
        Local::Exact => {
            let mut bytes = [0; Bvh2Node::BYTES];
            read(index, &mut bytes)?;
            let node = Bvh2View::new(&bytes).to_repr().ok_or(corrupt)?;
            let pending =
                |Subtree { child, bounds }| Pending { child, bounds, grid: Local::Exact, depth };
            Ok((node.children.map(pending).into_iter().collect(), 1))
        }
        Local::Quantized(placement, quantization) => {
            let mut bytes = [0; QuantizedPair::MAX_BYTES];
            read(index, &mut bytes[..tree.format.bytes() as usize])?;
            let pair = QuantizedView::new(&bytes, quantization.bits).to_repr();
            let grid = |place| Local::Quantized(place, *quantization);
            let decode = |child| decode(placement, quantization, child, grid, depth);
            Ok((pair.children.iter().map(decode).collect::<Option<_>>().ok_or(corrupt)?, 1))
        }
        Local::Wide(placement, quantization) => {
            let mut bytes = [0; WideNode::MAX_BYTES];
            read(index, &mut bytes[..tree.format.bytes() as usize])?;
            let node = WideView::new(&bytes, quantization.bits).to_repr();
            let grid = |place| Local::Wide(place, *quantization);
            let decode = |child| decode(placement, quantization, child, grid, depth);
            let children = node.children.iter().flatten().map(decode);
            Ok((children.collect::<Option<_>>().ok_or(corrupt)?, 1))
        }
        Local::Shared(context, sharing) => {
            let mut words = SharedWords::new();
            while words.is_empty() || SharedNode::is_extended(&words) {
                let mut bytes = [0; SharedNode::WORD_BYTES as usize];
                read(index.checked_sub(words.len() as u32).ok_or(corrupt)?, &mut bytes)?;
                words.push(u64::from_le_bytes(bytes)).map_err(|_| corrupt)?;
            }
            let node = SharedNode::from_words(&words, sharing.grids).ok_or(corrupt)?;
            let children = context.decode(NodeIndex(index), &node, words.len(), sharing);
            let pending = |context: SharedContext| {
                let SharedContext { child, bounds, .. } = context;
                Pending { child, bounds, grid: Local::Shared(context, *sharing), depth }
            };
            let children = children.ok_or(corrupt)?.map(pending);
            Ok((children.into_iter().collect(), words.len() as u32))
        }
    }
}

/// A child of a quantized node, unless it leaves the node's box.
fn decode(
    parent: &Placement,
    quantization: &Quantization,
    child: &QuantizedChild,
    grid: impl Fn(Placement) -> Local,
    depth: u32,
) -> Option<Pending> {
    let cells = parent.context.decode(child, quantization)?;
    let place = parent.child(&cells, quantization);
    Some(Pending { child: child.child, bounds: place.decoded(), grid: grid(place), depth })
}

fn read_entry<B: Bus>(
    bus: &mut B,
    scene: &Scene,
    entry: u32,
) -> Result<(LeafEntry, Aabb), TraceError<B::Error>> {
    let corrupt = TraceError::CorruptLeaf { entry };
    let addr = scene.tree.leaf_table.record(entry, LeafEntry::BYTES as u32);
    let addr = addr.filter(|_| entry < scene.tree.entry_count).ok_or(corrupt)?;
    let mut bytes = [0; LeafEntry::BYTES];
    bus.read(addr, &mut bytes).map_err(|error| TraceError::Bus { addr, error })?;
    let leaf_entry = LeafEntry::from_bytes(bytes);
    let addr = scene.triangles.record(leaf_entry.primitive.0, Triangle::BYTES as u32);
    let in_count = |_: &_| leaf_entry.primitive.0 < scene.triangle_count;
    let addr = addr.filter(in_count).ok_or(corrupt)?;
    let mut bytes = [0; Triangle::BYTES];
    bus.read(addr, &mut bytes).map_err(|error| TraceError::Bus { addr, error })?;
    Ok((leaf_entry, Triangle::from_bytes(&bytes).bounds()))
}
