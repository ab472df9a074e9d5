//! Wide trees, streamed, beside streamed pairs.

use std::sync::Arc;

use xylem_core::compress::Compression;
use xylem_core::geom::Ray;
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::sort::InputFormat;

use super::beyond::{self, MESHES, SIZE, build};
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value};
use crate::report::html::Source;
use crate::run::{BuildRun, TraceRun};
use crate::scene::{Camera, Mesh, UpAxis};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "wide",
    place: "P3 §4",
    title: "Nodes of four children, streamed",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 10] = [
    Column::new("nodes_per_primitive", "nodes/prim", Source::Counted),
    Column::new("node_bytes_per_primitive", "node B/prim", Source::Counted),
    Column::new("node_fetches", "fetches/ray", Source::Counted),
    Column::new("node_bytes_per_ray", "node B/ray", Source::Counted).places(0),
    Column::new("box_tests", "boxes/ray", Source::Counted),
    Column::new("triangle_tests", "triangles/ray", Source::Counted),
    Column::new("build_bytes_per_primitive", "build B/prim", Source::Counted),
    Column::new("repairs_per_node", "repairs/node", Source::Counted).places(4),
    Column::new("repair_percent", "repairs, % of traffic", Source::Counted),
    Column::new("other_hits", "other hits", Source::Counted).places(0),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    outcome.nothing_at_hand = true;
    for name in MESHES {
        let Some(mesh) = lab.mesh(name)? else {
            outcome.notes.push(format!("No mesh '{name}' is at hand."));
            continue;
        };
        outcome.tables.push(trees(&mesh)?);
        outcome.nothing_at_hand = false;
    }
    outcome.configuration.extend(CONFIGURATION.map(str::to_owned));
    Ok(())
}

const CONFIGURATION: [&str; 2] = [
    "LBVH of 30-bit codes, equal codes in one leaf, 40-byte triangles in, 32-byte records, M = 8192, \
     B = 16; quantized in 6-bit modulo coordinates, margin 1, repairs in memory.",
    "Rays: 256 x 192 from a camera that has the model in view, and a diffuse bounce of each, together; \
     the closest hit.",
];

/// All trees over a mesh.
fn trees(mesh: &Arc<Mesh>) -> Result<Table, ExperimentError> {
    let base = BuildConfig { input: InputFormat::Triangle40, ..BuildConfig::default() };
    let streamed = |treelet_depth, collapse| {
        let compression = Some(Compression { treelet_depth, ..Compression::DEFAULT });
        BuildConfig { compression, collapse, ..base }
    };
    let exact = build(mesh, base)?;
    let rays = rays(mesh, &exact)?;
    let reference = trace(mesh, &exact, &rays)?.hits;
    let caption = format!("{}, {} triangles", mesh.name, mesh.triangles.len());
    let mut table = Table::new(caption, "nodes", COLUMNS);
    for (name, config) in [
        ("two boxes, 64 bytes", base),
        ("two, 16 bytes, no treelets", streamed(1, false)),
        ("two, 16 bytes, treelets of 2", streamed(2, false)),
        ("four, 32 bytes, no treelets", streamed(1, true)),
        ("four, 32 bytes, treelets of 2", streamed(2, true)),
    ] {
        let built = build(mesh, config)?;
        let traced = trace(mesh, &built, &rays)?;
        let tree = &built.scene.tree;
        let primitives = mesh.triangles.len().max(1) as f64;
        let per_ray = |count: u64| count as f64 / rays.len().max(1) as f64;
        let nodes = f64::from(tree.node_count);
        let bytes = built.traffic.total().bytes();
        let other = traced.hits.iter().zip(&reference).filter(|(a, b)| a != b).count();
        let values = [
            nodes / primitives,
            nodes * f64::from(tree.format.bytes()) / primitives,
            per_ray(traced.sums.nodes),
            per_ray(traced.sums.node_bytes),
            per_ray(traced.sums.box_tests),
            per_ray(traced.sums.triangle_tests),
            bytes as f64 / primitives,
            built.compressor.backtracks() as f64 / nodes.max(1.0),
            100.0 * built.traffic.stage(Stage::Compress).bytes() as f64 / bytes.max(1) as f64,
            other as f64,
        ];
        table.row(name, values.map(Value::ours));
    }
    Ok(table)
}

/// Primary rays and a bounce of each that hits.
fn rays(mesh: &Mesh, exact: &BuildRun) -> Result<Vec<Option<Ray>>, ExperimentError> {
    let camera = Camera::framing(mesh.bounds().unwrap_or_default(), UpAxis::Y, SIZE.0, SIZE.1);
    Ok(beyond::rays(mesh, &camera, &exact.memory, &exact.scene)?.concat())
}

fn trace(mesh: &Mesh, built: &BuildRun, rays: &[Option<Ray>]) -> Result<TraceRun, ExperimentError> {
    beyond::trace(mesh, &built.memory, &built.scene, rays)
}
