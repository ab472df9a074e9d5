//! What each method multiplies and keeps, in bits.

use super::Method;
use crate::node::{Coordinates, Quantization};

/// Bits of the traversal point below a cell.
pub(super) const POINT_FRACTION: u32 = 2;

/// Bits of a reciprocal's mantissa, and of a step in time, as the traversal point uses them, for
/// coordinates of `bits` bits.
pub(super) const fn point_mantissa(bits: u8) -> u32 {
    bits as u32 + 4
}

/// Some equal multipliers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Multipliers {
    /// How many.
    pub count: u32,
    /// Bits of one factor, without a sign.
    pub left: u32,
    /// Bits of the other.
    pub right: u32,
}

impl Multipliers {
    /// Partial products of all: a measure of area.
    pub const fn partial_products(&self) -> u32 {
        self.count * self.left * self.right
    }
}

/// The arithmetic and the memory that a traversal unit needs for a [`Method`].
///
/// Multiplications by 2 to a power are shifts, and one by a mantissa that is rounded up is one by
/// the mantissa rounded down and an addition; neither is counted. What happens once a ray (at the
/// root) is not counted either.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cost {
    /// Tests the boxes of both children of a node: two planes on each of three axes.
    pub test: Multipliers,
    /// Moves the traversal point to a child that the search goes down to.
    pub descend: Option<Multipliers>,
    /// Finds the traversal point of a node that was popped; its factors also are those of a few
    /// passes of `descend`.
    pub resume: Option<Multipliers>,
    /// Bits of a stack entry.
    pub stack_entry_bits: u32,
}

/// Bits of a direction component's magnitude, which is at most 2³⁰.
const DIRECTION: u32 = 31;
/// Bits of a time within [`crate::geom::Ray::TIME_LIMIT`], with sign. A node's entry time needs no
/// more: an earlier one may be replaced by the earliest.
const TIME: u32 = 35;
/// Bits of a distance between two points of which one is on the grid, in units of 2⁻⁶, or of a
/// [`crate::num::PlaneOffset`]; with sign.
const DISTANCE: u32 = 32;
/// Bits of a reciprocal's mantissa.
const MANTISSA: u32 = 24;
/// Bits of a grid coordinate.
const COORDINATE: u32 = 24;
/// Bits of a scale, at most 20.
const SCALE: u32 = 5;
/// Bits of a child pointer and the leaf bit.
const POINTER: u32 = 28;

impl Method {
    /// What this method costs for nodes of a quantization.
    pub const fn cost(self, quantization: &Quantization) -> Cost {
        let bits = quantization.bits as u32;
        // Where it is, when the ray enters it, and its grid: a scale and a number of cells, less one.
        let node = POINTER + TIME + 3 * (SCALE + bits);
        let low = match quantization.coordinates {
            Coordinates::Relative => 0,
            Coordinates::Modulo => 3 * bits,
        };
        // The lower corner has the modulo coordinates in it.
        let placed = node + 3 * COORDINATE;
        match self {
            Self::Decompress => Cost {
                test: Multipliers { count: 12, left: DISTANCE - 1, right: MANTISSA },
                descend: None,
                resume: None,
                stack_entry_bits: placed,
            },
            Self::TraversalPoint => {
                let short = point_mantissa(quantization.bits);
                let distance = bits + 1 + POINT_FRACTION;
                Cost {
                    test: Multipliers { count: 12, left: distance, right: short },
                    descend: Some(Multipliers { count: 3, left: DIRECTION, right: short }),
                    resume: Some(Multipliers { count: 3, left: DIRECTION, right: TIME - 1 }),
                    stack_entry_bits: placed,
                }
            }
            Self::Incremental => Cost {
                test: Multipliers { count: 12, left: MANTISSA, right: bits },
                descend: None,
                resume: None,
                stack_entry_bits: node + low + 6 * DISTANCE,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_factors_are_short_and_entries_are_what_they_hold() {
        // The table of the module's documentation.
        let costs = Method::ALL.map(|method| method.cost(&Quantization::MODULO));
        let [full, point, step] = costs.map(|cost| cost.test.partial_products());
        assert_eq!((full, point, step), (12 * 31 * 24, 12 * 9 * 10, 12 * 24 * 6));
        assert_eq!(costs.map(|cost| cost.stack_entry_bits), [168, 168, 306]);
        let moving = |cost: Option<Multipliers>| cost.map(|m| (m.count, m.left, m.right));
        assert_eq!(costs.map(|c| moving(c.descend)), [None, Some((3, 31, 10)), None]);
        assert_eq!(costs.map(|c| moving(c.resume)), [None, Some((3, 31, 34)), None]);
        let relative = Method::Incremental.cost(&Quantization::RELATIVE);
        assert_eq!(relative.stack_entry_bits, 306 - 18);
    }

    #[test]
    fn no_scale_and_no_time_needs_more_bits_than_an_entry_has() {
        // The whole grid at the narrowest width, or the highest minimum scale.
        let scale = (COORDINATE - 4).max(u32::from(Quantization::MAX_MIN_SCALE));
        assert!(scale < 1 << SCALE);
        let limit = crate::geom::Ray::TIME_LIMIT.to_bits();
        assert!((1 << (TIME - 2)..1 << (TIME - 1)).contains(&limit));
    }
}
