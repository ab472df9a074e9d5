//! Traversal contexts and the coordinates that depend on them.

use glam::IVec3;

use crate::geom::Aabb;
use crate::node::{Child, NodeFormat, QuantizedChild};
use crate::num::Grid;

/// `N`, the width of a quantized coordinate in bits.
pub const QUANT_BITS: u32 = 6;

/// The most cells that a box spans on its local grid.
const MAX_CELLS: i32 = 1 << QUANT_BITS;

/// The finest local grid: one grid unit. On an integer grid this is the minimum scale of P3 §4.4 by
/// nature.
const MIN_SCALE: u32 = 0;

/// How a quantized coordinate names a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Coordinates {
    /// Counted from the parent's lower bound; the upper bound is stored less one (P3 Eq. 1).
    Relative,
    /// The cell's number on the scene-wide grid of that scale, modulo 2⁶ (P3 Eqs. 7–8).
    Modulo,
}

impl Coordinates {
    /// The node format with these coordinates.
    pub const fn format(self) -> NodeFormat {
        match self {
            Self::Relative => NodeFormat::QuantizedRelative,
            Self::Modulo => NodeFormat::QuantizedModulo,
        }
    }
}

/// What a reader must know of a node to decode its children: the traversal context of P3 §3.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Context {
    /// The local grid's cell is `2^scale` grid units wide, per axis.
    pub scale: [u8; 3],
    /// How many cells the node's decoded box spans, 1 to 64.
    pub cells: [u8; 3],
    /// The cell number of the decoded lower bound, modulo 2⁶.
    pub low: [u8; 3],
}

/// A child's decoded box in cells of the parent's local grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellBox {
    /// Cells between the parent's lower bound and the child's (`r`), 0 to 63.
    pub low: [u8; 3],
    /// Cells between the child's lower and upper bound, 1 to 64.
    pub width: [u8; 3],
}

impl Context {
    /// Decodes a child, or `None` if its box leaves its parent's, which no encoder writes.
    ///
    /// P3 Fig. 4 line 4 computes a modulo upper bound as a distance from the parent's lower bound;
    /// that loses the case of an upper bound exactly 2⁶ cells above it with a lower bound that is
    /// not equal to it. Here the width comes first: it is never 0, so it has a unique value modulo
    /// 2⁶.
    #[inline]
    pub fn decode(&self, child: &QuantizedChild, coordinates: Coordinates) -> Option<CellBox> {
        let mask = (MAX_CELLS - 1) as u8;
        let mut cell_box = CellBox { low: [0; 3], width: [0; 3] };
        let mut inside = true;
        for axis in 0..3 {
            let (low, high) = (child.low[axis], child.high[axis]);
            let (r, width) = match coordinates {
                Coordinates::Relative => {
                    inside &= low <= high;
                    (low, high.wrapping_sub(low).wrapping_add(1))
                }
                Coordinates::Modulo => (
                    low.wrapping_sub(self.low[axis]) & mask,
                    (high.wrapping_sub(low).wrapping_sub(1) & mask) + 1,
                ),
            };
            inside &= r.wrapping_add(width) <= self.cells[axis];
            cell_box.low[axis] = r;
            cell_box.width[axis] = width;
        }
        inside.then_some(cell_box)
    }

    /// The context of a child whose decoded box is `child`.
    ///
    /// Its grid is the finest one on which the box spans at most 2⁶ cells (P3 Eq. 2). P3 Fig. 4
    /// stops one step short where that would be exactly 2⁶; the equation is followed here.
    #[inline]
    pub fn child(&self, child: &CellBox) -> Self {
        let mut context = *self;
        for axis in 0..3 {
            let width = child.width[axis];
            let finer = finer_by(width).min(u32::from(self.scale[axis]) - MIN_SCALE);
            context.scale[axis] = self.scale[axis] - finer as u8;
            context.cells[axis] = width << finer;
            // P3 Fig. 4 line 1. The shift is at most 6, so bits that leave the byte were above 2⁶.
            let low = u32::from(self.low[axis]) + u32::from(child.low[axis]);
            context.low[axis] = ((low << finer) & (MAX_CELLS as u32 - 1)) as u8;
        }
        context
    }
}

/// `floor(log2(64 / width))`, for a width of 1 to 64 cells.
#[inline]
fn finer_by(width: u8) -> u32 {
    QUANT_BITS - (u8::BITS - (width - 1).leading_zeros())
}

/// A context and the place of the decoded box in the scene, as an encoder needs it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Placement {
    /// The context.
    pub context: Context,
    /// The decoded lower bound, in grid units; a multiple of the cell size.
    pub lower: IVec3,
}

impl Placement {
    /// The placement of a root with exact box `bounds`, or `None` if that is no box on the grid.
    ///
    /// The grid is the finest on which the box, rounded outward, spans at most 2⁶ cells. As it
    /// depends on the box alone, encoder and reader find the same one.
    pub fn root(bounds: &Aabb) -> Option<Self> {
        if !is_on_grid(bounds) {
            return None;
        }
        let mut context = Context { scale: [0; 3], cells: [0; 3], low: [0; 3] };
        let mut lower = IVec3::ZERO;
        for axis in 0..3 {
            let (p, q) = (bounds.min[axis], bounds.max[axis]);
            let span = |scale: u32| (q >> scale) + 1 - (p >> scale);
            let mut scale = MIN_SCALE;
            while span(scale) > MAX_CELLS {
                scale += 1;
            }
            context.scale[axis] = scale as u8;
            context.cells[axis] = span(scale) as u8;
            context.low[axis] = (p >> scale & (MAX_CELLS - 1)) as u8;
            lower[axis] = p >> scale << scale;
        }
        Some(Self { context, lower })
    }

    /// The decoded box: half-open in the sense that its upper bound is above every point inside.
    pub fn decoded(&self) -> Aabb {
        let upper = |axis: usize| {
            self.lower[axis] + (i32::from(self.context.cells[axis]) << self.context.scale[axis])
        };
        Aabb::new(self.lower, IVec3::new(upper(0), upper(1), upper(2)))
    }

    /// Encodes a child with exact box `bounds`, or gives `None` if it leaves this node's box.
    ///
    /// The lower bound is rounded down and the upper bound rounded down plus one cell, also where
    /// it is exact (P3 Eq. 1): no decoded box has zero width, and each encloses the exact box with
    /// its upper planes strictly outside. All of it is floor division in two's complement, where
    /// P3 Fig. 5 rounds magnitudes and so rounds negative numbers up.
    pub fn encode(
        &self,
        bounds: &Aabb,
        child: Child,
        coordinates: Coordinates,
    ) -> Option<(QuantizedChild, CellBox)> {
        if !is_on_grid(bounds) {
            return None;
        }
        let mut out = QuantizedChild { low: [0; 3], high: [0; 3], child };
        let mut cell_box = CellBox { low: [0; 3], width: [0; 3] };
        for axis in 0..3 {
            let scale = u32::from(self.context.scale[axis]);
            let low = bounds.min[axis] >> scale;
            let high = (bounds.max[axis] >> scale) + 1;
            let r = low - (self.lower[axis] >> scale);
            let s = high - (self.lower[axis] >> scale);
            if r < 0 || s <= r || s > i32::from(self.context.cells[axis]) {
                return None;
            }
            cell_box.low[axis] = r as u8;
            cell_box.width[axis] = (s - r) as u8;
            let (stored_low, stored_high) = match coordinates {
                Coordinates::Relative => (r, s - 1),
                Coordinates::Modulo => (low & (MAX_CELLS - 1), high & (MAX_CELLS - 1)),
            };
            out.low[axis] = stored_low as u8;
            out.high[axis] = stored_high as u8;
        }
        Some((out, cell_box))
    }

    /// The placement of a child whose decoded box is `child`.
    pub fn child(&self, child: &CellBox) -> Self {
        let offset = |axis: usize| i32::from(child.low[axis]) << self.context.scale[axis];
        let lower = self.lower + IVec3::new(offset(0), offset(1), offset(2));
        Self { context: self.context.child(child), lower }
    }
}

/// Whether this is a box of the grid, so that its coordinates can be counted from any other.
fn is_on_grid(bounds: &Aabb) -> bool {
    let grid = Grid::DEFAULT;
    bounds.is_valid() && grid.contains(bounds.min) && grid.contains(bounds.max)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHILD: Child = Child::Leaf { first: 0, count: Child::TO_MARK };

    struct Random(u64);

    impl Random {
        fn below(&mut self, n: i32) -> i32 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((self.0 >> 33) % n as u64) as i32
        }

        /// A box inside `outer`, of any size down to a point.
        fn box_inside(&mut self, outer: &Aabb) -> Aabb {
            let mut inner = *outer;
            for axis in 0..3 {
                let side = outer.max[axis] - outer.min[axis];
                let keep = side >> self.below(12);
                let start = outer.min[axis] + self.below(side - keep + 1);
                inner.min[axis] = start;
                inner.max[axis] = start + keep;
            }
            inner
        }
    }

    #[test]
    fn chains_of_boxes_decode_to_boxes_that_enclose_them_in_both_coordinates() {
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        for seed in 0..500 {
            let mut random = Random(seed);
            let mut exact = random.box_inside(&all);
            let mut placement = Placement::root(&exact).unwrap();
            for _ in 0..12 {
                let decoded = placement.decoded();
                assert!(decoded.contains(&exact) && decoded.max.cmpgt(exact.max).all(), "{seed}");
                let inner = random.box_inside(&exact);
                let (relative, cells) =
                    placement.encode(&inner, CHILD, Coordinates::Relative).unwrap();
                let (modulo, _) = placement.encode(&inner, CHILD, Coordinates::Modulo).unwrap();
                let context = placement.context;
                assert_eq!(context.decode(&relative, Coordinates::Relative), Some(cells), "{seed}");
                assert_eq!(context.decode(&modulo, Coordinates::Modulo), Some(cells), "{seed}");
                placement = placement.child(&cells);
                exact = inner;
            }
        }
    }

    #[test]
    fn a_child_grid_is_the_finest_that_holds_the_child() {
        for width in 1..=64u8 {
            let context = Context { scale: [9; 3], cells: [64; 3], low: [5; 3] };
            let child = context.child(&CellBox { low: [0; 3], width: [width; 3] });
            let finer = 9 - child.scale[0];
            assert_eq!(child.cells[0], width << finer);
            assert!(child.cells[0] <= 64 && u32::from(child.cells[0]) * 2 > 64);
            assert_eq!(u32::from(child.low[0]), (5 << finer) & 63);
        }
    }

    #[test]
    fn the_finest_grid_is_one_grid_unit() {
        let context = Context { scale: [0, 1, 2], cells: [64; 3], low: [0; 3] };
        let child = context.child(&CellBox { low: [1; 3], width: [1; 3] });
        assert_eq!((child.scale, child.cells, child.low), ([0; 3], [1, 2, 4], [1, 2, 4]));
    }

    #[test]
    fn a_point_has_a_cell_and_the_whole_grid_64() {
        let point = Placement::root(&Aabb::new(IVec3::ONE, IVec3::ONE)).unwrap();
        assert_eq!(point.context.cells, [1; 3]);
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        let root = Placement::root(&all).unwrap();
        assert_eq!((root.context.scale, root.context.cells), ([18; 3], [64; 3]));
        assert_eq!(Placement::root(&Aabb::EMPTY), None);
    }

    #[test]
    fn children_that_leave_their_parent_are_not_decoded() {
        let context = Context { scale: [3; 3], cells: [40; 3], low: [60; 3] };
        let child =
            |low: u8, high: u8| QuantizedChild { low: [low; 3], high: [high; 3], child: CHILD };
        assert!(context.decode(&child(39, 39), Coordinates::Relative).is_some());
        assert_eq!(context.decode(&child(39, 40), Coordinates::Relative), None);
        assert_eq!(context.decode(&child(3, 2), Coordinates::Relative), None);
        // 60 + 40 = 100 = 36 modulo 64.
        assert!(context.decode(&child(60, 36), Coordinates::Modulo).is_some());
        assert_eq!(context.decode(&child(60, 37), Coordinates::Modulo), None);
        assert_eq!(context.decode(&child(59, 60), Coordinates::Modulo), None);
    }
}
