//! Axis-aligned bounding boxes.

use glam::IVec3;

/// A closed axis-aligned box of grid points, in grid units.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Aabb {
    /// The lowest corner.
    pub min: IVec3,
    /// The highest corner, at least `min` on every axis unless the box is [`Aabb::EMPTY`].
    pub max: IVec3,
}

impl Aabb {
    /// The box of no points: the neutral element of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: IVec3::MAX, max: IVec3::MIN };

    /// The box from `min` to `max`.
    pub const fn new(min: IVec3, max: IVec3) -> Self {
        Self { min, max }
    }

    /// The smallest box around some points.
    pub fn of_points(points: &[IVec3]) -> Self {
        points.iter().fold(Self::EMPTY, |aabb, &p| Self::new(aabb.min.min(p), aabb.max.max(p)))
    }

    /// The smallest box around both boxes.
    #[inline(always)]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether `min` does not exceed `max` on any axis.
    #[inline]
    pub fn is_valid(&self) -> bool {
        self.min.cmple(self.max).all()
    }

    /// Whether all of `other` is inside.
    pub fn contains(&self, other: &Self) -> bool {
        self.min.cmple(other.min).all() && self.max.cmpge(other.max).all()
    }

    /// Half of the surface area in square grid units, for a box of at most 2³⁰ units a side.
    pub fn half_area(&self) -> u64 {
        let d = |axis: usize| u64::from(self.max[axis].abs_diff(self.min[axis]));
        let (x, y, z) = (d(0), d(1), d(2));
        x * y + y * z + z * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn union_holds_both_and_empty_is_neutral() {
        let a = Aabb::new(IVec3::new(0, 1, 2), IVec3::new(3, 4, 5));
        let b = Aabb::new(IVec3::new(-9, 2, 2), IVec3::new(-8, 3, 9));
        let u = a.union(&b);
        assert!(u.contains(&a) && u.contains(&b) && u.is_valid());
        assert_eq!(u, Aabb::new(IVec3::new(-9, 1, 2), IVec3::new(3, 4, 9)));
        assert_eq!(a.union(&Aabb::EMPTY), a);
        assert!(!Aabb::EMPTY.is_valid());
    }

    #[test]
    fn half_area_of_the_whole_grid_does_not_overflow() {
        let side = (1u64 << 24) - 1;
        let all = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
        assert_eq!(all.half_area(), 3 * side * side);
    }
}
