//! The traversal unit's cycle model: the core's records and events, whatever memory's pace, and what a ray
//! takes.

use xylem::bus::FlatMemory;
use xylem::machine::port::IdealPort;
use xylem::machine::traverser::{TraverserConfig, TraverserJob, TraverserRun, run};
use xylem::run::{self as runs, BuildOptions};
use xylem::scene::camera::{Camera, UpAxis};
use xylem::scene::convert::{GridRay, convert};
use xylem::scene::{LoadOptions, Mesh};
use xylem_core::geom::Ray;
use xylem_core::mem::ByteAddr;
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::traverse::{Hit, Query};

const FORMATS: [(&str, NodeFormat); 3] = [
    ("bvh2", NodeFormat::Bvh2),
    ("relative", NodeFormat::Quantized(Quantization::RELATIVE)),
    ("modulo", NodeFormat::Quantized(Quantization::MODULO)),
];

/// A scene from its camera.
struct View {
    mesh: Mesh,
    rays: Vec<Ray>,
}

impl View {
    fn new(mesh: Mesh, width: u32, height: u32) -> Self {
        let bounds = mesh.bounds().expect("a scene has triangles");
        let scene_rays = Camera::framing(bounds, UpAxis::Y, width, height).rays();
        let on_grid = convert(&mesh.frame, &scene_rays).unwrap();
        let rays = on_grid.iter().filter_map(GridRay::core).copied().collect();
        Self { mesh, rays }
    }

    /// A tree in memory, with the rays and room for records behind it.
    fn job(&self, format: NodeFormat, query: Query) -> (FlatMemory, TraverserJob) {
        let options = BuildOptions { format, ..BuildOptions::default() };
        let built = runs::build(&self.mesh.triangles, &options).unwrap();
        let rays = built.memory.bytes().len().next_multiple_of(64);
        let hits = (rays + self.rays.len() * Ray::BYTES).next_multiple_of(64);
        let mut memory = FlatMemory::new(hits + self.rays.len() * Hit::BYTES);
        memory.bytes_mut()[..built.memory.bytes().len()].copy_from_slice(built.memory.bytes());
        for (ray, at) in self.rays.iter().zip((rays..).step_by(Ray::BYTES)) {
            memory.bytes_mut()[at..at + Ray::BYTES].copy_from_slice(&ray.to_bytes());
        }
        let [rays, hits] = [rays, hits].map(|at| ByteAddr(at as u32));
        let ray_count = self.rays.len() as u32;
        (memory, TraverserJob { scene: built.scene, query, rays, ray_count, hits })
    }

    fn run(&self, format: NodeFormat, query: Query, latency: u32) -> TraverserRun {
        let (mut memory, job) = self.job(format, query);
        let rays: Vec<_> = self.rays.iter().copied().map(Some).collect();
        let wanted = runs::trace(&memory, &job.scene, &rays, query).unwrap();
        let mut port = IdealPort::new(latency);
        let ran = run(TraverserConfig::SMALL, &mut memory, job, &mut port).unwrap();
        let records: Vec<u8> =
            wanted.hits.iter().flat_map(|hit| Hit::to_bytes(hit.as_ref())).collect();
        assert!(memory.bytes()[job.hits.0 as usize..][..records.len()] == records);
        assert_eq!(ran.hits as usize, wanted.hits.iter().flatten().count());
        assert_eq!(ran.nodes, wanted.sums.nodes);
        assert_eq!(ran.box_tests, wanted.sums.box_tests);
        assert_eq!(ran.triangle_tests, wanted.sums.triangle_tests);
        ran
    }
}

fn named(name: &str) -> Result<Mesh, xylem::scene::SceneError> {
    xylem::scene::load(name, &LoadOptions::default())
}

#[test]
fn records_and_events_are_the_cores_at_any_latency_and_only_cycles_differ() {
    for name in ["cornell_box", "terrain:4", "degenerate/identical"] {
        let view = View::new(named(name).unwrap(), 24, 24);
        for (_, format) in FORMATS {
            for query in [Query::Closest, Query::Any] {
                let [fast, slow] = [1, 30].map(|latency| view.run(format, query, latency));
                // A read is asked for at most once at a time, and nothing is done meanwhile.
                assert_eq!(slow.cycles - fast.cycles, 29 * fast.reads, "{name}");
                assert_eq!(TraverserRun { cycles: 0, ..slow }, TraverserRun { cycles: 0, ..fast });
            }
        }
    }
}

#[test]
fn a_ray_takes_some_hundred_cycles() {
    println!(
        "| scene | format | lines cached | latency | nodes a ray | triangles a ray | lines a ray | cycles a ray |"
    );
    println!("|---|---|--:|--:|--:|--:|--:|--:|");
    for (name, size) in [("terrain:5", 32), ("anim_elephant_f0", 32), ("bunny", 32)] {
        let Ok(mesh) = named(name) else {
            println!("skipped: {name}: no such scene in XYLEM_SCENES");
            continue;
        };
        let view = View::new(mesh, size, size);
        for (format_name, format) in FORMATS {
            for config in TraverserConfig::ALL {
                let (mut memory, job) = view.job(format, Query::Closest);
                let mut port = IdealPort::new(20);
                let ran = run(config, &mut memory, job, &mut port).unwrap();
                let a_ray = |count: u64| count as f64 / view.rays.len() as f64;
                println!(
                    "| {name} | {format_name} | {} | {:.1} | {:.2} | {:.1} | {:.0} |",
                    1 << config.cache_width,
                    a_ray(ran.nodes),
                    a_ray(ran.triangle_tests),
                    a_ray(ran.reads),
                    a_ray(ran.cycles)
                );
                // A ray's own, a node's with a pop, a triangle's, and a miss'.
                let bound = 100.0
                    + 16.0 * a_ray(ran.nodes)
                    + 137.0 * a_ray(ran.triangle_tests)
                    + 22.0 * a_ray(ran.reads);
                assert!(a_ray(ran.cycles) < bound, "{name}: {} {bound}", a_ray(ran.cycles));
            }
        }
    }
}
