//! The slab test in fixed point.

use crate::compress::{CellBox, Context};
use crate::geom::{Aabb, Ray};

/// The distances of a ray's origin to the near and far planes of a box, per axis, in mantissa
/// units ([`crate::num::PlaneOffset`]): near ones rounded down, far ones rounded up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Slabs {
    /// To the plane that the ray crosses first.
    pub near: [i32; 3],
    /// To the plane that the ray crosses last.
    pub far: [i32; 3],
}

/// A time before every representable one.
const BEFORE: i64 = i64::MIN;

/// A time after every representable one.
const AFTER: i64 = i64::MAX;

impl Slabs {
    /// The planes of `bounds`, whose corners are at most 2²³ grid units from the centre.
    #[inline]
    pub fn new(ray: &Ray, bounds: &Aabb) -> Self {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        let mut slabs = Self { near: [0; 3], far: [0; 3] };
        for (i, axis) in ray.axes().iter().enumerate() {
            // The planes change places and their distances sign with the direction, without a branch.
            let flip = -i64::from(axis.negative);
            let swap = (min[i] ^ max[i]) & flip as i32;
            let (near, far) = (min[i] ^ swap, max[i] ^ swap);
            let to =
                |plane: i32| (((i64::from(plane) << 6) - i64::from(axis.origin)) ^ flip) - flip;
            slabs.near[i] = axis.reciprocal.offset_down(to(near)).to_bits();
            slabs.far[i] = axis.reciprocal.offset_up(to(far)).to_bits();
        }
        slabs
    }

    /// The planes of the box `child`, found from those of the node that holds it: `self` are that
    /// node's planes and `parent` is its context, on whose local grid `child` lies.
    ///
    /// Each plane is a step of some cells away, a multiplication of the 24-bit mantissa by a 7-bit
    /// count. The near plane's step is rounded down, and so is the far plane's, which is counted
    /// inward from the parent's *far* plane and subtracted: near distances only err downward and far
    /// ones upward, however deep the tree.
    #[inline(always)]
    pub fn step(&self, ray: &Ray, parent: &Context, child: &CellBox) -> Self {
        let mut slabs = *self;
        for (i, axis) in ray.axes().iter().enumerate() {
            // Cells from the parent's lower plane to the child's, and from the child's upper plane
            // to the parent's.
            let below = i32::from(child.low[i]);
            let above = i32::from(parent.cells[i]) - below - i32::from(child.width[i]);
            // Exchanged if the ray comes from above, without a branch.
            let flip = (below ^ above) & -i32::from(axis.negative);
            let (near, far) = (below ^ flip, above ^ flip);
            let scale = u32::from(parent.scale[i]);
            let inward = |cells| axis.reciprocal.step_down(cells, scale).to_bits();
            slabs.near[i] = slabs.near[i].wrapping_add(inward(near));
            slabs.far[i] = slabs.far[i].wrapping_sub(inward(far));
        }
        slabs
    }

    /// The time at which the ray enters the box, rounded down, if it passes through the box within
    /// `t_min < t <= t_max`; both are in units of 2⁻⁶.
    ///
    /// On an axis that the ray does not move along, the origin must lie between the planes, which
    /// is decided exactly.
    #[inline(always)]
    pub fn entry(&self, ray: &Ray, t_min: i64, t_max: i64) -> Option<i64> {
        let (enter, leave) = if ray.is_axis_parallel() {
            self.parallel_interval(ray)
        } else {
            let shift = ray.axes().each_ref().map(|axis| axis.reciprocal.shift());
            let near = |i: usize| i64::from(self.near[i]) << shift[i];
            let far = |i: usize| i64::from(self.far[i]) << shift[i];
            (near(0).max(near(1)).max(near(2)), far(0).min(far(1)).min(far(2)))
        };
        (enter <= leave && leave > t_min && enter <= t_max).then_some(enter)
    }

    /// When a ray with a direction component of zero enters and leaves.
    #[cold]
    fn parallel_interval(&self, ray: &Ray) -> (i64, i64) {
        let (mut enter, mut leave) = (BEFORE, AFTER);
        for (i, axis) in ray.axes().iter().enumerate() {
            let (near, far) = (i64::from(self.near[i]), i64::from(self.far[i]));
            let (near, far) = if axis.zero {
                (if near <= 0 { BEFORE } else { AFTER }, if far >= 0 { AFTER } else { BEFORE })
            } else {
                let shift = axis.reciprocal.shift();
                (near << shift, far << shift)
            };
            enter = enter.max(near);
            leave = leave.min(far);
        }
        (enter, leave)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::{SubGrid, Time};
    use glam::IVec3;

    fn ray(origin: [f32; 3], direction: [i32; 3]) -> Ray {
        let o = origin.map(SubGrid::from_num);
        Ray::new(o, IVec3::from(direction), Time::ZERO, Ray::TIME_LIMIT).unwrap()
    }

    fn hits(ray: &Ray, bounds: &Aabb) -> bool {
        Slabs::new(ray, bounds).entry(ray, 0, ray.t_max().to_bits()).is_some()
    }

    #[test]
    fn an_axis_parallel_ray_in_a_face_plane_hits_and_one_beside_it_misses() {
        let bounds = Aabb::new(IVec3::new(0, 0, 0), IVec3::new(10, 10, 10));
        for z in [-5.0, 15.0f32] {
            let d = if z < 0.0 { 1 << 30 } else { -(1 << 30) };
            for (x, y, inside) in [
                (0.0, 5.0, true),
                (10.0, 10.0, true),
                (10.015625, 5.0, false),
                (5.0, -0.015625, false),
            ] {
                assert_eq!(hits(&ray([x, y, z], [0, 0, d]), &bounds), inside, "{x} {y} {z}");
            }
        }
    }

    #[test]
    fn a_box_behind_the_origin_is_missed_and_one_around_it_is_hit() {
        let bounds = Aabb::new(IVec3::splat(-4), IVec3::splat(4));
        let d = [1 << 30, 3, -7];
        assert!(hits(&ray([0.0, 0.0, 0.0], d), &bounds));
        assert!(hits(&ray([-9.0, 0.0, 0.0], d), &bounds));
        assert!(!hits(&ray([9.0, 0.0, 0.0], d), &bounds));
    }

    #[test]
    fn the_interval_cuts_boxes_off() {
        let bounds = Aabb::new(IVec3::new(10, -1, -1), IVec3::new(12, 1, 1));
        let r = ray([0.0, 0.0, 0.0], [1 << 30, 0, 0]);
        let slabs = Slabs::new(&r, &bounds);
        let time = |t: i32| i64::from(t) << 6;
        assert!(slabs.entry(&r, 0, time(9)).is_none());
        assert!(slabs.entry(&r, 0, time(10)).is_some());
        assert!(slabs.entry(&r, time(11), time(99)).is_some());
        assert!(slabs.entry(&r, time(13), time(99)).is_none());
    }
}
