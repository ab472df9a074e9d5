//! The hierarchy emitter of P1 §4.3 and P2 §5.4, one stack operation at a time.

use heapless::Vec;

use crate::geom::{Aabb, PrimIndex};
use crate::node::{Bvh2Node, Child, LeafEntry, NodeIndex, Subtree};
use crate::probe::Probe;
use crate::sort::Item;

/// The most entries that the stack can hold, and the deepest tree: one for each of 63 Morton bits
/// and one for each of 32 index bits.
///
/// Levels fall strictly from the bottom of the stack to its top, so the stack cannot outgrow their
/// number. In a sorted sequence there is always a split at a higher bit between two splits at one
/// bit; where memory changed behind the sorter's back, equal levels are combined like lower ones.
pub const MAX_DEPTH: usize = 63 + 32;

/// A level of the hierarchy: which bit a split is at. Bits of the leaf counter rank below all bits
/// of the Morton code; the end of the input ranks above.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Level(u8);

impl Level {
    /// The end of the input: above all bits.
    pub const INFINITE: Self = Self(u8::MAX);
    /// Above all bits, below the end.
    const HIGHEST: Self = Self(MAX_DEPTH as u8);

    /// The level of a split that has `below` levels under it, up to [`MAX_DEPTH`].
    pub(crate) const fn split(below: u8) -> Self {
        Self(below)
    }

    /// The level below which `bits` bits at the top of a code of `width` bits differ: the highest
    /// bit that is not among them. With all of them, the levels of the leaf counter remain.
    pub const fn below(bits: u32, width: u32) -> Self {
        let bits = if bits < width { bits } else { width };
        Self((32 + width - bits) as u8 - 1)
    }

    /// The highest bit in which two different Morton codes differ.
    fn of_codes(a: u64, b: u64) -> Self {
        Self((32 + 63 - (a ^ b).leading_zeros()) as u8)
    }

    /// The highest bit in which leaf number `count` differs from the next.
    fn of_leaves(count: u32) -> Self {
        Self((31 - (count ^ count.wrapping_add(1)).leading_zeros()) as u8)
    }
}

/// A subtree that has everything but its place in the tree: an entry of the emitter's stack, and
/// what the emitter hands out above its threshold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cell {
    /// The subtree.
    pub subtree: Subtree,
    /// The level of the split between this subtree and the next one.
    pub level: Level,
    /// Nodes on the longest way down the subtree; 0 for a leaf.
    pub depth: u8,
    /// Primitives in it.
    pub size: u32,
}

impl Cell {
    /// Something to fill a buffer with.
    pub const EMPTY: Self = Self {
        subtree: Subtree { bounds: Aabb::EMPTY, child: Child::Leaf { first: 0, count: 0 } },
        level: Level::INFINITE,
        depth: 0,
        size: 0,
    };

    /// The cell of node number `node` over this cell and the next one, with box `bounds`.
    #[inline(always)]
    fn over(&self, next: &Self, bounds: Aabb, node: u32) -> Self {
        let subtree = Subtree { bounds, child: Child::Inner(NodeIndex(node)) };
        // No deeper than the stack can get, but for unsorted input.
        let depth = self.depth.max(next.depth).saturating_add(1);
        Self { subtree, level: next.level, depth, size: self.size + next.size }
    }

    /// Whether this is a leaf that ends in front of entry `end`: the last one closed, if that is where
    /// the closed ones end, and not one that comes from a buffer.
    fn is_leaf_before(&self, end: u32) -> bool {
        matches!(self.subtree.child, Child::Leaf { first, count } if first + count == end)
    }

    /// The leaf of this leaf and the next one, if it has at most `limit` primitives and does not cost
    /// more than a node over the two, with `Ci` = 1.2 and `Ct` = 1.
    fn join(&self, next: &Self, bounds: Aabb, limit: u32) -> Option<Self> {
        let size = self.size + next.size;
        let (Child::Leaf { first, .. }, Child::Leaf { .. }) =
            (self.subtree.child, next.subtree.child)
        else {
            return None;
        };
        let cost = |bounds: &Aabb, size: u32| u128::from(bounds.half_area()) * u128::from(size);
        let (left, right) = (&self.subtree.bounds, &next.subtree.bounds);
        let apart = 6 * u128::from(bounds.half_area())
            + 5 * (cost(left, self.size) + cost(right, next.size));
        let joined = size <= limit && 5 * cost(&bounds, size) <= apart;
        let child = Child::Leaf { first, count: size };
        joined.then_some(Self { subtree: Subtree { bounds, child }, size, ..*next })
    }
}

/// What [`Emitter::step`] did.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// Nothing: the emitter waits for input.
    Idle,
    /// A subtree was pushed on the stack.
    Push,
    /// The stack was popped and this node completed; its index is the number of nodes before it.
    Node(Bvh2Node),
    /// The stack was popped and its leaf joined to the pending one. The mark between them is to be
    /// taken from the leaf table: it is on the entry in front of the last `entries` ones.
    JoinLeaves {
        /// Primitives of the second leaf, fewer than the joined leaf may have.
        entries: u32,
    },
    /// The stack is empty and this subtree is not to be joined to the next one, as the split between
    /// them is above the threshold. [`Emitter::resume`] takes it back.
    Cell(Cell),
    /// The input has ended and this is the whole tree.
    Root(Subtree),
}

/// The emitter's state machine.
///
/// Alternate: while [`Emitter::is_ready`], feed it with [`Emitter::accept`]; otherwise let it
/// [`Emitter::step`]. After the last primitive call [`Emitter::finish`] and step until
/// [`Step::Root`].
///
/// Consecutive primitives with equal codes share a leaf (P2 Algorithm 1, lines 4–8) up to the
/// largest leaf size. A longer run becomes several leaves, split by the bits of their running
/// number, which gives a balanced subtree; a largest leaf size of 1 is the variant of P1 §4.3.
///
/// Two slips of the printed algorithm are corrected: lines 4–8 overwrite `input` before its box is
/// combined, which loses a primitive (here the open leaf's box grows by each one); and the last
/// split has level infinity, so that the stack empties.
///
/// With a threshold ([`Emitter::with_threshold`]; P2 Algorithm 1, lines 15–19) only splits up to it
/// are made, and the subtrees between higher ones come out as cells, the last one too.
#[derive(Clone, Debug)]
pub struct Emitter {
    stack: Vec<Cell, MAX_DEPTH>,
    max_leaf_size: u32,
    /// Leaves are joined up to this size where that is cheaper than a node; 0 or 1 for never.
    join_leaves: u32,
    /// The highest level that subtrees are joined at; without a threshold, the highest that exists.
    threshold: Level,
    cells: bool,
    open: Option<OpenLeaf>,
    pending: Option<Cell>,
    /// Primitives accepted.
    entries: u32,
    leaves: u32,
    nodes: u32,
}

/// The leaf that the last primitive went into; it may still grow.
#[derive(Clone, Copy, Debug)]
struct OpenLeaf {
    code: u64,
    subtree: Subtree,
    size: u32,
    last: PrimIndex,
}

impl Emitter {
    /// An emitter for leaves of at most `max_leaf_size` primitives (0 counts as 1).
    pub const fn new(max_leaf_size: u32) -> Self {
        let max_leaf_size = if max_leaf_size == 0 { 1 } else { max_leaf_size };
        Self {
            stack: Vec::new(),
            max_leaf_size,
            join_leaves: 0,
            threshold: Level::HIGHEST,
            cells: false,
            open: None,
            pending: None,
            entries: 0,
            leaves: 0,
            nodes: 0,
        }
    }

    /// An emitter that joins subtrees at splits up to `threshold` and hands out what is between
    /// higher ones.
    pub const fn with_threshold(max_leaf_size: u32, threshold: Level) -> Self {
        let mut emitter = Self::new(max_leaf_size);
        emitter.threshold = threshold;
        emitter.cells = true;
        emitter
    }

    /// Joins neighbouring leaves, up to `size` primitives and the largest leaf size, where a leaf costs
    /// no more than a node over two.
    pub fn join_leaves(&mut self, size: u32) {
        self.join_leaves = size.min(self.max_leaf_size);
    }

    /// Raises the threshold; a lower one than before is ignored. Cells that came out before may be
    /// [resumed](Emitter::resume) from the first one on.
    pub fn raise_threshold(&mut self, threshold: Level) {
        self.threshold = self.threshold.max(threshold);
    }

    /// Drops the threshold and leaves leaves as they are: from now on all that is
    /// [resumed](Emitter::resume) is joined, to one root. The order of cells may have changed.
    pub fn join_cells(&mut self) {
        self.threshold = Level::HIGHEST;
        self.cells = false;
        self.join_leaves = 0;
    }

    /// Takes back a cell, as the subtree after those on the stack. Call only when
    /// [`Emitter::is_ready`]; otherwise the cell is given back in `Err`.
    ///
    /// # Errors
    /// The cell, when the emitter is not ready; its state is unchanged.
    pub fn resume(&mut self, cell: Cell) -> Result<(), Cell> {
        if !self.is_ready() {
            return Err(cell);
        }
        self.pending = Some(cell);
        Ok(())
    }

    /// Whether [`Emitter::accept`] may be called: no subtree waits for a stack operation.
    #[inline]
    pub const fn is_ready(&self) -> bool {
        self.pending.is_none()
    }

    /// Nodes completed so far.
    pub const fn nodes(&self) -> u32 {
        self.nodes
    }

    /// Leaves completed so far.
    pub const fn leaves(&self) -> u32 {
        self.leaves
    }

    /// Takes the next primitive in order and returns the leaf table entry of the one before it.
    /// Call only when [`Emitter::is_ready`]; otherwise the primitive is given back in `Err`.
    ///
    /// # Errors
    /// The item, when the emitter is not ready; its state is unchanged.
    #[inline]
    pub fn accept<P: Probe>(
        &mut self,
        item: &Item,
        probe: &mut P,
    ) -> Result<Option<LeafEntry>, Item> {
        if !self.is_ready() {
            return Err(*item);
        }
        let (entry, closed) = self.next(item, probe);
        self.pending = closed;
        Ok(entry)
    }

    /// Takes the next primitive; returns the leaf table entry of the one before it and the leaf that
    /// thereby closed, which waits for its stack operations.
    #[inline(always)]
    pub(crate) fn next<P: Probe>(
        &mut self,
        item: &Item,
        probe: &mut P,
    ) -> (Option<LeafEntry>, Option<Cell>) {
        let primitive = PrimIndex(item.reference);
        let result = match &mut self.open {
            Some(leaf) if leaf.code == item.code && leaf.size < self.max_leaf_size => {
                probe.emit_extend_leaf();
                let entry = LeafEntry { primitive: leaf.last, last: false };
                leaf.size += 1;
                leaf.subtree.bounds = leaf.subtree.bounds.union(&item.bounds);
                leaf.last = primitive;
                (Some(entry), None)
            }
            _ => {
                let closed = self.close(|code, leaves| match code == item.code {
                    true => Level::of_leaves(leaves),
                    false => Level::of_codes(code, item.code),
                });
                let child = Child::Leaf { first: self.entries, count: 0 };
                self.open = Some(OpenLeaf {
                    code: item.code,
                    subtree: Subtree { bounds: item.bounds, child },
                    size: 1,
                    last: primitive,
                });
                closed.unzip()
            }
        };
        self.entries += 1;
        result
    }

    /// Ends the input and returns the last leaf table entry, or `None` if there is none or the
    /// emitter is not ready.
    pub fn finish(&mut self) -> Option<LeafEntry> {
        if !self.is_ready() {
            return None;
        }
        let (entry, closed) = self.close(|_, _| Level::INFINITE)?;
        self.pending = Some(closed);
        Some(entry)
    }

    /// Primitives in closed leaves.
    fn closed(&self) -> u32 {
        self.entries - self.open.map_or(0, |leaf| leaf.size)
    }

    /// Closes the open leaf, if any, with the level of the split after it.
    #[inline(always)]
    fn close(&mut self, level: impl FnOnce(u64, u32) -> Level) -> Option<(LeafEntry, Cell)> {
        let OpenLeaf { code, mut subtree, size, last } = self.open.take()?;
        if let Child::Leaf { count, .. } = &mut subtree.child {
            *count = size;
        }
        let cell = Cell { subtree, level: level(code, self.leaves), depth: 0, size };
        self.leaves += 1;
        Some((LeafEntry { primitive: last, last: true }, cell))
    }

    /// Whether all that comes out are nodes and the root: no cells, and no leaves to join.
    #[inline]
    pub const fn is_plain(&self) -> bool {
        !self.cells && self.join_leaves <= 1
    }

    /// Does all stack operations on the subtree that [`Emitter::next`] closed, as one
    /// [`Emitter::step`] after the other does them in a [plain](Emitter::is_plain) emitter; `write`
    /// receives the children of each node.
    ///
    /// # Errors
    /// Those of `write`; the emitter must then be given up.
    #[inline(always)]
    pub(crate) fn settle<P: Probe, E>(
        &mut self,
        mut pending: Cell,
        probe: &mut P,
        mut write: impl FnMut(&Subtree, &Subtree) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some(top) = self.stack.last()
            && top.level <= pending.level
        {
            probe.emit_node();
            probe.built_node([&top.subtree, &pending.subtree]);
            write(&top.subtree, &pending.subtree)?;
            let bounds = top.subtree.bounds.union(&pending.subtree.bounds);
            pending = top.over(&pending, bounds, self.nodes);
            self.stack.pop();
            self.nodes += 1;
        }
        self.push(pending, probe);
        Ok(())
    }

    #[inline(always)]
    fn push<P: Probe>(&mut self, cell: Cell, probe: &mut P) {
        // Cannot be full: see MAX_DEPTH.
        let pushed = self.stack.push(cell).is_ok();
        debug_assert!(pushed, "levels on the stack are distinct");
        probe.emit_push(self.stack.len());
    }

    /// Does one stack operation: combines the pending subtree with the top of the stack, or pushes
    /// it.
    #[inline]
    pub fn step<P: Probe>(&mut self, probe: &mut P) -> Step {
        let Some(pending) = self.pending else { return Step::Idle };
        if let Some(top) = self.stack.last()
            && top.level <= pending.level
        {
            let bounds = top.subtree.bounds.union(&pending.subtree.bounds);
            if self.join_leaves > 1
                && pending.is_leaf_before(self.closed())
                && let Some(joined) = top.join(&pending, bounds, self.join_leaves)
            {
                self.stack.pop();
                self.leaves -= 1;
                self.pending = Some(joined);
                return Step::JoinLeaves { entries: pending.size };
            }
            let node = Bvh2Node { children: [top.subtree, pending.subtree] };
            self.pending = Some(top.over(&pending, bounds, self.nodes));
            self.stack.pop();
            self.nodes += 1;
            probe.emit_node();
            return Step::Node(node);
        }
        self.pending = None;
        if pending.level > self.threshold {
            return if self.cells { Step::Cell(pending) } else { Step::Root(pending.subtree) };
        }
        self.push(pending, probe);
        Step::Push
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::IVec3;

    type Leaves = Vec<(u32, u32), 32>;
    type Nodes = Vec<[(u32, u32); 2], 32>;

    /// Runs the emitter over codes and writes each node as the pair of its children's primitive
    /// ranges, and the leaf table's marks.
    fn emit(codes: &[u64], max_leaf: u32) -> (Nodes, Leaves, Option<Subtree>) {
        let mut emitter = Emitter::new(max_leaf);
        let (mut nodes, mut ranges) = (Vec::<_, 32>::new(), Vec::<(u32, u32), 32>::new());
        let (mut table, mut root) = (Leaves::new(), None);
        let mut run = |emitter: &mut Emitter| {
            while !emitter.is_ready() {
                match emitter.step(&mut ()) {
                    Step::Node(node) => {
                        let range = node.children.map(|c| match c.child {
                            Child::Leaf { first, count } => (first, first + count),
                            Child::Inner(NodeIndex(i)) => ranges[i as usize],
                        });
                        assert_eq!(range[0].1, range[1].0, "children are neighbours");
                        ranges.push((range[0].0, range[1].1)).unwrap();
                        nodes.push(range).unwrap();
                    }
                    Step::Root(subtree) => root = Some(subtree),
                    Step::JoinLeaves { .. } | Step::Push | Step::Cell(_) | Step::Idle => {}
                }
            }
        };
        let mut note = |entry: Option<LeafEntry>| {
            if let Some(LeafEntry { primitive, last }) = entry {
                table.push((primitive.0, u32::from(last))).unwrap();
            }
        };
        for (i, &code) in codes.iter().enumerate() {
            let p = IVec3::splat(i as i32);
            let item = Item { code, bounds: Aabb::new(p, p), reference: i as u32 };
            note(emitter.accept(&item, &mut ()).unwrap());
            run(&mut emitter);
        }
        note(emitter.finish());
        run(&mut emitter);
        (nodes, table, root)
    }

    #[test]
    fn the_example_of_p2_figure_5() {
        // Six primitives a..f in 4-bit codes; d and e share one.
        let (nodes, table, root) = emit(&[0b0000, 0b0100, 0b0101, 0b1000, 0b1000, 0b1010], 255);
        let expect = [
            [(1, 2), (2, 3)], // A: b c
            [(0, 1), (1, 3)], // B: a A
            [(3, 5), (5, 6)], // C: (d e) f
            [(0, 3), (3, 6)], // D: B C, the root
        ];
        assert_eq!(nodes.as_slice(), expect);
        let marks = [(0, 1), (1, 1), (2, 1), (3, 0), (4, 1), (5, 1)];
        assert_eq!(table.as_slice(), marks);
        let root = root.unwrap();
        assert_eq!(root.child, Child::Inner(NodeIndex(3)));
        assert_eq!(root.bounds, Aabb::new(IVec3::ZERO, IVec3::splat(5)));
    }

    #[test]
    fn no_input_is_no_tree_and_one_primitive_is_a_leaf() {
        assert_eq!(emit(&[], 255), (Vec::new(), Leaves::new(), None));
        let (nodes, table, root) = emit(&[9], 255);
        assert!(nodes.is_empty());
        assert_eq!(table.as_slice(), [(0, 1)]);
        assert_eq!(root.unwrap().child, Child::Leaf { first: 0, count: 1 });
    }

    #[test]
    fn a_run_of_equal_codes_over_the_leaf_size_splits_into_a_balanced_subtree() {
        let (nodes, _, _) = emit(&[7; 8], 1);
        let expect = [
            [(0, 1), (1, 2)],
            [(2, 3), (3, 4)],
            [(0, 2), (2, 4)],
            [(4, 5), (5, 6)],
            [(6, 7), (7, 8)],
            [(4, 6), (6, 8)],
            [(0, 4), (4, 8)],
        ];
        assert_eq!(nodes.as_slice(), expect);
        let (nodes, table, _) = emit(&[7; 8], 3);
        assert_eq!(nodes.as_slice(), [[(0, 3), (3, 6)], [(0, 6), (6, 8)]]);
        assert_eq!(table.iter().filter(|(_, last)| *last == 1).count(), 3);
    }

    #[test]
    fn a_busy_emitter_gives_the_primitive_back_unchanged() {
        let mut emitter = Emitter::new(255);
        let item = |code| Item { code, ..Item::ZERO };
        emitter.accept(&item(0), &mut ()).unwrap();
        emitter.accept(&item(1), &mut ()).unwrap();
        assert!(!emitter.is_ready());
        assert_eq!(emitter.accept(&item(2), &mut ()), Err(item(2)));
        assert_eq!(emitter.finish(), None);
        assert_eq!(emitter.step(&mut ()), Step::Push);
        assert!(emitter.is_ready());
    }

    #[test]
    fn leaves_are_joined_where_that_is_cheaper_and_up_to_the_limit() {
        // Codes one apart, but boxes alike: a leaf of all costs no more than any node.
        let run = |limit, boxes: &dyn Fn(i32) -> Aabb| {
            let mut emitter = Emitter::new(255);
            emitter.join_leaves(limit);
            let (mut nodes, mut unmarked) = (0, Vec::<u32, 8>::new());
            for i in 0..=8u32 {
                let item = Item { code: i.into(), bounds: boxes(i as i32), reference: i };
                let _ = if i < 8 { emitter.accept(&item, &mut ()) } else { Ok(emitter.finish()) };
                while !emitter.is_ready() {
                    match emitter.step(&mut ()) {
                        Step::Node(_) => nodes += 1,
                        Step::JoinLeaves { entries } => unmarked.push(entries).unwrap(),
                        _ => {}
                    }
                }
            }
            (nodes, emitter.leaves(), unmarked.into_iter().collect::<Vec<_, 8>>())
        };
        let alike = |_| Aabb::new(IVec3::ZERO, IVec3::ONE);
        let (nodes, leaves, unmarked) = run(4, &alike);
        assert_eq!((nodes, leaves), (1, 2));
        assert_eq!(unmarked.as_slice(), [1, 1, 2, 1, 1, 2]);
        let (nodes, leaves, unmarked) = run(8, &alike);
        assert_eq!((nodes, leaves, unmarked.last()), (0, 1, Some(&4)));
        assert_eq!(run(0, &alike).0, 7);
        let apart = |i| Aabb::new(IVec3::splat(10 * i), IVec3::splat(10 * i + 1));
        assert_eq!(run(8, &apart).0, 7);
    }
}
