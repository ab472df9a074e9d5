//! Shared-plane nodes: which planes are inherited, on which grid the others are, and what a reader
//! makes of them.
//!
//! A plane of a node is a plane of one of its children, so each node stores the other child's only. An
//! inherited plane is the one that was *decoded*: it was rounded on the grid of the ancestor where it was
//! stored, however much finer the heir's own grid is (P3 §4.5). From the root down this is a matter of
//! carrying boxes. Bottom-up it would make every node depend on planes of distant ancestors, in two
//! ways, and here in none:
//!
//! - *The numbers.* Planes are cells of a scene-wide grid modulo 2^6, so a plane is the same whatever the
//!   box around it, while the grid is the same and the box spans 2^6 cells at most.
//! - *The grid.* It is a function of the exact box ([`fit`]), which the writer has, with room for
//!   planes that are rounded outward by some powers of two ([`Sharing::margin`]). The parent
//!   has both exact boxes when it is written, and stores the difference of the grids.
//!
//! What is left is an heir whose grid is finer than the ancestor's by more than that room. Every
//! subtree on the stack carries the coarsest grid that each of its six planes may be on
//! ([`OpenNode`]); a plane that must be finer than its node's grid is written exactly, in an extension of
//! the node. Nothing that was written is ever touched again.

use glam::IVec3;

use crate::geom::Aabb;
use crate::node::{
    Bvh2Node, Child, Grids, Link, NodeIndex, Plane, SharedNode, SharedWords, Sharing, Subtree,
};
use crate::num::Grid;

/// The most cells that a box spans.
const CELLS: i64 = 1 << 6;

/// A grid no coarser than this is fine for a plane that nobody inherits.
const ANY: u8 = 31;

/// The grid of a box, per axis: the finest on which it spans 2^6 cells at most, once its planes are
/// rounded outward to one that is coarser by [`Sharing::margin`] powers of two; but on no axis finer than
/// its coarsest by more than [`Sharing::flatness`]. Grids of boxes in a box are not coarser.
pub(crate) fn fit(bounds: &Aabb, sharing: &Sharing) -> [u8; 3] {
    let mut scale = [0u8; 3];
    let margin = match sharing.grids {
        Grids::Stored => sharing.margin,
        Grids::Derived => 0,
    };
    for (axis, scale) in scale.iter_mut().enumerate() {
        while *scale + margin < ANY && extent(bounds, axis, *scale + margin) > CELLS << *scale {
            *scale += 1;
        }
    }
    let coarsest = scale[0].max(scale[1]).max(scale[2]);
    scale.map(|scale| scale.max(coarsest.saturating_sub(sharing.flatness)))
}

/// How long a box is once its planes are rounded outward to a grid.
fn extent(bounds: &Aabb, axis: usize, scale: u8) -> i64 {
    let (low, high) = (bounds.min[axis] >> scale, bounds.max[axis] >> scale);
    (i64::from(high) + 1 - i64::from(low)) << scale
}

/// What a reader must know of a node to decode its children.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SharedContext {
    /// The decoded box; its upper planes are above it.
    pub bounds: Aabb,
    /// The cells of its grid are `2^scale` grid units wide, per axis; of no meaning for a leaf.
    pub scale: [u8; 3],
    /// Which leaf table entries are below it: the first, and the one after the last.
    pub entries: [u32; 2],
    /// The child itself.
    pub child: Child,
}

impl SharedContext {
    /// The context of the root of a tree with so many leaf table entries, or `None` if its box is off the
    /// grid.
    pub fn root(root: &Subtree, entry_count: u32, sharing: &Sharing) -> Option<Self> {
        let Aabb { min, max } = root.bounds;
        if !is_on_grid(&root.bounds) || sharing.check().is_err() {
            return None;
        }
        let scale = fit(&root.bounds, sharing);
        let bounds = Aabb::new(min, max + IVec3::ONE);
        Some(Self { bounds, scale, entries: [0, entry_count], child: root.child })
    }

    /// Decodes the children of a node of so many words at `index`, or `None` if no writer writes it.
    #[inline]
    pub fn decode(
        &self,
        index: NodeIndex,
        node: &SharedNode,
        words: usize,
        sharing: &Sharing,
    ) -> Option<[Self; 2]> {
        let mut boxes = [self.bounds; 2];
        for axis in 0..3 {
            let scale = u32::from(*self.scale.get(axis)?);
            let (low, high) = (self.bounds.min[axis], self.bounds.max[axis]);
            let base = low >> scale;
            let lower = match node.planes[2 * axis] {
                Plane::Cell(cell) => {
                    let cells = (i32::from(cell) - base) & (CELLS as i32 - 1);
                    ((base + cells) << scale).max(low)
                }
                Plane::Exact(at) => at,
            };
            let upper = match node.planes[2 * axis + 1] {
                Plane::Cell(cell) => {
                    let cells = ((i32::from(cell) - base - 1) & (CELLS as i32 - 1)) + 1;
                    ((base + cells) << scale).min(high)
                }
                Plane::Exact(at) => at,
            };
            if lower < low || upper > high {
                return None;
            }
            let other = |heir: u8| usize::from(1 - (heir & 1));
            boxes[other(node.heirs[2 * axis])].min[axis] = lower;
            boxes[other(node.heirs[2 * axis + 1])].max[axis] = upper;
        }
        let [first, end] = self.entries;
        let size = node.link.entries;
        if size == 0 || size >= end.checked_sub(first)? {
            return None;
        }
        let middle = if node.leaves[0] { first + size } else { end - size };
        // The last word in front of this node and its extensions, if there is one.
        let before = index.0.checked_sub(words as u32);
        let children = match node.leaves {
            [false, false] => [before.and_then(|at| at.checked_sub(node.link.words)), before],
            _ => [before; 2],
        };
        let child = |i: usize| {
            let (bounds, entries) = (boxes[i], [[first, middle], [middle, end]][i]);
            if !bounds.min.cmplt(bounds.max).all() {
                return None;
            }
            if node.leaves[i] {
                let child = Child::Leaf { first: entries[0], count: entries[1] - entries[0] };
                return Some(Self { bounds, scale: self.scale, entries, child });
            }
            let scale = match sharing.grids {
                Grids::Derived => {
                    let inclusive = Aabb::new(bounds.min, bounds.max - IVec3::ONE);
                    fit(&inclusive, sharing)
                }
                Grids::Stored => {
                    let mut scale = self.scale;
                    for (scale, finer) in scale.iter_mut().zip(node.finer[i]) {
                        *scale = scale.checked_sub(finer)?;
                    }
                    scale
                }
            };
            Some(Self { bounds, scale, entries, child: Child::Inner(NodeIndex(children[i]?)) })
        };
        Some([child(0)?, child(1)?])
    }
}

/// What a writer must know of a child to write its parent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OpenNode {
    /// The child's grid.
    pub scale: [u8; 3],
    /// The coarsest grid that each of its planes may be rounded to, by the power of two.
    pub bears: [u8; 6],
    /// Words below it and its own; 0 for a leaf.
    pub words: u32,
    /// Leaf table entries below it.
    pub entries: u32,
}

impl OpenNode {
    /// A leaf of so many entries.
    pub const fn leaf(entries: u32) -> Self {
        Self { scale: [0; 3], bears: [ANY; 6], words: 0, entries }
    }

    /// The words of a node over two children, and what its own parent must know; or `None` for boxes that
    /// are off the grid and counts beyond [`SharedNode::MAX_LINK`].
    pub fn join(
        node: &Bvh2Node,
        children: &[Self; 2],
        sharing: &Sharing,
    ) -> Option<(SharedWords, Self)> {
        let bounds = node.children[0].bounds.union(&node.children[1].bounds);
        if !is_on_grid(&bounds) {
            return None;
        }
        let scale = fit(&bounds, sharing);
        let mut shared = share(node, children, scale)?;
        let [left, right] = children;
        let mut bears = [0; 6];
        for (k, bears) in bears.iter_mut().enumerate() {
            let heir = usize::from(shared.heirs[k]);
            let at = |child: usize| {
                let Aabb { min, max } = node.children[child].bounds;
                if k % 2 == 0 { min[k / 2] } else { max[k / 2] + 1 }
            };
            *bears = children[heir].bears[k].min(own_bears(&bounds, scale, k / 2));
            let other = children[1 - heir].bears[k];
            if other < scale[k / 2] {
                if at(0) == at(1) {
                    // The stored plane is cut to the node's, so it errs by no more than that one.
                    *bears = other.min(*bears);
                } else {
                    shared.planes[k] = Plane::Exact(at(1 - heir));
                }
            }
        }
        for (i, child) in children.iter().enumerate().filter(|(i, _)| !shared.leaves[*i]) {
            for (finer, (own, below)) in
                shared.finer[i].iter_mut().zip(scale.iter().zip(child.scale))
            {
                *finer = own.checked_sub(below)?;
            }
        }
        let words = shared.to_words(sharing.grids);
        let entries = left.entries.checked_add(right.entries)?;
        let below = left.words.checked_add(right.words)?.checked_add(words.len() as u32)?;
        if entries > SharedNode::MAX_LINK || below > SharedNode::MAX_LINK {
            return None;
        }
        Some((words, Self { scale, bears, words: below, entries }))
    }
}

/// A node on a given grid, its planes in cells of it. `children` tell how large they are, and which of two
/// possible heirs bears a rounded plane better. `None` for a right subtree that does not follow the left.
pub fn share(node: &Bvh2Node, children: &[OpenNode; 2], scale: [u8; 3]) -> Option<SharedNode> {
    let [left, right] = node.children;
    let leaves = [left, right].map(|child| matches!(child.child, Child::Leaf { .. }));
    let mut shared = SharedNode {
        planes: [Plane::Cell(0); 6],
        heirs: [0; 6],
        leaves,
        finer: [[0; 3]; 2],
        link: Link {
            words: if leaves == [false; 2] { children[1].words } else { 0 },
            entries: children[usize::from(!leaves[0])].entries,
        },
    };
    for k in 0..6 {
        let axis = k / 2;
        let at = |bounds: &Aabb| if k % 2 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let (a, b) = (at(&left.bounds), at(&right.bounds));
        let first_is_outer = if k % 2 == 0 { a < b } else { a > b };
        let heir = if a == b {
            usize::from(children[1].bears[k] > children[0].bears[k])
        } else {
            usize::from(!first_is_outer)
        };
        let cell = [b, a][heir] >> scale[axis];
        shared.heirs[k] = heir as u8;
        shared.planes[k] = Plane::Cell((cell + (k as i32 & 1)) as u8 & (CELLS as u8 - 1));
    }
    Some(shared)
}

/// The coarsest grid to which both planes of a box may be rounded on an axis, if it is to span 2^6 cells of
/// its own grid at most.
fn own_bears(bounds: &Aabb, scale: [u8; 3], axis: usize) -> u8 {
    let room = CELLS << scale[axis];
    let mut bears = scale[axis];
    while bears + 1 < ANY && extent(bounds, axis, bears + 1) <= room {
        bears += 1;
    }
    bears
}

/// Whether this is a box of the grid.
fn is_on_grid(bounds: &Aabb) -> bool {
    let grid = Grid::DEFAULT;
    bounds.is_valid() && grid.contains(bounds.min) && grid.contains(bounds.max)
}

#[cfg(test)]
mod tests {
    use heapless::Vec;

    use super::*;
    use crate::testing::{Random, cases};

    const NODES: usize = 64;

    /// A tree: nodes in the order of their completion, and what their parents must know.
    struct Built {
        nodes: Vec<Bvh2Node, NODES>,
        at: Vec<u32, NODES>,
        words: Vec<u64, { NODES * SharedNode::MAX_WORDS }>,
        open: Vec<(Subtree, OpenNode), NODES>,
        entries: u32,
    }

    impl Built {
        fn leaf(&mut self, random: &mut Random) {
            let mut bounds = Aabb::EMPTY;
            let (spread, coarse) = (random.below(22), random.below(2) * random.below(18));
            for _ in 0..2 {
                let mut c = || {
                    let anchor = random.below(1 << 24) >> (random.below(2) * random.below(20));
                    let near = random.below(1 << spread);
                    ((anchor + near).min((1 << 24) - 1) >> coarse << coarse) - (1 << 23)
                };
                let point = IVec3::new(c(), c(), c());
                bounds = bounds.union(&Aabb::new(point, point));
            }
            let count = if random.below(3) == 0 { 1 + random.below(255) as u32 } else { 1 };
            let child = Child::Leaf { first: self.entries, count };
            self.entries += count;
            let pushed = self.open.push((Subtree { bounds, child }, OpenNode::leaf(count)));
            assert!(pushed.is_ok());
        }

        fn join(&mut self, sharing: &Sharing) {
            let (right, left) = (self.open.pop().unwrap(), self.open.pop().unwrap());
            let node = Bvh2Node { children: [left.0, right.0] };
            let (words, open) = match sharing.grids {
                Grids::Stored => OpenNode::join(&node, &[left.1, right.1], sharing).unwrap(),
                Grids::Derived => {
                    let words = share(&node, &[left.1, right.1], [0; 3]).unwrap();
                    let words = words.to_words(Grids::Derived);
                    let below = left.1.words + right.1.words + words.len() as u32;
                    let entries = left.1.entries + right.1.entries;
                    (words, OpenNode { words: below, ..OpenNode::leaf(entries) })
                }
            };
            self.words.extend(words.iter().rev().copied());
            self.at.push(self.words.len() as u32 - 1).unwrap();
            let bounds = left.0.bounds.union(&right.0.bounds);
            let child = Child::Inner(NodeIndex(self.nodes.len() as u32));
            self.nodes.push(node).unwrap();
            self.open.push((Subtree { bounds, child }, open)).unwrap();
        }
    }

    fn tree(random: &mut Random, sharing: &Sharing) -> Built {
        let mut built = Built {
            nodes: Vec::new(),
            at: Vec::new(),
            words: Vec::new(),
            open: Vec::new(),
            entries: 0,
        };
        for _ in 0..2 + random.below(40) {
            built.leaf(random);
            while built.open.len() > 1 && random.below(2) == 0 {
                built.join(sharing);
            }
        }
        while built.open.len() > 1 {
            built.join(sharing);
        }
        built
    }

    /// Walks a tree from the root down and compares all that is decoded.
    fn check(built: &Built, sharing: &Sharing) {
        let (root, open) = built.open[0];
        let Child::Inner(NodeIndex(last)) = root.child else { return };
        let words = built.words.len() as u32;
        let place = Subtree { child: Child::Inner(NodeIndex(words - 1)), ..root };
        let start = SharedContext::root(&place, built.entries, sharing).unwrap();
        let mut stack = Vec::<(u32, OpenNode, SharedContext), NODES>::new();
        stack.push((last, open, start)).unwrap();
        while let Some((number, _, context)) = stack.pop() {
            let node = &built.nodes[number as usize];
            let Child::Inner(index) = context.child else { panic!("not a node") };
            assert_eq!(index.0, built.at[number as usize]);
            let mut words = SharedWords::new();
            while words.is_empty() || SharedNode::is_extended(&words) {
                words.push(built.words[index.0 as usize - words.len()]).unwrap();
            }
            let mut shared = SharedNode::from_words(&words, sharing.grids).unwrap();
            if sharing.grids == Grids::Derived {
                // The numbers of planes are known now that the grid is.
                let planes = share(node, &[OpenNode::leaf(0); 2], context.scale).unwrap();
                (shared.planes, shared.heirs) = (planes.planes, planes.heirs);
            }
            let children = context.decode(index, &shared, words.len(), sharing).unwrap();
            for (exact, child) in node.children.iter().zip(children) {
                let Aabb { min, max } = child.bounds;
                assert!(min.cmple(exact.bounds.min).all(), "{exact:?} {child:?}");
                assert!(max.cmpgt(exact.bounds.max).all(), "{exact:?} {child:?}");
                match exact.child {
                    Child::Inner(NodeIndex(number)) => {
                        stack.push((number, open, child)).unwrap();
                    }
                    leaf => assert_eq!(leaf, child.child),
                }
            }
        }
    }

    #[test]
    fn every_decoded_box_of_a_stream_encloses_the_exact_one() {
        for seed in 0..cases(600) {
            let mut random = Random(seed.into());
            let margin = random.below(6) as u8;
            let flatness = [31, 4, 2][random.below(3) as usize];
            let sharing = Sharing { margin, flatness, ..Sharing::STREAMED };
            check(&tree(&mut random, &sharing), &sharing);
        }
    }

    #[test]
    fn every_decoded_box_from_the_root_down_encloses_the_exact_one() {
        for seed in 0..cases(600) {
            let mut random = Random(seed.into());
            let flatness = [31, 4, 2][random.below(3) as usize];
            let sharing = Sharing { flatness, ..Sharing::TOP_DOWN };
            check(&tree(&mut random, &sharing), &sharing);
        }
    }

    #[test]
    fn grids_of_boxes_in_boxes_are_not_coarser() {
        let mut random = Random(3);
        for _ in 0..cases(5000) {
            let mut corner = |from: IVec3, to: IVec3| {
                IVec3::from_array(
                    [0, 1, 2].map(|axis| from[axis] + random.below(to[axis] - from[axis] + 1)),
                )
            };
            let (low, high) = (IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
            let min = corner(low, high);
            let outer = Aabb::new(min, corner(min, high));
            let min = corner(outer.min, outer.max);
            let inner = Aabb::new(min, corner(min, outer.max));
            for (margin, flatness) in [(0, 31), (3, 4), (5, 0)] {
                let sharing = Sharing { margin, flatness, ..Sharing::STREAMED };
                let (inner, outer) = (fit(&inner, &sharing), fit(&outer, &sharing));
                assert!(inner.iter().zip(outer).all(|(inner, outer)| *inner <= outer));
            }
        }
    }
}
