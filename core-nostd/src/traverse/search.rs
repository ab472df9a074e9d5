//! The search loop: ordered depth-first descent with a bounded stack.

use heapless::Vec;

use super::slab::Slabs;
use super::{Hit, Query, Scene, TraceError};
use crate::error::RegionName;
use crate::geom::{Intersection, PrimIndex, Ray, Triangle};
use crate::mem::{Bus, Region};
use crate::node::{Child, LeafEntry, NodeIndex, Subtree};
use crate::num::Grid;
use crate::probe::Probe;

/// A node format as the search sees it: nodes of up to `N` children.
pub(super) trait Traversable<const N: usize> {
    /// What must be known of a node to test its children.
    type Context: Copy;
    /// A node's bytes.
    type Bytes: AsMut<[u8]> + AsRef<[u8]>;
    /// A buffer for a node.
    const EMPTY: Self::Bytes;

    /// The context of the root, whose exact box the ray enters at `entry`, or `None` if that box is
    /// off the grid.
    fn root(&self, ray: &Ray, root: &Subtree, entry: i64) -> Option<Self::Context>;

    /// Whether the record before the `have` bytes at hand, as long as the first, is a part of the node.
    #[inline(always)]
    fn more(&self, _bytes: &Self::Bytes, _have: usize) -> bool {
        false
    }

    /// The children whose boxes the ray passes, within `t <= t_max`, or `None` if the node is
    /// corrupt.
    fn children(
        &self,
        ray: &Ray,
        bytes: &Self::Bytes,
        context: &Self::Context,
        t_max: i64,
    ) -> Option<[Option<Pending<Self::Context>>; N]>;

    /// How many children the node has, each with a box to test.
    #[inline(always)]
    fn boxes(&self, _bytes: &Self::Bytes) -> usize {
        N
    }
}

/// A subtree that is still to be searched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pending<C> {
    pub child: Child,
    /// When the ray enters its box, rounded down, in units of 2⁻⁶.
    pub entry: i64,
    pub context: C,
}

/// The best hit so far.
struct Best {
    t_max: i64,
    hit: Option<(PrimIndex, Intersection)>,
}

impl Best {
    fn into_hit(self) -> Option<Hit> {
        self.hit.map(|(primitive, at)| Hit::new(primitive, &at))
    }
}

/// Finds the answer to `query`. See [`super::trace`] for the contract.
///
/// Children that are hit are searched in the order in which the ray enters them, on a tie in that of
/// the node; at most `D` subtrees wait. Nodes and leaf entries are counted: a tree holds each once, so exceeding the
/// count proves that memory is corrupt and bounds the work.
pub(super) fn search<const N: usize, const D: usize, F: Traversable<N>, B: Bus, P: Probe>(
    format: &F,
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    probe: &mut P,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    let tree = &scene.tree;
    let Some(root) = tree.root else { return Ok(None) };
    let mut best = Best { t_max: ray.t_max().to_bits(), hit: None };
    let t_min = ray.t_min().to_bits();
    if t_min >= best.t_max {
        return Ok(None);
    }
    let root_corrupt = TraceError::CorruptNode { index: tree.node_count.saturating_sub(1) };
    // The descriptor has the exact box, whatever the format; rays that leave a scene from its hull
    // need not enter the wider one.
    probe.box_test();
    let slabs = Slabs::new(ray, &root.bounds);
    let Some(entry) = slabs.entry(ray, t_min, best.t_max) else { return Ok(None) };
    let context = format.root(ray, &root, entry).ok_or(root_corrupt)?;

    let stride = tree.format.bytes();
    // No more than the regions have room for, however wild the counts; but one more, so that a region
    // that is too small is reported as such.
    let room = |region: Region, stride: u32| region.size / stride + 1;
    let mut nodes_left = tree.node_count.min(room(tree.nodes, stride));
    let mut entries_left = tree.entry_count.min(room(tree.leaf_table, LeafEntry::BYTES as u32));
    let mut stack = Vec::<Pending<F::Context>, D>::new();
    let mut next = Some(Pending { child: root.child, entry, context });
    let mut bytes = F::EMPTY;
    while let Some(Pending { child, entry, context }) = next.take() {
        if entry <= best.t_max {
            match child {
                Child::Leaf { first, count } => {
                    let run = Run { first, count, left: &mut entries_left };
                    let done = search_leaf(bus, scene, ray, query, run, &mut best, probe)?;
                    if done {
                        return Ok(best.into_hit());
                    }
                }
                Child::Inner(NodeIndex(index)) => {
                    let corrupt = TraceError::CorruptNode { index };
                    if index >= tree.node_count || nodes_left == 0 {
                        return Err(corrupt);
                    }
                    nodes_left -= 1;
                    let outside = TraceError::OutOfRegion { region: region_name(stride) };
                    let addr = tree.nodes.record(index, stride).ok_or(outside)?;
                    bus.read(addr, &mut bytes.as_mut()[..stride as usize])
                        .map_err(|error| TraceError::Bus { addr, error })?;
                    probe.node_fetch(addr, stride);
                    let mut have = stride as usize;
                    while format.more(&bytes, have) {
                        let before = index.checked_sub(have as u32 / stride).ok_or(corrupt)?;
                        let addr = tree.nodes.record(before, stride).ok_or(outside)?;
                        let part = bytes.as_mut().get_mut(have..have + stride as usize);
                        bus.read(addr, part.ok_or(corrupt)?)
                            .map_err(|error| TraceError::Bus { addr, error })?;
                        probe.node_fetch(addr, stride);
                        have += stride as usize;
                    }
                    let children = format.children(ray, &bytes, &context, best.t_max);
                    let mut children = children.ok_or(corrupt)?;
                    for _ in 0..format.boxes(&bytes) {
                        probe.box_test();
                    }
                    order(&mut children);
                    for far in children[1..].iter().rev().flatten() {
                        stack.push(*far).map_err(|_| corrupt)?;
                        probe.stack_push(stack.len());
                    }
                    next = children[0];
                }
            }
        }
        if next.is_none() {
            next = stack.pop();
            if next.is_some() {
                probe.stack_pop();
            }
        }
    }
    Ok(best.into_hit())
}

/// Puts the child that is entered first in front, and those that are missed last.
#[inline(always)]
fn order<C: Copy, const N: usize>(children: &mut [Option<Pending<C>>; N]) {
    for end in 1..N {
        for at in (0..end).rev() {
            let after = match (&children[at], &children[at + 1]) {
                (Some(a), Some(b)) => a.entry > b.entry,
                (first, second) => first.is_none() && second.is_some(),
            };
            if !after {
                break;
            }
            children.swap(at, at + 1);
        }
    }
}

/// Which region holds nodes of this size.
const fn region_name(stride: u32) -> RegionName {
    if stride == 64 { RegionName::Nodes } else { RegionName::QuantizedNodes }
}

/// A leaf: a run of leaf table entries, and how many entries may still be visited.
struct Run<'a> {
    first: u32,
    count: u32,
    left: &'a mut u32,
}

/// Tests the triangles of a leaf; returns whether the query is answered.
#[inline]
fn search_leaf<B: Bus, P: Probe>(
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    run: Run<'_>,
    best: &mut Best,
    probe: &mut P,
) -> Result<bool, TraceError<B::Error>> {
    let table = scene.tree.leaf_table;
    let failed = |addr| move |error| TraceError::Bus { addr, error };
    for i in 0..run.count {
        let entry = run.first.saturating_add(i);
        if entry >= scene.tree.entry_count || *run.left == 0 {
            return Err(TraceError::CorruptLeaf { entry });
        }
        *run.left -= 1;
        let outside = TraceError::OutOfRegion { region: RegionName::LeafTable };
        let addr = table.record(entry, LeafEntry::BYTES as u32).ok_or(outside)?;
        let mut bytes = [0; LeafEntry::BYTES];
        bus.read(addr, &mut bytes).map_err(failed(addr))?;
        let LeafEntry { primitive, last } = LeafEntry::from_bytes(bytes);

        if primitive.0 >= scene.triangle_count {
            return Err(TraceError::CorruptLeaf { entry });
        }
        let outside = TraceError::OutOfRegion { region: RegionName::Triangles };
        let addr = scene.triangles.record(primitive.0, Triangle::BYTES as u32).ok_or(outside)?;
        let mut bytes = [0; Triangle::BYTES];
        bus.read(addr, &mut bytes).map_err(failed(addr))?;
        let triangle = Triangle::from_bytes(&bytes);
        if !triangle.vertices.iter().all(|&v| Grid::DEFAULT.contains(v)) {
            return Err(TraceError::CorruptTriangle { primitive });
        }
        probe.triangle_test();
        let t_max = crate::num::Time::from_bits(best.t_max);
        if let Some(at) = triangle.intersect(ray, t_max) {
            // Not later than the best so far; on a tie the lower index wins.
            let t = at.t.to_bits();
            let wins = best.hit.is_none_or(|(holder, _)| t < best.t_max || primitive < holder);
            if wins {
                probe.best_hit();
                *best = Best { t_max: t, hit: Some((primitive, at)) };
            }
            if query == Query::Any {
                return Ok(true);
            }
        }
        if last {
            break;
        }
    }
    Ok(false)
}
