//! One scene in every node format, and small random scenes.

use glam::IVec3;
use xylem::bus::{FlatMemory, MemoryError};
use xylem::run::{self, BuildOptions};
use xylem::scene::Random;
use xylem_core::compress::compress_top_down;
use xylem_core::geom::Triangle;
use xylem_core::mem::Region;
use xylem_core::node::{NodeFormat, NodeIndex, Quantization, QuantizedPair, QuantizedView};
use xylem_core::num::Grid;
use xylem_core::quality::{self, Malformed, Quality};
use xylem_core::traverse::Scene;

/// A scene whose tree is in memory in all formats; the nodes have the same indices in each.
#[derive(Debug)]
pub struct Forest {
    /// Everything.
    pub memory: FlatMemory,
    /// The tree of 64-byte nodes.
    pub exact: Scene,
    /// The tree of quantized pairs in relative coordinates.
    pub relative: Scene,
    /// The tree of quantized pairs in modulo coordinates.
    pub modulo: Scene,
}

impl Forest {
    /// Builds the tree with the default configuration and compresses it both ways.
    ///
    /// # Panics
    /// If the core refuses to.
    pub fn grow(triangles: &[Triangle]) -> Self {
        let run = run::build(triangles, &BuildOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let exact = run.exact.expect("the nodes are exact");
        let size = run.memory.bytes().len();
        let room = exact.tree.node_count as usize * Quantization::MODULO.node_bytes() as usize;
        let mut memory = FlatMemory::new(size + 2 * room);
        memory.bytes_mut()[..size].copy_from_slice(run.memory.bytes());
        drop(run);
        let mut compress = |at: usize, quantization| {
            let target = Region::new(at as u32, room as u32);
            let tree = compress_top_down(&mut memory, &exact.tree, target, &quantization, &mut ());
            Scene { tree: tree.unwrap_or_else(|e| panic!("{e}")), ..exact }
        };
        let relative = compress(size, Quantization::RELATIVE);
        let modulo = compress(size + room, Quantization::MODULO);
        Self { memory, exact, relative, modulo }
    }

    /// A node of a quantized scene.
    ///
    /// # Panics
    /// If the node is not in memory.
    pub fn pair(&self, scene: &Scene, index: NodeIndex) -> QuantizedPair {
        let NodeFormat::Quantized(quantization) = scene.tree.format else {
            panic!("the nodes are exact")
        };
        let len = quantization.node_bytes();
        let at = scene.tree.nodes.record(index.0, len).expect("the node is inside its region").0;
        let mut bytes = [0; QuantizedPair::MAX_BYTES];
        let node = &mut bytes[..len as usize];
        node.copy_from_slice(&self.memory.bytes()[at as usize..][..len as usize]);
        QuantizedView::new(&bytes, quantization.bits).to_repr()
    }

    /// Checks a scene's tree and measures it.
    ///
    /// # Errors
    /// The first fault met.
    pub fn check(&self, scene: &Scene) -> Result<Quality, Malformed<MemoryError>> {
        let mut seen = vec![0; scene.triangle_count.div_ceil(32) as usize];
        quality::check(&mut self.memory.snapshot(), scene, &mut seen)
    }

    /// The scene in each format, with the format's name.
    pub fn scenes(&self) -> [(&'static str, &Scene); 3] {
        [("bvh2", &self.exact), ("relative", &self.relative), ("modulo", &self.modulo)]
    }
}

/// `count` random triangles. Their sizes range over all powers of two, and about half of their
/// coordinates are coarse, so that equal codes, shared planes and zero areas occur.
pub fn soup(random: &mut Random, count: usize) -> Vec<Triangle> {
    let grid = Grid::DEFAULT;
    (0..count as u32)
        .map(|id| {
            let coarse = if random.below(2) == 0 { random.below(20) as i32 } else { 0 };
            let spread = random.below(24) as u32;
            let mut any = |bits: u32| (random.bits() >> (64 - 24)) as i32 >> (24 - bits);
            let anchor = IVec3::new(any(24), any(24), any(24));
            let vertices = [(); 3].map(|()| {
                let offset = IVec3::new(any(spread), any(spread), any(spread));
                let point = (anchor + offset) >> coarse << coarse;
                (point + grid.min()).clamp(IVec3::splat(grid.min()), IVec3::splat(grid.max()))
            });
            Triangle { vertices, id }
        })
        .collect()
}
