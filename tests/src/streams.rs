//! What tests of streamed trees share: ways of compressing, and equal hits.

use std::ops::RangeInclusive;

use proptest::prelude::*;
use xylem::bus::FlatMemory;
use xylem::run::BuildRun;
use xylem::scene::Random;
use xylem_core::compress::{Compression, Repairs};
use xylem_core::geom::Triangle;
use xylem_core::node::{Coordinates, Quantization};
use xylem_core::traverse::{Method, Query, Scene, trace_by};

use crate::rays::hard_ray;

/// Every way of compressing with treelets of so many levels.
pub fn compressions(treelet_depths: RangeInclusive<u8>) -> impl Strategy<Value = Compression> {
    let quantization = (any::<bool>(), 4..=8u8, prop_oneof![Just(0u8), 0..=15u8]);
    (quantization, treelet_depths, 0..=3u8, prop_oneof![Just(0u8), 2..=64u8]).prop_map(
        |((relative, bits, min_scale), treelet_depth, margin, lines)| Compression {
            quantization: Quantization {
                coordinates: if relative { Coordinates::Relative } else { Coordinates::Modulo },
                bits,
                min_scale,
            },
            treelet_depth,
            margin,
            repairs: if lines == 0 { Repairs::InMemory } else { Repairs::InLines(lines) },
        },
    )
}

/// A build's tree, and the memory that it is in.
pub fn tree(run: &BuildRun) -> (&FlatMemory, &Scene) {
    (&run.memory, &run.scene)
}

/// Traces hard rays through two trees of the same triangles, in every way.
///
/// # Panics
/// If the closest hits differ, or one finds any hit and the other none.
pub fn assert_same_hits(
    triangles: &[Triangle],
    exact: (&FlatMemory, &Scene),
    found: (&FlatMemory, &Scene),
    random: &mut Random,
) {
    let bounds = triangles.iter().map(Triangle::bounds).reduce(|a, b| a.union(&b));
    let Some(bounds) = bounds else { return };
    for _ in 0..100 {
        let (_, ray) = hard_ray(random, triangles, &bounds);
        let hit = |(memory, scene): (&FlatMemory, &Scene), method, query| {
            trace_by(method, &mut memory.snapshot(), scene, &ray, query, &mut ())
                .unwrap_or_else(|e| panic!("{e}"))
        };
        let closest = hit(exact, Method::default(), Query::Closest);
        for method in Method::ALL {
            assert_eq!(hit(found, method, Query::Closest), closest, "{method:?}, {ray:?}");
            let any = hit(found, method, Query::Any);
            assert_eq!(any.is_some(), closest.is_some(), "{method:?}, {ray:?}");
        }
    }
}
