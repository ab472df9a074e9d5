//! Properties of the number system and of answers, on random inputs over their full ranges.

use std::cell::Cell;

use glam::IVec3;
use num_traits::ToPrimitive as _;
use proptest::prelude::*;
use xylem::run::Reference;
use xylem::scene::Random;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::num::{Grid, SubGrid, Time};
use xylem_core::traverse::Query;
use xylem_tests::cases::for_all;
use xylem_tests::job::trace;
use xylem_tests::rational::{ExactRay, grid_corners, ratio};
use xylem_tests::rays::hard_ray;
use xylem_tests::trees::{Forest, soup};

const SEED: u64 = 0x5eed_0042;

const ONE: i32 = 1 << 30;

/// A coordinate anywhere on the grid, often small or at an end.
fn coordinate() -> impl Strategy<Value = i32> {
    let (low, high) = (Grid::DEFAULT.min(), Grid::DEFAULT.max());
    prop_oneof![4 => low..=high, 1 => -4..=4, 1 => low..=low + 2, 1 => high - 2..=high]
}

fn point() -> impl Strategy<Value = IVec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(IVec3::from)
}

/// A component of an origin in units of 2⁻⁶.
fn origin_part() -> impl Strategy<Value = i32> {
    let limit = Ray::ORIGIN_LIMIT << 6;
    prop_oneof![4 => -limit..=limit, 1 => -300..=300, 1 => limit - 9..=limit, 1 => -limit..=9 - limit]
}

/// A ray from anywhere towards a point in 2⁻⁶ grid units, or anywhere.
fn ray_towards(origin: [i32; 3], target: [i64; 3], (t_min, t_max): (i64, i64)) -> Option<Ray> {
    let way = [0, 1, 2].map(|i| target[i] - i64::from(origin[i]));
    let largest = way.iter().map(|w| w.abs()).max()?;
    if largest == 0 {
        return None;
    }
    let part = |w: i64| (i128::from(w) * i128::from(ONE) / i128::from(largest)) as i32;
    let origin = origin.map(SubGrid::from_bits);
    let (t_min, t_max) = (Time::from_bits(t_min), Time::from_bits(t_max));
    Ray::new(origin, IVec3::from(way.map(part)), t_min, t_max).ok()
}

fn interval() -> impl Strategy<Value = (i64, i64)> {
    let limit = Ray::TIME_LIMIT.to_bits();
    prop_oneof![3 => Just((0, limit)), 1 => Just((-limit, limit)), 1 => (-limit..limit, -limit..limit)]
}

#[test]
fn the_triangle_test_is_the_exact_one_with_the_time_rounded_up() {
    let (hits, misses) = (Cell::new(0), Cell::new(0));
    let corners = [point(), point(), point()];
    let inputs =
        (corners, [origin_part(), origin_part(), origin_part()], 0..=64i64, 0..=64i64, interval());
    for_all(SEED, 20_000, inputs, |(vertices, origin, a, b, interval)| {
        // Towards a point of the triangle in 64ths of its weights, sometimes outside it.
        let [v0, v1, v2] = vertices.map(|v| v.to_array().map(i64::from));
        let target = [0, 1, 2].map(|i| 64 * v0[i] + a * (v1[i] - v0[i]) + b * (v2[i] - v0[i]));
        let Some(ray) = ray_towards(origin, target, interval) else { return Ok(()) };
        let triangle = Triangle { vertices, id: 0 };
        let ours = triangle.intersect(&ray, ray.t_max());
        let exact = ExactRay::of_grid(&ray).hit(&grid_corners(&triangle));
        // Interval ends are representable, so rounding up cannot move a time across one.
        let rounded = exact.map(|t| (t * ratio(64, 1)).ceil().to_integer().to_i64());
        prop_assert_eq!(ours.map(|at| Some(at.t.to_bits())), rounded);
        let count = if ours.is_some() { &hits } else { &misses };
        count.set(count.get() + 1);
        Ok(())
    });
    println!("{} hits, {} misses", hits.get(), misses.get());
    assert!(hits.get() > 5000 && misses.get() > 5000);
}

/// The volume of direction, `a` and `b` from the origin: on which side of the edge the ray passes.
fn side(ray: &Ray, a: IVec3, b: IVec3) -> i128 {
    let o = ray.origin().map(|c| i128::from(c.to_bits()));
    let d = ray.direction().to_array().map(i128::from);
    let from = |p: IVec3| [0, 1, 2].map(|i| 64 * i128::from(p[i]) - o[i]);
    let (p, q) = (from(a), from(b));
    d[0] * (p[1] * q[2] - p[2] * q[1])
        + d[1] * (p[2] * q[0] - p[0] * q[2])
        + d[2] * (p[0] * q[1] - p[1] * q[0])
}

#[test]
fn a_line_that_passes_inside_a_ring_hits_the_fan_that_spans_it() {
    // A line that has all edges of a closed ring on the same side is linked with the ring, so it
    // must cross every surface that the ring bounds. The fan's inner edges may not leak.
    let (inside, through) = (Cell::new(0), Cell::new(0));
    let ring = prop::collection::vec((1..=4096i32, -2000..=2000i32), 3..9);
    let near = || -66..=66i32;
    let aim = (0..9usize, 0..=16i64, [near(), near(), near()], prop::bool::ANY);
    let origin = [origin_part(), origin_part(), origin_part()];
    for_all(
        SEED,
        40_000,
        (point(), ring, 0..=11u32, aim, origin),
        |(centre, ring, size, aim, origin)| {
            // Corners around the centre by angle, in fixed directions so that everything is exact.
            let n = ring.len();
            let centre = centre.clamp(IVec3::splat(-8_000_000), IVec3::splat(8_000_000));
            let corners: Vec<IVec3> = (0..n)
                .map(|i| {
                    let angle = i as f64 / n as f64 * std::f64::consts::TAU;
                    let (radius, height) = ring[i];
                    let r = f64::from(radius) + 8.0;
                    let flat =
                        IVec3::new((r * angle.cos()) as i32, (r * angle.sin()) as i32, height);
                    centre + (flat << size >> 4)
                })
                .collect();
            let triangles: Vec<Triangle> = (0..n)
                .map(|i| Triangle {
                    vertices: [centre, corners[i], corners[(i + 1) % n]],
                    id: i as u32,
                })
                .collect();
            // Towards a point of a spoke or of the centre, exactly or off by up to a grid unit.
            let (spoke, part, off, exactly) = aim;
            let spoke = corners[spoke % n];
            let off = if exactly { [0; 3] } else { off };
            let target = [0, 1, 2].map(|i| {
                let (c, s) = (i64::from(centre[i]), i64::from(spoke[i]));
                64 * c + 4 * part * (s - c) + i64::from(off[i])
            });
            let limit = Ray::TIME_LIMIT.to_bits();
            let Some(ray) = ray_towards(origin, target, (-limit, limit)) else { return Ok(()) };
            let sides: Vec<i128> =
                (0..n).map(|i| side(&ray, corners[i], corners[(i + 1) % n])).collect();
            let linked = sides.iter().all(|&s| s > 0) || sides.iter().all(|&s| s < 0);
            let hits =
                triangles.iter().filter(|t| t.intersect(&ray, ray.t_max()).is_some()).count();
            through.set(through.get() + usize::from(hits > 1));
            if linked {
                inside.set(inside.get() + 1);
                prop_assert!(hits >= 1, "{:?} leaks through {:?}", ray, triangles);
            }
            Ok(())
        },
    );
    println!("{} lines inside their rings, {} through edges", inside.get(), through.get());
    assert!(inside.get() > 10_000 && through.get() > 100);
}

#[test]
fn answers_depend_neither_on_the_format_nor_on_the_order_of_triangles_but_for_ties() {
    let (hits, ties) = (Cell::new(0), Cell::new(0));
    for_all(SEED, 150, (any::<u64>(), 1..400usize), |(seed, count)| {
        let mut random = Random::new(seed);
        let mut triangles = soup(&mut random, count);
        // Some come twice, so that there are ties.
        triangles.extend_from_within(..count / 4);
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        let shuffled: Vec<Triangle> = order.iter().map(|&i| triangles[i]).collect();
        let forests = [Forest::grow(&triangles), Forest::grow(&shuffled)];
        let reference = Reference::new(&triangles);
        let place: Vec<u32> = {
            let mut place = vec![0; order.len()];
            order.iter().enumerate().for_each(|(new, &old)| place[old] = new as u32);
            place
        };
        let bounds = forests[0].exact.tree.root.expect("there are triangles").bounds;
        for _ in 0..40 {
            let (kind, ray) = hard_ray(&mut random, &triangles, &bounds);
            let first = reference.closest(&ray);
            let mut tied = Vec::new();
            reference.visit(&ray, |primitive, t| {
                tied.extend(first.filter(|f| f.t == t).map(|_| primitive));
                true
            });
            let expect = [
                tied.iter().copied().min(),
                tied.iter().map(|&primitive| place[primitive as usize]).min(),
            ];
            for (forest, expect) in forests.iter().zip(expect) {
                for (format, scene) in forest.scenes() {
                    let memory = &mut forest.memory.snapshot();
                    let hit = trace(memory, scene, &ray, Query::Closest).unwrap();
                    prop_assert_eq!(
                        hit.map(|h| h.t.to_bits()),
                        first.map(|f| f.t),
                        "{} {:?}",
                        format,
                        kind
                    );
                    prop_assert_eq!(hit.map(|h| h.primitive.0), expect, "{} {:?}", format, kind);
                    let any = trace(memory, scene, &ray, Query::Any).unwrap();
                    prop_assert_eq!(any.is_some(), first.is_some(), "{} {:?}", format, kind);
                    if let Some(any) = any {
                        let at = any.primitive.0 as usize;
                        let own = if std::ptr::eq(forest, &forests[0]) { at } else { order[at] };
                        prop_assert_eq!(reference.hit(&ray, own as u32), Some(any.t.to_bits()));
                    }
                }
            }
            hits.set(hits.get() + usize::from(first.is_some()));
            ties.set(ties.get() + usize::from(tied.len() > 1));
        }
        Ok(())
    });
    println!("{} hits, {} of them ties", hits.get(), ties.get());
    assert!(hits.get() > 500 && ties.get() > 100);
}
