//! A small job on any bus: build, compress both ways, trace.

use glam::IVec3;
use xylem::bus::FlatMemory;
use xylem::run::{self, BuildOptions, Layout};
use xylem::scene::Random;
use xylem_core::compress::compress_top_down;
use xylem_core::error::BuildError;
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::Bus;
use xylem_core::node::{Quantization, Tree};
use xylem_core::pipeline::{self, BuildConfig};
use xylem_core::probe::Probe;
use xylem_core::sort::{RecordFormat, SortBuffers, SortConfig};
use xylem_core::traverse::{self, Hit, Query, Scene, TraceError};

use crate::rays::hard_ray;
use crate::trees::soup;

/// A scene, loaded into memory, and how it is to be built.
#[derive(Clone, Debug)]
pub struct Job {
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// How to build.
    pub config: BuildConfig,
    /// Where things are.
    pub layout: Layout,
    /// Memory with the input in it and nothing else.
    pub memory: FlatMemory,
}

impl Job {
    /// A random scene with runs of `record`. The sorter is so small that a few hundred triangles
    /// take several merge passes.
    ///
    /// # Panics
    /// If the scene cannot be built at all.
    pub fn new(random: &mut Random, count: usize, record: RecordFormat) -> Self {
        let triangles = soup(random, count);
        let sort = SortConfig { capacity: 64, burst: 8, record, ..SortConfig::PAPER };
        let config =
            BuildConfig { sort, max_leaf_size: 4, write_burst: 256, ..BuildConfig::default() };
        let options = BuildOptions { config, ..BuildOptions::default() };
        let run = run::build(&triangles, &options).unwrap_or_else(|e| panic!("{e}"));
        let (layout, mut memory) = (run.layout, run.memory);
        // Everything behind the input is output.
        let inputs = layout.build.runs_a.base.0 as usize;
        memory.bytes_mut()[inputs..].fill(0);
        Self { triangles, config, layout, memory }
    }

    /// Builds the tree of 64-byte nodes.
    ///
    /// # Errors
    /// The core's.
    pub fn build<B: Bus, P: Probe>(
        &self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<Tree, BuildError<B::Error>> {
        let mut buffers = Box::new(SortBuffers::<64, 4>::new());
        let (regions, count) = (&self.layout.build, self.triangles.len() as u32);
        pipeline::build(bus, &self.config, regions, count, &mut buffers.workspace(), probe)
    }

    /// Compresses a tree.
    ///
    /// # Errors
    /// The core's.
    pub fn compress<B: Bus, P: Probe>(
        &self,
        bus: &mut B,
        tree: &Tree,
        quantization: &Quantization,
        probe: &mut P,
    ) -> Result<Tree, BuildError<B::Error>> {
        compress_top_down(bus, tree, self.layout.quantized_nodes, quantization, probe)
    }

    /// The scene of a tree.
    pub fn scene(&self, tree: Tree) -> Scene {
        let triangle_count = self.triangles.len() as u32;
        Scene { tree, triangles: self.layout.triangles, triangle_count }
    }

    /// Rays aimed at the scene.
    pub fn rays(&self, random: &mut Random, count: usize) -> Vec<Ray> {
        let bounds = self.bounds();
        (0..count).map(|_| hard_ray(random, &self.triangles, &bounds).1).collect()
    }

    /// The box of the scene.
    pub fn bounds(&self) -> Aabb {
        let boxes = self.triangles.iter().map(Triangle::bounds);
        boxes.fold(Aabb::new(IVec3::MAX, IVec3::MIN), |a, b| a.union(&b))
    }
}

/// Traces one ray without a probe.
///
/// # Errors
/// The core's.
pub fn trace<B: Bus>(
    bus: &mut B,
    scene: &Scene,
    ray: &Ray,
    query: Query,
) -> Result<Option<Hit>, TraceError<B::Error>> {
    traverse::trace(bus, scene, ray, query, &mut ())
}
