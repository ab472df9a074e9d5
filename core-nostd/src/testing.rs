//! What unit tests share.

/// How many cases a property is tried on: all of them, or a hundredth under Miri, which interprets and
/// takes a thousand times as long.
pub fn cases(all: u32) -> u32 {
    if cfg!(miri) { all.div_ceil(100) } else { all }
}

/// A linear congruential generator (Knuth's MMIX), from a seed.
pub struct Random(pub u64);

impl Random {
    /// A number from 0 to less than `n`, which is above 0.
    pub fn below(&mut self, n: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) % n as u64) as i32
    }
}
