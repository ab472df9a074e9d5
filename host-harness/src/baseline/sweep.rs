//! The full SAH sweep: every cut between neighbours on every axis is tried.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use xylem_core::emit::MAX_DEPTH;
use xylem_core::geom::Aabb;
use xylem_core::node::MAX_LEAF_SIZE;

use super::HostTree;
use super::tree::{Cut, union};

/// Where a sweep stops.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SweepLeaves {
    /// At one primitive.
    Single,
    /// Where no cut is cheaper than a leaf, or at one primitive; leaves have at most
    /// [`MAX_LEAF_SIZE`] primitives. This is the gold standard: of the two it is the one whose costs
    /// stand to the LBVH's as the papers' do (the bunny 36.5 against 45.1; single primitives 38.1).
    Sah,
}

/// Builds the tree of a full SAH sweep over `boxes`, from the root down, with the costs `Ci` = 1.2,
/// `Cl` = 0 and `Ct` = 1 of P2 §6.
///
/// On each axis the primitives are sorted by the centres of their boxes, equal ones by their index;
/// the cut with the lowest `A(left)·n(left) + A(right)·n(right)` is taken. Areas and products are
/// exact integers. Among cuts of one cost the one nearest to the middle wins, then the lower axis,
/// then the lower position, so that a range whose boxes are all alike is halved. From depth 63 on
/// ranges are halved in any case, which keeps every tree within [`MAX_DEPTH`].
///
/// Sorting is done once: each cut partitions the three orders and keeps them sorted. Subtrees are
/// built on all cores; the result does not depend on how many there are.
pub fn sweep(boxes: &[Aabb], leaves: SweepLeaves) -> HostTree {
    let count = boxes.len();
    let mut orders = [0, 1, 2].map(|axis| {
        let mut order: Vec<u32> = (0..count as u32).collect();
        let centre = |b: &Aabb| b.min[axis] + b.max[axis];
        order.par_sort_unstable_by_key(|&i| (centre(&boxes[i as usize]), i));
        order
    });
    let shared =
        Shared { boxes, leaves, in_left: (0..count).map(|_| AtomicBool::new(false)).collect() };
    let mut cuts = vec![Cut::LEAVES; count];
    let root = Range {
        first: 0,
        depth: 0,
        orders: orders.each_mut().map(Vec::as_mut_slice),
        buffer: &mut vec![0; count],
        areas: &mut vec![0; count],
        cuts: cuts.get_mut(1..).unwrap_or_default(),
    }
    .build(&shared);
    let [primitives, ..] = orders;
    HostTree::assemble(boxes, primitives, &cuts, root)
}

/// From this depth on ranges are halved: 32 more levels hold any number of primitives.
const HALVE_DEPTH: usize = MAX_DEPTH - 32;

/// Ranges shorter than this are built by one thread.
const PARALLEL: usize = 4096;

struct Shared<'a> {
    boxes: &'a [Aabb],
    leaves: SweepLeaves,
    /// By primitive: on which side of the last cut it is. Ranges touch their own primitives only.
    in_left: Vec<AtomicBool>,
}

/// A range of primitives that becomes a subtree, with its part of all storage.
struct Range<'a> {
    first: u32,
    depth: usize,
    orders: [&'a mut [u32]; 3],
    buffer: &'a mut [u32],
    areas: &'a mut [u64],
    /// One less: the cuts strictly inside.
    cuts: &'a mut [Cut],
}

/// A cut on an axis in front of a position of the range, and its cost over `Ct`.
#[derive(Clone, Copy)]
struct Candidate {
    cost: u128,
    axis: usize,
    position: usize,
}

impl Range<'_> {
    /// Orders the range and cuts it into subtrees; returns where it is cut first.
    fn build(mut self, shared: &Shared<'_>) -> u32 {
        let count = self.buffer.len();
        if count <= 1 {
            return Cut::NONE;
        }
        let best = self.best_cut(shared.boxes);
        if shared.leaves == SweepLeaves::Sah && count <= MAX_LEAF_SIZE as usize {
            let boxes = self.orders[0].iter().map(|&p| shared.boxes[p as usize]);
            let area = u128::from(union(boxes).half_area());
            // Ci·A + Ct·cost against Ct·A·n, in fifths.
            if 6 * area + 5 * best.cost >= 5 * area * count as u128 {
                return Cut::NONE;
            }
        }
        self.partition(&shared.in_left, best);
        let at = best.position;
        let [x, y, z] = self.orders.map(|order| order.split_at_mut(at));
        let (buffer, areas) = (self.buffer.split_at_mut(at), self.areas.split_at_mut(at));
        let (left_cuts, cuts) = self.cuts.split_at_mut(at - 1);
        let Some((own, right_cuts)) = cuts.split_first_mut() else { return Cut::NONE };
        let (middle, depth) = (self.first + at as u32, self.depth + 1);
        let left = Range {
            first: self.first,
            depth,
            orders: [x.0, y.0, z.0],
            buffer: buffer.0,
            areas: areas.0,
            cuts: left_cuts,
        };
        let right = Range {
            first: middle,
            depth,
            orders: [x.1, y.1, z.1],
            buffer: buffer.1,
            areas: areas.1,
            cuts: right_cuts,
        };
        let (left, right) = match count < PARALLEL {
            true => (left.build(shared), right.build(shared)),
            false => rayon::join(|| left.build(shared), || right.build(shared)),
        };
        *own = Cut { left, right };
        middle
    }

    /// The cut to take.
    fn best_cut(&mut self, boxes: &[Aabb]) -> Candidate {
        let count = self.buffer.len();
        let from_middle = |position: usize| position.abs_diff(count / 2);
        let mut best = Candidate { cost: u128::MAX, axis: 0, position: count / 2 };
        if self.depth >= HALVE_DEPTH {
            return best;
        }
        for (axis, order) in self.orders.iter().enumerate() {
            let bounds = |i: usize| &boxes[order[i] as usize];
            let mut right = Aabb::EMPTY;
            for i in (1..count).rev() {
                right = right.union(bounds(i));
                self.areas[i] = right.half_area();
            }
            let mut left = Aabb::EMPTY;
            for position in 1..count {
                left = left.union(bounds(position - 1));
                let cost = u128::from(left.half_area()) * position as u128
                    + u128::from(self.areas[position]) * (count - position) as u128;
                if (cost, from_middle(position)) < (best.cost, from_middle(best.position)) {
                    best = Candidate { cost, axis, position };
                }
            }
        }
        best
    }

    /// Brings the left part of each order in front of the right one.
    fn partition(&mut self, in_left: &[AtomicBool], cut: Candidate) {
        for (i, &p) in self.orders[cut.axis].iter().enumerate() {
            in_left[p as usize].store(i < cut.position, Ordering::Relaxed);
        }
        for (axis, order) in self.orders.iter_mut().enumerate() {
            if axis == cut.axis {
                continue;
            }
            let (mut left, mut right) = (0, cut.position);
            for &p in order.iter() {
                let place = match in_left[p as usize].load(Ordering::Relaxed) {
                    true => &mut left,
                    false => &mut right,
                };
                self.buffer[*place] = p;
                *place += 1;
            }
            order.copy_from_slice(self.buffer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::IVec3;

    fn cube(at: [i32; 3], size: i32) -> Aabb {
        let at = IVec3::from(at);
        Aabb::new(at, at + IVec3::splat(size))
    }

    #[test]
    fn two_far_clusters_are_parted_first() {
        let boxes: Vec<Aabb> =
            [0, 1000, 2, 1002, 4].into_iter().map(|y| cube([0, y, 0], 1)).collect();
        let tree = sweep(&boxes, SweepLeaves::Single);
        let root = tree.nodes.last().unwrap();
        assert_eq!(root.children[0].bounds, Aabb::new(IVec3::ZERO, IVec3::new(1, 5, 1)));
        assert_eq!(root.children[1].bounds, Aabb::new([0, 1000, 0].into(), [1, 1003, 1].into()));
        let mut primitives = tree.primitives.clone();
        primitives.sort_unstable();
        assert_eq!(primitives, [0, 1, 2, 3, 4]);
        assert_eq!(tree.nodes.len(), 4);
    }

    #[test]
    fn a_small_tree_costs_what_the_formula_says() {
        // Half areas: a unit cube 3, both together 1·1 + 2·(1·11) = 23.
        let boxes = [cube([0, 0, 0], 1), cube([10, 0, 0], 1)];
        let tree = sweep(&boxes, SweepLeaves::Single);
        let expect = 1.2 + (3.0 + 3.0) / 23.0;
        assert!((tree.sah_cost().to_num::<f64>() - expect).abs() < 1e-9);
        assert_eq!(sweep(&boxes, SweepLeaves::Sah), tree);
        // Where the parts are as large as the whole, one leaf of two costs less than a node.
        let same = sweep(&[boxes[0]; 2], SweepLeaves::Sah);
        assert!(same.nodes.is_empty());
        assert_eq!(same.sah_cost().to_num::<f64>(), 2.0);
        assert_eq!(same.quality().largest_leaf, 2);
    }

    #[test]
    fn equal_boxes_are_halved_and_nothing_has_no_tree() {
        let tree = sweep(&[cube([1, 2, 3], 0); 64], SweepLeaves::Single);
        assert_eq!((tree.nodes.len(), tree.quality().depth), (63, 6));
        let leaf_limit = sweep(&[cube([1, 2, 3], 4); 600], SweepLeaves::Sah);
        assert_eq!(leaf_limit.quality().largest_leaf, 150);
        assert_eq!(sweep(&[], SweepLeaves::Sah), HostTree::default());
        assert_eq!(sweep(&[cube([0; 3], 1)], SweepLeaves::Single).quality().largest_leaf, 1);
    }

    #[test]
    fn a_tree_is_never_deeper_than_a_traversal_stack() {
        // Sizes and distances grow so that every sweep cuts off one box.
        let boxes: Vec<Aabb> = (0..2000).map(|i| cube([i * i, 0, 0], i)).collect();
        assert!(sweep(&boxes, SweepLeaves::Single).quality().depth as usize <= MAX_DEPTH);
    }
}
