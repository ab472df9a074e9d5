//! Refits, measured.

use std::time::{Duration, Instant};

use xylem_core::compress::{Compression, HeldNode, compress_top_down};
use xylem_core::error::BuildError;
use xylem_core::geom::Triangle;
use xylem_core::mem::Bus;
use xylem_core::node::{NodeFormat, Tree};
use xylem_core::probe::Probe;
use xylem_core::quality::SahCost;
use xylem_core::refit::{self, InPlace};
use xylem_core::traverse::Scene;

use super::watch::BuildWatch;
use super::{BuildRun, Layout};
use crate::bus::{MemoryError, MemoryTiming, Metered, StageClock, Traffic};
use crate::machine::compressor::CompressorEvents;

/// A finished refit with everything that was measured. The trees and the triangles are in the
/// [`BuildRun`] that it was done on.
#[derive(Debug, Clone)]
pub struct RefitRun {
    /// The SAH cost of the refitted tree with exact boxes.
    pub cost: SahCost,
    /// Traffic by stage and region.
    pub traffic: Traffic,
    /// What the streaming compressor did.
    pub compressor: CompressorEvents,
    /// How long the host took, measured.
    pub host_time: Duration,
}

/// How a tree is refitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RefitMethod {
    /// In place: 64-byte nodes as they are, quantized ones through the streaming compressor with these
    /// parameters, of which the format is that of the tree.
    InPlace(Compression),
    /// Quantized nodes by way of 64-byte ones and a separate compression from the top down: P3's
    /// baseline. There must be room for both, as there is where they were built in that way.
    TopDown,
}

/// Why a tree was not refitted.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RefitError {
    /// The triangles are others than those that the tree was built over.
    #[error(
        "the tree was built over {before} triangles, the moved scene has {after}; build it anew"
    )]
    Triangles {
        /// Triangles of the build.
        before: u32,
        /// Triangles given.
        after: usize,
    },
    /// There is no region for 64-byte nodes.
    #[error(
        "the tree was compressed as it was built, so 64-byte nodes have no room; refit it in place"
    )]
    NoRoom,
    /// The core reported an error.
    #[error("{0}")]
    Core(#[from] BuildError<MemoryError>),
}

/// Moves the triangles of a build and refits the tree that is traced.
///
/// # Errors
/// [`RefitError`]. After one of the core's, the tree is no longer to be used.
pub fn refit(
    run: &mut BuildRun,
    triangles: &[Triangle],
    method: &RefitMethod,
    timing: MemoryTiming,
) -> Result<RefitRun, RefitError> {
    let count = run.scene.triangle_count;
    if u32::try_from(triangles.len()) != Ok(count) {
        return Err(RefitError::Triangles { before: count, after: triangles.len() });
    }
    let shared = run.layout.build.nodes == run.layout.quantized_nodes && count > 0;
    if *method == RefitMethod::TopDown && shared {
        return Err(RefitError::NoRoom);
    }
    let region = run.layout.triangles;
    let start = region.base.0 as usize;
    let records = &mut run.memory.bytes_mut()[start..start + region.size as usize];
    for (record, triangle) in records.chunks_exact_mut(Triangle::BYTES).zip(triangles) {
        record.copy_from_slice(&triangle.to_bytes());
    }
    let stage = StageClock::default();
    let mut watch = BuildWatch::new(&stage);
    let memory = std::mem::take(&mut run.memory);
    let mut bus = Metered::new(memory, &stage, &run.layout.named(), timing);
    let start = Instant::now();
    let done = update(&mut bus, &run.layout, &run.scene, method, &mut watch);
    let host_time = start.elapsed();
    let compressor = watch.compressor;
    let traffic = bus.traffic();
    run.memory = bus.into_inner();
    let Refits { scene, exact, cost } = done?;
    (run.scene, run.exact) = (scene, exact);
    Ok(RefitRun { cost, traffic, compressor, host_time })
}

/// A refitted tree as it is traced, with exact boxes if there are any, and its cost.
struct Refits {
    scene: Scene,
    exact: Option<Scene>,
    cost: SahCost,
}

/// Refits on any bus.
fn update<B: Bus, P: Probe>(
    bus: &mut B,
    layout: &Layout,
    scene: &Scene,
    method: &RefitMethod,
    probe: &mut P,
) -> Result<Refits, BuildError<B::Error>> {
    let triangles = (scene.triangles, scene.triangle_count);
    let with = |tree| Scene { tree, ..*scene };
    match (method, scene.tree.format) {
        (RefitMethod::TopDown, NodeFormat::Quantized(quantization)) => {
            let nodes = layout.build.nodes;
            let done = refit::refit(bus, &scene.tree, triangles, &mut InPlace { nodes }, probe)?;
            let exact = Tree { format: NodeFormat::Bvh2, nodes, root: done.root, ..scene.tree };
            let target = layout.quantized_nodes;
            let tree = compress_top_down(bus, &exact, target, &quantization, probe)?;
            Ok(Refits { scene: with(tree), exact: Some(with(exact)), cost: done.cost })
        }
        (method, format) => {
            let compression = match method {
                RefitMethod::InPlace(compression) => *compression,
                RefitMethod::TopDown => Compression::DEFAULT,
            };
            let mut held = vec![HeldNode::EMPTY; compression.held_nodes()];
            let (tree, cost) =
                refit::refit_in_place(bus, &scene.tree, triangles, &compression, &mut held, probe)?;
            let exact = (format == NodeFormat::Bvh2).then_some(with(tree));
            Ok(Refits { scene: with(tree), exact, cost })
        }
    }
}
