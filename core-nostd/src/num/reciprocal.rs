//! Reciprocals and plane distances with directed rounding.
//!
//! A ray direction component `D` is a signed integer in units of 2⁻³⁰ (see [`crate::geom::Ray`]).
//! A plane at distance `x` from the origin along that axis is crossed at time `x · 2³⁰ / D`. The
//! factor spans thirty powers of two, so it is kept as a 24-bit mantissa and a shift:
//!
//! ```text
//! 2^(k-1) < |D| <= 2^k        1/2 <= m = 2^(k-1) / |D| < 1        2^30 / |D| = m · 2^(31-k)
//! ```
//!
//! Distances stay *in mantissa units* (`x · m`, a [`PlaneOffset`]) while a traversal descends, which
//! bounds them by the distance itself: 32 bits, whatever the direction. Only to compare the axes
//! are they shifted by `31 - k` to a common [`Time`], which is exact. Errors are in space along that
//! axis, whatever the direction: rounding a product costs less than 1/64 grid unit, and rounding the
//! mantissa to 24 bits the distance times 2⁻²³ at most, a few grid units for the farthest planes.

use fixed::types::extra::{U6, U24};
use fixed::{FixedI32, FixedI64, FixedU32};

/// A position below grid resolution: Q25.6, in grid units.
pub type SubGrid = FixedI32<U6>;

/// A mantissa of a reciprocal, in [1/2, 1]: UQ8.24.
pub type Mantissa = FixedU32<U24>;

/// A distance along an axis times the mantissa of that axis' reciprocal: Q25.6, in grid units.
pub type PlaneOffset = FixedI32<U6>;

/// A ray parameter (a time of flight): Q57.6, where the ray moves by at least half a grid unit and
/// at most one along its major axis in one unit of time.
pub type Time = FixedI64<U6>;

/// The reciprocal of the magnitude of a direction component, enclosed from below and above.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reciprocal {
    /// Mantissa rounded down.
    down: u32,
    /// All ones if the mantissa is not exact, so that rounded up it is one more; else 0.
    inexact: i32,
    /// `31 - k`, from 1 to 31.
    shift: u32,
}

impl Reciprocal {
    /// The reciprocal that leaves distances as they are: `m = 1`, shift 0. It stands in for a
    /// direction component of zero, where a plane is never crossed and only its side counts.
    pub const UNIT: Self = Self { down: 1 << 24, inexact: 0, shift: 0 };

    /// The reciprocal of `|component| · 2⁻³⁰`, or [`Self::UNIT`] for zero.
    ///
    /// `component` must not exceed 2³⁰ in magnitude; larger ones are treated as 2³⁰.
    pub fn new(component: i32) -> Self {
        let magnitude = component.unsigned_abs().min(1 << 30);
        if magnitude == 0 {
            return Self::UNIT;
        }
        // ceil(log2(magnitude)), 0 to 30.
        let k = 32 - (magnitude - 1).leading_zeros();
        // m = 2^(k-1) / magnitude in units of 2^-24.
        let scaled = 1u64 << (23 + k);
        let down = (scaled / u64::from(magnitude)) as u32;
        let exact = scaled.is_multiple_of(u64::from(magnitude));
        Self { down, inexact: -i32::from(!exact), shift: 31 - k }
    }

    /// The mantissa rounded down, in [1/2, 1].
    #[inline]
    pub const fn mantissa(&self) -> Mantissa {
        Mantissa::from_bits(self.down)
    }

    /// The upper `bits` bits of the mantissa, at most 24: a lower bound in units of `2^-bits`, and the
    /// exact mantissa is less than one unit above it.
    #[inline]
    pub const fn leading(&self, bits: u32) -> u32 {
        self.down >> (24 - bits)
    }

    /// Whether the mantissa was not rounded.
    #[inline]
    pub const fn is_exact(&self) -> bool {
        self.inexact == 0
    }

    /// The left shift that turns a [`PlaneOffset`] into a [`Time`].
    #[inline]
    pub const fn shift(&self) -> u32 {
        self.shift
    }

    /// `distance · m`, rounded down. `distance` is in units of 2⁻⁶ and fits 33 bits.
    ///
    /// The lower bound of a product takes the mantissa rounded up where the distance is negative,
    /// which adds the distance once more.
    #[inline]
    pub const fn offset_down(&self, distance: i64) -> PlaneOffset {
        let more = distance & (distance >> 63) & self.inexact as i64;
        PlaneOffset::from_bits(((distance * self.down as i64 + more) >> 24) as i32)
    }

    /// `distance · m`, rounded up. `distance` is in units of 2⁻⁶ and fits 33 bits.
    #[inline]
    pub const fn offset_up(&self, distance: i64) -> PlaneOffset {
        let more = distance & !(distance >> 63) & self.inexact as i64;
        let product = distance * self.down as i64 + more;
        PlaneOffset::from_bits(((product + 0xff_ffff) >> 24) as i32)
    }

    /// `cells · 2^scale · m` grid units, rounded down, for `cells >= 0`: the step between two
    /// planes of a quantized box, a multiplication of the 24-bit mantissa by a 7-bit count.
    #[inline]
    pub const fn step_down(&self, cells: i32, scale: u32) -> PlaneOffset {
        // At most 7 + 24 bits, and a scale is at most 20.
        let product = cells as i64 * self.down as i64;
        PlaneOffset::from_bits(((product << scale) >> 18) as i32)
    }

    /// The time at which a plane at `offset` is crossed; exact.
    #[inline]
    pub const fn time(&self, offset: PlaneOffset) -> Time {
        Time::from_bits((offset.to_bits() as i64) << self.shift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Components at and around every power of two, and some between.
    fn components() -> impl Iterator<Item = i32> {
        (0..=30)
            .flat_map(|k| {
                let p = 1i64 << k;
                [p - 1, p, p + 1, p + p / 3].into_iter().filter(|d| (1..=1 << 30).contains(d))
            })
            .map(|d| d as i32)
    }

    #[test]
    fn the_mantissa_is_enclosed_and_normalised() {
        for d in components() {
            let r = Reciprocal::new(d);
            let k = 31 - r.shift();
            let up = r.down.wrapping_sub(r.inexact as u32);
            assert!(r.down >= 1 << 23 && up <= 1 << 24, "{d}");
            // down <= 2^(k-1+24) / d <= up
            let scaled = 1u128 << (23 + k);
            assert!(
                u128::from(r.down) * d as u128 <= scaled && scaled <= u128::from(up) * d as u128
            );
            assert_eq!(r, Reciprocal::new(-d));
        }
    }

    #[test]
    fn offsets_enclose_the_exact_product() {
        for d in components() {
            let r = Reciprocal::new(d);
            let k = 31 - r.shift();
            for x in [0i64, 1, -1, 63, -63, 64, 12_345_678, -12_345_679, (1 << 31) - 1, -(1 << 31)]
            {
                // x * 2^(k-1) / d, compared as fractions.
                let exact = i128::from(x) << k >> 1;
                let down = i128::from(r.offset_down(x).to_bits()) * i128::from(d);
                if k > 0 {
                    assert!(down <= exact, "{d} {x}");
                }
                let up = i128::from(r.offset_up(x).to_bits());
                if i64::from(r.offset_up(x).to_bits()) < (1 << 31) - 1 && k > 0 {
                    assert!(up * i128::from(d) >= exact, "{d} {x}");
                }
            }
        }
    }

    #[test]
    fn steps_are_rounded_down_products() {
        for d in components() {
            let r = Reciprocal::new(d);
            for cells in [0, 1, 5, 63, 64] {
                for scale in [0, 1, 9, 18] {
                    let bits = i64::from(r.step_down(cells, scale).to_bits());
                    let exact = (i128::from(cells) * i128::from(r.down)) << scale;
                    assert!(i128::from(bits) << 18 <= exact);
                    assert!(i128::from(bits + 1) << 18 > exact);
                }
            }
        }
    }

    #[test]
    fn zero_measures_plain_distance() {
        let r = Reciprocal::new(0);
        assert_eq!(r, Reciprocal::UNIT);
        assert_eq!(r.offset_down(-77).to_bits(), -77);
        assert_eq!(r.step_down(3, 2).to_bits(), 3 * 4 * 64);
    }
}
