//! The same steps in the accelerator's units, by their cycle models, which the RTL equals.

use xylem::bus::FlatMemory;
use xylem::machine::compress::CompressUnit;
use xylem::machine::heap::{HeapConfig, HeapEntry, HeapModel, HeapOp};
use xylem::machine::port::{Access, IdealPort, Port, PortError};
use xylem::machine::traverser::{Traverser, TraverserConfig, TraverserInputs, TraverserJob};
use xylem::run::{BuildOptions, build};
use xylem::soc::SceneBlob;
use xylem_core::compress::{Compression, HeldNode, Repairs};
use xylem_core::error::BuildError;
use xylem_core::geom::Ray;
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{LeafEntry, NodeFormat, Quantization};
use xylem_core::num::MortonCoder;
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::sort::Item;
use xylem_core::traverse::Hit;

use super::CustomError;

/// Cycles of the accelerator's units on a scene, behind memory that answers in the next cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Accelerated {
    /// Replacing the top of `xy_heap` so often takes so many cycles.
    pub heap: [u64; 2],
    /// So many nodes leave `xy_emit`, which builds and compresses a sorted stream, in so many cycles.
    pub compress: [u64; 2],
    /// So many rays are traced by `xy_traverser` through 64-byte nodes in so many cycles,
    pub trace: [u64; 2],
    /// and on their way so many boxes are tested in so many cycles, from a node's arrival to the second verdict.
    pub boxes: [u64; 2],
}

/// Runs the models on a scene.
///
/// # Errors
/// [`CustomError::Model`].
pub fn accelerated(scene: &SceneBlob) -> Result<Accelerated, CustomError> {
    let failed = |error: &dyn std::fmt::Display| CustomError::Model(error.to_string());
    let config = BuildConfig {
        max_leaf_size: scene.max_leaf_size,
        morton: scene.morton,
        ..BuildConfig::default()
    };
    let options = BuildOptions { config, format: NodeFormat::Bvh2, ..BuildOptions::default() };
    let built = build(&scene.triangles, &options).map_err(|error| failed(&error))?;
    let rays = built.memory.bytes().len().next_multiple_of(64);
    let hits = (rays + scene.rays.len() * Ray::BYTES).next_multiple_of(64);
    let end = (hits + scene.rays.len() * Hit::BYTES).next_multiple_of(64);
    let mut memory = FlatMemory::new(end);
    memory.bytes_mut()[..built.memory.bytes().len()].copy_from_slice(built.memory.bytes());
    for (ray, at) in scene.rays.iter().zip((rays..).step_by(Ray::BYTES)) {
        memory.bytes_mut()[at..at + Ray::BYTES].copy_from_slice(&ray.to_bytes());
    }
    let job = TraverserJob {
        scene: built.scene,
        query: scene.query,
        rays: ByteAddr(rays as u32),
        ray_count: scene.rays.len() as u32,
        hits: ByteAddr(hits as u32),
    };
    let [trace, boxes] = trace(&memory, job);
    Ok(Accelerated {
        heap: heap(),
        compress: compress(scene).map_err(|error| failed(&error))?,
        trace,
        boxes,
    })
}

/// Traces the rays; counts and cycles of all, and of both boxes of a node from its arrival to the second verdict.
fn trace(memory: &FlatMemory, job: TraverserJob) -> [[u64; 2]; 2] {
    let mut port = IdealPort::new(1);
    let mut unit = Traverser::new(TraverserConfig::SMALL, memory, job);
    let (mut cycle, mut boxes, mut node) = (0, [0; 2], None);
    while !unit.is_done() {
        let (read, write) = unit.shown();
        let mut offer = |addr, write| port.offer(Access { addr, write, tag: 0 });
        let read_ready = read.is_some_and(|addr| offer(addr, false));
        let write_ready = write.is_some_and(|line| offer(line.addr, true));
        let response = port.take().is_some();
        let out = unit.tick(&TraverserInputs { read_ready, response, write_ready });
        if out.node_fetch {
            node = Some((cycle, 0));
        }
        if let (true, Some((since, tested))) = (out.box_test, &mut node) {
            *tested += 1;
            if *tested == 2 {
                boxes = [boxes[0] + 2, boxes[1] + cycle - *since];
            }
        }
        cycle += 1;
        port.tick();
    }
    [[job.ray_count.into(), cycle], boxes]
}

/// Fills the heap of the paper and replaces its top as often as it can.
fn heap() -> [u64; 2] {
    const REPLACES: u64 = 10_000;
    let mut heap = HeapModel::new(HeapConfig::PAPER);
    let mut slot = 0;
    while heap.len() < HeapConfig::PAPER.capacity() {
        let key = u64::from(slot) * 7919 % 1024;
        let op = heap.outputs().ready.then_some(HeapOp::Insert(HeapEntry { key, slot }));
        slot += u32::from(op.is_some());
        heap.tick(op);
    }
    let (mut done, mut cycles) = (0, 0);
    while done < REPLACES {
        let outputs = heap.outputs();
        let top = outputs.top.filter(|_| outputs.ready);
        let next = |top: HeapEntry| HeapEntry { key: top.key + 1009, ..top };
        heap.tick(top.map(|top| HeapOp::Replace(next(top))));
        done += u64::from(top.is_some());
        cycles += 1;
    }
    [done, cycles]
}

/// Builds and compresses the scene's sorted primitives; memory takes every line at once.
fn compress(scene: &SceneBlob) -> Result<[u64; 2], BuildError<PortError>> {
    let coder = MortonCoder::new(scene.grid, scene.morton);
    let mut items: Vec<Item> = (0..)
        .zip(&scene.triangles)
        .map(|(reference, triangle)| {
            let bounds = triangle.bounds();
            Item { bounds, code: coder.code(bounds.min, bounds.max), reference }
        })
        .collect();
    items.sort_by_key(|item| (item.code, item.reference));
    let compression = Compression {
        quantization: Quantization::MODULO,
        treelet_depth: 2,
        margin: 1,
        repairs: Repairs::InMemory,
    };
    let (nodes, leaves) = (16 * items.len() as u32, LeafEntry::BYTES as u32 * items.len() as u32);
    let regions = BuildRegions {
        nodes: Region::new(64, nodes),
        leaf_table: Region::new((64 + nodes).next_multiple_of(64), leaves),
        ..BuildRegions::default()
    };
    let config = BuildConfig { max_leaf_size: scene.max_leaf_size, ..BuildConfig::default() };
    let mut held = vec![HeldNode::EMPTY; compression.held_nodes()];
    let mut image = vec![0; (regions.leaf_table.base.0 + leaves).next_multiple_of(64) as usize];
    let mut unit = CompressUnit::new(&config, compression, &regions, &mut held);
    let mut items = items.iter().peekable();
    let (mut cycles, mut flying) = (0, false);
    while !unit.is_finished() {
        let arrives = std::mem::replace(&mut flying, unit.compressor().read().is_some());
        let wrote = unit.compressor().write().is_some();
        let item = items.peek().copied();
        if unit.tick(item, item.is_none(), &mut image)?.accepted {
            items.next();
        }
        if unit.leaf_table().offer().is_some() {
            unit.leaf_taken();
        }
        let compressor = unit.compressor_mut();
        if arrives {
            compressor.arrive();
        }
        if flying {
            compressor.read_taken();
        }
        if wrote {
            compressor.write_taken();
        }
        unit.end_cycle(&mut image)?;
        cycles += 1;
    }
    let [nodes, ..] = unit.emitter().counts();
    Ok([nodes.into(), cycles])
}
