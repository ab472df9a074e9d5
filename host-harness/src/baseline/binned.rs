//! Binned SAH over all primitives, from the root down (Wald 2007).

use rayon::prelude::*;
use xylem_core::emit::MAX_DEPTH;
use xylem_core::geom::Aabb;
use xylem_core::node::MAX_LEAF_SIZE;

use super::HostTree;
use super::tree::{Cut, union};

/// Builds the tree of a binned SAH build over `boxes` with `bins` bins on each axis, with the costs
/// `Ci` = 1.2, `Cl` = 0 and `Ct` = 1 of P2 §6.
///
/// The bins of a range are equal parts of what the centres of its boxes span. Of all planes on three
/// axes the cheapest is taken, the first of equal ones, and none where a leaf of at most
/// [`MAX_LEAF_SIZE`] primitives costs no more. Where all centres are in one bin, and from depth 63 on,
/// a range is halved. Fewer than two bins count as two.
pub fn binned(boxes: &[Aabb], bins: usize) -> HostTree {
    let mut primitives: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut cuts = vec![Cut::LEAVES; boxes.len()];
    let shared = Shared { boxes, bins: bins.max(2) };
    let inside = cuts.get_mut(1..).unwrap_or_default();
    let root = shared.build(&mut primitives, inside, 0, 0);
    HostTree::assemble(boxes, primitives, &cuts, root)
}

/// From this depth on ranges are halved: 32 more levels hold any number of primitives.
const HALVE_DEPTH: usize = MAX_DEPTH - 32;

/// Ranges shorter than this are built by one thread.
const PARALLEL: usize = 4096;

struct Shared<'a> {
    boxes: &'a [Aabb],
    bins: usize,
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: u64,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, count: 0 };

    fn with(self, other: &Self) -> Self {
        Self { bounds: self.bounds.union(&other.bounds), count: self.count + other.count }
    }

    /// Of bins that are not empty.
    fn cost(&self) -> u128 {
        u128::from(self.bounds.half_area()) * u128::from(self.count)
    }
}

/// Twice the centre of a box.
fn centre(bounds: &Aabb, axis: usize) -> i32 {
    bounds.min[axis] + bounds.max[axis]
}

impl Shared<'_> {
    /// Orders a range and cuts it into subtrees; returns where it is cut first.
    fn build(&self, range: &mut [u32], cuts: &mut [Cut], first: u32, depth: usize) -> u32 {
        if range.len() <= 1 {
            return Cut::NONE;
        }
        let Some(at) = self.part(range, depth) else { return Cut::NONE };
        let (left, right) = range.split_at_mut(at);
        let (left_cuts, rest) = cuts.split_at_mut(at - 1);
        let Some((own, right_cuts)) = rest.split_first_mut() else { return Cut::NONE };
        let (middle, depth) = (first + at as u32, depth + 1);
        let parallel = left.len() + right.len() >= PARALLEL;
        let mut build_left = || self.build(left, left_cuts, first, depth);
        let mut build_right = || self.build(right, right_cuts, middle, depth);
        let (left, right) = match parallel {
            true => rayon::join(build_left, build_right),
            false => (build_left(), build_right()),
        };
        *own = Cut { left, right };
        middle
    }

    /// Parts a range and returns how many are on the left, or `None` for a leaf.
    fn part(&self, range: &mut [u32], depth: usize) -> Option<usize> {
        let half = range.len() / 2;
        let bounds = |&p: &u32| &self.boxes[p as usize];
        let leaf_fits = range.len() <= MAX_LEAF_SIZE as usize;
        if depth >= HALVE_DEPTH {
            return (!leaf_fits).then_some(half);
        }
        let (low, high) = range.iter().map(bounds).fold(([i32::MAX; 3], [i32::MIN; 3]), |s, b| {
            let c = [0, 1, 2].map(|axis| centre(b, axis));
            ([0, 1, 2].map(|a| s.0[a].min(c[a])), [0, 1, 2].map(|a| s.1[a].max(c[a])))
        });
        let span = [0, 1, 2].map(|axis| u64::from(high[axis].abs_diff(low[axis])) + 1);
        let bin = |b: &Aabb, axis: usize| {
            (u64::from(centre(b, axis).abs_diff(low[axis])) * self.bins as u64 / span[axis])
                as usize
        };
        let bins = self.fill(range, &bin);
        let mut best: Option<(u128, usize, usize)> = None;
        for (axis, bins) in bins.iter().enumerate() {
            let mut rights = bins.clone();
            for i in (1..self.bins).rev() {
                rights[i - 1] = rights[i - 1].with(&rights[i]);
            }
            let mut left = Bin::EMPTY;
            for plane in 1..self.bins {
                left = left.with(&bins[plane - 1]);
                let right = &rights[plane];
                if left.count == 0 || right.count == 0 {
                    continue;
                }
                let cost = left.cost() + right.cost();
                if best.is_none_or(|(lowest, ..)| cost < lowest) {
                    best = Some((cost, axis, plane));
                }
            }
        }
        if leaf_fits {
            let area = u128::from(union(range.iter().map(bounds).copied()).half_area());
            // Ci·A + Ct·cost against Ct·A·n, in fifths; halves cost at least as much as a leaf.
            let leaf = 5 * area * range.len() as u128;
            if best.is_none_or(|(cost, ..)| 6 * area + 5 * cost >= leaf) {
                return None;
            }
        }
        let Some((_, axis, plane)) = best else { return Some(half) };
        let mut left = 0;
        for i in 0..range.len() {
            if bin(bounds(&range[i]), axis) < plane {
                range.swap(left, i);
                left += 1;
            }
        }
        Some(left)
    }

    /// The bins of a range on all axes.
    fn fill(&self, range: &[u32], bin: &(impl Fn(&Aabb, usize) -> usize + Sync)) -> [Vec<Bin>; 3] {
        let empty = || [(); 3].map(|()| vec![Bin::EMPTY; self.bins]);
        let add = |mut bins: [Vec<Bin>; 3], &p: &u32| {
            let one = Bin { bounds: self.boxes[p as usize], count: 1 };
            for (axis, bins) in bins.iter_mut().enumerate() {
                let bin = &mut bins[bin(&one.bounds, axis)];
                *bin = bin.with(&one);
            }
            bins
        };
        let merge = |mut a: [Vec<Bin>; 3], b: [Vec<Bin>; 3]| {
            for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
                *a = a.with(b);
            }
            a
        };
        match range.len() < PARALLEL {
            true => range.iter().fold(empty(), add),
            false => range.par_iter().with_min_len(PARALLEL).fold(empty, add).reduce(empty, merge),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SweepLeaves, sweep};
    use super::*;
    use crate::scene::{LoadOptions, procedural};
    use xylem_core::geom::Triangle;

    fn boxes(scene: &str) -> Vec<Aabb> {
        let soup = procedural::soup(scene).unwrap().unwrap();
        let mesh = soup.into_mesh(scene, &LoadOptions::default()).unwrap();
        mesh.triangles.iter().map(Triangle::bounds).collect()
    }

    #[test]
    fn every_primitive_is_in_one_leaf_and_depths_are_bounded() {
        for scene in ["terrain:6", "sphereflake:3"] {
            let boxes = boxes(scene);
            let tree = binned(&boxes, 16);
            let mut primitives = tree.primitives.clone();
            primitives.sort_unstable();
            assert!(primitives.iter().copied().eq(0..boxes.len() as u32), "{scene}");
            assert!(tree.quality().depth as usize <= MAX_DEPTH);
        }
        let one = Aabb::new([0; 3].into(), [0; 3].into());
        assert_eq!(binned(&[one; 600], 16).quality().largest_leaf, 150);
        assert_eq!(binned(&[], 16), HostTree::default());
    }

    #[test]
    fn bins_cost_a_little_more_than_the_sweep_and_fewer_a_little_more_than_many() {
        let boxes = boxes("sphereflake:3");
        let cost = |bins| binned(&boxes, bins).sah_cost().to_num::<f64>();
        let best = sweep(&boxes, SweepLeaves::Sah).sah_cost().to_num::<f64>();
        let (few, many) = (cost(4), cost(32));
        assert!(many < few && many < 1.1 * best && few > best, "{best} {many} {few}");
    }
}
