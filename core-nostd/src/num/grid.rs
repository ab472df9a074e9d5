//! The cubic grid that all geometry lives on.

use glam::IVec3;

/// A cubic grid of signed integer coordinates of a given width.
///
/// Along each axis a coordinate runs from `-2^(bits-1)` to `2^(bits-1) - 1`, in grid units. The
/// loader maps the scene so that its longest side spans the grid exactly and its lowest corner is
/// the grid's lowest corner; a Morton code is then the top bits of the coordinates. Which length in
/// scene units a grid unit stands for is the loader's business: nothing below it knows.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Grid {
    bits: u8,
}

impl Grid {
    /// The widest grid, and the default: 24-bit coordinates.
    pub const DEFAULT: Self = Self { bits: 24 };

    /// A grid of `bits`-bit coordinates, or `None` outside 4 to 24.
    pub const fn new(bits: u8) -> Option<Self> {
        if bits >= 4 && bits <= 24 { Some(Self { bits }) } else { None }
    }

    /// Width of a coordinate in bits.
    pub const fn bits(self) -> u8 {
        self.bits
    }

    /// The lowest coordinate, in grid units.
    pub const fn min(self) -> i32 {
        -(1 << (self.bits - 1))
    }

    /// The highest coordinate, in grid units.
    pub const fn max(self) -> i32 {
        (1 << (self.bits - 1)) - 1
    }

    /// Whether all three coordinates of `point` are on the grid.
    #[inline]
    pub fn contains(self, point: IVec3) -> bool {
        // Counted from the lowest corner, what is outside has higher bits.
        let offset = |c: i32| c.wrapping_sub(self.min()) as u32;
        (offset(point.x) | offset(point.y) | offset(point.z)) >> self.bits == 0
    }
}

impl Default for Grid {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_outside_4_to_24_are_refused() {
        assert_eq!(Grid::new(3), None);
        assert_eq!(Grid::new(25), None);
        assert_eq!(Grid::new(24), Some(Grid::DEFAULT));
    }

    #[test]
    fn the_grid_holds_its_extremes_and_nothing_beyond() {
        let grid = Grid::DEFAULT;
        assert!(grid.contains(IVec3::splat(-8_388_608)));
        assert!(grid.contains(IVec3::splat(8_388_607)));
        assert!(!grid.contains(IVec3::new(0, 8_388_608, 0)));
        assert!(!grid.contains(IVec3::new(0, 0, -8_388_609)));
    }
}
