//! Clusters, and what becomes of two of them.

use super::super::MAX_DEPTH;
use crate::geom::Aabb;
use crate::node::{Bvh2Node, Child, NodeIndex, Subtree};
use crate::num::Grid;
use crate::probe::Probe;
use crate::sort::Item;

/// The largest leaf that merges make, in primitives.
pub const MAX_OPEN_LEAF: usize = 4;

/// The top bit of both words of a record: an open leaf, and a second primitive in it. References
/// have 31 bits.
const OPEN: u32 = 1 << 31;

/// Where a chain puts what it finishes.
pub trait Port {
    /// Why it could not be put there.
    type Error;

    /// Writes the entries of a leaf and returns the index of the first.
    ///
    /// # Errors
    /// The port's own.
    fn leaf(&mut self, references: &[u32]) -> Result<u32, Self::Error>;

    /// Writes a node and returns its index.
    ///
    /// # Errors
    /// The port's own.
    fn node<P: Probe>(&mut self, node: &Bvh2Node, probe: &mut P) -> Result<NodeIndex, Self::Error>;

    /// Appends a cluster that has a record to the list of the next pass.
    ///
    /// # Errors
    /// The port's own.
    fn cluster(&mut self, cluster: &Cluster) -> Result<(), Self::Error>;
}

/// A subtree that waits for its sibling.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cluster {
    bounds: Aabb,
    content: Content,
    /// Nodes on the longest way down.
    depth: u8,
    /// How many clusters of this pass's list it holds; 255 stands for that many and more.
    weight: u8,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Content {
    /// A leaf whose entries are not written yet.
    Open { references: [u32; MAX_OPEN_LEAF], count: u8 },
    /// A subtree in memory.
    Closed(Child),
}

impl Cluster {
    /// A filler for storage.
    pub(super) const ZERO: Self = Self {
        bounds: Item::ZERO.bounds,
        content: Content::Closed(Child::Inner(NodeIndex(0))),
        depth: 0,
        weight: 0,
    };

    /// An open leaf of one primitive.
    #[inline]
    pub fn of_primitive(item: &Item) -> Self {
        let mut references = [0; MAX_OPEN_LEAF];
        references[0] = item.reference;
        Self {
            bounds: item.bounds,
            content: Content::Open { references, count: 1 },
            depth: 0,
            weight: 1,
        }
    }

    /// The box.
    #[inline]
    pub const fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Nodes on the longest way down.
    #[inline]
    pub const fn depth(&self) -> u8 {
        self.depth
    }

    #[inline]
    pub(super) const fn weight(&self) -> u8 {
        self.weight
    }

    /// The record of a list, or `None` for an open leaf of more than two primitives.
    ///
    /// 32 bytes in memory, the box and two words:
    ///
    /// |            | reference                | code                                        |
    /// |------------|--------------------------|---------------------------------------------|
    /// | node       | its index                | bits 0..8 zero, 8..16 its depth             |
    /// | leaf       | its first entry          | bits 0..8 its size, 8..16 zero              |
    /// | one open   | the primitive            | bit 31                                      |
    /// | two open   | the first, bit 31        | the second, bit 31                          |
    pub fn to_record(&self) -> Option<Item> {
        let (reference, code) = match self.content {
            Content::Closed(Child::Inner(NodeIndex(index))) => (index, u32::from(self.depth) << 8),
            Content::Closed(Child::Leaf { first, count }) => (first, count),
            Content::Open { references: [only, ..], count: 1 } => (only, OPEN),
            Content::Open { references: [a, b, ..], count: 2 } => (a | OPEN, b | OPEN),
            Content::Open { .. } => return None,
        };
        Some(Item { code: code.into(), bounds: self.bounds, reference })
    }

    /// The cluster of a record, or `None` if it is not one that an emitter on `grid` writes.
    pub fn from_record(record: &Item, grid: &Grid) -> Option<Self> {
        let Item { code, bounds, reference } = *record;
        let code = u32::try_from(code).ok()?;
        let (size, depth, rest) = (code & 0xff, (code >> 8) as u8, code >> 16);
        let pair = reference & OPEN != 0;
        let (content, depth) = match code & OPEN != 0 {
            true if pair || code == OPEN => {
                let references = [reference & !OPEN, code & !OPEN, 0, 0];
                (Content::Open { references, count: 1 + u8::from(pair) }, 0)
            }
            false if size == 0 && depth > 0 && usize::from(depth) <= MAX_DEPTH && rest == 0 => {
                (Content::Closed(Child::Inner(NodeIndex(reference))), depth)
            }
            false if size > 0 && depth == 0 && rest == 0 => {
                (Content::Closed(Child::Leaf { first: reference, count: size }), 0)
            }
            _ => return None,
        };
        let on_grid = grid.contains(bounds.min) && grid.contains(bounds.max);
        let sound = on_grid && bounds.is_valid();
        sound.then_some(Self { bounds, content, depth, weight: 1 })
    }

    /// The cluster as it goes into a list: a leaf that no record can hold is closed.
    #[inline]
    pub(super) fn settle<O: Port, P: Probe>(
        self,
        port: &mut O,
        probe: &mut P,
    ) -> Result<Self, O::Error> {
        let content = match self.content {
            Content::Open { count: 3.., .. } => Content::Closed(self.close(port, probe)?.child),
            content => content,
        };
        Ok(Self { content, weight: 1, ..self })
    }

    /// The smallest depth of a node over both; a merged leaf has none.
    #[inline]
    pub(super) const fn joint_depth(&self, other: &Self) -> u8 {
        1 + if self.depth > other.depth { self.depth } else { other.depth }
    }

    /// Merges two clusters of one list, the earlier one first: into one open leaf if that costs no
    /// more, else into a node over both.
    #[inline]
    pub(super) fn merge<O: Port, P: Probe>(
        self,
        other: Self,
        max_leaf_size: u32,
        port: &mut O,
        probe: &mut P,
    ) -> Result<Self, O::Error> {
        let bounds = self.bounds.union(&other.bounds);
        let weight = self.weight.saturating_add(other.weight);
        if let Some(content) = self.joint_leaf(&other, &bounds, max_leaf_size) {
            probe.emit_extend_leaf();
            return Ok(Self { bounds, content, depth: 0, weight });
        }
        let depth = self.joint_depth(&other);
        let children = [self.close(port, probe)?, other.close(port, probe)?];
        let index = port.node(&Bvh2Node { children }, probe)?;
        probe.emit_node();
        Ok(Self { bounds, content: Content::Closed(Child::Inner(index)), depth, weight })
    }

    /// Both as one leaf, if they are open, few enough, and cheaper so.
    fn joint_leaf(&self, other: &Self, bounds: &Aabb, max_leaf_size: u32) -> Option<Content> {
        let Content::Open { mut references, count } = self.content else { return None };
        let Content::Open { references: more, count: added } = other.content else { return None };
        let size = count + added;
        if usize::from(size) > MAX_OPEN_LEAF || u32::from(size) > max_leaf_size {
            return None;
        }
        // In fifths; areas are below 2^50.
        let cost = |n: u8, aabb: &Aabb| 5 * u64::from(n) * aabb.half_area();
        let node = 6 * bounds.half_area();
        if cost(size, bounds) > node + cost(count, &self.bounds) + cost(added, &other.bounds) {
            return None;
        }
        for (to, from) in references.iter_mut().skip(count.into()).zip(more) {
            *to = from;
        }
        Some(Content::Open { references, count: size })
    }

    /// The subtree; writes the entries of an open leaf.
    ///
    /// # Errors
    /// The port's own.
    #[inline]
    pub fn close<O: Port, P: Probe>(
        self,
        port: &mut O,
        probe: &mut P,
    ) -> Result<Subtree, O::Error> {
        let child = match self.content {
            Content::Closed(child) => child,
            Content::Open { references, count } => {
                let first = port.leaf(references.get(..count.into()).unwrap_or(&references))?;
                probe.ploc_leaf(count.into());
                Child::Leaf { first, count: count.into() }
            }
        };
        Ok(Subtree { bounds: self.bounds, child })
    }
}
