//! Tracing rays: closest hit and any hit over every node format.
//!
//! One loop (`search`) serves all formats: it orders children, keeps a bounded stack and tests
//! triangles. A format contributes only how the boxes of a node's children are read and tested.
//!
//! # Watertightness
//!
//! A box test may report a hit where there is none, never the reverse: near planes are crossed at
//! times that are rounded down and far planes at times that are rounded up. [`watertight`] is the
//! proof, for every format and every [`Method`].

mod bvh2;
mod hit;
mod quantized;
mod search;
mod shared;
mod slab;
pub mod watertight;

pub use hit::{Barycentric, Hit, Query, TraceError};
pub use quantized::{Cost, Method, Multipliers, TraversalPoint};
pub use slab::Slabs;

use crate::geom::Ray;
use crate::mem::{Bus, Region};
use crate::node::{NodeFormat, Tree};
use crate::probe::Probe;

/// A tree and the triangles that its leaves refer to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Scene {
    /// The tree.
    pub tree: Tree,
    /// The region of 40-byte triangle records ([`crate::geom::Triangle`]).
    pub triangles: Region,
    /// How many triangles there are.
    pub triangle_count: u32,
}

/// Traces one ray.
///
/// [`Query::Closest`] returns the hit with the lowest time, rounded up to a representable one; of
/// several at that time, the one with the lowest primitive index. The answer does not depend on
/// the tree. [`Query::Any`] returns the first hit that the search meets.
///
/// # Errors
/// A bus error, or memory that does not hold a tree: see [`TraceError`]. The search visits every
/// node and every leaf table entry at most once, whatever is in memory.
#[inline]
pub fn trace<B: Bus, P: Probe>(
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    probe: &mut P,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    trace_by(Method::Incremental, bus, scene, ray, query, probe)
}

/// Traces one ray, testing the boxes of quantized nodes by a method. Nodes of 64 bytes have exact
/// boxes and are tested in one way, and so are shared-plane nodes: they are decompressed.
///
/// The closest hit does not depend on the method; which nodes are visited does, and so may which of
/// several hits answers [`Query::Any`].
///
/// # Errors
/// As [`trace`].
#[inline]
pub fn trace_by<B: Bus, P: Probe>(
    method: Method,
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    probe: &mut P,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    use quantized::{ByPoint, Decompress, Incremental};
    use search::search;
    match (scene.tree.format, method) {
        (NodeFormat::Bvh2, _) => search(&bvh2::Exact, bus, scene, ray, query, probe),
        (NodeFormat::Quantized(q), Method::Decompress) => {
            search(&Decompress(q), bus, scene, ray, query, probe)
        }
        (NodeFormat::Quantized(q), Method::TraversalPoint) => {
            search(&ByPoint(q), bus, scene, ray, query, probe)
        }
        (NodeFormat::Quantized(q), Method::Incremental) => {
            search(&Incremental(q), bus, scene, ray, query, probe)
        }
        (NodeFormat::Shared(sharing), _) => {
            let format = shared::Shared { sharing, entry_count: scene.tree.entry_count };
            search(&format, bus, scene, ray, query, probe)
        }
    }
}
