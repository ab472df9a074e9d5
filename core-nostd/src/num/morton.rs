//! Morton codes: position along a Z-order curve through the grid.

use glam::IVec3;

use super::Grid;

/// How many bits a Morton code has.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MortonWidth {
    /// 30 bits, 10 an axis, as in the papers.
    #[default]
    Bits30,
    /// 63 bits, 21 an axis.
    Bits63,
}

impl MortonWidth {
    /// Bits of one axis.
    pub const fn axis_bits(self) -> u32 {
        match self {
            Self::Bits30 => 10,
            Self::Bits63 => 21,
        }
    }

    /// Bits of a whole code.
    pub const fn bits(self) -> u32 {
        3 * self.axis_bits()
    }
}

/// Computes Morton codes of box centres on one grid.
///
/// The centre of a box is `floor((min + max) / 2)` in grid units. Its coordinate, counted from the
/// grid's lowest corner, gives its top [`MortonWidth::axis_bits`] bits (padded with zeros below if
/// the grid is narrower); x takes the highest bit of each triple, then y, then z.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MortonCoder {
    origin: i32,
    down: u32,
    up: u32,
    wide: bool,
}

impl MortonCoder {
    /// A coder for `grid`.
    pub const fn new(grid: Grid, width: MortonWidth) -> Self {
        let (grid_bits, axis_bits) = (grid.bits() as u32, width.axis_bits());
        Self {
            origin: grid.min(),
            down: grid_bits.saturating_sub(axis_bits),
            up: axis_bits.saturating_sub(grid_bits),
            wide: matches!(width, MortonWidth::Bits63),
        }
    }

    /// How many bits a code has.
    pub const fn bits(&self) -> u32 {
        if self.wide { MortonWidth::Bits63.bits() } else { MortonWidth::Bits30.bits() }
    }

    /// The code of the box from `min` to `max`, both on the grid.
    #[inline(always)]
    pub fn code(&self, min: IVec3, max: IVec3) -> u64 {
        let cell = |lo: i32, hi: i32| {
            let centre = (lo.wrapping_add(hi)) >> 1;
            (centre.wrapping_sub(self.origin) as u32) >> self.down << self.up
        };
        let (x, y, z) = (cell(min.x, max.x), cell(min.y, max.y), cell(min.z, max.z));
        if self.wide {
            spread21(x) << 2 | spread21(y) << 1 | spread21(z)
        } else {
            u64::from(spread10(x) << 2 | spread10(y) << 1 | spread10(z))
        }
    }
}

/// Moves bit i of a 10-bit number to bit 3i.
#[inline(always)]
const fn spread10(v: u32) -> u32 {
    let v = v & 0x3ff;
    let v = (v | v << 16) & 0x0300_00ff;
    let v = (v | v << 8) & 0x0300_f00f;
    let v = (v | v << 4) & 0x030c_30c3;
    (v | v << 2) & 0x0924_9249
}

/// Moves bit i of a 21-bit number to bit 3i.
#[inline]
const fn spread21(v: u32) -> u64 {
    let v = (v & 0x1f_ffff) as u64;
    let v = (v | v << 32) & 0x001f_0000_0000_ffff;
    let v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    let v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    let v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, cases};

    fn interleave(x: u64, y: u64, z: u64, bits: u32) -> u64 {
        (0..bits).fold(0, |code, i| {
            code | (x >> i & 1) << (3 * i + 2)
                | (y >> i & 1) << (3 * i + 1)
                | (z >> i & 1) << (3 * i)
        })
    }

    #[test]
    fn codes_are_the_interleaved_top_bits_of_the_centre() {
        let grid = Grid::DEFAULT;
        let mut random = Random(1);
        for _ in 0..cases(1000) {
            let mut next = || random.below(1 << 24) + grid.min();
            let min = IVec3::new(next(), next(), next());
            let max = min.max(IVec3::new(next(), next(), next()));
            let centre: IVec3 = (min + max) >> 1;
            let from_low = |v: i32| (v - grid.min()) as u64;
            for (width, bits) in [(MortonWidth::Bits30, 10), (MortonWidth::Bits63, 21)] {
                let top = |v: i32| from_low(v) >> (24 - bits);
                let expect = interleave(top(centre.x), top(centre.y), top(centre.z), bits);
                assert_eq!(MortonCoder::new(grid, width).code(min, max), expect);
            }
        }
    }

    #[test]
    fn the_grid_corners_have_the_lowest_and_the_highest_code() {
        for bits in [4, 10, 16, 21, 24] {
            let grid = Grid::new(bits).unwrap();
            let coder = MortonCoder::new(grid, MortonWidth::Bits30);
            let (low, high) = (IVec3::splat(grid.min()), IVec3::splat(grid.max()));
            assert_eq!(coder.code(low, low), 0);
            let ones = if bits >= 10 {
                0x3fff_ffff
            } else {
                0x3fff_ffff >> (30 - 3 * bits) << (30 - 3 * bits)
            };
            assert_eq!(coder.code(high, high), ones);
        }
    }
}
