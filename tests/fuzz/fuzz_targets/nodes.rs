//! Damaged nodes, leaf tables and triangles through the decoder, the quality check and all
//! traversals: an answer or a typed error, in no more work than a whole tree takes.

#![no_main]

use libfuzzer_sys::fuzz_target;
use xylem_core::mem::Region;
use xylem_core::node::{Child, Grids, NodeFormat, NodeIndex, SharedNode};
use xylem_core::quality;
use xylem_core::traverse::{Method, Query, Scene, trace_by};
use xylem_fuzz::{Input, Memory, scene};

/// The least and the most bytes of nodes of which nothing is sound.
const RAW: std::ops::RangeInclusive<usize> = 4096..=65536;

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let mode = input.byte();
    let format = match mode & 7 {
        0 => NodeFormat::Bvh2,
        1 => NodeFormat::Quantized(input.quantization()),
        2..=4 => NodeFormat::Wide(input.quantization()),
        _ => NodeFormat::Shared(input.sharing()),
    };
    let (bytes, mut scene) = scene(format);
    let rays = [(); 4].map(|()| input.ray());
    let nodes = scene.tree.nodes;
    let at = nodes.base.0 as usize..(nodes.base.0 + nodes.size) as usize;
    let before = bytes[at].to_vec();
    let mut memory = Memory { nodes, before, ..Memory::new(bytes, format) };
    match mode >> 4 & 3 {
        0 => raw(&mut input, &mut memory, &mut scene, mode >> 6),
        1 => overlay(&mut input, &mut memory),
        _ => sparse(&mut input, &mut memory, &scene),
    }
    if mode >> 4 & 3 == 0 {
        // Hardly a way down is long here: each node is a root.
        for index in 0..scene.tree.node_count {
            if let Some(root) = &mut scene.tree.root {
                root.child = Child::Inner(NodeIndex(index));
            }
            let method = Method::ALL[index as usize % 3];
            let query = if index & 4 == 0 { Query::Closest } else { Query::Any };
            search(&mut memory, &scene, &rays[index as usize / 8 % 4], method, query);
        }
    } else {
        for ray in &rays {
            for method in Method::ALL {
                search(&mut memory, &scene, ray, method, Query::Closest);
                search(&mut memory, &scene, ray, method, Query::Any);
            }
        }
    }
    memory.accesses_left = accesses(&scene);
    let mut seen = [0; 32];
    if let Ok(quality) = quality::check(&mut memory, &scene, &mut seen) {
        quality.sah_cost();
    }
    Memory::count_execution();
});

/// A region of nothing but the fuzzer's bytes, again and again up to 4 KiB.
fn raw(input: &mut Input<'_>, memory: &mut Memory, scene: &mut Scene, plausible: u8) {
    let pattern = if input.0.is_empty() { &[0][..] } else { input.0 };
    let len = pattern.len().clamp(*RAW.start(), *RAW.end());
    let stride = scene.tree.format.bytes();
    let base = memory.bytes.len() as u32;
    scene.tree.nodes = Region::new(base, len as u32);
    scene.tree.node_count = len as u32 / stride;
    memory.nodes = scene.tree.nodes;
    memory.before.clear();
    memory.bytes.extend(pattern.iter().cycle().take(len));
    if let (NodeFormat::Shared(sharing), 1) = (&mut scene.tree.format, plausible & 1) {
        sharing.grids = Grids::Derived;
    }
    if plausible & 1 == 1 && matches!(stride, 16 | 32) {
        // Pointers to nodes before and to leaves that exist, so that ways down are longer.
        for index in 0..scene.tree.node_count {
            for half in 0..stride / 8 {
                let at = (base + index * stride + 8 * half + 4) as usize;
                let word = u32::from_le_bytes(memory.bytes[at..at + 4].try_into().expect("four"));
                let bound = if word >> 4 & 1 == 1 { scene.tree.entry_count } else { index.max(1) };
                let word = (word & 31) | (word >> 5) % bound << 5;
                memory.bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            }
        }
    }
}

/// A sound tree with the fuzzer's bytes over a part of it.
fn overlay(input: &mut Input<'_>, memory: &mut Memory) {
    let start = input.word() % memory.nodes.size;
    let at = (memory.nodes.base.0 + start) as usize;
    let end = (memory.nodes.base.0 + memory.nodes.size) as usize;
    for (byte, flip) in memory.bytes[at..end].iter_mut().zip(input.0) {
        *byte ^= flip;
    }
}

/// A sound scene with single bytes changed, most of them in nodes.
fn sparse(input: &mut Input<'_>, memory: &mut Memory, scene: &Scene) {
    while !input.0.is_empty() {
        let [kind, flip, place @ ..] = input.array::<4>();
        let region = match kind % 8 {
            0 => scene.tree.leaf_table,
            1 => scene.triangles,
            _ => memory.nodes,
        };
        let place = u32::from(u16::from_le_bytes(place)) % region.size;
        memory.bytes[(region.base.0 + place) as usize] ^= flip;
    }
}

fn search(
    memory: &mut Memory,
    scene: &Scene,
    ray: &xylem_core::geom::Ray,
    method: Method,
    query: Query,
) {
    memory.accesses_left = accesses(scene);
    if let Ok(Some(hit)) = trace_by(method, memory, scene, ray, query, &mut ()) {
        assert!(hit.primitive.0 < scene.triangle_count);
        assert!(hit.t > ray.t_min() && hit.t <= ray.t_max());
    }
}

/// Each node once, all words of it, and for each entry of the leaf table it and its triangle.
fn accesses(scene: &Scene) -> u64 {
    let reads = match scene.tree.format {
        NodeFormat::Shared(_) => SharedNode::MAX_WORDS as u64,
        _ => 1,
    };
    reads * u64::from(scene.tree.node_count) + 2 * u64::from(scene.tree.entry_count) + 2
}
