//! Meshes and builds, made once and kept for all experiments of a run.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;
use xylem_core::geom::{Aabb, Triangle};

use super::ExperimentError;
use super::outcome::Missing;
use super::scenes::PaperScene;
use crate::baseline::{DoyleModel, DoyleTraffic, SweepLeaves, binned, sweep};
use crate::bus::Traffic;
use crate::machine::compressor::CompressorEvents;
use crate::machine::toplevel::TopEvents;
use crate::run::{self, BuildOptions, ClockedRun};
use crate::scene::{self, LoadOptions, Mesh, SceneError};

/// Where experiments are made.
pub struct Lab<'a> {
    progress: &'a (dyn Fn(&str) + Sync),
    meshes: Kept<(&'static str, Option<Arc<Mesh>>)>,
    builds: Kept<(Arc<Mesh>, BuildOptions, Arc<Built>)>,
    sweeps: Kept<(Arc<Mesh>, f64)>,
    binned: Kept<(Arc<Mesh>, BinnedSah)>,
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
    /// What the top-level builder did.
    pub top: TopEvents,
    /// What the streaming compressor did.
    pub compressor: CompressorEvents,
    /// The SAH cost.
    pub sah_cost: f64,
    /// The clock's side of it, if a machine built.
    pub clocked: Option<ClockedRun>,
}

/// A binned SAH tree over all primitives.
#[derive(Debug, Clone, Copy)]
pub struct BinnedSah {
    /// Its SAH cost.
    pub sah_cost: f64,
    /// What the hardware for it moves: **modelled**.
    pub traffic: DoyleTraffic,
}

impl BinnedSah {
    /// The traffic in MiB.
    pub fn mib(&self) -> f64 {
        self.traffic.bytes() as f64 / f64::from(1 << 20)
    }
}

impl Built {
    /// The time on the clock in milliseconds: **modelled**; 0 without a clock.
    pub fn milliseconds(&self) -> f64 {
        self.clocked.as_ref().map_or(0.0, ClockedRun::milliseconds)
    }
}

impl<'a> Lab<'a> {
    /// A lab that says what it is doing to `progress`, from any thread.
    pub fn new(progress: &'a (dyn Fn(&str) + Sync)) -> Self {
        Self {
            progress,
            meshes: Mutex::default(),
            builds: Mutex::default(),
            sweeps: Mutex::default(),
            binned: Mutex::default(),
        }
    }

    /// Says what an experiment is doing.
    pub fn say(&self, what: &str) {
        (self.progress)(what);
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
    ///
    /// # Errors
    /// [`ExperimentError::Scene`].
    pub fn mesh(&self, name: &'static str) -> Result<Option<Arc<Mesh>>, ExperimentError> {
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
            top: run.top,
            compressor: run.compressor,
            sah_cost: quality.sah_cost().to_num(),
            clocked: run.clocked,
        });
        let entry = (Arc::clone(mesh), *options, Arc::clone(&built));
        lock(&self.builds).push(entry);
        Ok(built)
    }

    /// The SAH costs of full sweeps: the measure of the other costs (P2 §6).
    pub fn sweep_costs(&self, scenes: &[Loaded]) -> Vec<f64> {
        let cost = |loaded: &Loaded| {
            kept(&self.sweeps, &loaded.mesh, || {
                (self.progress)(&format!("sweeping {}", loaded.mesh.name));
                sweep(&boxes(&loaded.mesh), SweepLeaves::Sah).sah_cost().to_num()
            })
        };
        scenes.iter().map(cost).collect()
    }

    /// Binned SAH of 16 bins over all primitives, and its traffic by P2 §6.1.
    pub fn binned(&self, scenes: &[Loaded]) -> Vec<BinnedSah> {
        let build = |loaded: &Loaded| {
            kept(&self.binned, &loaded.mesh, || {
                (self.progress)(&format!("binned SAH of {}", loaded.mesh.name));
                let tree = binned(&boxes(&loaded.mesh), 16);
                let traffic = DoyleModel::PAPER.traffic(&tree);
                BinnedSah { sah_cost: tree.sah_cost().to_num(), traffic }
            })
        };
        scenes.iter().map(build).collect()
    }
}

fn boxes(mesh: &Mesh) -> Vec<Aabb> {
    mesh.triangles.iter().map(Triangle::bounds).collect()
}

/// What was kept of a mesh, or what `make` makes.
fn kept<T: Copy>(kept: &Kept<(Arc<Mesh>, T)>, mesh: &Arc<Mesh>, make: impl FnOnce() -> T) -> T {
    let known = lock(kept).iter().find(|(m, _)| Arc::ptr_eq(m, mesh)).map(|(_, made)| *made);
    known.unwrap_or_else(|| {
        let made = make();
        lock(kept).push((Arc::clone(mesh), made));
        made
    })
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
