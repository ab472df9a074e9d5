//! Deterministic numbers: the same seed gives the same scene and the same rays on every machine.

/// A stream of pseudo-random numbers, SplitMix64 (Steele, Lea and Flood, 2014).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The stream of a seed.
    pub const fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The stream of a seed and an index, such as a pixel's: streams of one seed are independent, so
    /// that rays can be made in any order.
    pub const fn stream(seed: u64, index: u64) -> Self {
        let mut outer = Self::new(seed);
        Self::new(outer.bits() ^ index.wrapping_mul(0xd134_2543_de82_ef95))
    }

    /// The next 64 bits.
    pub const fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ self.state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number in `0.0 .. 1.0`, a multiple of 2⁻⁵³.
    pub const fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A number in `-1.0 .. 1.0`.
    pub const fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// An index in `0 .. count`, or 0 if `count` is 0.
    pub const fn below(&mut self, count: usize) -> usize {
        ((self.bits() as u128 * count as u128) >> 64) as usize
    }

    /// A point in the unit disc.
    pub const fn in_disc(&mut self) -> [f64; 2] {
        // One of 4.7 tries fails on average; no stream fails for long.
        loop {
            let p = [self.signed(), self.signed()];
            if p[0] * p[0] + p[1] * p[1] < 1.0 {
                return p;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_in_range_and_the_same_for_the_same_seed() {
        let (mut a, mut b, mut c) = (Random::new(7), Random::new(7), Random::stream(7, 1));
        let mut mean = 0.0;
        for _ in 0..4096 {
            let x = a.unit();
            assert!((0.0..1.0).contains(&x));
            assert_eq!(x, b.unit());
            assert_ne!(x, c.unit());
            mean += x / 4096.0;
        }
        assert!((mean - 0.5).abs() < 0.02, "{mean}");
        assert!((0..100).all(|_| a.below(3) < 3));
        assert_eq!(a.below(0), 0);
        // The published first output of the stream of 0.
        assert_eq!(Random::new(0).bits(), 0xe220_a839_7b1d_cdaf);
    }
}
