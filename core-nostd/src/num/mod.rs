//! The number system: a cubic integer grid, directed rounding, reciprocals and Morton codes.

mod grid;
mod morton;
mod reciprocal;

pub use grid::Grid;
pub use morton::{MortonCoder, MortonWidth};
pub use reciprocal::{Mantissa, PlaneOffset, Reciprocal, SubGrid, Time};
