//! Lemmas 14 and 15: from plane distances to a verdict.

use glam::IVec3;
use rayon::prelude::*;
use xylem_core::geom::{Aabb, Ray};
use xylem_core::num::SubGrid;
use xylem_core::traverse::Slabs;
use xylem_tests::planes::Planes;

/// Directions of all small slopes, their largest component in a ray's range.
fn directions() -> Vec<IVec3> {
    let part = -3..=3;
    let mut all = Vec::new();
    for x in part.clone() {
        for y in part.clone() {
            for z in [-1, 0, 1] {
                let largest = i32::max(x, y).max(-x).max(-y).max(i32::abs(z));
                if largest > 0 {
                    // From one third to the full range.
                    let scale = (1 << 30) / largest;
                    all.push(IVec3::new(x, y, z) * scale);
                    all.push(IVec3::new(x, y, z) * (scale - scale / 3));
                }
            }
        }
    }
    all
}

#[test]
fn lemma_14_every_small_box_is_hit_by_every_small_ray_that_passes_it() {
    // All boxes with corners in 0..4 on two axes, all origins on and around them in halves, and
    // every interval between some times.
    let spans: Vec<(i32, i32)> =
        (0..4).flat_map(|low| (low..4).map(move |high| (low, high))).collect();
    let times = [-64i64, 0, 1, 65, 333];
    let (mut passes, mut hits) = (0u64, 0u64);
    let counts: Vec<(u64, u64)> = directions()
        .into_par_iter()
        .map(|direction| {
            let (mut passes, mut hits) = (0, 0);
            for (x, y) in (-3..=7).flat_map(|x| (-3..=7).map(move |y| (x, y))) {
                let origin = [x * 32, y * 32, 32].map(SubGrid::from_bits);
                let limit = Ray::TIME_LIMIT;
                let ray = Ray::new(origin, direction, -limit, limit).expect("the ray is in range");
                for (a, b) in spans.iter().flat_map(|a| spans.iter().map(move |b| (a, b))) {
                    let bounds = Aabb::new(IVec3::new(a.0, b.0, 0), IVec3::new(a.1, b.1, 1));
                    let (slabs, exact) = (Slabs::new(&ray, &bounds), Planes::new(&ray, &bounds));
                    for (i, &t_min) in times.iter().enumerate() {
                        for &t_max in &times[i + 1..] {
                            let entry = slabs.entry(&ray, t_min, t_max);
                            let pass = exact.passes(t_min, t_max);
                            assert!(entry.is_some() || !pass, "{ray:?} {bounds:?} {t_min} {t_max}");
                            // The entry is at or before the first time that the ray is in the box.
                            if let (Some(entry), Some((enter, _))) = (entry, exact.crossing()) {
                                assert!(entry <= enter, "{ray:?} {bounds:?}");
                            }
                            passes += u64::from(pass);
                            hits += u64::from(entry.is_some());
                        }
                    }
                }
            }
            (passes, hits)
        })
        .collect();
    for (pass, hit) in counts {
        passes += pass;
        hits += hit;
    }
    println!("{passes} pass, {hits} hit");
    // Rounding is below a 32nd of a unit, so few are hit that do not pass.
    assert!(passes > 1_000_000 && hits >= passes && hits < passes + passes / 20);
}
