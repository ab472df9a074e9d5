//! The traversal point, moved along.
//!
//! Keely 2014 moves a ray's origin to where the ray enters a node, so that it can be written on that
//! node's local grid with a few bits, and tests the children from there with short numbers. This is
//! an integer version of that idea, rounded so that no hit is lost.
//!
//! # The point
//!
//! The search keeps a node's place and a time `T`, and the point is the ray's at that time:
//! `origin + direction · T`. That is exact: `T` is a multiple of 2⁻⁶ and the direction one of 2⁻³⁰,
//! so the point is one of 2⁻³⁶ grid units, and no error builds up however deep the tree. (A point
//! that is itself kept on the local grid does not work. Its error is a part of the *parent's* cell;
//! boxes shrink on the way down and such an error does not, so that soon it would be wider than the
//! nodes.) Going down by `dT` moves the point by `direction · dT`, and `dT` may be a short number,
//! as any time *before* the ray enters the node will do: a multiplication of 31 by `N + 4` bits on
//! each axis. Only after a pop the point is found again from `T` in full.
//!
//! # The tests
//!
//! Per axis, with the ray's direction taken as positive (else the axis is mirrored, and the plane
//! that is met first is the upper one):
//!
//! - The point, counted from the node's near corner, is rounded down to quarters of a cell, `q`; it
//!   is in `[q, q + 1)`.
//! - The child's planes are `near` and `far` cells from that corner. The distances are at least
//!   `max(4 near - (q + 1), 0)` and at most `4 far - q`; if that is negative, the child is behind.
//! - The reciprocal's mantissa is cut to its upper `M = N + 4` bits, `m`; it is in `[m, m + 1)`. The
//!   near distance is multiplied by `m` and the far one by `m + 1`.
//!
//! The products are rounded outward to 2⁻⁶ grid units and compared across the axes like those of the
//! other methods ([`Slabs::entry`]).
//!
//! # Why nothing is lost
//!
//! By induction, every time of the ray's interval at which the ray is in the node's exact box is at or
//! after `T`. For the root, `T` is the entry time rounded down, or the interval's start. A time at
//! which the ray is in a child's is one at which it is in the node's, so at or after `T`, and from `T`
//! on it takes at least each near plane's product and at most each far plane's. The child's own `T`
//! adds at most the largest of the near planes' products to `T`.
//!
//! # Widths
//!
//! `T` may be early, so that the point is before the node. It falls short of the child's near plane
//! by at most a quarter of a cell for `q`, 2⁻⁵ of one for the rounding of the product, and a part
//! `2^(1-M)` of the distance each for `m` and for `dT`. Let the point be at most `b · 2^N` cells before
//! the node. A child's cells are at most 2^N times finer, so that there
//!
//! ```text
//! b <= 1/4 + 1/32 + (2^N + b · 2^N) · 2 · 2^(1-M) = 17/32 + b/4,    b <= 17/24
//! ```
//!
//! at every level. Distances are then below `2^(N+1)` cells, that is `N + 3` bits; and as `2^N` cells
//! are at most 2²⁴ grid units, products fit 31 bits in units of 2⁻⁶.

use super::Bytes;
use super::cost::{POINT_FRACTION, point_mantissa};
use crate::compress::{CellBox, Placement};
use crate::geom::{Axis, Ray};
use crate::node::{Quantization, Subtree, WideNode};
use crate::traverse::search::{Pending, Traversable};
use crate::traverse::slab::Slabs;

/// A node and the time at which a ray is at its traversal point, which is at or before the first
/// time of the ray's interval at which it is in the node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TraversalPoint {
    /// The node's grid and place.
    pub placement: Placement,
    /// `T`, in units of 2⁻⁶.
    pub time: i64,
}

impl TraversalPoint {
    /// The point of a root whose exact or decoded box the ray enters at `entry`, rounded down, in units
    /// of 2⁻⁶.
    pub fn root(ray: &Ray, placement: Placement, entry: i64) -> Self {
        Self { placement, time: entry.max(ray.t_min().to_bits()) }
    }

    /// The point: its distance from the node's near corner along each axis, in quarters of a cell,
    /// rounded down.
    pub fn position(&self, ray: &Ray) -> [i32; 3] {
        let direction = ray.direction();
        let corners = self.placement.decoded();
        let mut position = [0; 3];
        for (i, axis) in ray.axes().iter().enumerate() {
            let Axis { origin, negative, .. } = *axis;
            let corner = if negative { corners.max[i] } else { corners.min[i] };
            // In units of 2^-36. The sum fits though its terms may not: the point is near the node,
            // and where the ray does not move it is less than 2^26 grid units away.
            let moved = self.time.wrapping_mul(i64::from(direction[i]));
            let point = (i64::from(origin) << 30).wrapping_add(moved);
            let from_corner = point.wrapping_sub(i64::from(corner) << 36);
            let along = if negative { from_corner.wrapping_neg() } else { from_corner };
            let scale = u32::from(self.placement.context.scale[i]);
            position[i] = (along >> (36 - POINT_FRACTION + scale)) as i32;
        }
        position
    }

    /// The distances from the point, which is at `position`, to the planes of `child`: like those of
    /// [`Slabs::step`], but counted from here, and near ones at least 0.
    #[inline]
    pub fn slabs(&self, ray: &Ray, position: &[i32; 3], child: &CellBox, bits: u8) -> Slabs {
        let mantissa = point_mantissa(bits);
        // From quarters of a cell times 2^-M to 2^-6 grid units.
        let drop = POINT_FRACTION + mantissa - 6;
        let context = &self.placement.context;
        let mut slabs = Slabs { near: [0; 3], far: [0; 3] };
        for (i, axis) in ray.axes().iter().enumerate() {
            let (below, width) = (i32::from(child.low[i]), i32::from(child.width[i]));
            let above = i32::from(context.cells[i]) - below - width;
            let near = if axis.negative { above } else { below };
            let to_near = ((near << POINT_FRACTION) - position[i] - 1).max(0);
            let to_far = ((near + width) << POINT_FRACTION) - position[i];
            let m = i64::from(axis.reciprocal.leading(mantissa));
            let scale = context.scale[i];
            let product = i64::from(to_near) * m;
            slabs.near[i] = ((product << scale) >> drop) as i32;
            let product = i64::from(to_far) * (m + 1);
            // Behind the point if negative, and never rounded to 0 then.
            let up = if to_far < 0 { 0 } else { (1 << drop) - 1 };
            slabs.far[i] = (((product << scale) + up) >> drop) as i32;
        }
        slabs
    }

    /// The point of `child`, which the ray enters not before `after` units of 2⁻⁶ from this point.
    /// Only the upper `N + 4` bits of that count.
    #[inline]
    pub fn descend(&self, child: &CellBox, after: i64, quantization: &Quantization) -> Self {
        let bits = i64::BITS - after.leading_zeros();
        let spare = bits.saturating_sub(point_mantissa(quantization.bits));
        let time = self.time + (after >> spare << spare);
        Self { placement: self.placement.child(child, quantization), time }
    }
}

/// Nodes of `N` children, 2 or 4, and any width and coordinates, tested from a point on the ray near the node.
#[derive(Debug)]
pub(in crate::traverse) struct ByPoint<const N: usize>(pub Quantization);

impl<const N: usize> Traversable<N> for ByPoint<N> {
    type Context = TraversalPoint;
    type Bytes = Bytes;
    const EMPTY: Bytes = [0; WideNode::MAX_BYTES];

    fn root(&self, ray: &Ray, root: &Subtree, entry: i64) -> Option<TraversalPoint> {
        Some(TraversalPoint::root(ray, Placement::root(&root.bounds, &self.0)?, entry))
    }

    #[inline(always)]
    fn boxes(&self, bytes: &Bytes) -> usize {
        super::boxes::<N>(&self.0, bytes)
    }

    #[inline(always)]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Bytes,
        point: &TraversalPoint,
        t_max: i64,
    ) -> Option<[Option<Pending<TraversalPoint>>; N]> {
        let position = point.position(ray);
        let (t_min, t_max) = (ray.t_min().to_bits() - point.time, t_max - point.time);
        super::children(&self.0, bytes, &point.placement.context, |cells| {
            let slabs = point.slabs(ray, &position, cells, self.0.bits);
            let after = slabs.entry(ray, t_min, t_max)?;
            let child = point.descend(cells, after, &self.0);
            Some((child.time, child))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;
    use crate::num::{SubGrid, Time};
    use crate::testing::{Random, cases};
    use glam::IVec3;

    /// A grid point and a ray exactly through it.
    fn ray_through_a_point(random: &mut Random) -> (IVec3, Ray) {
        let mut part = |n: i32| random.below(2 * n + 1) - n;
        let target = [(); 3].map(|()| part((1 << 23) - 1));
        let mut direction = [part(16), part(16), part(16)];
        direction[random.below(3) as usize] = if random.below(2) == 0 { 16 } else { -16 };
        let steps = random.below(1 << 23);
        let limit = i64::from(Ray::ORIGIN_LIMIT) << 6;
        let origin = [0, 1, 2].map(|i| {
            // 2^-4 of a grid unit is 4 of the origin's units.
            let back = i64::from(direction[i]) * 4 * i64::from(steps);
            (i64::from(target[i]) << 6) - back
        });
        if origin.iter().any(|o| o.abs() > limit) {
            return ray_through_a_point(random);
        }
        let origin = origin.map(|o| SubGrid::from_bits(o as i32));
        let direction = IVec3::from(direction) << 26;
        let t_min = [Time::ZERO, -Ray::TIME_LIMIT][random.below(2) as usize];
        let ray = Ray::new(origin, direction, t_min, Ray::TIME_LIMIT).unwrap();
        (IVec3::from(target), ray)
    }

    /// A box of the node's grid around the cell of a point: that cell alone, or more.
    fn around(random: &mut Random, placement: &Placement, point: IVec3) -> CellBox {
        let mut cells = CellBox { low: [0; 3], width: [1; 3] };
        let alone = random.below(2) == 0;
        for axis in 0..3 {
            let cell = (point[axis] - placement.lower[axis]) >> placement.context.scale[axis];
            let count = i32::from(placement.context.cells[axis]);
            let below = if alone { 0 } else { random.below(cell + 1) };
            let above = if alone { 0 } else { random.below(count - cell) };
            cells.low[axis] = (cell - below) as u8;
            cells.width[axis] = (below + 1 + above) as u16;
        }
        cells
    }

    #[test]
    fn boxes_around_a_point_of_the_ray_are_hit_and_numbers_keep_their_widths() {
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        // The farthest that a point was before and beyond its node, in 24ths of the largest node.
        let mut farthest = [0; 2];
        for seed in 0..cases(20_000) {
            let mut random = Random(seed.into());
            let bits = 4 + random.below(5) as u8;
            let min_scale = (random.below(16) * random.below(2)) as u8;
            let quantization = Quantization { bits, min_scale, ..Quantization::MODULO };
            let (target, ray) = ray_through_a_point(&mut random);
            let placement = Placement::root(&all, &quantization).unwrap();
            let slabs = Slabs::new(&ray, &placement.decoded());
            let (t_min, t_max) = (ray.t_min().to_bits(), ray.t_max().to_bits());
            let entry = slabs.entry(&ray, t_min, t_max).expect("the point is on the grid");
            let mut point = TraversalPoint::root(&ray, placement, entry);
            for _ in 0..12 {
                let position = point.position(&ray);
                let width = 1 << (bits + 2);
                for (q, axis) in position.into_iter().zip(ray.axes()) {
                    if !axis.zero {
                        farthest[0] = farthest[0].max(-q * 24 / width);
                        farthest[1] = farthest[1].max((q - width) * 24 / width);
                    }
                }
                let cells = around(&mut random, &point.placement, target);
                let slabs = point.slabs(&ray, &position, &cells, bits);
                let after = slabs.entry(&ray, t_min - point.time, t_max - point.time);
                let after = after.unwrap_or_else(|| panic!("lost, {seed}: {ray:?} {point:?}"));
                point = point.descend(&cells, after, &quantization);
                assert!(point.time >= t_min && point.time <= t_max);
            }
        }
        let [before, beyond] = farthest;
        assert!((6..=17).contains(&before) && beyond < 24, "{farthest:?}");
    }
}
