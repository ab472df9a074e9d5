//! Jobs for the traversal unit: scenes with a tree, rays, and room for hit records.

use xylem::bus::FlatMemory;
use xylem::machine::traverser::TraverserJob;
use xylem::run::{BuildOptions, build};
use xylem::scene::camera::{Camera, UpAxis};
use xylem::scene::convert::{GridRay, convert};
use xylem::scene::mesh::{LoadOptions, Mesh};
use xylem::scene::sampling;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::mem::ByteAddr;
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::traverse::{self, Hit, Query, TraceError};

use crate::random::Random;
use crate::traverser::geometry;

/// The formats that the unit walks.
pub const FORMATS: [(&str, NodeFormat); 3] = [
    ("relative", NodeFormat::Quantized(Quantization::RELATIVE)),
    ("modulo", NodeFormat::Quantized(Quantization::MODULO)),
    ("bvh2", NodeFormat::Bvh2),
];

/// A mesh and rays of many kinds through it.
#[derive(Debug)]
pub struct Set {
    /// What it is called.
    pub name: String,
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// The rays, each of which is one of the core's.
    pub rays: Vec<Ray>,
}

impl Set {
    /// The scene `name`, with `count` rays of each of eight kinds.
    ///
    /// # Panics
    /// If there is no such scene.
    pub fn new(name: &str, count: usize, seed: u64) -> Self {
        let mesh = xylem::scene::load(name, &LoadOptions::default());
        Self::of(&mesh.unwrap_or_else(|error| panic!("{error}")), count, seed)
    }

    fn of(mesh: &Mesh, count: usize, seed: u64) -> Self {
        let mut scene_rays = Vec::new();
        if let Some(bounds) = mesh.bounds() {
            let side = (count as f64).sqrt().ceil() as u32;
            scene_rays.extend(Camera::framing(bounds, UpAxis::Y, side, side).rays());
        }
        if !mesh.triangles.is_empty() {
            for sample in [
                sampling::segments,
                sampling::axis_parallel,
                sampling::axis_parallel_through_vertices,
                sampling::through_vertices,
                sampling::through_edges,
                sampling::in_box_faces,
            ] {
                scene_rays.extend(sample(mesh, count, seed));
            }
        }
        let on_grid = convert(&mesh.frame, &scene_rays).unwrap_or_default();
        let mut rays: Vec<Ray> = on_grid.iter().filter_map(GridRay::core).copied().collect();
        let mut random = Random::new(seed);
        for _ in 0..count {
            let target = match random.below(mesh.triangles.len().max(1) as u64) as usize {
                i if random.below(2) == 0 => mesh.triangles.get(i).map(|t| t.vertices[0]),
                _ => None,
            };
            rays.push(match target {
                Some(target) => geometry::ray_through(&mut random, target),
                None => geometry::ray(&mut random),
            });
        }
        // Unlike rays beside one another, so that an early error leaves all kinds behind it.
        for i in (1..rays.len()).rev() {
            rays.swap(i, random.below(i as u64 + 1) as usize);
        }
        Self { name: mesh.name.clone(), triangles: mesh.triangles.clone(), rays }
    }

    /// The job of tracing the rays through a tree in `format`, and memory with everything in it.
    ///
    /// # Panics
    /// If the scene cannot be built.
    pub fn job(&self, format: NodeFormat, query: Query) -> (FlatMemory, TraverserJob) {
        let run = build(&self.triangles, &BuildOptions { format, ..BuildOptions::default() });
        let run = run.unwrap_or_else(|error| panic!("{}: {error}", self.name));
        let rays = run.memory.bytes().len().next_multiple_of(64);
        let hits = (rays + self.rays.len() * Ray::BYTES).next_multiple_of(64);
        let mut memory =
            FlatMemory::new((hits + self.rays.len() * Hit::BYTES).next_multiple_of(64));
        memory.bytes_mut()[..run.memory.bytes().len()].copy_from_slice(run.memory.bytes());
        for (i, ray) in self.rays.iter().enumerate() {
            let at = rays + i * Ray::BYTES;
            memory.bytes_mut()[at..at + Ray::BYTES].copy_from_slice(&ray.to_bytes());
        }
        let job = TraverserJob {
            scene: run.scene,
            query,
            rays: ByteAddr(rays as u32),
            ray_count: self.rays.len() as u32,
            hits: ByteAddr(hits as u32),
        };
        (memory, job)
    }
}

/// A job with a few bits of its memory flipped, and at times one node, entry or triangle less than there are.
pub fn damaged(
    mut memory: FlatMemory,
    mut job: TraverserJob,
    random: &mut Random,
) -> (FlatMemory, TraverserJob) {
    let tree = job.scene.tree;
    let regions = [
        (tree.nodes.base, tree.node_count * tree.format.bytes()),
        (tree.leaf_table.base, tree.entry_count * 4),
        (job.scene.triangles.base, job.scene.triangle_count * 40),
        (job.rays, job.ray_count * Ray::BYTES as u32),
    ];
    for _ in 0..1 + random.below(4) {
        // Nodes, entries and triangles more often than rays, which end a job for less.
        let (base, size) = regions[[0, 0, 0, 1, 1, 2, 2, 2, 3][random.below(9) as usize]];
        let at = base.0 as usize + random.below(size.max(1).into()) as usize;
        memory.bytes_mut()[at] ^= 1 << random.below(8);
    }
    let mut less = |count: &mut u32| *count -= u32::from(*count > 0 && random.below(8) == 0);
    less(&mut job.scene.tree.node_count);
    less(&mut job.scene.tree.entry_count);
    less(&mut job.scene.triangle_count);
    (memory, job)
}

/// The hit records that the core writes for a job until the first ray that it cannot trace, and whether there is
/// one and what it says.
pub fn expected(memory: &FlatMemory, job: &TraverserJob) -> (Vec<u8>, Option<String>) {
    let mut records = Vec::new();
    for i in 0..job.ray_count as usize {
        let at = job.rays.0 as usize + i * Ray::BYTES;
        let mut bytes = [0; Ray::BYTES];
        bytes.copy_from_slice(&memory.bytes()[at..at + Ray::BYTES]);
        let Ok(ray) = Ray::from_bytes(&bytes) else { return (records, Some(format!("ray {i}"))) };
        match traverse::trace(&mut memory.snapshot(), &job.scene, &ray, job.query, &mut ()) {
            Ok(hit) => records.extend(Hit::to_bytes(hit.as_ref())),
            Err(TraceError::CorruptNode { .. }) => return (records, Some("node".into())),
            Err(TraceError::CorruptLeaf { entry }) => {
                return (records, Some(format!("leaf {entry}")));
            }
            Err(TraceError::CorruptTriangle { primitive }) => {
                return (records, Some(format!("triangle {}", primitive.0)));
            }
            Err(error) => return (records, Some(error.to_string())),
        }
    }
    (records, None)
}
