//! The hierarchy emitter of P1 §4.3 and P2 §5.4, one stack operation at a time.

use heapless::Vec;

use crate::geom::PrimIndex;
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
struct Level(u8);

impl Level {
    const INFINITE: Self = Self(u8::MAX);

    /// The highest bit in which two different Morton codes differ.
    fn of_codes(a: u64, b: u64) -> Self {
        Self((32 + 63 - (a ^ b).leading_zeros()) as u8)
    }

    /// The highest bit in which leaf number `count` differs from the next.
    fn of_leaves(count: u32) -> Self {
        Self((31 - (count ^ count.wrapping_add(1)).leading_zeros()) as u8)
    }
}

/// A stack entry: a subtree that waits for its right sibling, and the level of the split.
#[derive(Clone, Copy, Debug)]
struct Entry {
    subtree: Subtree,
    level: Level,
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
#[derive(Debug)]
pub struct Emitter {
    stack: Vec<Entry, MAX_DEPTH>,
    max_leaf_size: u32,
    open: Option<OpenLeaf>,
    pending: Option<Entry>,
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
            open: None,
            pending: None,
            entries: 0,
            leaves: 0,
            nodes: 0,
        }
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
        let primitive = PrimIndex(item.reference);
        let entry = match &mut self.open {
            Some(leaf) if leaf.code == item.code && leaf.size < self.max_leaf_size => {
                probe.emit_extend_leaf();
                let entry = LeafEntry { primitive: leaf.last, last: false };
                leaf.size += 1;
                leaf.subtree.bounds = leaf.subtree.bounds.union(&item.bounds);
                leaf.last = primitive;
                Some(entry)
            }
            _ => {
                let entry = self.close(|code, leaves| match code == item.code {
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
                entry
            }
        };
        self.entries += 1;
        Ok(entry)
    }

    /// Ends the input and returns the last leaf table entry, or `None` if there is none or the
    /// emitter is not ready.
    pub fn finish(&mut self) -> Option<LeafEntry> {
        if self.is_ready() { self.close(|_, _| Level::INFINITE) } else { None }
    }

    /// Closes the open leaf, if any, with the level of the split after it.
    fn close(&mut self, level: impl FnOnce(u64, u32) -> Level) -> Option<LeafEntry> {
        let OpenLeaf { code, mut subtree, size, last } = self.open.take()?;
        if let Child::Leaf { count, .. } = &mut subtree.child {
            *count = size;
        }
        self.pending = Some(Entry { subtree, level: level(code, self.leaves) });
        self.leaves += 1;
        Some(LeafEntry { primitive: last, last: true })
    }

    /// Does one stack operation: combines the pending subtree with the top of the stack, or pushes
    /// it.
    #[inline]
    pub fn step<P: Probe>(&mut self, probe: &mut P) -> Step {
        let Some(pending) = self.pending else { return Step::Idle };
        if let Some(top) = self.stack.last()
            && top.level <= pending.level
        {
            let node = Bvh2Node { children: [top.subtree, pending.subtree] };
            let bounds = top.subtree.bounds.union(&pending.subtree.bounds);
            let child = Child::Inner(NodeIndex(self.nodes));
            self.stack.pop();
            self.nodes += 1;
            self.pending = Some(Entry { subtree: Subtree { bounds, child }, ..pending });
            probe.emit_node();
            return Step::Node(node);
        }
        self.pending = None;
        if pending.level == Level::INFINITE {
            return Step::Root(pending.subtree);
        }
        // Cannot be full: see MAX_DEPTH.
        let pushed = self.stack.push(pending).is_ok();
        debug_assert!(pushed, "levels on the stack are distinct");
        probe.emit_push(self.stack.len());
        Step::Push
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;
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
                    Step::Push | Step::Idle => {}
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
}
