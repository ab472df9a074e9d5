//! `xy_box_test` against `Slabs::new`, `Context::decode`, `Context::child`, `Slabs::step` and `Slabs::entry`.

use std::collections::VecDeque;

use glam::IVec3;
use xylem_core::compress::{CellBox, Context, Placement};
use xylem_core::geom::{Aabb, Ray};
use xylem_core::node::{Child, NodeIndex, Quantization, QuantizedChild};
use xylem_core::traverse::Slabs;

use super::{Fields, Multipliers, field, packed};
use crate::random::Random;
use crate::rtl::Rtl;
use crate::traverser::geometry;

/// Checks `count` boxes; returns how many were hit, missed, and outside of their parent's box.
///
/// # Errors
/// The first that is wrong.
pub fn check_boxes(rtl: &mut Rtl, seed: u64, count: u64) -> Result<[u64; 3], String> {
    let mut multipliers = Multipliers::new(
        rtl,
        ["near_factors_o", "far_factors_o"],
        ["near_product_i", "far_product_i"],
    );
    let input = |name: &str| rtl.input(name);
    let (valid, first, last) = (input("valid_i"), input("first_i"), input("last_i"));
    let (step, modulo, node) = (input("step_i"), input("modulo_i"), input("node_i"));
    let (low_code, high_code) = (input("low_code_i"), input("high_code_i"));
    let (low_plane, high_plane) = (input("low_plane_i"), input("high_plane_i"));
    let (reciprocal, origin) = (input("reciprocal_i"), input("origin_i"));
    let (t_min, t_max) = (input("t_min_i"), input("t_max_i"));
    let (child, verdict) = (rtl.output("box_o"), rtl.output("verdict_valid_o"));
    let (hit, outside, entry) =
        (rtl.output("hit_o"), rtl.output("outside_o"), rtl.output("entry_o"));

    let mut random = Random::new(seed);
    let mut expected = VecDeque::<(u64, Option<(u64, i32, i32)>)>::new();
    let mut verdicts = VecDeque::<(u64, BoxCase)>::new();
    let mut counts = [0; 3];
    let mut cycle = 0;
    let mut fed = 0;
    while fed < count || !verdicts.is_empty() {
        let case = (fed < count && random.below(8) != 0).then(|| box_case(&mut random));
        // The interval must stay until the verdict, so a case is followed by idle cycles.
        for axis in 0..8 {
            rtl.set(valid, 0u32);
            if let (Some(case), 0..3) = (&case, axis) {
                let at = &case.ray.axes()[axis];
                let (component, from) = (case.ray.direction()[axis], &case.axes[axis]);
                rtl.set(valid, 1u32);
                rtl.set(first, u32::from(axis == 0));
                rtl.set(last, u32::from(axis == 2));
                rtl.set(step, u32::from(case.step));
                rtl.set(modulo, u32::from(case.modulo));
                rtl.set(reciprocal, packed(at, component).1);
                rtl.set(origin, at.origin as u32);
                rtl.set(low_plane, from.planes[0] as u32);
                rtl.set(high_plane, from.planes[1] as u32);
                rtl.set(low_code, u32::from(from.codes[0]));
                rtl.set(high_code, u32::from(from.codes[1]));
                let state = Fields::default().with(from.offsets[1] as u32 as u64, 32);
                let state = state.with(from.offsets[0] as u32 as u64, 32).with(from.grid, 18);
                rtl.set_bytes(node, &state.bytes);
                rtl.set(t_min, case.ray.t_min().to_bits() as u64);
                rtl.set(t_max, case.ray.t_max().to_bits() as u64);
                expected.push_back((cycle + 3, case.boxes.map(|boxes| boxes[axis])));
            }
            multipliers.tick(rtl)?;
            if let Some(&(at, wanted)) = expected.front().filter(|(at, _)| *at == cycle) {
                expected.pop_front();
                let bytes = rtl.bytes(child);
                let far = field(&bytes, 0, 32) as u32 as i32;
                let got = (field(&bytes, 64, 18), field(&bytes, 32, 32) as u32 as i32, far);
                if wanted.is_some_and(|wanted| wanted != got) {
                    return Err(format!("cycle {at}: box {got:x?}, not {wanted:x?}"));
                }
            }
            let due = verdicts.front().is_some_and(|(at, _)| *at == cycle);
            if rtl.is_set(verdict) != due {
                return Err(format!("cycle {cycle}: verdict {}, not {due}", !due));
            }
            if due && let Some((_, case)) = verdicts.pop_front() {
                let got = rtl.is_set(hit).then(|| (rtl.get(entry) << 29) as i64 >> 29);
                if rtl.is_set(outside) != case.boxes.is_none() {
                    return Err(format!("cycle {cycle}: outside {}", case.boxes.is_some()));
                }
                if case.boxes.is_some() && got != case.entry {
                    return Err(format!(
                        "cycle {cycle}: {:?}: {got:?} not {:?}",
                        case.ray, case.entry
                    ));
                }
                counts[0] += u64::from(case.entry.is_some());
                counts[1] += u64::from(case.boxes.is_some() && case.entry.is_none());
                counts[2] += u64::from(case.boxes.is_none());
            }
            if let (Some(_), 2) = (&case, axis) {
                fed += 1;
            }
            cycle += 1;
            if axis == 2
                && let Some(case) = &case
            {
                let BoxCase { ray, axes, step, modulo, boxes, entry } = *case;
                verdicts.push_back((cycle + 4, BoxCase { ray, axes, step, modulo, boxes, entry }));
            }
        }
    }
    Ok(counts)
}

/// A box to be tested, and what is to come of it.
struct BoxCase {
    ray: Ray,
    /// Per axis: the planes, or the parent's state and the two codes.
    axes: [BoxAxis; 3],
    step: bool,
    modulo: bool,
    /// The box' offsets and grids per axis, unless it is outside of its parent.
    boxes: Option<[(u64, i32, i32); 3]>,
    entry: Option<i64>,
}

#[derive(Clone, Copy, Default)]
struct BoxAxis {
    planes: [i32; 2],
    grid: u64,
    offsets: [i32; 2],
    codes: [u8; 2],
}

fn grid(context: &Context, axis: usize) -> u64 {
    let (cells, scale) = (u64::from(context.cells[axis]), u64::from(context.scale[axis]));
    u64::from(context.low[axis]) | cells << 6 | scale << 13
}

fn box_case(random: &mut Random) -> BoxCase {
    let bounds = geometry::aabb(random);
    let ray = match random.below(4) {
        0 => geometry::ray(random),
        1 => geometry::ray_through(random, bounds.max),
        2 => geometry::ray_through(random, bounds.min),
        _ => geometry::ray_through(random, bounds.min + (bounds.max - bounds.min) / 2),
    };
    let (t_min, t_max) = (ray.t_min().to_bits(), ray.t_max().to_bits());
    let mut axes = [BoxAxis::default(); 3];
    if random.below(3) == 0 {
        // Decoded boxes may end one beyond the grid.
        let upper = bounds.max + IVec3::splat(random.below(2) as i32);
        let bounds = Aabb::new(bounds.min, upper);
        let slabs = Slabs::new(&ray, &bounds);
        let boxes = [0, 1, 2].map(|i| {
            axes[i].planes = [bounds.min[i], bounds.max[i]];
            axes[i].grid = random.below(1 << 18);
            (axes[i].grid, slabs.near[i], slabs.far[i])
        });
        let entry = slabs.entry(&ray, t_min, t_max);
        return BoxCase { ray, axes, step: false, modulo: false, boxes: Some(boxes), entry };
    }

    // A child of a placed node, or of any context at all: then it may be outside.
    let modulo = random.below(2) == 0;
    let quantization = if modulo { Quantization::MODULO } else { Quantization::RELATIVE };
    let placement = Placement::root(&bounds, &quantization).unwrap();
    let slabs = Slabs::new(&ray, &placement.decoded());
    let context = placement.context;
    let pick = |random: &mut Random, i: usize| {
        let cells = u64::from(context.cells[i]);
        let r = random.below(cells);
        let width = if random.below(3) == 0 { cells - r } else { 1 + random.below(cells - r) };
        (r as u8, width as u16)
    };
    let mut cells = CellBox { low: [0; 3], width: [0; 3] };
    let mut code = QuantizedChild { low: [0; 3], high: [0; 3], child: Child::Inner(NodeIndex(0)) };
    let wild = random.below(16) == 0;
    for (i, axis) in axes.iter_mut().enumerate() {
        (cells.low[i], cells.width[i]) = pick(random, i);
        let start = if modulo { context.low[i] } else { 0 } + cells.low[i];
        let end = u16::from(start) + cells.width[i] - u16::from(!modulo);
        (code.low[i], code.high[i]) = (start & 63, end as u8 & 63);
        if wild {
            (code.low[i], code.high[i]) = (random.below(64) as u8, random.below(64) as u8);
        }
        *axis = BoxAxis {
            planes: [0; 2],
            grid: grid(&context, i),
            offsets: [slabs.near[i], slabs.far[i]],
            codes: [code.low[i], code.high[i]],
        };
    }
    let decoded = context.decode(&code, &quantization);
    assert!(wild || decoded == Some(cells));
    let mut entry = None;
    let boxes = decoded.map(|cells| {
        let child = context.child(&cells, &quantization);
        let slabs = slabs.step(&ray, &context, &cells);
        entry = slabs.entry(&ray, t_min, t_max);
        [0, 1, 2].map(|i| (grid(&child, i), slabs.near[i], slabs.far[i]))
    });
    BoxCase { ray, axes, step: true, modulo, boxes, entry }
}
