//! Tracing sets of rays, in parallel.

use std::ops::AddAssign;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use serde::Serialize;
use xylem_core::geom::Ray;
use xylem_core::mem::ByteAddr;
use xylem_core::probe::Probe;
use xylem_core::traverse::{self, Hit, Method, Query, Scene, TraceError};

use crate::bus::{FlatMemory, MemoryError};

/// What one ray, or many, cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct TraceCounts {
    /// Nodes fetched.
    pub nodes: u64,
    /// Bytes of nodes fetched.
    pub node_bytes: u64,
    /// Boxes tested, the root's included.
    pub box_tests: u64,
    /// Triangles tested.
    pub triangle_tests: u64,
    /// Pushes on the stack.
    pub stack_pushes: u64,
    /// The deepest stack, in entries.
    pub stack_depth: u64,
}

/// [`TraceCounts`] of many rays: counts add, depths take the largest.
pub type Sums = TraceCounts;

impl AddAssign for TraceCounts {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.node_bytes += other.node_bytes;
        self.box_tests += other.box_tests;
        self.triangle_tests += other.triangle_tests;
        self.stack_pushes += other.stack_pushes;
        self.stack_depth = self.stack_depth.max(other.stack_depth);
    }
}

impl Probe for TraceCounts {
    #[inline]
    fn node_fetch(&mut self, _: ByteAddr, bytes: u32) {
        self.nodes += 1;
        self.node_bytes += u64::from(bytes);
    }
    #[inline]
    fn box_test(&mut self) {
        self.box_tests += 1;
    }
    #[inline]
    fn triangle_test(&mut self) {
        self.triangle_tests += 1;
    }
    #[inline]
    fn stack_push(&mut self, depth: usize) {
        self.stack_pushes += 1;
        self.stack_depth = self.stack_depth.max(depth as u64);
    }
}

/// The answers to a set of rays.
#[derive(Debug, Clone)]
pub struct TraceRun {
    /// One answer a ray, in order; `None` is a miss.
    pub hits: Vec<Option<Hit>>,
    /// What each ray cost.
    pub per_ray: Vec<TraceCounts>,
    /// What all cost.
    pub sums: Sums,
    /// How long the host took with all its threads, measured.
    pub host_time: Duration,
}

/// Traces rays on all threads. A `None` among the rays is a miss by itself (a ray without a
/// direction or an interval, or one that passes the scene by).
///
/// # Errors
/// The error of the first ray, in order, that could not be traced.
pub fn trace(
    memory: &FlatMemory,
    scene: &Scene,
    rays: &[Option<Ray>],
    query: Query,
) -> Result<TraceRun, TraceError<MemoryError>> {
    trace_by(Method::default(), memory, scene, rays, query)
}

/// As [`trace`], testing the boxes of quantized nodes by a method.
///
/// # Errors
/// As [`trace`].
pub fn trace_by(
    method: Method,
    memory: &FlatMemory,
    scene: &Scene,
    rays: &[Option<Ray>],
    query: Query,
) -> Result<TraceRun, TraceError<MemoryError>> {
    let start = Instant::now();
    let answers: Result<Vec<_>, _> = rays
        .par_iter()
        .with_min_len(256)
        .map(|ray| {
            let mut counts = TraceCounts::default();
            let hit = match ray {
                Some(ray) => {
                    let memory = &mut memory.snapshot();
                    traverse::trace_by(method, memory, scene, ray, query, &mut counts)?
                }
                None => None,
            };
            Ok((hit, counts))
        })
        .collect();
    let (hits, per_ray): (Vec<_>, Vec<_>) = answers?.into_iter().unzip();
    let mut sums = Sums::default();
    for counts in &per_ray {
        sums += *counts;
    }
    Ok(TraceRun { hits, per_ray, sums, host_time: start.elapsed() })
}
