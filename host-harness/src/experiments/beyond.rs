//! What the experiments that go beyond the papers' tables share: meshes, builds and rays.

use rayon::prelude::*;
use xylem_core::geom::Ray;
use xylem_core::pipeline::BuildConfig;
use xylem_core::traverse::{Query, Scene};

use super::ExperimentError;
use crate::bus::FlatMemory;
use crate::run::{self, BuildOptions, BuildRun, TraceRun};
use crate::scene::{Camera, GridRay, Mesh, sampling};

/// The models, by the names of their meshes.
pub const MESHES: [&str; 7] = [
    "bunny",
    "anim_cloth_ball_f0",
    "elephant",
    "armadillo",
    "sponza_crytek",
    "sibenik",
    "dragon_res2",
];

/// Pixels of the pictures whose rays are traced, one ray and one bounce each.
pub const SIZE: (u32, u32) = (256, 192);

/// Builds and checks every box of the tree.
///
/// # Errors
/// [`ExperimentError::Build`].
pub fn build(mesh: &Mesh, config: BuildConfig) -> Result<BuildRun, ExperimentError> {
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    let failed = |source| ExperimentError::Build { scene: mesh.name.clone(), source };
    let run = run::build(&mesh.triangles, &options).map_err(failed)?;
    run.check().map_err(failed)?;
    Ok(run)
}

/// Traces rays to their closest hits.
///
/// # Errors
/// [`ExperimentError::Trace`].
pub fn trace(
    mesh: &Mesh,
    memory: &FlatMemory,
    scene: &Scene,
    rays: &[Option<Ray>],
) -> Result<TraceRun, ExperimentError> {
    run::trace(memory, scene, rays, Query::Closest)
        .map_err(|source| ExperimentError::Trace { scene: mesh.name.clone(), source })
}

/// The rays of a camera, and a diffuse bounce of each that hits something in `scene`.
///
/// # Errors
/// As [`trace`].
pub fn rays(
    mesh: &Mesh,
    camera: &Camera,
    memory: &FlatMemory,
    scene: &Scene,
) -> Result<[Vec<Option<Ray>>; 2], ExperimentError> {
    let on_grid: Vec<_> = camera.rays().iter().map(|ray| GridRay::new(&mesh.frame, ray)).collect();
    let primary: Vec<_> = on_grid.iter().map(|ray| ray.core().copied()).collect();
    let hits = trace(mesh, memory, scene, &primary)?.hits;
    let bounce = |(i, ray): (usize, &GridRay)| {
        let hit = ray.hit(hits[i].as_ref());
        let bounce = sampling::bounce(mesh, &camera.ray(i), &hit, 1, i)?;
        Some(GridRay::new(&mesh.frame, &bounce).core().copied())
    };
    let diffuse = on_grid.par_iter().enumerate().filter_map(bounce).collect();
    Ok([primary, diffuse])
}
