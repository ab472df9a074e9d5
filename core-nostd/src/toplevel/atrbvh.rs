//! Agglomerative treelet restructuring over cells (Domingues and Pedrini 2015; P2 §5.6).

use heapless::Vec;

use super::{Binned, Exhausted, NodeSink};
use crate::emit::{Cell, MAX_DEPTH};
use crate::geom::Aabb;
use crate::node::{Bvh2Node, Child, Subtree};
use crate::probe::Probe;

/// The treelet restructuring builder.
///
/// It starts from the LBVH of the cells, which their levels give, or from a binned tree. Then it walks the tree bottom-up,
/// and takes every node for the root of a treelet: the node whose box is largest among the treelet's
/// leaves is opened until there are enough. The leaves are joined anew, always the two whose common
/// box is smallest (by half surface area; of equal ones the two that were opened first), and the
/// treelet is replaced if the sum of the areas of its inner nodes becomes smaller. The tree never gets
/// deeper than [`MAX_DEPTH`] by it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Atrbvh {
    /// Leaves of a treelet, 3 to 16.
    pub treelet: u8,
    /// How often the tree is walked.
    pub iterations: u8,
    /// What is walked first: the tree of this builder, or without one that of the Morton codes.
    pub start: Option<Binned>,
}

impl Default for Atrbvh {
    /// P2's: treelets of eight, two iterations.
    fn default() -> Self {
        Self { treelet: 8, iterations: 2, start: None }
    }
}

/// The most leaves that a treelet can have.
const MAX_TREELET: usize = 16;

/// A node of the top tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TopNode {
    bounds: Aabb,
    area: u64,
    children: [Ref; 2],
    depth: u8,
}

impl TopNode {
    /// Something to fill storage with.
    pub const EMPTY: Self = Self { bounds: Aabb::EMPTY, area: 0, children: [Ref(0); 2], depth: 0 };
}

/// A node, or, with the highest bit, a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Ref(u32);

impl Ref {
    const CELL: u32 = 1 << 31;

    fn cell(self) -> Option<usize> {
        (self.0 & Self::CELL != 0).then_some((self.0 & !Self::CELL) as usize)
    }
}

/// The top tree in storage.
struct Top<'a> {
    cells: &'a [Cell],
    nodes: &'a mut [TopNode],
}

/// A way down the tree: a node and how many of its children have been dealt with.
type Path = Vec<(Ref, u8), { MAX_DEPTH + 1 }>;

impl Atrbvh {
    pub(super) fn is_valid(self) -> bool {
        (3..=MAX_TREELET).contains(&usize::from(self.treelet))
    }

    /// Builds the tree over `cells` and returns its root, or `None` for none. `nodes` has room for one
    /// less than there are cells.
    pub(crate) fn build<S: NodeSink, P: Probe>(
        self,
        cells: &mut [Cell],
        nodes: &mut [TopNode],
        sink: &mut S,
        probe: &mut P,
    ) -> Result<Option<Subtree>, Exhausted<S::Error>> {
        if nodes.len() + 1 < cells.len() {
            return Err(Exhausted::Stack);
        }
        if let Some(binned) = self.start {
            binned.arrange(cells, probe).ok_or(Exhausted::Stack)?;
        }
        let cells = &*cells;
        let mut top = Top { cells, nodes };
        let Some(root) = top.lbvh() else { return Ok(None) };
        for _ in 0..self.iterations {
            top.walk(root, |top, node, above| {
                top.restructure(node, above, usize::from(self.treelet), probe);
                Ok(())
            })?;
        }
        let mut done = Vec::<Subtree, { MAX_DEPTH + 1 }>::new();
        if let Some(cell) = root.cell() {
            return Ok(Some(cells[cell].subtree));
        }
        top.walk(root, |top, node, _| {
            let [left, right] = top.nodes[node].children;
            let mut take = |child: Ref| match child.cell() {
                Some(cell) => Some(cells[cell].subtree),
                None => done.pop(),
            };
            let (right, left) = (take(right), take(left));
            let (Some(left), Some(right)) = (left, right) else { return Err(Exhausted::Stack) };
            let joined = join(sink, probe, [left, right]).map_err(Exhausted::Sink)?;
            done.push(joined).map_err(|_| Exhausted::Stack)
        })?;
        Ok(done.pop())
    }
}

impl Top<'_> {
    fn bounds(&self, at: Ref) -> Aabb {
        match at.cell() {
            Some(cell) => self.cells[cell].subtree.bounds,
            None => self.nodes[at.0 as usize].bounds,
        }
    }

    fn depth(&self, at: Ref) -> u8 {
        match at.cell() {
            Some(cell) => self.cells[cell].depth,
            None => self.nodes[at.0 as usize].depth,
        }
    }

    fn set(&mut self, index: usize, children: [Ref; 2]) -> Ref {
        let [left, right] = children;
        let bounds = self.bounds(left).union(&self.bounds(right));
        let depth = self.depth(left).max(self.depth(right)).saturating_add(1);
        self.nodes[index] = TopNode { bounds, area: bounds.half_area(), children, depth };
        Ref(index as u32)
    }

    /// Joins the cells by their levels, as the emitter would.
    fn lbvh(&mut self) -> Option<Ref> {
        let mut stack = Vec::<(Ref, crate::emit::Level), MAX_DEPTH>::new();
        let mut count = 0;
        let mut root = None;
        for (i, cell) in self.cells.iter().enumerate() {
            let mut at = Ref(i as u32 | Ref::CELL);
            while let Some(&(left, level)) = stack.last()
                && level <= cell.level
            {
                stack.pop();
                at = self.set(count, [left, at]);
                count += 1;
            }
            root = Some(at);
            // Levels fall towards the top of the stack.
            let _ = stack.push((at, cell.level));
        }
        root
    }

    /// Visits all nodes under `root`, children before parents, with the number of nodes above each.
    fn walk<E>(
        &mut self,
        root: Ref,
        mut visit: impl FnMut(&mut Self, usize, usize) -> Result<(), Exhausted<E>>,
    ) -> Result<(), Exhausted<E>> {
        let mut path = Path::new();
        let mut next = Some((root, 0));
        while let Some((at, seen)) = next {
            let (None, index) = (at.cell(), at.0 as usize) else {
                next = path.pop();
                continue;
            };
            if seen == 2 {
                visit(self, index, path.len())?;
                next = path.pop();
                continue;
            }
            let child = self.nodes[index].children[usize::from(seen)];
            path.push((at, seen + 1)).map_err(|_| Exhausted::Stack)?;
            next = Some((child, 0));
        }
        Ok(())
    }

    /// Rebuilds the treelet under a node that has `above` nodes above it, if that makes it better.
    fn restructure<P: Probe>(&mut self, root: usize, above: usize, size: usize, probe: &mut P) {
        let mut leaves = Vec::<Ref, MAX_TREELET>::new();
        let mut inner = Vec::<usize, MAX_TREELET>::new();
        let _ = inner.push(root);
        let _ = leaves.extend_from_slice(&self.nodes[root].children);
        let mut before = 0u128;
        while leaves.len() < size.min(MAX_TREELET) {
            let mut widest: Option<(u64, usize)> = None;
            for (i, leaf) in leaves.iter().enumerate() {
                if leaf.cell().is_none() {
                    let area = self.nodes[leaf.0 as usize].area;
                    if widest.is_none_or(|(most, _)| area > most) {
                        widest = Some((area, i));
                    }
                }
            }
            let Some((area, i)) = widest else { break };
            let node = leaves[i].0 as usize;
            before += u128::from(area);
            let _ = inner.push(node);
            let [left, right] = self.nodes[node].children;
            leaves[i] = left;
            let _ = leaves.push(right);
        }
        if leaves.len() < 3 {
            return;
        }
        let treelet = Agglomeration::new(self, &leaves);
        let deepest = above + usize::from(treelet.depth);
        let better = treelet.area < before && deepest <= MAX_DEPTH;
        probe.top_treelet(leaves.len(), better);
        if better {
            self.replace(&leaves, &inner, &treelet);
        }
    }

    /// Writes the joins into the nodes of the old treelet, the last one into its root.
    fn replace(&mut self, leaves: &[Ref], inner: &[usize], treelet: &Agglomeration) {
        let mut refs = Vec::<Ref, MAX_TREELET>::new();
        let _ = refs.extend_from_slice(leaves);
        for (&[left, right], &index) in treelet.joins.iter().zip(inner.iter().rev()) {
            refs[left] = self.set(index, [refs[left], refs[right]]);
        }
    }
}

/// Joins two subtrees.
fn join<S: NodeSink, P: Probe>(
    sink: &mut S,
    probe: &mut P,
    children: [Subtree; 2],
) -> Result<Subtree, S::Error> {
    probe.top_node();
    let index = sink.node(&Bvh2Node { children }, probe)?;
    let bounds = children[0].bounds.union(&children[1].bounds);
    Ok(Subtree { bounds, child: Child::Inner(index) })
}

/// How the leaves of a treelet are joined: each time the second into the place of the first.
struct Agglomeration {
    joins: Vec<[usize; 2], MAX_TREELET>,
    /// The sum of the areas of all inner nodes but the root.
    area: u128,
    depth: u8,
}

impl Agglomeration {
    fn new(top: &Top<'_>, leaves: &[Ref]) -> Self {
        let count = leaves.len().min(MAX_TREELET);
        let mut bounds = [Aabb::EMPTY; MAX_TREELET];
        let mut depth = [0u8; MAX_TREELET];
        for (i, &leaf) in leaves.iter().enumerate().take(count) {
            bounds[i] = top.bounds(leaf);
            depth[i] = top.depth(leaf);
        }
        let mut distance = [[u64::MAX; MAX_TREELET]; MAX_TREELET];
        for i in 0..count {
            for j in i + 1..count {
                distance[i][j] = bounds[i].union(&bounds[j]).half_area();
            }
        }
        let mut this = Self { joins: Vec::new(), area: 0, depth: 0 };
        for _ in 1..count {
            let (mut least, mut pair) = (u64::MAX, [0, 0]);
            for (i, row) in distance.iter().enumerate().take(count) {
                for (j, &d) in row.iter().enumerate().take(count).skip(i + 1) {
                    if d < least {
                        (least, pair) = (d, [i, j]);
                    }
                }
            }
            let [a, b] = pair;
            this.area += u128::from(least);
            this.depth = depth[a].max(depth[b]).saturating_add(1);
            let _ = this.joins.push(pair);
            bounds[a] = bounds[a].union(&bounds[b]);
            depth[a] = this.depth;
            for i in 0..count {
                distance[i.min(b)][i.max(b)] = u64::MAX;
            }
            for i in 0..count {
                let (low, high) = (i.min(a), i.max(a));
                if i != a && distance[low][high] != u64::MAX {
                    distance[low][high] = bounds[i].union(&bounds[a]).half_area();
                }
            }
            if this.joins.len() + 1 == count {
                // The root has the same box however its leaves are joined.
                this.area -= u128::from(least);
            }
        }
        this
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emit::Level;
    use crate::node::NodeIndex;
    use glam::IVec3;

    struct Nodes(Vec<Bvh2Node, 64>);

    impl NodeSink for Nodes {
        type Error = ();

        fn node<P: Probe>(&mut self, node: &Bvh2Node, _: &mut P) -> Result<NodeIndex, ()> {
            self.0.push(*node).map_err(|_| ())?;
            Ok(NodeIndex(self.0.len() as u32 - 1))
        }
    }

    impl Nodes {
        fn area(&self) -> u64 {
            let bounds = |n: &Bvh2Node| n.children[0].bounds.union(&n.children[1].bounds);
            self.0.iter().map(|node| bounds(node).half_area()).sum()
        }
    }

    /// Cells at these places on a line whose levels make the tree of the index bits.
    fn cells<const N: usize>(places: [i32; N], depth: u8) -> [Cell; N] {
        let mut cells = [Cell::EMPTY; N];
        for (i, (cell, x)) in cells.iter_mut().zip(places).enumerate() {
            let at = IVec3::new(x, 0, 0);
            let child = Child::Leaf { first: i as u32, count: 1 };
            let bounds = Aabb::new(at, at + IVec3::ONE);
            let level = match i + 1 {
                next if next == N => Level::INFINITE,
                next => Level::split(next.trailing_zeros() as u8),
            };
            *cell = Cell { subtree: Subtree { bounds, child }, level, depth, size: 1 };
        }
        cells
    }

    fn build(atrbvh: Atrbvh, cells: &mut [Cell]) -> (Nodes, Option<Subtree>) {
        let mut nodes = [TopNode::EMPTY; 64];
        let mut sink = Nodes(Vec::new());
        let root = atrbvh.build(cells, &mut nodes, &mut sink, &mut ()).unwrap();
        (sink, root)
    }

    #[test]
    fn no_iterations_leave_the_tree_of_the_levels() {
        let (nodes, root) =
            build(Atrbvh { iterations: 0, ..Atrbvh::default() }, &mut cells([0, 9, 1, 8], 0));
        assert_eq!(nodes.0.len(), 3);
        let inner = |i| Child::Inner(NodeIndex(i));
        assert_eq!(root.unwrap().child, inner(2));
        assert_eq!(nodes.0[2].children.map(|c| c.child), [inner(0), inner(1)]);
        assert_eq!(nodes.0[0].children.map(|c| c.bounds.min.x), [0, 9]);
    }

    #[test]
    fn a_treelet_is_joined_by_nearness() {
        let (nodes, root) = build(Atrbvh::default(), &mut cells([0, 9, 1, 8], 0));
        let mut pairs = [0, 1].map(|i| nodes.0[i].children.map(|c| c.bounds.min.x));
        pairs.sort_unstable();
        assert_eq!(pairs, [[0, 1], [9, 8]]);
        assert_eq!(root.unwrap().bounds, Aabb::new(IVec3::ZERO, IVec3::new(10, 1, 1)));
    }

    #[test]
    fn iterations_never_make_it_worse_and_keep_every_cell() {
        let places: [i32; 32] = core::array::from_fn(|i| (i as i32 * 7919) % 1009);
        let mut last = u64::MAX;
        for iterations in 0..4 {
            for start in [None, Some(Binned::default())] {
                let atrbvh = Atrbvh { iterations, start, treelet: 8 };
                let (nodes, _) = build(atrbvh, &mut cells(places, 0));
                let mut seen = [false; 32];
                for subtree in nodes.0.iter().flat_map(|n| n.children) {
                    if let Child::Leaf { first, .. } = subtree.child {
                        assert!(!core::mem::replace(&mut seen[first as usize], true));
                    }
                }
                assert!(seen.iter().all(|&s| s) && nodes.0.len() == 31);
                if start.is_none() {
                    assert!(nodes.area() <= last);
                    last = nodes.area();
                }
            }
        }
    }

    #[test]
    fn a_tree_that_would_get_too_deep_stays() {
        let places = [0, 1 << 20, 1 << 10, 1 << 5, 1 << 15, 1, 1 << 3, 1 << 18];
        let height = |depth: u8| {
            let (nodes, _) = build(Atrbvh::default(), &mut cells(places, depth));
            let mut depths = [0usize; 8];
            for (i, node) in nodes.0.iter().enumerate() {
                let below = node.children.map(|c| match c.child {
                    Child::Inner(NodeIndex(i)) => depths[i as usize],
                    Child::Leaf { .. } => usize::from(depth),
                });
                depths[i] = 1 + below[0].max(below[1]);
            }
            depths[nodes.0.len() - 1]
        };
        assert!(height(0) > 3);
        assert_eq!(height(MAX_DEPTH as u8 - 3), MAX_DEPTH);
    }

    #[test]
    fn no_cells_have_no_tree_and_one_is_its_own() {
        assert_eq!(build(Atrbvh::default(), &mut []).1, None);
        let mut one = cells([5], 0);
        assert_eq!(build(Atrbvh::default(), &mut one).1, Some(one[0].subtree));
    }
}
