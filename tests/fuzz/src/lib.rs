//! What the fuzz targets share: input bytes, memory that counts what is read of damaged nodes, and
//! a scene to damage.

mod memory;
mod scene;

pub use memory::{Memory, OutOfMemory};
pub use scene::{Pristine, pristine, scene};

use xylem_core::geom::Ray;
use xylem_core::node::{Coordinates, Quantization, Sharing};
use xylem_core::num::{SubGrid, Time};

/// The fuzzer's bytes, taken from the front; zeros once they have run out.
#[derive(Debug)]
pub struct Input<'a>(pub &'a [u8]);

impl Input<'_> {
    /// The next byte.
    pub fn byte(&mut self) -> u8 {
        self.array::<1>()[0]
    }

    /// The next number.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    /// The next bytes.
    pub fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut out = [0; N];
        let (head, rest) = self.0.split_at(N.min(self.0.len()));
        out[..head.len()].copy_from_slice(head);
        self.0 = rest;
        out
    }

    /// Any quantization that [`Quantization::check`] passes.
    pub fn quantization(&mut self) -> Quantization {
        let byte = self.byte();
        let coordinates = if byte & 1 == 0 { Coordinates::Relative } else { Coordinates::Modulo };
        // Mostly the default, which keeps the number of trees to make small.
        let min_scale = if byte >> 4 == 15 { self.byte() & 15 } else { 0 };
        Quantization { coordinates, bits: 4 + (byte >> 1) % 5, min_scale }
    }

    /// Any way of sharing planes that can be streamed.
    pub fn sharing(&mut self) -> Sharing {
        let byte = self.byte();
        // Mostly the default, as above.
        let flatness = if byte >> 4 == 15 { self.byte() & 31 } else { Sharing::STREAMED.flatness };
        Sharing { margin: byte % 6, flatness, ..Sharing::STREAMED }
    }

    /// A ray: its origin anywhere, aimed at one of the scene's vertices or in any direction.
    pub fn ray(&mut self) -> Ray {
        let kind = self.byte();
        let limit = Ray::ORIGIN_LIMIT << 6;
        let origin = [(); 3].map(|()| (self.word() as i32) % (limit + 1));
        let direction = match kind % 4 {
            0 => [(); 3].map(|()| self.word() as i32 >> 1),
            1 => {
                let mut along = [0; 3];
                along[usize::from(kind >> 2) % 3] = if kind & 64 == 0 { 1 } else { -1 };
                along
            }
            _ => {
                let triangles = &pristine().triangles;
                let at = self.word() as usize;
                let target = triangles[at % triangles.len()].vertices[at % 3].to_array();
                [0, 1, 2].map(|i| ((i64::from(target[i]) << 6) - i64::from(origin[i])) as i32 / 2)
            }
        };
        let direction = normalised(direction);
        let (t_min, t_max) = if kind < 192 {
            (Time::ZERO, Ray::TIME_LIMIT)
        } else {
            let time = |word: u32| Time::from_bits(i64::from(word as i32));
            (time(self.word()), time(self.word()))
        };
        let origin = origin.map(SubGrid::from_bits);
        Ray::new(origin, direction.into(), t_min, t_max).expect("the parts are in their ranges")
    }
}

/// A direction whose largest component is in `(2^29, 2^30]`.
fn normalised(direction: [i32; 3]) -> [i32; 3] {
    let mut d = direction.map(i64::from);
    let largest = |d: &[i64; 3]| d.iter().map(|c| c.abs()).max().unwrap_or(0);
    if largest(&d) == 0 {
        return [1 << 30, 0, 0];
    }
    while largest(&d) > 1 << 30 {
        d = d.map(|c| c / 2);
    }
    while largest(&d) <= 1 << 29 {
        d = d.map(|c| c * 2);
    }
    d.map(|c| c as i32)
}
