//! The parts of the traversal unit against the functions of the core that they compute.
//!
//! A check feeds a part random cases and says what the first wrong one is.

mod boxes;
mod reciprocals;
mod triangles;

use std::collections::VecDeque;

use xylem_core::geom::Axis;

use crate::rtl::{Pin, Rtl};

pub use boxes::check_boxes;
pub use reciprocals::check_reciprocals;
pub use triangles::check_triangles;

/// A word of any width, filled from the lowest bit on.
#[derive(Default)]
struct Fields {
    bytes: Vec<u8>,
    bits: usize,
}

impl Fields {
    fn with(mut self, value: u64, bits: usize) -> Self {
        for bit in 0..bits {
            if self.bits.is_multiple_of(8) {
                self.bytes.push(0);
            }
            self.bytes[self.bits / 8] |= ((value >> bit & 1) as u8) << (self.bits % 8);
            self.bits += 1;
        }
        self
    }
}

/// Bits `from ..` of an output, `bits` of them, at most 64.
fn field(bytes: &[u8], from: usize, bits: usize) -> u64 {
    (0..bits).fold(0, |word, bit| {
        let at = from + bit;
        word | u64::from(bytes[at / 8] >> (at % 8) & 1) << bit
    })
}

/// Whether the mantissa was rounded, and the reciprocal as the RTL packs it.
fn packed(axis: &Axis, component: i32) -> (bool, u64) {
    let mantissa = u64::from(axis.reciprocal.mantissa().to_bits());
    let k = 31 - axis.reciprocal.shift();
    let inexact = !axis.zero && mantissa * u64::from(component.unsigned_abs()) != 1 << (23 + k);
    // Of a direction of zero only `zero` counts.
    let (mantissa, shift) = if axis.zero { (0, 0) } else { (mantissa, axis.reciprocal.shift()) };
    let flags = u64::from(axis.negative) << 31 | u64::from(axis.zero) << 30;
    (inexact, flags | u64::from(inexact) << 29 | u64::from(shift) << 24 | mantissa)
}

/// The two multipliers, beside the unit: products come two cycles after their factors.
struct Multipliers {
    factors: [Pin; 2],
    products: [Pin; 2],
    flying: VecDeque<[i128; 2]>,
}

impl Multipliers {
    fn new(rtl: &Rtl, factors: [&str; 2], products: [&str; 2]) -> Self {
        Self {
            factors: factors.map(|name| rtl.output(name)),
            products: products.map(|name| rtl.input(name)),
            flying: VecDeque::from([[0; 2]; 2]),
        }
    }

    /// Runs a cycle of the unit with its multipliers; outputs are those during it.
    fn tick(&mut self, rtl: &mut Rtl) -> Result<(), String> {
        let done = self.flying.pop_front().unwrap_or_default();
        for (pin, product) in self.products.into_iter().zip(done) {
            rtl.set_bytes(pin, &product.to_le_bytes()[..8]);
        }
        rtl.settle();
        self.flying.push_back(self.factors.map(|pin| {
            let word = rtl.get(pin);
            let (a, b) = ((word >> 30) as u32 as i32, (word << 34) as i64 >> 34);
            i128::from(a) * i128::from(b)
        }));
        rtl.edge().map_err(|error| error.to_string())
    }
}
