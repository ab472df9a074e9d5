//! The parts of the traversal unit in gates against the functions of the core that they compute.

use std::collections::VecDeque;

use glam::IVec3;
use xylem_core::compress::{CellBox, Context};
use xylem_core::geom::{Axis, PrimIndex, Ray, Triangle};
use xylem_core::node::{Child, NodeIndex, Quantization, QuantizedChild};
use xylem_core::num::{Reciprocal, Time};
use xylem_core::traverse::{Hit, Slabs};
use xylem_cosim::random::Random;
use xylem_cosim::rtl::{Pin, Rtl};
use xylem_cosim::tools_for;
use xylem_cosim::traverser::{self, geometry};
use xylem_cosim::verilate::Mutation;

fn load(top: &'static str, mutation: Option<Mutation>, seed: u32) -> Rtl {
    let library = traverser::build_part(top, mutation).unwrap_or_else(|error| panic!("{error}"));
    Rtl::load(&library, seed).unwrap()
}

/// A word of any width, filled from the lowest bit on.
#[derive(Default)]
struct Fields {
    bytes: Vec<u8>,
    bits: usize,
}

impl Fields {
    fn with(mut self, value: u64, bits: usize) -> Self {
        for bit in 0..bits {
            if self.bits.is_multiple_of(8) {
                self.bytes.push(0);
            }
            self.bytes[self.bits / 8] |= ((value >> bit & 1) as u8) << (self.bits % 8);
            self.bits += 1;
        }
        self
    }
}

/// Bits `from ..` of an output, `bits` of them, at most 64.
fn field(bytes: &[u8], from: usize, bits: usize) -> u64 {
    (0..bits).fold(0, |word, bit| {
        let at = from + bit;
        word | u64::from(bytes[at / 8] >> (at % 8) & 1) << bit
    })
}

/// Whether the mantissa was rounded, and the reciprocal as the RTL packs it.
fn packed(axis: &Axis, component: i32) -> (bool, u64) {
    let mantissa = u64::from(axis.reciprocal.mantissa().to_bits());
    let k = 31 - axis.reciprocal.shift();
    let inexact = !axis.zero && mantissa * u64::from(component.unsigned_abs()) != 1 << (23 + k);
    // Of a direction of zero only `zero` counts.
    let (mantissa, shift) = if axis.zero { (0, 0) } else { (mantissa, axis.reciprocal.shift()) };
    let flags = u64::from(axis.negative) << 31 | u64::from(axis.zero) << 30;
    (inexact, flags | u64::from(inexact) << 29 | u64::from(shift) << 24 | mantissa)
}

/// Cycles from a reciprocal's start to its end, as the header of the RTL says.
fn reciprocal_cycles(component: i32) -> u64 {
    let magnitude = component.unsigned_abs();
    if magnitude == 0 {
        return 1;
    }
    let k = u32::BITS - (magnitude - 1).leading_zeros();
    let skipped = [28i32, 20, 12, 4].into_iter().find(|s| magnitude >= 2 << s).unwrap_or(-1);
    (k as i32 + 23 - skipped) as u64 + 1
}

fn check_reciprocals(rtl: &mut Rtl, seed: u64, count: u64) -> Result<(), String> {
    let (start, component) = (rtl.input("start_i"), rtl.input("component_i"));
    let (done, reciprocal) = (rtl.output("done_o"), rtl.output("reciprocal_o"));
    let mut random = Random::new(seed);
    let corners = (0..=30).flat_map(|k| [(1 << k) - 1, 1 << k, (1 << k) + 1, -(1 << k)]);
    let corners: Vec<i32> = corners.filter(|d: &i32| d.unsigned_abs() <= 1 << 30).collect();
    for i in 0..count {
        let d = match corners.get(i as usize) {
            Some(&d) => d,
            None => geometry::number(&mut random, 1 << 30),
        };
        rtl.set(component, d as u32);
        rtl.set(start, 1u32);
        rtl.tick().map_err(|error| error.to_string())?;
        rtl.set(start, 0u32);
        let mut cycles = 1;
        loop {
            rtl.settle();
            if rtl.is_set(done) {
                break;
            }
            rtl.edge().map_err(|error| error.to_string())?;
            cycles += 1;
            if cycles > 99 {
                return Err(format!("{d}: never done"));
            }
        }
        let axis =
            Axis { origin: 0, negative: d < 0, zero: d == 0, reciprocal: Reciprocal::new(d) };
        let (_, expected) = packed(&axis, d);
        let mask = if d == 0 { 3 << 30 } else { u32::MAX };
        if (rtl.get(reciprocal) as u32 & mask) != expected as u32 {
            return Err(format!("1/{d} is {:08x}, not {expected:08x}", rtl.get(reciprocal)));
        }
        if cycles != reciprocal_cycles(d) {
            return Err(format!("1/{d} took {cycles} cycles, not {}", reciprocal_cycles(d)));
        }
    }
    Ok(())
}

#[test]
fn reciprocals_are_those_of_the_core_and_take_the_cycles_stated() {
    if !tools_for("reciprocals_are_those_of_the_core_and_take_the_cycles_stated") {
        return;
    }
    let mut rtl = load("xy_reciprocal", None, 1);
    check_reciprocals(&mut rtl, 1, 20_000).unwrap();
}

/// The two multipliers, beside the unit: products come two cycles after their factors.
struct Multipliers {
    factors: [Pin; 2],
    products: [Pin; 2],
    flying: VecDeque<[i128; 2]>,
}

impl Multipliers {
    fn new(rtl: &Rtl, factors: [&str; 2], products: [&str; 2]) -> Self {
        Self {
            factors: factors.map(|name| rtl.output(name)),
            products: products.map(|name| rtl.input(name)),
            flying: VecDeque::from([[0; 2]; 2]),
        }
    }

    /// Runs a cycle of the unit with its multipliers; outputs are those during it.
    fn tick(&mut self, rtl: &mut Rtl) -> Result<(), String> {
        let done = self.flying.pop_front().unwrap_or_default();
        for (pin, product) in self.products.into_iter().zip(done) {
            rtl.set_bytes(pin, &product.to_le_bytes()[..8]);
        }
        rtl.settle();
        self.flying.push_back(self.factors.map(|pin| {
            let word = rtl.get(pin);
            let (a, b) = ((word >> 30) as u32 as i32, (word << 34) as i64 >> 34);
            i128::from(a) * i128::from(b)
        }));
        rtl.edge().map_err(|error| error.to_string())
    }
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
        let bounds = xylem_core::geom::Aabb::new(bounds.min, upper);
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
    let placement = xylem_core::compress::Placement::root(&bounds, &quantization).unwrap();
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

fn check_boxes(rtl: &mut Rtl, seed: u64, count: u64) -> Result<[u64; 3], String> {
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

#[test]
fn box_tests_are_those_of_the_core() {
    if !tools_for("box_tests_are_those_of_the_core") {
        return;
    }
    for seed in 0..4 {
        let mut rtl = load("xy_box_test", None, seed);
        let [hits, misses, outside] = check_boxes(&mut rtl, seed.into(), 40_000).unwrap();
        println!(
            "boxes, seed {seed}: {hits} hit, {misses} missed, {outside} outside of their node"
        );
        assert!(hits > 5_000 && misses > 5_000 && outside > 500);
    }
}

/// Cycles of a triangle test from its start to its end, as the header of the RTL says.
fn triangle_cycles(crossed: bool, hit: bool) -> u64 {
    match (crossed, hit) {
        (_, true) => 129,
        (true, false) => 63,
        (false, false) => 20,
    }
}

fn check_triangles(rtl: &mut Rtl, seed: u64, count: u64) -> Result<[u64; 4], String> {
    let mut multipliers =
        Multipliers::new(rtl, ["factors_a_o", "factors_b_o"], ["product_a_i", "product_b_i"]);
    let input = |name: &str| rtl.input(name);
    let (word_valid, word_index, word) =
        (input("word_valid_i"), input("word_index_i"), input("word_i"));
    let (start, tie_wins) = (input("start_i"), input("tie_wins_i"));
    let (origin, direction) = (input("origin_i"), input("direction_i"));
    let (t_min, t_max) = (input("t_min_i"), input("t_max_i"));
    let output = |name: &str| rtl.output(name);
    let (done, hit, off_grid) = (output("done_o"), output("hit_o"), output("off_grid_o"));
    let (t, u, v) = (output("t_o"), output("u_o"), output("v_o"));

    let mut random = Random::new(seed);
    let mut counts = [0; 4];
    for _ in 0..count {
        let (triangle, ray) = geometry::aimed(&mut random);
        let mut record = triangle.to_bytes();
        let spoilt = random.below(32) == 0;
        if spoilt {
            record[4 * random.below(9) as usize + 3] ^= 1 << random.below(8);
        }
        let ray_record = ray.to_bytes();
        rtl.set_bytes(origin, &ray_record[..12]);
        rtl.set_bytes(direction, &ray_record[12..24]);
        rtl.set(t_min, ray.t_min().to_bits() as u64);
        // The best time so far: the ray's end, or one at, before or after the hit.
        let line = triangle.intersect(&ray, Ray::TIME_LIMIT).map(|at| at.t.to_bits());
        let best = match (line, random.below(3)) {
            (Some(at), 0) => at + random.below(3) as i64 - 1,
            _ => ray.t_max().to_bits(),
        };
        rtl.set(t_max, best as u64);
        let tie = random.below(2) == 0;
        rtl.set(tie_wins, u32::from(tie));
        for (index, chunk) in record.chunks(8).enumerate() {
            rtl.set(word_valid, 1u32);
            rtl.set(word_index, index as u32);
            rtl.set_bytes(word, chunk);
            multipliers.tick(rtl)?;
            rtl.set(word_valid, 0u32);
            rtl.set(word, random.bits());
            if random.below(4) == 0 {
                multipliers.tick(rtl)?;
            }
        }
        let on_grid = Triangle::from_bytes(&record);
        let on_grid = on_grid.vertices.iter().all(|&v| xylem_core::num::Grid::DEFAULT.contains(v));
        rtl.settle();
        if rtl.is_set(off_grid) == on_grid {
            return Err(format!(
                "{triangle:?} is {}",
                if on_grid { "on the grid" } else { "off it" }
            ));
        }
        if !on_grid {
            counts[3] += 1;
            continue;
        }
        let triangle = Triangle::from_bytes(&record);
        rtl.set(start, 1u32);
        multipliers.tick(rtl)?;
        rtl.set(start, 0u32);
        let mut cycles = 1;
        loop {
            multipliers.tick(rtl)?;
            if rtl.is_set(done) {
                break;
            }
            cycles += 1;
            if cycles > 999 {
                return Err(format!("{triangle:?}: never done"));
            }
        }
        let at = triangle.intersect(&ray, Time::from_bits(best));
        let at = at.filter(|at| at.t.to_bits() < best || tie);
        let wanted = at.map(|at| Hit::new(PrimIndex(0), &at));
        let got = rtl.is_set(hit).then(|| {
            let t = (rtl.get(t) << 29) as i64 >> 29;
            (t, rtl.get(u) as u32, rtl.get(v) as u32)
        });
        let wanted = wanted.map(|hit| (hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits()));
        if got != wanted {
            return Err(format!("{triangle:?} {ray:?}: {got:?}, not {wanted:?}"));
        }
        let crossed = triangle.crossing(&ray).is_some();
        if cycles != triangle_cycles(crossed, wanted.is_some()) {
            return Err(format!("{triangle:?}: {cycles} cycles, {crossed}, {wanted:?}"));
        }
        counts[if wanted.is_some() { 0 } else { 2 - usize::from(crossed) }] += 1;
    }
    Ok(counts)
}

#[test]
fn triangle_tests_are_those_of_the_core_and_take_the_cycles_stated() {
    if !tools_for("triangle_tests_are_those_of_the_core_and_take_the_cycles_stated") {
        return;
    }
    for seed in 0..4 {
        let mut rtl = load("xy_triangle_test", None, seed);
        let [hits, outside, missed, off] = check_triangles(&mut rtl, seed.into(), 20_000).unwrap();
        println!(
            "triangles, seed {seed}: {hits} hit, {outside} outside the interval, {missed} missed, {off} off the grid"
        );
        assert!(hits > 2_000 && outside > 1_000 && missed > 5_000 && off > 100);
    }
}
