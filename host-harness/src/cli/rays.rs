//! Rays in scene units through a tree on the grid, and their answers back.

use indicatif::ProgressBar;
use rayon::prelude::*;
use xylem_core::geom::Ray;
use xylem_core::traverse::{self, Method, Query, Scene};

use super::{CliError, progress};
use crate::run::{BuildRun, Reference, Sums, TraceRun};
use crate::scene::{GridRay, Mesh};

/// How many rays are traced between two steps of a progress bar.
const CHUNK: usize = 1 << 16;

/// Traces rays through a tree of `run`, testing the boxes of quantized nodes by `method`.
///
/// # Errors
/// [`CliError::Trace`].
pub(super) fn trace(
    method: Method,
    mesh: &Mesh,
    run: &BuildRun,
    scene: &Scene,
    rays: &[GridRay],
    query: Query,
) -> Result<TraceRun, CliError> {
    let bar = progress::bar(rays.len() as u64, "tracing rays");
    let mut all = TraceRun {
        hits: Vec::with_capacity(rays.len()),
        per_ray: Vec::with_capacity(rays.len()),
        sums: Sums::default(),
        host_time: Default::default(),
    };
    for chunk in rays.chunks(CHUNK) {
        let core: Vec<Option<Ray>> = chunk.iter().map(|ray| ray.core().copied()).collect();
        let part = crate::run::trace_by(method, &run.memory, scene, &core, query)
            .map_err(|source| CliError::Trace { scene: mesh.name.clone(), source })?;
        all.hits.extend(part.hits);
        all.per_ray.extend(part.per_ray);
        all.sums += part.sums;
        all.host_time += part.host_time;
        bar.inc(chunk.len() as u64);
    }
    bar.finish_and_clear();
    Ok(all)
}

/// A ray whose answer is not that of trying every triangle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Mismatch {
    /// The ray, from 0.
    pub ray: usize,
    /// What was found and what is right.
    pub difference: String,
}

/// Compares answers with those of trying every triangle, exactly: the same triangle at the same
/// time, or for [`Query::Any`] a triangle that the ray does hit then.
pub(super) fn check(
    reference: &Reference,
    rays: &[GridRay],
    hits: &[Option<traverse::Hit>],
    query: Query,
) -> Vec<Mismatch> {
    let bar = progress::bar(rays.len() as u64, "trying every triangle");
    let one = |(index, (ray, hit)): (usize, (&GridRay, &Option<traverse::Hit>))| {
        let difference = difference(reference, ray.core(), hit.as_ref(), query);
        tick(&bar);
        difference.map(|difference| Mismatch { ray: index, difference })
    };
    let mismatches = rays.par_iter().zip(hits).enumerate().filter_map(one).collect();
    bar.finish_and_clear();
    mismatches
}

/// Advances a bar; costs nothing where it is not shown.
fn tick(bar: &ProgressBar) {
    if !bar.is_hidden() {
        bar.inc(1);
    }
}

fn difference(
    reference: &Reference,
    ray: Option<&Ray>,
    hit: Option<&traverse::Hit>,
    query: Query,
) -> Option<String> {
    let found = hit.map(|hit| (hit.primitive.0, hit.t.to_bits()));
    let right = match (ray, query, found) {
        (None, _, _) => None,
        (Some(ray), Query::Closest, _) => reference.closest(ray).map(|a| (a.primitive, a.t)),
        // Any hit is right if it is one.
        (Some(ray), Query::Any, Some((primitive, _))) => {
            reference.hit(ray, primitive).map(|t| (primitive, t))
        }
        (Some(ray), Query::Any, None) => reference.closest(ray).map(|a| (a.primitive, a.t)),
    };
    let say = |answer: Option<(u32, i64)>| match answer {
        Some((primitive, t)) => format!("triangle {primitive} at {t}/64 grid steps"),
        None => "a miss".to_owned(),
    };
    (found != right).then(|| format!("found {}, but it is {}", say(found), say(right)))
}
