//! A scene of a thousand triangles in every format.

use std::collections::HashMap;
use std::sync::{Mutex, OnceLock};

use glam::IVec3;
use xylem_core::compress::{Compression, OpenWide, WideCompressor, compress_top_down};
use xylem_core::geom::Triangle;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{
    Bvh2Node, Bvh2View, Child, NodeFormat, NodeIndex, Quantization, Subtree, Tree,
};
use xylem_core::pipeline::{BuildConfig, BuildRegions, build};
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

/// Where quantized nodes go, behind everything else.
pub const QUANTIZED: Region = Region::new(0x40_000, 20 * COUNT);

/// The scene.
pub fn pristine() -> &'static Pristine {
    static SCENE: OnceLock<Pristine> = OnceLock::new();
    SCENE.get_or_init(make)
}

/// The scene with quantized nodes: memory and descriptor.
pub fn quantized(quantization: &Quantization) -> (Vec<u8>, Scene) {
    static TREES: OnceLock<Mutex<HashMap<Quantization, (Vec<u8>, Scene)>>> = OnceLock::new();
    let mut trees = TREES.get_or_init(Mutex::default).lock().expect("no panic is survived");
    let (bytes, scene) = trees.entry(*quantization).or_insert_with(|| {
        let Pristine { bytes, scene, .. } = pristine();
        let mut memory = memory(bytes.clone());
        let tree =
            compress_top_down(&mut memory, &scene.tree, QUANTIZED, quantization, &mut ());
        (memory.bytes, Scene { tree: tree.expect("the tree is sound"), ..*scene })
    });
    (bytes.clone(), *scene)
}

/// The scene with quantized nodes of up to four children.
pub fn wide(quantization: &Quantization) -> (Vec<u8>, Scene) {
    static TREES: OnceLock<Mutex<HashMap<Quantization, (Vec<u8>, Scene)>>> = OnceLock::new();
    let mut trees = TREES.get_or_init(Mutex::default).lock().expect("no panic is survived");
    let (bytes, scene) = trees.entry(*quantization).or_insert_with(|| {
        let Pristine { bytes, scene, .. } = pristine();
        let mut memory = memory(bytes.clone());
        let compression = Compression { quantization: *quantization, ..Compression::DEFAULT };
        let mut open = vec![OpenWide::EMPTY; OpenWide::STACK];
        let region = Region { size: 40 * COUNT, ..QUANTIZED };
        memory.bytes.resize((region.base.0 + region.size) as usize, 0);
        let mut compressor = WideCompressor::new(compression, region, &mut open);
        let at = scene.tree.nodes.base.0 as usize;
        let nodes = bytes[at..].chunks_exact(Bvh2Node::BYTES).take(scene.tree.node_count as usize);
        for (index, node) in (0..).map(NodeIndex).zip(nodes) {
            let node = Bvh2View::new(node.try_into().expect("64 bytes")).to_repr();
            let node = node.expect("the tree is sound");
            let accepted = compressor.accept(&mut memory, &node, index, &mut ());
            accepted.expect("the tree is sound");
        }
        let count = compressor.finish(&mut memory, scene.tree.root.as_ref(), &mut ());
        let count = count.expect("the tree is sound");
        let child = Child::Inner(NodeIndex(count - 1));
        let root = scene.tree.root.map(|root| Subtree { child, ..root });
        let format = NodeFormat::Wide(*quantization);
        let nodes = Region { size: format.bytes() * count, ..region };
        let tree = Tree { format, nodes, root, node_count: count, ..scene.tree };
        (memory.bytes, Scene { tree, ..*scene })
    });
    (bytes.clone(), *scene)
}

fn memory(bytes: Vec<u8>) -> Memory {
    Memory { bytes, nodes: Region::default(), before: Vec::new(), accesses_left: u64::MAX }
}

fn make() -> Pristine {
    let mut seed = 1u64;
    let mut random = move |bits: u32| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> (64 - bits)) as i32 - (1 << (bits - 1))
    };
    let mut memory = memory(vec![0; (QUANTIZED.base.0 + QUANTIZED.size) as usize]);
    let mut triangles = Vec::new();
    for id in 0..COUNT {
        let centre = IVec3::new(random(23), random(23), random(23));
        // Sides of all sizes; a quarter is flat along an axis, and some share a place.
        let size = 4 + id % 18;
        let mut side = |axis: u32| if id % 16 == axis { 0 } else { random(size) };
        let centre = if id % 64 < 8 { IVec3::splat(id as i32 / 64 * 4096) } else { centre };
        let vertices = [(); 3].map(|()| centre + IVec3::new(side(0), side(1), side(2)));
        let triangle = Triangle { vertices, id };
        memory.write(ByteAddr(40 * id), &triangle.to_bytes()).expect("there is room");
        triangles.push(triangle);
    }
    let regions = BuildRegions {
        primitives: Region::new(0, 40 * COUNT),
        runs_a: Region::new(0x10_000, 32 * COUNT),
        runs_b: Region::default(),
        nodes: Region::new(0x20_000, 64 * COUNT),
        leaf_table: Region::new(0x30_000, 4 * COUNT),
    };
    let config = BuildConfig {
        input: InputFormat::Triangle40,
        sort: SortConfig { capacity: 1024, burst: 8, ..SortConfig::PAPER },
        ..BuildConfig::default()
    };
    let mut buffers = Box::new(SortBuffers::<1024, 64>::new());
    let workspace = &mut buffers.workspace();
    let tree = build(&mut memory, &config, &regions, COUNT, workspace, &mut ());
    let tree = tree.expect("the scene can be built");
    let scene = Scene { tree, triangles: regions.primitives, triangle_count: COUNT };
    Pristine { bytes: memory.bytes, scene, triangles }
}
