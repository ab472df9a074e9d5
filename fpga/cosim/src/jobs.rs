//! What a whole accelerator is given: scenes, the driver's jobs for them, and the cycle models of both units.

use xylem::machine::config::MachineConfig;
use xylem::machine::traverser::{TraverserConfig, TraverserJob};
use xylem::run::Layout;
use xylem::scene;
use xylem::scene::mesh::{LoadOptions, Mesh};
use xylem_core::compress::Compression;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Coordinates, LeafEntry, Quantization};
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::{InputFormat, RecordFormat, SortConfig};
use xylem_core::traverse::Hit;
use xylem_driver::{BuildJob, TraceJob};

use crate::random::Random;
use crate::top::TopConfig;

/// Counts of primitives around which builds differ on [`TopConfig::SMALL`]: one, a line and a half, a piece, a
/// run, a pass, two passes; and one more or less.
pub const COUNTS: [u32; 13] = [1, 2, 3, 7, 8, 9, 127, 128, 129, 300, 2047, 2048, 2049];

/// Small triangles here and there, every third near the middle.
pub fn soup(count: u32, seed: u64) -> Vec<Triangle> {
    let mut random = Random::new(seed);
    let mut any = |spread: u64| random.below(2 * spread) as i32 - spread as i32;
    let triangle = |id| {
        let spread = if id % 3 == 0 { 1 << 12 } else { (1 << 23) - (1 << 13) };
        let anchor = [any(spread), any(spread), any(spread)];
        let vertices = [(); 3].map(|()| anchor.map(|c| c + any(1 << 12)).into());
        Triangle { vertices, id }
    };
    (0..count).map(triangle).collect()
}

/// Scenes of the size that people use. Says that `test` goes without the bunny if `XYLEM_SCENES` names no folder.
///
/// # Panics
/// If one cannot be loaded.
pub fn real_scenes(test: &str) -> Vec<(&'static str, Mesh)> {
    let mut names = vec!["sphereflake:2", "cloth:64"];
    if std::env::var_os("XYLEM_SCENES").is_some() {
        names.push("bunny");
    } else {
        println!("skipped: {test}: the bunny, as XYLEM_SCENES names no folder");
    }
    let load = |name| {
        let mesh = scene::load(name, &LoadOptions::default());
        (name, mesh.unwrap_or_else(|error| panic!("{name}: {error}")))
    };
    names.into_iter().map(load).collect()
}

/// The driver's job of what `build` does with `count` primitives.
pub fn build_job(layout: &Layout, count: u32, build: &BuildConfig) -> BuildJob {
    let mut regions = layout.build;
    // Places are 4 KiB apart, so there is room for the rest of the last line.
    for region in [
        &mut regions.primitives,
        &mut regions.runs_a,
        &mut regions.runs_b,
        &mut regions.nodes,
        &mut regions.leaf_table,
    ] {
        *region = lines(region.base, region.size);
    }
    BuildJob {
        regions,
        count,
        input: build.input,
        record: RecordFormat::Box32,
        morton: build.morton,
        max_leaf_size: build.max_leaf_size,
        compressed: build.compression.map(|compression| xylem_driver::Compression {
            target: regions.nodes,
            coordinates: compression.quantization.coordinates,
            treelet_depth: compression.treelet_depth,
        }),
    }
}

/// The driver's job of what the traversal unit does in `job`.
pub fn trace_job(job: &TraverserJob) -> TraceJob {
    let mut tree = job.scene.tree;
    tree.nodes = lines(tree.nodes.base, tree.node_count * tree.format.bytes());
    tree.leaf_table = lines(tree.leaf_table.base, tree.entry_count * LeafEntry::BYTES as u32);
    let triangles = job.scene.triangle_count * Triangle::BYTES as u32;
    TraceJob {
        tree,
        triangles: lines(job.scene.triangles.base, triangles),
        triangle_count: job.scene.triangle_count,
        rays: lines(job.rays, job.ray_count * Ray::BYTES as u32),
        hits: lines(job.hits, job.ray_count * Hit::BYTES as u32),
        ray_count: job.ray_count,
        query: job.query,
    }
}

/// A region of `bytes` from `base` on, to the end of its last line.
fn lines(base: ByteAddr, bytes: u32) -> Region {
    Region::new(base.0, bytes.next_multiple_of(64))
}

impl TopConfig {
    /// What it builds from boxes, without compression.
    pub fn build_config(&self) -> BuildConfig {
        BuildConfig {
            sort: SortConfig { capacity: self.capacity, burst: self.burst, ..SortConfig::PAPER },
            input: InputFormat::Box32,
            write_burst: Self::WRITE_BURST,
            ..BuildConfig::default()
        }
    }

    /// How it compresses nodes in `coordinates`.
    pub fn compression(&self, coordinates: Coordinates) -> Compression {
        let quantization = Quantization { coordinates, ..Quantization::MODULO };
        let treelet_depth = self.depth as u8;
        Compression { quantization, treelet_depth, ..Compression::DEFAULT }
    }

    /// The cycle model of its builder.
    pub fn machine(&self, build: BuildConfig) -> MachineConfig {
        let Self { sorters, fifo, read_ahead, time_out, .. } = *self;
        let time_out = time_out.into();
        MachineConfig { sorters, fifo, read_ahead, time_out, ..MachineConfig::p2(build) }
    }

    /// The cycle model of its traversal unit.
    pub fn traverser(&self) -> TraverserConfig {
        let Self { name, cache_width, cache_block, .. } = *self;
        TraverserConfig { name, cache_width, cache_block, ..TraverserConfig::SMALL }
    }
}
