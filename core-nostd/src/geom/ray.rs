//! Rays in fixed point.

use core::fmt;

use glam::IVec3;

use crate::num::{Reciprocal, SubGrid, Time};

/// A ray `origin + direction · 2⁻³⁰ · t` over the half-open interval `t_min < t <= t_max`.
///
/// Positions are in grid units. The direction carries a block exponent chosen by whoever converts a
/// ray from scene units: its largest component is more than 2²⁹ and at most 2³⁰ in magnitude, so
/// that the ray moves at least half a grid unit and at most one along that axis in a unit of time.
/// These numbers *are* the ray: everything below is exact on them or rounded in a stated direction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ray {
    origin: [i32; 3],
    direction: IVec3,
    t_min: i64,
    t_max: i64,
    axes: [Axis; 3],
    axis_parallel: bool,
}

/// One axis of a ray as a box test wants it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Axis {
    /// The origin on this axis, in units of 2⁻⁶ grid units.
    pub origin: i32,
    /// Whether the direction component is negative: the high plane is then the near one.
    pub negative: bool,
    /// Whether the direction component is zero.
    pub zero: bool,
    /// The reciprocal of the component's magnitude.
    pub reciprocal: Reciprocal,
}

/// Why three vectors are not a [`Ray`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RayError {
    /// An origin coordinate exceeds [`Ray::ORIGIN_LIMIT`] grid units in magnitude.
    OriginOutOfRange,
    /// The largest direction component is not in `2^29 + 1 ..= 2^30`. A zero direction is this too.
    DirectionNotNormalised,
    /// A time exceeds [`Ray::TIME_LIMIT`] in magnitude.
    TimeOutOfRange,
}

impl fmt::Display for RayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OriginOutOfRange => "ray origin is too far from the grid; move it along the ray",
            Self::DirectionNotNormalised => "largest direction component is not in (2^29, 2^30]",
            Self::TimeOutOfRange => "ray interval exceeds the representable times",
        })
    }
}

impl core::error::Error for RayError {}

impl Ray {
    /// Bytes of a ray record in memory: origin 3 × i32 (units of 2⁻⁶), direction 3 × i32 (2⁻³⁰),
    /// `t_min` and `t_max` as i64 (2⁻⁶), little-endian.
    pub const BYTES: usize = 40;

    /// The farthest that an origin coordinate may be from the grid's centre: 2²⁵ − 2²³ − 1 grid
    /// units, one and a half grid widths. It keeps every distance to a plane of the grid below 2²⁵
    /// units, which is 31 bits and a sign in units of 2⁻⁶.
    pub const ORIGIN_LIMIT: i32 = (1 << 25) - (1 << 23) - 1;

    /// The largest magnitude of a time, 2²⁷ in [`Time`] units proper: no hit in the grid is farther.
    pub const TIME_LIMIT: Time = Time::from_bits(1 << 33);

    /// A ray from its parts.
    ///
    /// An interval with `t_min >= t_max` is empty: such a ray hits nothing.
    ///
    /// # Errors
    /// [`RayError`] when a part is out of its range.
    pub fn new(
        origin: [SubGrid; 3],
        direction: IVec3,
        t_min: Time,
        t_max: Time,
    ) -> Result<Self, RayError> {
        let limit = (Self::ORIGIN_LIMIT as u32) << 6;
        if origin.iter().any(|o| o.to_bits().unsigned_abs() > limit) {
            return Err(RayError::OriginOutOfRange);
        }
        let largest = direction.to_array().map(i32::unsigned_abs).into_iter().max().unwrap_or(0);
        if largest <= 1 << 29 || largest > 1 << 30 {
            return Err(RayError::DirectionNotNormalised);
        }
        let times = -Self::TIME_LIMIT..=Self::TIME_LIMIT;
        if !times.contains(&t_min) || !times.contains(&t_max) {
            return Err(RayError::TimeOutOfRange);
        }
        let origin = origin.map(SubGrid::to_bits);
        let axes = [0, 1, 2].map(|i| Axis {
            origin: origin[i],
            negative: direction[i] < 0,
            zero: direction[i] == 0,
            reciprocal: Reciprocal::new(direction[i]),
        });
        let (t_min, t_max) = (t_min.to_bits(), t_max.to_bits());
        let axis_parallel = axes.iter().any(|axis| axis.zero);
        Ok(Self { origin, direction, t_min, t_max, axes, axis_parallel })
    }

    /// The origin, in grid units.
    pub fn origin(&self) -> [SubGrid; 3] {
        self.origin.map(SubGrid::from_bits)
    }

    /// The direction, in units of 2⁻³⁰ grid units per unit of time.
    pub const fn direction(&self) -> IVec3 {
        self.direction
    }

    /// The exclusive start of the interval.
    pub const fn t_min(&self) -> Time {
        Time::from_bits(self.t_min)
    }

    /// The inclusive end of the interval.
    pub const fn t_max(&self) -> Time {
        Time::from_bits(self.t_max)
    }

    /// The axes, prepared for box tests.
    #[inline]
    pub const fn axes(&self) -> &[Axis; 3] {
        &self.axes
    }

    /// Whether the ray does not move along some axis.
    #[inline]
    pub const fn is_axis_parallel(&self) -> bool {
        self.axis_parallel
    }

    /// The record of this ray.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        for i in 0..3 {
            bytes[4 * i..4 * i + 4].copy_from_slice(&self.origin[i].to_le_bytes());
            bytes[12 + 4 * i..16 + 4 * i].copy_from_slice(&self.direction[i].to_le_bytes());
        }
        bytes[24..32].copy_from_slice(&self.t_min.to_le_bytes());
        bytes[32..40].copy_from_slice(&self.t_max.to_le_bytes());
        bytes
    }

    /// The ray of a record.
    ///
    /// # Errors
    /// As [`Ray::new`].
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Result<Self, RayError> {
        let word = |at: usize| {
            i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let long =
            |at: usize| Time::from_bits(i64::from(word(at) as u32) | i64::from(word(at + 4)) << 32);
        Self::new(
            [0, 4, 8].map(|at| SubGrid::from_bits(word(at))),
            IVec3::new(word(12), word(16), word(20)),
            long(24),
            long(32),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: i32, direction: [i32; 3]) -> Result<Ray, RayError> {
        let o = [SubGrid::from_num(origin), SubGrid::ZERO, SubGrid::ZERO];
        Ray::new(o, IVec3::from(direction), Time::ZERO, Ray::TIME_LIMIT)
    }

    #[test]
    fn parts_out_of_range_are_refused_at_the_limit() {
        let d = [1 << 30, 0, 0];
        assert!(ray(Ray::ORIGIN_LIMIT, d).is_ok());
        assert_eq!(ray(Ray::ORIGIN_LIMIT + 1, d), Err(RayError::OriginOutOfRange));
        assert!(ray(0, [(1 << 29) + 1, 0, 0]).is_ok());
        assert_eq!(ray(0, [1 << 29, 0, 0]), Err(RayError::DirectionNotNormalised));
        assert_eq!(ray(0, [(1 << 30) + 1, 0, 0]), Err(RayError::DirectionNotNormalised));
        assert_eq!(ray(0, [0, 0, 0]), Err(RayError::DirectionNotNormalised));
        assert_eq!(ray(0, [i32::MIN, 0, 0]), Err(RayError::DirectionNotNormalised));
        let beyond = Ray::TIME_LIMIT + Time::DELTA;
        let r = Ray::new([SubGrid::ZERO; 3], IVec3::from(d), Time::ZERO, beyond);
        assert_eq!(r, Err(RayError::TimeOutOfRange));
    }

    #[test]
    fn records_round_trip() {
        let r = Ray::new(
            [SubGrid::from_bits(-5), SubGrid::from_bits(7), SubGrid::from_num(100)],
            IVec3::new(-(1 << 30), 3, -1),
            Time::from_bits(-9),
            Time::from_bits(1 << 33),
        )
        .unwrap();
        assert_eq!(Ray::from_bytes(&r.to_bytes()), Ok(r));
        assert_eq!(Ray::from_bytes(&[0; 40]), Err(RayError::DirectionNotNormalised));
    }
}
