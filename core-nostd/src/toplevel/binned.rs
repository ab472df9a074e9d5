//! Binned SAH over cells, from the root down (Wald 2007; P1 §4.5).

use heapless::Vec;

use crate::emit::{Cell, Level, MAX_DEPTH};
use crate::geom::Aabb;
use crate::probe::Probe;

/// How many bins there are on each axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum Bins {
    /// 8, as in P1 §4.5.
    Eight,
    /// 16.
    #[default]
    Sixteen,
}

impl Bins {
    /// Their number.
    pub const fn count(self) -> usize {
        match self {
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }
}

/// The binned SAH builder.
///
/// A range of cells is sorted into equal bins by the centres of the cells' boxes, on all three axes
/// at once; the bins span the centres. Of the planes between bins the one with the lowest
/// `A(left)·w(left) + A(right)·w(right)` is taken, where the weight of a cell is the number of its
/// primitives. All of it is exact in integers. Among planes of one cost the one that parts the cells
/// most evenly wins, then the lower axis, then the lower plane. Where all centres are in one bin, and
/// where the depth left is just enough, the range is halved in the order it is in.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub struct Binned {
    /// Bins on each axis.
    pub bins: Bins,
}

const MAX_BINS: usize = 16;

#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    weight: u64,
    cells: u32,
}

impl Bin {
    const EMPTY: Self = Self { bounds: Aabb::EMPTY, weight: 0, cells: 0 };

    fn add(&mut self, other: &Self) {
        self.bounds = self.bounds.union(&other.bounds);
        self.weight += other.weight;
        self.cells += other.cells;
    }

    /// Of a side of a plane with something on it.
    fn cost(&self) -> u128 {
        u128::from(self.bounds.half_area()) * u128::from(self.weight)
    }
}

/// The plane on `axis` in front of bin `plane`.
#[derive(Clone, Copy)]
struct Plane {
    axis: usize,
    bin: usize,
}

/// A range of cells still to be parted, with `room` for so many nodes on the way down.
struct Range {
    first: usize,
    end: usize,
    room: u8,
}

impl Binned {
    /// Brings the cells in the order of the tree and gives them the levels of its splits, so that
    /// joining neighbours by their levels makes the tree.
    pub(crate) fn arrange<P: Probe>(self, cells: &mut [Cell], probe: &mut P) -> Option<()> {
        let mut ranges = Vec::<Range, MAX_DEPTH>::new();
        let mut next = Some(Range { first: 0, end: cells.len(), room: MAX_DEPTH as u8 });
        while let Some(Range { first, end, room }) = next {
            next = if end - first > 1 {
                // A level belongs to a place, not to the cell there. Of this range's places only the
                // last one has its level yet; the last of all keeps the end of the input.
                let after = cells[end - 1].level;
                let middle = first + self.part(&mut cells[first..end], room.into(), probe);
                cells[end - 1].level = after;
                cells[middle - 1].level = Level::split(room);
                let room = room.saturating_sub(1);
                ranges.push(Range { first: middle, end, room }).ok()?;
                Some(Range { first, end: middle, room })
            } else {
                ranges.pop()
            };
        }
        Some(())
    }

    /// Parts two or more cells and returns how many are in the left part.
    fn part<P: Probe>(self, cells: &mut [Cell], room: usize, probe: &mut P) -> usize {
        probe.top_sweep(cells.len());
        let half = cells.len() / 2;
        // A plane may cut off a single cell, so it must leave a level to spare.
        if deepest(cells) + levels(cells.len()) >= room {
            return half;
        }
        let binning = Binning::new(cells, self.bins.count());
        let Some(plane) = binning.best_plane(cells) else { return half };
        let mut left = 0;
        for i in 0..cells.len() {
            if binning.bin(&cells[i], plane.axis) < plane.bin {
                cells.swap(left, i);
                left += 1;
            }
        }
        left
    }
}

/// Twice the centre of a cell's box.
fn centre(cell: &Cell, axis: usize) -> i32 {
    cell.subtree.bounds.min[axis] + cell.subtree.bounds.max[axis]
}

/// How the centres of a range map to bins.
struct Binning {
    bins: usize,
    /// The lowest centre on each axis.
    low: [i32; 3],
    /// One more than the distance to the highest.
    span: [u64; 3],
}

impl Binning {
    fn new(cells: &[Cell], bins: usize) -> Self {
        let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
        for cell in cells {
            for axis in 0..3 {
                let c = centre(cell, axis);
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        let span = [0, 1, 2].map(|axis| u64::from(high[axis].abs_diff(low[axis])) + 1);
        Self { bins, low, span }
    }

    fn bin(&self, cell: &Cell, axis: usize) -> usize {
        let above = u64::from(centre(cell, axis).abs_diff(self.low[axis]));
        (above * self.bins as u64 / self.span[axis]) as usize
    }

    /// The plane to part the cells at, or `None` if no plane parts them.
    fn best_plane(&self, cells: &[Cell]) -> Option<Plane> {
        let mut bins = [[Bin::EMPTY; MAX_BINS]; 3];
        for cell in cells {
            let one = Bin { bounds: cell.subtree.bounds, weight: u64::from(cell.size), cells: 1 };
            for (axis, bins) in bins.iter_mut().enumerate() {
                // Below the number of bins, as centres are below low + span.
                bins[self.bin(cell, axis)].add(&one);
            }
        }
        let mut best = None;
        for (axis, bins) in bins.iter().enumerate() {
            let bins = &bins[..self.bins];
            let mut rights = [Bin::EMPTY; MAX_BINS];
            let mut right = Bin::EMPTY;
            for (i, bin) in bins.iter().enumerate().rev() {
                right.add(bin);
                rights[i] = right;
            }
            let mut left = Bin::EMPTY;
            for (i, bin) in bins.iter().enumerate() {
                if left.cells > 0 && rights[i].cells > 0 {
                    let uneven = left.cells.abs_diff(rights[i].cells);
                    let cost = (left.cost() + rights[i].cost(), uneven);
                    if best.is_none_or(|(lowest, _)| cost < lowest) {
                        best = Some((cost, Plane { axis, bin: i }));
                    }
                }
                left.add(bin);
            }
        }
        best.map(|(_, plane)| plane)
    }
}

/// `ceil(log2 n)`, the depth of the shallowest tree over `n` cells.
fn levels(n: usize) -> usize {
    n.next_power_of_two().trailing_zeros() as usize
}

/// Nodes on the longest way down any of the cells.
fn deepest(cells: &[Cell]) -> usize {
    cells.iter().map(|cell| usize::from(cell.depth)).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Child, Subtree};
    use glam::IVec3;

    fn cell(number: u32, at: [i32; 3], size: u32, depth: u8) -> Cell {
        let at = IVec3::from(at);
        let child = Child::Leaf { first: number, count: size };
        let subtree = Subtree { bounds: Aabb::new(at, at + IVec3::ONE), child };
        let level = Level::split(number as u8);
        Cell { subtree, level, depth, size }
    }

    fn number(cell: &Cell) -> u32 {
        match cell.subtree.child {
            Child::Leaf { first, .. } => first,
            Child::Inner(_) => u32::MAX,
        }
    }

    /// Nodes on the longest way that the levels give.
    fn depth(cells: &[Cell]) -> usize {
        let inside = cells.len() - 1;
        let top = (0..inside).max_by_key(|&i| cells[i].level);
        match top {
            None => cells[0].depth.into(),
            Some(i) => 1 + depth(&cells[..=i]).max(depth(&cells[i + 1..])),
        }
    }

    #[test]
    fn clusters_are_parted_before_their_members() {
        let places = [0, 500, 3, 503, 6, 506].map(|y| [0, y, 0]);
        let mut cells = [0, 1, 2, 3, 4, 5].map(|i| cell(i, places[i as usize], 1, 0));
        cells[5].level = Level::INFINITE;
        Binned::default().arrange(&mut cells, &mut ()).unwrap();
        let mut sides = cells.each_ref().map(|c| number(c) % 2);
        assert!(sides.is_sorted());
        sides.sort_unstable();
        let levels = cells.map(|c| c.level);
        assert_eq!(levels[5], Level::INFINITE);
        assert!((0..5).all(|i| i == 2 || levels[i] < levels[2]), "{levels:?}");
    }

    #[test]
    fn the_weight_of_a_cell_is_its_primitives() {
        // One heavy cell, and three light ones that are nearer to it than to each other: the heavy one
        // is alone on its side.
        let places = [0, 40, 80, 120].map(|x| [x, 0, 0]);
        let mut cells =
            [0, 1, 2, 3].map(|i| cell(i, places[i as usize], if i == 3 { 99 } else { 1 }, 0));
        cells[3].level = Level::INFINITE;
        Binned { bins: Bins::Eight }.arrange(&mut cells, &mut ()).unwrap();
        assert_eq!(number(&cells[3]), 3);
        assert!(cells[2].level > cells[0].level.max(cells[1].level));
    }

    #[test]
    fn equal_cells_are_halved_in_their_order() {
        let mut cells = [0; 64].map(|_| cell(0, [5, 5, 5], 1, 0));
        cells[63].level = Level::INFINITE;
        Binned::default().arrange(&mut cells, &mut ()).unwrap();
        assert_eq!(depth(&cells), 6);
    }

    #[test]
    fn a_tree_gets_no_deeper_than_it_may() {
        // Each sweep would cut off one cell: distances double.
        let far = |i: u32| [1 << (i % 22), 1 << (i / 22 % 22), 0];
        for below in [0, 60, 86, 89] {
            let mut cells = [0; 64].map(|_| cell(0, [0; 3], 1, 0));
            for (i, c) in cells.iter_mut().enumerate() {
                *c = cell(i as u32, far(i as u32), 1, below);
            }
            cells[63].level = Level::INFINITE;
            Binned::default().arrange(&mut cells, &mut ()).unwrap();
            assert!(depth(&cells) <= MAX_DEPTH, "{below}: {}", depth(&cells));
            assert!(below < 89 || depth(&cells) == MAX_DEPTH);
        }
    }
}
