//! A device and jobs that it takes, for the tests to vary.

use glam::IVec3;
use xylem_core::geom::Aabb;
use xylem_core::mem::Region;
use xylem_core::node::{Child, Coordinates, NodeFormat, NodeIndex, Subtree, Tree};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildRegions;
use xylem_core::sort::{InputFormat, RecordFormat};
use xylem_core::traverse::Query;
use xylem_driver::{BuildJob, Compression, NoInterrupt, TraceJob, Xylem};

use super::Fake;

/// The driver on a fake device, as its registers and its delay.
pub type Driver<I> = Xylem<Fake, Fake, I>;

pub fn polled(fake: &Fake) -> Driver<NoInterrupt> {
    Xylem::probe(fake.clone(), fake.clone(), NoInterrupt).expect("a device")
}

pub fn wired(fake: &Fake) -> Driver<Fake> {
    Xylem::probe(fake.clone(), fake.clone(), fake.clone()).expect("a device")
}

pub fn build_job() -> BuildJob {
    BuildJob {
        regions: BuildRegions {
            primitives: Region::new(0x1_0000, 0x8000),
            runs_a: Region::new(0x2_0000, 0x8000),
            runs_b: Region::default(),
            nodes: Region::new(0x3_0000, 0x1_0000),
            leaf_table: Region::new(0x4_0000, 0x1000),
        },
        count: 1000,
        input: InputFormat::Box32,
        record: RecordFormat::Box32,
        morton: MortonWidth::Bits30,
        max_leaf_size: 4,
        compressed: None,
    }
}

pub fn tree() -> Tree {
    let bounds = Aabb::new(IVec3::new(-5, 0, 1), IVec3::new(9, 8, 7));
    Tree {
        format: NodeFormat::Bvh2,
        root: Some(Subtree { bounds, child: Child::Inner(NodeIndex(99)) }),
        node_count: 100,
        leaf_count: 101,
        entry_count: 1000,
        nodes: Region::new(0x3_0000, 0x2000),
        leaf_table: Region::new(0x4_0000, 0x1000),
    }
}

pub fn compression() -> Compression {
    let coordinates = Coordinates::Modulo;
    Compression { target: Region::new(0x5_0000, 0x1000), coordinates, treelet_depth: 2 }
}

pub fn trace_job() -> TraceJob {
    TraceJob {
        tree: tree(),
        triangles: Region::new(0x6_0000, 0xa000),
        triangle_count: 1000,
        rays: Region::new(0x7_0000, 0x1000),
        hits: Region::new(0x8_0000, 0x1000),
        ray_count: 64,
        query: Query::Any,
    }
}
