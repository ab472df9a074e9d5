//! A ray against a box, exactly, in integers.
//!
//! Written without the core's reciprocals: a plane at distance `x` (in 2⁻⁶ grid units, counted in
//! the ray's direction) is crossed at time `x · 2³⁰ / |d|`, and fractions are compared by
//! multiplying out. Nothing is ever divided or rounded.

use xylem_core::geom::{Aabb, Ray};
use xylem_core::traverse::Slabs;

/// The planes of a closed box as a ray meets them.
#[derive(Clone, Copy, Debug)]
pub struct Planes {
    /// Distances to the planes crossed first; the low planes where the ray does not move.
    near: [i64; 3],
    /// Distances to the planes crossed last; the high planes where the ray does not move.
    far: [i64; 3],
    /// Magnitudes of the direction's components, in 2⁻³⁰.
    speed: [i64; 3],
}

impl Planes {
    /// The planes of `bounds`.
    #[inline]
    pub fn new(ray: &Ray, bounds: &Aabb) -> Self {
        let (origin, direction) = (ray.origin(), ray.direction());
        let mut planes = Self { near: [0; 3], far: [0; 3], speed: [0; 3] };
        for i in 0..3 {
            let to = |plane: i32| i64::from(plane) * 64 - i64::from(origin[i].to_bits());
            let (low, high) = (to(bounds.min[i]), to(bounds.max[i]));
            let d = i64::from(direction[i]);
            planes.speed[i] = d.abs();
            (planes.near[i], planes.far[i]) = if d < 0 { (-high, -low) } else { (low, high) };
        }
        planes
    }

    /// Whether the ray is in the closed box at some real time in `t_min < t <= t_max`, both in
    /// units of 2⁻⁶.
    #[inline]
    pub fn passes(&self, t_min: i64, t_max: i64) -> bool {
        for i in 0..3 {
            let (near, far) = (i128::from(self.near[i]), i128::from(self.far[i]));
            let speed = i128::from(self.speed[i]);
            let reached = near << 30 <= i128::from(t_max) * speed;
            let ahead = far << 30 > i128::from(t_min) * speed;
            // Where the ray does not move, it must lie between the planes.
            let inside = if speed == 0 { near <= 0 && far >= 0 } else { reached && ahead };
            if !inside {
                return false;
            }
        }
        // Distances have 33 bits and speeds 31: the products fit 64.
        let before = |i: usize, j: usize| {
            let (i_near, j_far) = (self.near[i] * self.speed[j], self.far[j] * self.speed[i]);
            self.speed[i] == 0 || self.speed[j] == 0 || i_near <= j_far
        };
        t_min < t_max
            && [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)].iter().all(|&(i, j)| before(i, j))
    }

    /// Whether every near plane is crossed no earlier than `slabs` says, and every far plane no
    /// later.
    #[inline]
    pub fn enclosed_by(&self, ray: &Ray, slabs: &Slabs) -> bool {
        (0..3).all(|i| {
            let (near, far) = (i128::from(slabs.near[i]), i128::from(slabs.far[i]));
            let (exact_near, exact_far) = (i128::from(self.near[i]), i128::from(self.far[i]));
            let speed = i128::from(self.speed[i]);
            if speed == 0 {
                return near <= exact_near && far >= exact_far;
            }
            let shift = ray.axes()[i].reciprocal.shift();
            (near << shift) * speed <= exact_near << 30 && (far << shift) * speed >= exact_far << 30
        })
    }

    /// Whether every near plane that is ahead of the ray at `time` is crossed no earlier than `slabs`,
    /// counted from then, say, and every far plane no later.
    #[inline]
    pub fn enclosed_after(&self, ray: &Ray, time: i64, slabs: &Slabs) -> bool {
        (0..3).all(|i| {
            let speed = i128::from(self.speed[i]);
            // Distances from the ray's place at that time, in units of 2^-36.
            let from = |plane: i64| (i128::from(plane) << 30) - i128::from(time) * speed;
            let (exact_near, exact_far) = (from(self.near[i]).max(0), from(self.far[i]));
            let (near, far) = (i128::from(slabs.near[i]), i128::from(slabs.far[i]));
            if speed == 0 {
                // Only the side counts.
                return (near <= 0 || exact_near > 0) && (far >= 0 || exact_far < 0);
            }
            let shift = ray.axes()[i].reciprocal.shift();
            // A far plane behind may be said to be anywhere behind.
            let behind = far < 0 && exact_far < 0;
            (near << shift) * speed <= exact_near && (behind || (far << shift) * speed >= exact_far)
        })
    }

    /// The time at which the ray enters the box's last near plane, rounded up, and the time at
    /// which it leaves the first far plane, rounded up; `None` if no axis moves.
    pub fn crossing(&self) -> Option<(i64, i64)> {
        let moving = || (0..3).filter(|&i| self.speed[i] != 0);
        // -(-a div b) rounds up.
        let time = |x: i64, i: usize| -(-(i128::from(x) << 30)).div_euclid(self.speed[i].into());
        let enter = moving().map(|i| time(self.near[i], i)).max()?;
        let leave = moving().map(|i| time(self.far[i], i)).min()?;
        Some((enter as i64, leave as i64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::IVec3;
    use xylem_core::num::{SubGrid, Time};

    #[test]
    fn a_diagonal_ray_touches_an_edge_and_misses_beyond_it() {
        let bounds = Aabb::new(IVec3::splat(0), IVec3::splat(8));
        let ray = |x: i32| {
            let origin = [SubGrid::from_bits(x), SubGrid::from_num(-8), SubGrid::from_num(4)];
            let d = IVec3::new(1 << 30, 1 << 30, 0);
            Ray::new(origin, d, Time::ZERO, Ray::TIME_LIMIT).unwrap()
        };
        let passes = |x: i32, t_max: i32| {
            Planes::new(&ray(x), &bounds).passes(0, Time::from_num(t_max).to_bits())
        };
        // Through (8, 0, 4) at time 8.
        assert!(passes(0, 8));
        assert!(!passes(0, 7));
        assert!(!passes(1, 99));
        assert!(passes(-1, 99));
        assert_eq!(Planes::new(&ray(0), &bounds).crossing(), Some((512, 512)));
    }
}
