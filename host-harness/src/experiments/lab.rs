//! Meshes and builds, made once and kept for all experiments of a run.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use xylem_core::geom::Triangle;

use super::ExperimentError;
use super::outcome::Missing;
use super::scenes::PaperScene;
use crate::baseline::{SweepLeaves, sweep};
use crate::bus::Traffic;
use crate::run::{self, BuildOptions, ClockedRun};
use crate::scene::{self, LoadOptions, Mesh, SceneError};

/// Where experiments are made.
pub struct Lab<'a> {
    progress: &'a (dyn Fn(&str) + Sync),
    meshes: Kept<(&'static str, Option<Arc<Mesh>>)>,
    builds: Kept<(Arc<Mesh>, BuildOptions, Arc<Built>)>,
    sweeps: Kept<(Arc<Mesh>, f64)>,
}

/// What was made, in no order: there are tens of them at most.
type Kept<T> = Mutex<Vec<T>>;

/// A model that is at hand.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// What the papers say of it.
    pub scene: &'static PaperScene,
    /// The mesh.
    pub mesh: Arc<Mesh>,
}

/// What is kept of a build.
#[derive(Debug)]
pub struct Built {
    /// Primitives.
    pub primitives: u64,
    /// Leaves of the tree.
    pub leaves: u64,
    /// Traffic by stage and region.
    pub traffic: Traffic,
    /// The SAH cost.
    pub sah_cost: f64,
    /// The clock's side of it, if a machine built.
    pub clocked: Option<ClockedRun>,
}

impl<'a> Lab<'a> {
    /// A lab that says what it is doing to `progress`, from any thread.
    pub fn new(progress: &'a (dyn Fn(&str) + Sync)) -> Self {
        Self {
            progress,
            meshes: Mutex::default(),
            builds: Mutex::default(),
            sweeps: Mutex::default(),
        }
    }

    /// Those of `scenes` that are at hand, and why the others are not.
    ///
    /// # Errors
    /// [`ExperimentError::Scene`] for a file that is there and is no mesh.
    pub fn scenes(
        &self,
        scenes: &[&'static PaperScene],
    ) -> Result<(Vec<Loaded>, Vec<Missing>), ExperimentError> {
        let found: Result<Vec<_>, _> = scenes
            .par_iter()
            .map(|scene| scene.mesh.map(|name| self.mesh(name)).transpose())
            .collect();
        let (mut here, mut missing) = (Vec::new(), Vec::new());
        for (&scene, mesh) in scenes.iter().zip(found?) {
            match mesh.flatten() {
                None => missing.push(Missing::new(scene)),
                Some(mesh) if !scene.can_have(mesh.triangles.len()) => {
                    missing.push(Missing::other(scene, mesh.triangles.len()));
                }
                Some(mesh) => here.push(Loaded { scene, mesh }),
            }
        }
        Ok((here, missing))
    }

    /// A mesh, or `None` if no folder has one of that name.
    fn mesh(&self, name: &'static str) -> Result<Option<Arc<Mesh>>, ExperimentError> {
        if let Some((_, mesh)) = lock(&self.meshes).iter().find(|(known, _)| *known == name) {
            return Ok(mesh.clone());
        }
        (self.progress)(&format!("loading {name}"));
        let mesh = match scene::load(name, &LoadOptions::default()) {
            Ok(mesh) => Some(Arc::new(mesh)),
            Err(SceneError::NotFound { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        lock(&self.meshes).push((name, mesh.clone()));
        Ok(mesh)
    }

    /// Builds each scene with each of `options`, on all cores, and gives one row of builds a scene.
    ///
    /// # Errors
    /// [`ExperimentError::Build`].
    pub fn builds(
        &self,
        scenes: &[Loaded],
        options: &[BuildOptions],
    ) -> Result<Vec<Vec<Arc<Built>>>, ExperimentError> {
        let jobs: Vec<_> =
            scenes.iter().flat_map(|scene| options.iter().map(move |o| (scene, o))).collect();
        let built: Result<Vec<_>, _> =
            jobs.par_iter().map(|(scene, options)| self.build(&scene.mesh, options)).collect();
        Ok(built?.chunks(options.len().max(1)).map(<[_]>::to_vec).collect())
    }

    /// Builds one mesh, unless that was done before.
    ///
    /// # Errors
    /// [`ExperimentError::Build`].
    pub fn build(
        &self,
        mesh: &Arc<Mesh>,
        options: &BuildOptions,
    ) -> Result<Arc<Built>, ExperimentError> {
        let known = lock(&self.builds)
            .iter()
            .find(|(known, with, _)| Arc::ptr_eq(known, mesh) && with == options)
            .map(|(_, _, built)| Arc::clone(built));
        if let Some(built) = known {
            return Ok(built);
        }
        let how = options.machine.map_or("", |_| " on the clock");
        (self.progress)(&format!("building {}{how}, memory {}", mesh.name, options.memory.name));
        let failed = |source| ExperimentError::Build { scene: mesh.name.clone(), source };
        let run = run::build(&mesh.triangles, options).map_err(failed)?;
        let quality = run.check().map_err(failed)?;
        let built = Arc::new(Built {
            primitives: mesh.triangles.len() as u64,
            leaves: u64::from(run.scene.tree.leaf_count),
            traffic: run.traffic,
            sah_cost: quality.sah_cost().to_num(),
            clocked: run.clocked,
        });
        let entry = (Arc::clone(mesh), *options, Arc::clone(&built));
        lock(&self.builds).push(entry);
        Ok(built)
    }

    /// The SAH cost of the full sweep over a mesh: the measure of the other costs (P2 §6).
    pub fn sweep_cost(&self, mesh: &Arc<Mesh>) -> f64 {
        let known = lock(&self.sweeps).iter().find(|(m, _)| Arc::ptr_eq(m, mesh)).map(|(_, c)| *c);
        known.unwrap_or_else(|| {
            (self.progress)(&format!("sweeping {}", mesh.name));
            let boxes: Vec<_> = mesh.triangles.iter().map(Triangle::bounds).collect();
            let cost = sweep(&boxes, SweepLeaves::Sah).sah_cost().to_num();
            lock(&self.sweeps).push((Arc::clone(mesh), cost));
            cost
        })
    }
}

impl fmt::Debug for Lab<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Lab").field("meshes", &self.meshes).finish_non_exhaustive()
    }
}

/// What a panicking thread left is whole: entries are pushed when they are done.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
