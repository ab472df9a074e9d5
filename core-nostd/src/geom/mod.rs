//! Boxes, triangles and rays on the grid.

mod aabb;
mod ray;
mod triangle;

pub use aabb::Aabb;
pub use ray::{Axis, Ray, RayError};
pub use triangle::{Crossing, Intersection, PrimIndex, Triangle};
