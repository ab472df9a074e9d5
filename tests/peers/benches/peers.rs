//! Building and tracing beside the crates `obvhs` and `bvh`: the same triangles, the same rays, one
//! thread, in one run, with the ratios printed at the end.
//!
//! `cargo bench -p xylem-peers`. Scenes: a procedural terrain and sphereflake, and the bunny and
//! Crytek Sponza where `XYLEM_SCENES` has them; more of its meshes are built and not traced.
//!
//! What is compared: Xylem's builder works on a byte-addressed bus as the hardware would, in bursts,
//! from 32-byte boxes to 64-byte nodes; the peers build from boxes in native arrays. Xylem's rays
//! are exact and read every node and triangle over the bus; the peers trace in f32. `obvhs` traces
//! triangles in the order of its leaves; `bvh` tests every leaf that a ray's line meets.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Duration;

use criterion::{BatchSize, Criterion, Throughput};
use nalgebra::{Point3, Vector3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::RayHit;
use xylem::bus::FlatMemory;
use xylem::run::{self, Buffers, BuildOptions};
use xylem::scene::{self, Camera, GridRay, LoadOptions, Mesh, SceneRay, UpAxis};
use xylem_core::geom::Ray;
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::traverse::{Query, trace};

const RAYS: u32 = 128;

/// Scenes that are built and traced.
const TRACED: [&str; 4] = ["bunny", "sponza_crytek", "terrain", "sphereflake"];

/// Scenes of over 50,000 triangles that are only built.
const BUILT: [&str; 13] = [
    "anim_cloth_ball_f0",
    "armadillo",
    "buddha",
    "coffee",
    "dragon",
    "dragon_res2",
    "hair",
    "horse",
    "igea",
    "kitten",
    "leaves",
    "sheen_cloth",
    "sibenik",
];

struct Subject {
    name: String,
    mesh: Mesh,
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
        .configure_from_args();
    let mut names = Vec::new();
    let scenes = TRACED.map(|name| (name, true)).into_iter();
    for (name, traced) in scenes.chain(BUILT.map(|name| (name, false))) {
        match scene::load(name, &LoadOptions::default()) {
            Ok(mesh) => {
                let subject = Subject { name: name.to_owned(), mesh };
                bench_build(&mut criterion, &subject);
                if traced {
                    bench_trace(&mut criterion, &subject);
                }
                names.push(subject.name);
            }
            Err(_) => println!("skipped: {name}: not found; set XYLEM_SCENES"),
        }
    }
    criterion.final_summary();
    print_ratios(&names);
}

fn bench_build(criterion: &mut Criterion, subject: &Subject) {
    let triangles = &subject.mesh.triangles;
    let mut group = criterion.benchmark_group(format!("build {}", subject.name));
    group.throughput(Throughput::Elements(triangles.len() as u64));
    for (name, format) in
        [("xylem", NodeFormat::Bvh2), ("xylem16", NodeFormat::Quantized(Quantization::MODULO))]
    {
        let options = BuildOptions { format, ..BuildOptions::default() };
        let (mut memory, layout) = run::load(triangles, &options.config).unwrap();
        let mut buffers = Buffers::new(&options.config);
        let count = triangles.len() as u32;
        group.bench_function(name, |b| {
            b.iter(|| {
                run::job(&mut memory, &layout, &options, count, &mut buffers, &mut ()).unwrap()
            });
        });
    }
    let soup = obvhs_triangles(&subject.mesh);
    group.bench_function("obvhs", |b| {
        b.iter(|| {
            build_bvh2_from_tris(&soup, BvhBuildParams::fastest_build(), &mut Duration::default())
        });
    });
    let shapes = bvh_shapes(&subject.mesh);
    group.bench_function("bvh", |b| {
        b.iter_batched_ref(
            || shapes.clone(),
            |shapes| bvh::bvh::Bvh::build(shapes),
            BatchSize::LargeInput,
        );
    });
    group.finish();
}

fn bench_trace(criterion: &mut Criterion, subject: &Subject) {
    let mesh = &subject.mesh;
    let build = |format| {
        let options = BuildOptions { format, ..BuildOptions::default() };
        run::build(&mesh.triangles, &options).unwrap()
    };
    let exact = build(NodeFormat::Bvh2);
    let modulo = build(NodeFormat::Quantized(Quantization::MODULO));
    let soup = obvhs_triangles(mesh);
    let params = BvhBuildParams::medium_build();
    let peer = build_bvh2_from_tris(&soup, params, &mut Duration::default());
    let in_order: Vec<_> = peer.primitive_indices.iter().map(|&i| soup[i as usize]).collect();
    let mut shapes = bvh_shapes(mesh);
    let other = bvh::bvh::Bvh::build(&mut shapes);

    for (set, rays) in ray_sets(mesh, &exact.memory, &exact.scene) {
        let mut group = criterion.benchmark_group(format!("{set} {}", subject.name));
        group.throughput(Throughput::Elements(rays.len() as u64));
        let grid: Vec<Ray> =
            rays.iter().filter_map(|ray| GridRay::new(&mesh.frame, ray).core().copied()).collect();
        for (name, run) in [("xylem", &exact), ("xylem16", &modulo)] {
            let mut memory = run.memory.snapshot();
            group.bench_function(name, |b| {
                b.iter(|| {
                    for ray in &grid {
                        let hit = trace(&mut memory, &run.scene, ray, Query::Closest, &mut ());
                        black_box(hit.unwrap());
                    }
                });
            });
        }
        let peer_rays: Vec<_> = rays.iter().map(obvhs_ray).collect();
        group.bench_function("obvhs", |b| {
            b.iter(|| {
                for &ray in &peer_rays {
                    let mut hit = RayHit::none();
                    peer.ray_traverse(ray, &mut hit, |ray, id| in_order[id].intersect(ray));
                    black_box(hit);
                }
            });
        });
        let other_rays: Vec<_> = rays.iter().map(bvh_ray).collect();
        group.bench_function("bvh", |b| {
            b.iter(|| {
                for ray in &other_rays {
                    let distances = other
                        .traverse_iterator(ray, &shapes)
                        .map(|s| ray.intersects_triangle(&s.v[0], &s.v[1], &s.v[2]).distance);
                    black_box(distances.fold(f32::INFINITY, f32::min));
                }
            });
        });
        group.finish();
    }
}

/// Primary rays of a camera that frames the scene, and a diffuse bounce of each hit.
fn ray_sets(
    mesh: &Mesh,
    memory: &FlatMemory,
    tree: &xylem_core::traverse::Scene,
) -> [(&'static str, Vec<SceneRay>); 2] {
    let bounds = mesh.bounds().unwrap();
    let primary = Camera::framing(bounds, UpAxis::Y, RAYS, RAYS).rays();
    let mut diffuse = Vec::new();
    for (i, ray) in primary.iter().enumerate() {
        let grid = GridRay::new(&mesh.frame, ray);
        let Some(core) = grid.core() else { continue };
        let hit = trace(&mut memory.snapshot(), tree, core, Query::Closest, &mut ()).unwrap();
        let hit = grid.hit(hit.as_ref());
        diffuse.extend(scene::sampling::bounce(mesh, ray, &hit, 1, i));
    }
    [("primary", primary), ("diffuse", diffuse)]
}

fn obvhs_triangles(mesh: &Mesh) -> Vec<obvhs::triangle::Triangle> {
    let corners = (0..mesh.triangles.len()).filter_map(|i| mesh.corners(i));
    corners
        .map(|c| {
            let [v0, v1, v2] = c.map(obvhs_glam::Vec3A::from);
            obvhs::triangle::Triangle { v0, v1, v2 }
        })
        .collect()
}

fn obvhs_ray(ray: &SceneRay) -> obvhs::ray::Ray {
    let (o, d) = (ray.origin.into(), ray.direction.into());
    obvhs::ray::Ray::new(o, d, ray.t_min, ray.t_max)
}

#[derive(Clone)]
struct Shape {
    v: [Point3<f32>; 3],
    node: usize,
}

impl bvh::aabb::Bounded<f32, 3> for Shape {
    fn aabb(&self) -> bvh::aabb::Aabb<f32, 3> {
        let mut aabb = bvh::aabb::Aabb::empty();
        self.v.iter().for_each(|v| aabb.grow_mut(v));
        aabb
    }
}

impl bvh::bounding_hierarchy::BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }
    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn bvh_shapes(mesh: &Mesh) -> Vec<Shape> {
    let corners = (0..mesh.triangles.len()).filter_map(|i| mesh.corners(i));
    corners.map(|c| Shape { v: c.map(Point3::from), node: 0 }).collect()
}

fn bvh_ray(ray: &SceneRay) -> bvh::ray::Ray<f32, 3> {
    bvh::ray::Ray::new(Point3::from(ray.origin), Vector3::from(ray.direction))
}

/// Prints medians and how many times as fast as each peer Xylem is.
fn print_ratios(scenes: &[String]) {
    println!("\nmedian times of this run; ratio = peer / xylem, above 1 where Xylem is faster");
    println!(
        "{:<26} {:>10} {:>10} {:>10} {:>10} {:>7} {:>7}",
        "", "xylem", "xylem16", "obvhs", "bvh", "obvhs", "bvh"
    );
    for scene in scenes {
        for job in ["build", "primary", "diffuse"] {
            let group = format!("{job} {scene}");
            let times = ["xylem", "xylem16", "obvhs", "bvh"].map(|name| median_ms(&group, name));
            let cell = |t: Option<f64>| t.map_or("n/a".to_owned(), |t| format!("{t:.2} ms"));
            let ratio = |peer: Option<f64>| match (peer, times[0]) {
                (Some(peer), Some(own)) => format!("{:.2}", peer / own),
                _ => "n/a".to_owned(),
            };
            if times.iter().all(Option::is_none) {
                continue;
            }
            let [own, own16, obvhs, bvh] = times.map(cell);
            let (to_obvhs, to_bvh) = (ratio(times[2]), ratio(times[3]));
            println!(
                "{group:<26} {own:>10} {own16:>10} {obvhs:>10} {bvh:>10} {to_obvhs:>7} {to_bvh:>7}"
            );
        }
    }
}

/// The median that criterion has just stored.
fn median_ms(group: &str, name: &str) -> Option<f64> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../target")),
        PathBuf::from,
    );
    let path = target.join("criterion").join(group).join(name).join("new/estimates.json");
    let text = std::fs::read_to_string(path).ok()?;
    let json: serde_json::Value = serde_json::from_str(&text).ok()?;
    Some(json["median"]["point_estimate"].as_f64()? / 1e6)
}
