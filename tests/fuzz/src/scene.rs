//! A scene of a thousand triangles in every format.

use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};

use glam::IVec3;
use xylem_core::compress::{Compression, HeldNode, OpenWide};
use xylem_core::geom::Triangle;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::NodeFormat;
use xylem_core::pipeline::{BuildConfig, BuildRegions, TreeStorage, build_with};
use xylem_core::sort::{InputFormat, SortBuffers, SortConfig};
use xylem_core::traverse::Scene;

use crate::Memory;

/// How many triangles.
const COUNT: u32 = 1024;

/// A scene in memory, in 64-byte nodes.
pub struct Pristine {
    pub bytes: Vec<u8>,
    pub scene: Scene,
    pub triangles: Vec<Triangle>,
}

/// Where nodes go, whatever their format.
const NODES: Region = Region::new(0x20_000, 64 * COUNT);

/// The scene in 64-byte nodes.
pub fn pristine() -> &'static Pristine {
    static SCENE: OnceLock<Pristine> = OnceLock::new();
    SCENE.get_or_init(|| {
        let triangles = triangles();
        let (bytes, scene) = stream(NodeFormat::Bvh2, &triangles);
        Pristine { bytes, scene, triangles }
    })
}

/// The scene in nodes of a format that can be streamed: memory and descriptor.
pub fn scene(format: NodeFormat) -> (Vec<u8>, Scene) {
    type Trees = HashMap<NodeFormat, (Vec<u8>, Scene)>;
    static TREES: OnceLock<Mutex<Trees>> = OnceLock::new();
    let mut trees = TREES.get_or_init(Mutex::default).lock().expect("no panic is survived");
    trees.entry(format).or_insert_with(|| stream(format, &pristine().triangles)).clone()
}

/// Builds a tree.
fn stream(format: NodeFormat, triangles: &[Triangle]) -> (Vec<u8>, Scene) {
    let regions = BuildRegions {
        primitives: Region::new(0, 40 * COUNT),
        runs_a: Region::new(0x10_000, 32 * COUNT),
        runs_b: Region::default(),
        nodes: NODES,
        leaf_table: Region::new(0x30_000, 4 * COUNT),
    };
    let compress = |quantization| Some(Compression { quantization, ..Compression::DEFAULT });
    let (compression, sharing) = match format {
        NodeFormat::Bvh2 => (None, None),
        NodeFormat::Quantized(quantization) | NodeFormat::Wide(quantization) => {
            (compress(quantization), None)
        }
        NodeFormat::Shared(sharing) => (None, Some(sharing)),
    };
    let config = BuildConfig {
        input: InputFormat::Triangle40,
        sort: SortConfig { capacity: 1024, burst: 8, ..SortConfig::PAPER },
        compression,
        collapse: matches!(format, NodeFormat::Wide(_)),
        sharing,
        ..BuildConfig::default()
    };
    let mut memory = Memory::new(vec![0; 0x31_000], format);
    for triangle in triangles {
        let at = ByteAddr(40 * triangle.id);
        memory.write(at, &triangle.to_bytes()).expect("there is room");
    }
    let mut buffers = Box::new(SortBuffers::<1024, 64>::new());
    let mut held = vec![HeldNode::EMPTY; Compression::DEFAULT.held_nodes()];
    let mut open = vec![OpenWide::EMPTY; OpenWide::STACK];
    let mut storage = TreeStorage { held: &mut held, open: &mut open, ..TreeStorage::none() };
    let workspace = &mut buffers.workspace();
    let tree = build_with(&mut memory, &config, &regions, COUNT, workspace, &mut storage, &mut ());
    let mut tree = tree.expect("the scene can be built");
    tree.nodes.size = format.bytes() * tree.node_count;
    (memory.bytes, Scene { tree, triangles: regions.primitives, triangle_count: COUNT })
}

fn triangles() -> Vec<Triangle> {
    let mut seed = 1u64;
    let mut random = move |bits: u32| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> (64 - bits)) as i32 - (1 << (bits - 1))
    };
    let triangle = |id| {
        let centre = IVec3::new(random(23), random(23), random(23));
        // Sides of all sizes; a quarter is flat along an axis, and some share a place.
        let size = 4 + id % 18;
        let mut side = |axis: u32| if id % 16 == axis { 0 } else { random(size) };
        let centre = if id % 64 < 8 { IVec3::splat(id as i32 / 64 * 4096) } else { centre };
        let vertices = [(); 3].map(|()| centre + IVec3::new(side(0), side(1), side(2)));
        Triangle { vertices, id }
    };
    (0..COUNT).map(triangle).collect()
}
