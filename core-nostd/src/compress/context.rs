//! Traversal contexts and the coordinates that depend on them.

use glam::IVec3;

use crate::geom::Aabb;
use crate::node::{Child, Coordinates, Quantization, QuantizedChild};
use crate::num::Grid;

/// What a reader must know of a node to decode its children: the traversal context of P3 §3.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Context {
    /// The local grid's cell is `2^scale` grid units wide, per axis.
    pub scale: [u8; 3],
    /// How many cells the node's decoded box spans, 1 to 2^N.
    pub cells: [u16; 3],
    /// The cell number of the decoded lower bound, modulo 2^N.
    pub low: [u8; 3],
}

/// A child's decoded box in cells of the parent's local grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellBox {
    /// Cells between the parent's lower bound and the child's (`r`), below 2^N.
    pub low: [u8; 3],
    /// Cells between the child's lower and upper bound, 1 to 2^N.
    pub width: [u16; 3],
}

impl Context {
    /// Decodes a child, or `None` if its box leaves its parent's, which no encoder writes.
    ///
    /// P3 Fig. 4 line 4 computes a modulo upper bound as a distance from the parent's lower bound;
    /// that loses the case of an upper bound exactly 2^N cells above it with a lower bound that is
    /// not equal to it. Here the width comes first: it is never 0, so it has a unique value modulo
    /// 2^N.
    #[inline(always)]
    pub fn decode(&self, child: &QuantizedChild, quantization: &Quantization) -> Option<CellBox> {
        let mask = quantization.max_cells() as u16 - 1;
        let mut cell_box = CellBox { low: [0; 3], width: [0; 3] };
        let mut inside = true;
        for axis in 0..3 {
            let (low, high) = (u16::from(child.low[axis]), u16::from(child.high[axis]));
            let (r, width) = match quantization.coordinates {
                Coordinates::Relative => {
                    inside &= low <= high;
                    (low, high.wrapping_sub(low).wrapping_add(1))
                }
                Coordinates::Modulo => (
                    low.wrapping_sub(u16::from(self.low[axis])) & mask,
                    (high.wrapping_sub(low).wrapping_sub(1) & mask) + 1,
                ),
            };
            inside &= r.wrapping_add(width) <= self.cells[axis];
            cell_box.low[axis] = r as u8;
            cell_box.width[axis] = width;
        }
        inside.then_some(cell_box)
    }

    /// The context of a child whose decoded box is `child`.
    ///
    /// Its grid is the finest one on which the box spans at most 2^N cells (P3 Eq. 2), but no finer
    /// than the minimum scale. P3 Fig. 4 stops one step short where the box would span exactly 2^N;
    /// the equation is followed here.
    #[inline(always)]
    pub fn child(&self, child: &CellBox, quantization: &Quantization) -> Self {
        let (bits, mask) = (u32::from(quantization.bits), quantization.max_cells() as u32 - 1);
        let mut context = *self;
        for axis in 0..3 {
            let width = child.width[axis];
            // floor(log2(2^N / width))
            let finer = bits.saturating_sub(u16::BITS - (width.wrapping_sub(1)).leading_zeros());
            let finer =
                finer.min(u32::from(self.scale[axis].saturating_sub(quantization.min_scale)));
            context.scale[axis] = self.scale[axis] - finer as u8;
            context.cells[axis] = width << finer;
            // P3 Fig. 4 line 1. The shift is at most N, so bits that leave the field were above 2^N.
            let low = u32::from(self.low[axis]) + u32::from(child.low[axis]);
            context.low[axis] = ((low << finer) & mask) as u8;
        }
        context
    }
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
    /// The placement of a root with exact box `bounds`, or `None` if that is no box on the grid or
    /// the quantization has parameters out of range.
    ///
    /// The grid is the finest on which the box, rounded outward, spans at most 2^N cells. As it
    /// depends on the box alone, encoder and reader find the same one.
    pub fn root(bounds: &Aabb, quantization: &Quantization) -> Option<Self> {
        Self::estimate(bounds, quantization, 0)
    }

    /// The placement in which a node with exact box `bounds` is encoded before its parent is known (P3
    /// §4.1), or `None` as in [`Placement::root`].
    ///
    /// The grid is the finest on which the box spans at most 2^N cells once it is rounded outward to a
    /// grid that is coarser by `margin` powers of two: its parent's grid, on which it will be
    /// encoded. With a margin of 0, which is P3's estimate, a box just below 2^N cells is encoded on a grid
    /// that its parent's rounding then makes too fine. With 0 the grid is never coarser than the final one,
    /// so repairs lose nothing and the tree is the one that [`compress_top_down`] makes.
    ///
    /// [`compress_top_down`]: super::compress_top_down
    pub fn estimate(bounds: &Aabb, quantization: &Quantization, margin: u8) -> Option<Self> {
        let margin = u32::from(margin);
        if !is_on_grid(bounds) || quantization.check().is_err() {
            return None;
        }
        let max_cells = quantization.max_cells();
        let mut context = Context { scale: [0; 3], cells: [0; 3], low: [0; 3] };
        let mut lower = IVec3::ZERO;
        for axis in 0..3 {
            let (p, q) = (bounds.min[axis], bounds.max[axis]);
            let span = |scale: u32| (q >> scale) + 1 - (p >> scale);
            let mut scale = u32::from(quantization.min_scale);
            while scale + margin < u32::BITS - 1 && span(scale + margin) << margin > max_cells {
                scale += 1;
            }
            context.scale[axis] = scale as u8;
            context.cells[axis] = span(scale) as u16;
            context.low[axis] = (p >> scale & (max_cells - 1)) as u8;
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
        quantization: &Quantization,
    ) -> Option<(QuantizedChild, CellBox)> {
        if !is_on_grid(bounds) {
            return None;
        }
        let mask = quantization.max_cells() - 1;
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
            cell_box.width[axis] = (s - r) as u16;
            let (stored_low, stored_high) = match quantization.coordinates {
                Coordinates::Relative => (r, s - 1),
                Coordinates::Modulo => (low & mask, high & mask),
            };
            out.low[axis] = stored_low as u8;
            out.high[axis] = stored_high as u8;
        }
        Some((out, cell_box))
    }

    /// Whether a node that was encoded in this placement must be encoded again for placement `new`.
    ///
    /// Modulo coordinates name cells of a scene-wide grid: they stay right while its scale does (P3
    /// §4.2). Relative ones must also count from the same lower bound; the number of its cell modulo
    /// 2^N tells, as both boxes hold the same exact one and span 2^N cells at most. Boxes that were
    /// encoded on a coarser grid before may also stick out of a decoded box that has become smaller.
    pub fn is_outdated(&self, new: &Self, quantization: &Quantization) -> bool {
        let (old, now) = (&self.context, &new.context);
        let moved = quantization.coordinates == Coordinates::Relative && old.low != now.low;
        old.scale != now.scale || moved || !new.decoded().contains(&self.decoded())
    }

    /// Encodes a child of a node in this placement again for placement `new`, or gives `None` for one
    /// that no encoder wrote. Beside its code come the placements of the child before and after.
    pub fn recode(
        &self,
        new: &Self,
        child: &QuantizedChild,
        quantization: &Quantization,
    ) -> Option<(QuantizedChild, [Self; 2])> {
        let cells = self.context.decode(child, quantization)?;
        let bounds = self.inclusive(&cells, new);
        let (code, recoded) = new.encode(&bounds, child.child, quantization)?;
        Some((code, [self.child(&cells, quantization), new.child(&recoded, quantization)]))
    }

    /// The decoded box of a child, with its upper bound inside, cut to its parent's new box.
    ///
    /// Decoded upper bounds are outside a box by P3 Eq. 1, so that rounding one again must not add
    /// another cell to it. The exact box is in both the child's and the parent's.
    fn inclusive(&self, child: &CellBox, new: &Self) -> Aabb {
        let scale = self.context.scale;
        let low = |axis: usize| self.lower[axis] + (i32::from(child.low[axis]) << scale[axis]);
        let high = |axis: usize| low(axis) + (i32::from(child.width[axis]) << scale[axis]) - 1;
        let decoded = new.decoded();
        Aabb::new(
            IVec3::new(low(0), low(1), low(2)).max(decoded.min),
            IVec3::new(high(0), high(1), high(2)).min(decoded.max - IVec3::ONE),
        )
    }

    /// The placement of a child whose decoded box is `child`.
    pub fn child(&self, child: &CellBox, quantization: &Quantization) -> Self {
        let offset = |axis: usize| i32::from(child.low[axis]) << self.context.scale[axis];
        let lower = self.lower + IVec3::new(offset(0), offset(1), offset(2));
        Self { context: self.context.child(child, quantization), lower }
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
    use crate::testing::{Random, cases};

    const CHILD: Child = Child::Leaf { first: 0, count: Child::TO_MARK };

    /// A box inside `outer`, of any size down to a point.
    fn box_inside(random: &mut Random, outer: &Aabb) -> Aabb {
        let mut inner = *outer;
        for axis in 0..3 {
            let side = outer.max[axis] - outer.min[axis];
            let keep = side >> random.below(12);
            let start = outer.min[axis] + random.below(side - keep + 1);
            inner.min[axis] = start;
            inner.max[axis] = start + keep;
        }
        inner
    }

    #[test]
    fn chains_of_boxes_decode_to_boxes_that_enclose_them_in_both_coordinates() {
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        for seed in 0..cases(1000) {
            let mut random = Random(seed.into());
            let bits = 4 + random.below(5) as u8;
            let min_scale = (random.below(16) * random.below(2)) as u8;
            let relative = Quantization { bits, min_scale, ..Quantization::RELATIVE };
            let modulo = Quantization { bits, min_scale, ..Quantization::MODULO };
            let mut exact = box_inside(&mut random, &all);
            let mut placement = Placement::root(&exact, &relative).unwrap();
            for _ in 0..12 {
                let decoded = placement.decoded();
                assert!(decoded.contains(&exact) && decoded.max.cmpgt(exact.max).all(), "{seed}");
                let inner = box_inside(&mut random, &exact);
                let (first, cells) = placement.encode(&inner, CHILD, &relative).unwrap();
                let (second, _) = placement.encode(&inner, CHILD, &modulo).unwrap();
                let context = placement.context;
                assert_eq!(context.decode(&first, &relative), Some(cells), "{seed}");
                assert_eq!(context.decode(&second, &modulo), Some(cells), "{seed}");
                placement = placement.child(&cells, &relative);
                exact = inner;
            }
        }
    }

    #[test]
    fn a_child_grid_is_the_finest_that_holds_the_child() {
        for bits in Quantization::WIDTHS {
            let quantization = Quantization { bits, ..Quantization::MODULO };
            let top = 1u16 << bits;
            for width in 1..=top {
                let context = Context { scale: [9; 3], cells: [top; 3], low: [5; 3] };
                let cells = CellBox { low: [0; 3], width: [width; 3] };
                let child = context.child(&cells, &quantization);
                let finer = 9 - child.scale[0];
                assert_eq!(child.cells[0], width << finer);
                assert!(child.cells[0] <= top && child.cells[0] * 2 > top);
                assert_eq!(u16::from(child.low[0]), (5 << finer) & (top - 1));
            }
        }
    }

    #[test]
    fn no_grid_is_finer_than_the_minimum_scale() {
        for min_scale in [0, 3] {
            let quantization = Quantization { min_scale, ..Quantization::MODULO };
            let scale = [0, 1, 2].map(|finer| min_scale + finer);
            let context = Context { scale, cells: [64; 3], low: [5; 3] };
            let child = context.child(&CellBox { low: [1; 3], width: [1; 3] }, &quantization);
            let (cells, low) = ([1, 2, 4], [6, 12, 24]);
            assert_eq!((child.scale, child.cells, child.low), ([min_scale; 3], cells, low));
            let point = Aabb::new(IVec3::splat(77), IVec3::splat(77));
            assert_eq!(
                Placement::root(&point, &quantization).unwrap().context.scale,
                [min_scale; 3]
            );
        }
    }

    #[test]
    fn a_point_has_a_cell_and_the_whole_grid_64() {
        let quantization = Quantization::RELATIVE;
        let point = Placement::root(&Aabb::new(IVec3::ONE, IVec3::ONE), &quantization).unwrap();
        assert_eq!(point.context.cells, [1; 3]);
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        let root = Placement::root(&all, &quantization).unwrap();
        assert_eq!((root.context.scale, root.context.cells), ([18; 3], [64; 3]));
        assert_eq!(Placement::root(&Aabb::EMPTY, &quantization), None);
        assert_eq!(Placement::root(&all, &Quantization { bits: 9, ..quantization }), None);
    }

    #[test]
    fn children_that_leave_their_parent_are_not_decoded() {
        let context = Context { scale: [3; 3], cells: [40; 3], low: [60; 3] };
        let child =
            |low: u8, high: u8| QuantizedChild { low: [low; 3], high: [high; 3], child: CHILD };
        let (relative, modulo) = (Quantization::RELATIVE, Quantization::MODULO);
        assert!(context.decode(&child(39, 39), &relative).is_some());
        assert_eq!(context.decode(&child(39, 40), &relative), None);
        assert_eq!(context.decode(&child(3, 2), &relative), None);
        // 60 + 40 = 100 = 36 modulo 64.
        assert!(context.decode(&child(60, 36), &modulo).is_some());
        assert_eq!(context.decode(&child(60, 37), &modulo), None);
        assert_eq!(context.decode(&child(59, 60), &modulo), None);
    }
}
