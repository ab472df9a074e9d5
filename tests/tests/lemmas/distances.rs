//! Lemmas 10 to 12 and 17: reciprocals, plane distances, steps, and those from a traversal point.

use glam::IVec3;
use rayon::prelude::*;
use xylem::scene::Random;
use xylem_core::compress::{CellBox, Context, Placement};
use xylem_core::geom::{Aabb, Ray};
use xylem_core::node::Quantization;
use xylem_core::num::{Reciprocal, SubGrid, Time};
use xylem_core::traverse::{Slabs, TraversalPoint};
use xylem_tests::planes::Planes;

const SEED: u64 = 0x5eed_00e0;

/// Where the octave of a component begins: `2^(k-1) < d <= 2^k`.
fn octave(d: i32) -> u32 {
    32 - (d as u32 - 1).leading_zeros()
}

/// Components of every octave: its first, last and middle ones, and some between.
fn components() -> Vec<i32> {
    let mut random = Random::new(SEED);
    let mut all: Vec<i32> = (0..=30u32)
        .flat_map(|k| {
            let (low, high) = ((1i64 << k >> 1) + 1, 1i64 << k);
            let some = [low, low + 1, (low + high) / 2, high - 1, high].into_iter();
            let more: Vec<_> =
                (0..11).map(|_| low + random.below((high - low + 1) as usize) as i64).collect();
            some.chain(more).filter(move |d| (low..=high).contains(d))
        })
        .map(|d| d as i32)
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[test]
fn lemma_10_a_mantissa_is_the_floor_of_its_fraction() {
    let check = |d: i32| {
        let (r, k) = (Reciprocal::new(d), octave(d));
        assert_eq!(r.shift(), 31 - k);
        let (fraction, down) = (1u128 << (23 + k), u128::from(r.mantissa().to_bits()));
        let d = d as u128;
        assert!(down * d <= fraction && fraction < (down + 1) * d, "{d}");
        assert!((1 << 23..1 << 24).contains(&down), "{d}");
        for bits in 8..=12 {
            // Cut to some bits, it is a lower bound less than a unit below.
            let cut = u128::from(r.leading(bits)) << (24 - bits);
            assert!(cut <= down && down < cut + (1 << (24 - bits)), "{d}");
        }
    };
    // All of the lower 24 octaves, and every 251st component of the others.
    (1..=1 << 24).into_par_iter().for_each(check);
    (1 << 24..1 << 30).into_par_iter().step_by(251).for_each(check);
    components().into_iter().for_each(check);
}

#[test]
fn lemma_11_products_are_rounded_outward_by_less_than_two_units_and_what_the_mantissa_lacks() {
    let check = |r: &Reciprocal, d: i32, x: i64| {
        // The exact offset is x * 2^(k-1) / d = x * 2^k / 2d.
        let (exact, d2) = (i128::from(x) << octave(d), 2 * i128::from(d));
        let down = i128::from(r.offset_down(x).to_bits());
        let up = i128::from(r.offset_up(x).to_bits());
        assert!(down * d2 <= exact && exact <= up * d2, "{d} {x}");
        let slack = (1 + (i128::from(x).abs() >> 24) + 1) * d2;
        assert!(exact - down * d2 < slack && up * d2 - exact < slack, "{d} {x}");
        // No farther from zero than the distance itself, so within its width.
        assert!(down >= i128::from(x.min(0)) && up <= i128::from(x.max(0)), "{d} {x}");
    };
    (1..=1 << 12).into_par_iter().for_each(|d| {
        let r = Reciprocal::new(d);
        (-1024..=1024).for_each(|x| check(&r, d, x));
    });
    let limit = (1i64 << 31) - 64;
    let mut random = Random::new(SEED);
    for d in components() {
        let r = Reciprocal::new(d);
        for k in 0..=31 {
            for x in [(1i64 << k) - 1, 1 << k, (1 << k) + 1, random.below(1 << k) as i64] {
                let x = x.min(limit);
                [x, -x].into_iter().for_each(|x| check(&r, d, x));
            }
        }
    }
}

#[test]
fn lemma_12_a_step_is_at_most_the_exact_one_for_every_number_of_cells() {
    for d in components() {
        let (r, k) = (Reciprocal::new(d), octave(d));
        for scale in 0..=20u32 {
            for cells in (0..1i32 << (24 - scale).min(8)).chain([1 << (24 - scale).min(8)]) {
                let step = i128::from(r.step_down(cells, scale).to_bits());
                let exact = (i128::from(cells) << (scale + 6)) << k;
                let (d2, distance) = (2 * i128::from(d), i128::from(cells) << (scale + 6));
                assert!(step * d2 <= exact, "{d} {cells} {scale}");
                assert!(exact - step * d2 < (2 + (distance >> 24)) * d2, "{d} {cells} {scale}");
                assert!(step >= 0 && step <= distance, "{d} {cells} {scale}");
            }
        }
    }
}

/// A ray along `+-d` on every axis alike, with its largest component as a ray's must be.
fn ray(origin: i32, d: i32) -> Option<Ray> {
    let direction = IVec3::new(1 << 30, d, -d);
    let origin = [SubGrid::from_bits(origin); 3];
    Ray::new(origin, direction, Time::ZERO, Ray::TIME_LIMIT).ok()
}

#[test]
fn lemma_12_planes_stay_enclosed_down_chains_of_every_child_on_an_axis() {
    // Every child of a node of 16 cells, and every child of that: all pairs of steps.
    let quantization = Quantization { bits: 4, ..Quantization::MODULO };
    let mut random = Random::new(SEED);
    let grid = Aabb::new(IVec3::splat(-(1 << 23)), IVec3::splat((1 << 23) - 1));
    let root = Placement::root(&grid, &quantization).expect("the grid is on the grid");
    let boxes: Vec<CellBox> = (0..16)
        .flat_map(|low| (1..=16 - low).map(move |width| (low as u8, width as u16)))
        .map(|(low, width)| CellBox { low: [low; 3], width: [width; 3] })
        .collect();
    let cases: Vec<_> = components()
        .into_iter()
        .filter_map(|d| ray(random.below(1 << 31) as i32 - (1 << 30), d))
        .collect();
    cases.par_iter().for_each(|ray| {
        let slabs = Slabs::new(ray, &root.decoded());
        for first in &boxes {
            let (node, stepped) =
                (root.child(first, &quantization), slabs.step(ray, &root.context, first));
            assert!(Planes::new(ray, &node.decoded()).enclosed_by(ray, &stepped));
            let most = node.context.cells[0];
            let fits = |b: &&CellBox| u16::from(b.low[0]) + b.width[0] <= most;
            for second in boxes.iter().filter(fits) {
                let below = node.child(second, &quantization);
                let stepped = stepped.step(ray, &node.context, second);
                assert!(Planes::new(ray, &below.decoded()).enclosed_by(ray, &stepped));
            }
        }
    });
}

#[test]
fn lemma_17_planes_ahead_of_a_traversal_point_are_enclosed_for_every_position_and_child() {
    // One axis of a node of 16 cells of `2^scale`; the point at every 16th of a cell within a node's
    // width of it, before and in it.
    const BITS: u8 = 4;
    for scale in [0u8, 3, 20] {
        let context = Context { scale: [scale; 3], cells: [16; 3], low: [0; 3] };
        let node = Placement { context, lower: IVec3::ZERO };
        (-256i64..256).into_par_iter().for_each(|sixteenths| {
            // Each position has other components of the same octaves.
            let start = sixteenths.rem_euclid(11) as usize;
            for d in components().into_iter().skip(start).step_by(11) {
                // Before the node as the ray sees it, on each of the axes.
                let at = (sixteenths << (scale + 6)) >> 4;
                let beyond = (16i64 << (scale + 6)) - at;
                let Some(origin) = i32::try_from(at).ok().zip(i32::try_from(beyond).ok()) else {
                    continue;
                };
                let origin = [origin.0, origin.0, origin.1].map(SubGrid::from_bits);
                let direction = IVec3::new(1 << 30, d, -d);
                let Ok(ray) = Ray::new(origin, direction, Time::ZERO, Ray::TIME_LIMIT) else {
                    continue;
                };
                let point = TraversalPoint { placement: node, time: 0 };
                let position = point.position(&ray);
                for (low, width) in (0..16).flat_map(|r| (1..=16 - r).map(move |w| (r, w))) {
                    let cells = CellBox { low: [low as u8; 3], width: [width as u16; 3] };
                    let slabs = point.slabs(&ray, &position, &cells, BITS);
                    let child =
                        node.child(&cells, &Quantization { bits: BITS, ..Quantization::MODULO });
                    let planes = Planes::new(&ray, &child.decoded());
                    assert!(planes.enclosed_after(&ray, 0, &slabs), "{ray:?} {cells:?} {slabs:?}");
                }
            }
        });
    }
}
