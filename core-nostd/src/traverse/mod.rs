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

pub use bvh2::{BoxTest, SlabTest};
pub use hit::{Barycentric, Hit, Query, TraceError};
pub use quantized::{Cost, Method, Multipliers, TraversalPoint};
pub use slab::Slabs;

use self::bvh2::Exact;
use self::quantized::{ByPoint, Decompress, Incremental};
use self::search::search;
use crate::emit::MAX_DEPTH;
use crate::geom::Ray;
use crate::mem::{Bus, Region};
use crate::node::{NodeFormat, Quantization, Tree};
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
    match scene.tree.format {
        NodeFormat::Bvh2 => {
            search::<2, MAX_DEPTH, _, _, _>(&Exact(SlabTest), bus, scene, ray, query, probe)
        }
        NodeFormat::Quantized(q) => {
            trace_quantized::<2, MAX_DEPTH, _, _>((method, q), bus, scene, ray, query, probe)
        }
        NodeFormat::Wide(q) => {
            trace_quantized::<4, WIDE_STACK, _, _>((method, q), bus, scene, ray, query, probe)
        }
        NodeFormat::Shared(sharing) => {
            let format = shared::Shared { sharing, entry_count: scene.tree.entry_count };
            search::<2, MAX_DEPTH, _, _, _>(&format, bus, scene, ray, query, probe)
        }
    }
}

/// Traces one ray, testing the boxes of 64-byte nodes by `test`. Other formats are traced as [`trace`] does.
///
/// # Errors
/// As [`trace`].
#[inline]
pub fn trace_testing<T: BoxTest, B: Bus, P: Probe>(
    test: T,
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    probe: &mut P,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    match scene.tree.format {
        NodeFormat::Bvh2 => {
            search::<2, MAX_DEPTH, _, _, _>(&Exact(test), bus, scene, ray, query, probe)
        }
        _ => trace(bus, scene, ray, query, probe),
    }
}

/// Of four children up to three wait, however little of the binary tree's depth is behind.
const WIDE_STACK: usize = 3 * MAX_DEPTH;

#[inline]
fn trace_quantized<const N: usize, const D: usize, B: Bus, P: Probe>(
    (method, quantization): (Method, Quantization),
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
    probe: &mut P,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    match method {
        Method::Decompress => {
            let format = Decompress::<N>(quantization);
            search::<N, D, _, _, _>(&format, bus, scene, ray, query, probe)
        }
        Method::TraversalPoint => {
            let format = ByPoint::<N>(quantization);
            search::<N, D, _, _, _>(&format, bus, scene, ray, query, probe)
        }
        Method::Incremental => {
            let format = Incremental::<N>(quantization);
            search::<N, D, _, _, _>(&format, bus, scene, ray, query, probe)
        }
    }
}
