//! The units of traversal contexts: pipelines whose outputs are the core's, a few cycles later.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use glam::IVec3;
use xylem_core::compress::Placement;
use xylem_core::geom::Aabb;
use xylem_core::node::{Child, Coordinates, Quantization, QuantizedChild};

use crate::bench::{Bench, Stop, Waves};
use crate::pins;
use crate::random::Random;
use crate::types::{box_bytes, code_bytes, place_bytes};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// How boxes are quantized, and the margin of estimates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ContextConfig {
    /// Bits of a coordinate.
    pub bits: u8,
    /// Margin of estimates.
    pub margin: u8,
    /// Minimum scale.
    pub min_scale: u8,
}

impl ContextConfig {
    fn quantization(&self, coordinates: Coordinates) -> Quantization {
        Quantization { coordinates, bits: self.bits, min_scale: self.min_scale }
    }
}

/// Builds `xy_context`, `xy_encoder` or `xy_recoder`, with a fault if `mutation` says so.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(
    top: &'static str,
    config: ContextConfig,
    mutation: Option<Mutation>,
) -> Result<PathBuf, CosimError> {
    let ContextConfig { bits, margin, min_scale } = config;
    let mut parameters = vec![("Bits", bits.into()), ("MinScale", min_scale.into())];
    let files = match top {
        "xy_context" => {
            parameters.push(("Margin", margin.into()));
            "context.f"
        }
        "xy_encoder" => "encoder.f",
        _ => "recoder.f",
    };
    let name = format!("bits{bits}margin{margin}min{min_scale}");
    verilate::unit(&Unit { top, files, config: &name, parameters: &parameters }, mutation)
}

/// A coordinate; the edges of the grid, zero and powers of two come often.
fn coordinate(random: &mut Random) -> i32 {
    let near = random.below(5) as i32 - 2;
    let value = match random.below(5) {
        0 => -(1 << 23) + near,
        1 => (1 << 23) + near,
        2 => near,
        3 => (1 << random.below(23)) * [1, -1][random.below(2) as usize] + near,
        _ => random.bits() as i32 >> (8 + random.below(20)),
    };
    value.clamp(-(1 << 23), (1 << 23) - 1)
}

/// A box of the grid, often a flat one or a point.
fn any_box(random: &mut Random) -> Aabb {
    let mut corner = || IVec3::from_array([0; 3].map(|_| coordinate(random)));
    let (a, b) = (corner(), corner());
    let mut bounds = Aabb::new(a.min(b), a.max(b));
    for axis in 0..3 {
        if random.below(6) == 0 {
            bounds.max[axis] = bounds.min[axis];
        }
    }
    bounds
}

/// A box inside `outer`.
fn box_inside(random: &mut Random, outer: &Aabb) -> Aabb {
    let mut inner = *outer;
    for axis in 0..3 {
        let side = i64::from(outer.max[axis]) - i64::from(outer.min[axis]);
        let keep = side >> random.below(12);
        let slack = (side - keep) as u64;
        // At an edge, or anywhere.
        let start = [0, slack, random.below(slack + 1)][random.below(3) as usize] as i32;
        inner.min[axis] = outer.min[axis] + start;
        inner.max[axis] = inner.min[axis] + keep as i32;
    }
    inner
}

/// A pipeline's outputs that are still to come, `None` for those after reset.
struct Pipeline<T>(VecDeque<Option<T>>);

impl<T> Pipeline<T> {
    fn new(latency: usize) -> Self {
        Self((0..latency).map(|_| None).collect())
    }

    fn outputs(&self) -> Option<&T> {
        self.0.front()?.as_ref()
    }

    fn advance(&mut self, inputs: T) {
        self.0.pop_front();
        self.0.push_back(Some(inputs));
    }
}

pins!(ContextPins { enable_i, box_i, exact_i; place_o, ok_o });

/// Runs `xy_context` for `cycles` cycles; returns how many boxes it was compared on.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run_context(
    library: &Path,
    config: ContextConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<u64, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = ContextPins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut pipeline = Pipeline::new(3);
    let mut compared = 0;
    while bench.cycle() < cycles {
        let mut bounds = any_box(&mut random);
        if random.below(16) == 0 {
            bounds = Aabb::new(bounds.max, bounds.min);
        }
        let (enable, exact) = (random.below(8) > 0, random.below(4) == 0);
        bench.rtl.set(pins.enable_i, enable);
        bench.rtl.set_bytes(pins.box_i, &box_bytes(&bounds));
        bench.rtl.set(pins.exact_i, exact);
        bench.rtl.settle();
        if let Some(outputs) = pipeline.outputs() {
            let outputs: &Option<Placement> = outputs;
            bench.expect(pins.ok_o, outputs.is_some())?;
            if let Some(place) = outputs {
                bench.expect_bytes(pins.place_o, &place_bytes(place))?;
            }
            compared += 1;
        }
        if enable {
            let margin = if exact { 0 } else { config.margin };
            let quantization = config.quantization(Coordinates::Modulo);
            pipeline.advance(Placement::estimate(&bounds, &quantization, margin));
        }
        bench.edge()?;
    }
    Ok(compared)
}

/// What an encoder or a recoder says of a child: its code, its contexts, and whether the node must be
/// encoded again.
type Encoded = Option<(QuantizedChild, [Placement; 2], bool)>;

pins!(EncoderPins {
    enable_i, modulo_i, place_i, box_i, old_i;
    code_o, old_o, new_o, needed_o, ok_o,
});

pins!(RecoderPins {
    enable_i, modulo_i, old_i, new_i, code_i;
    code_o, old_o, new_o, needed_o, ok_o,
});

const LEAF: Child = Child::Leaf { first: 0, count: Child::TO_MARK };

/// A parent with its box, and a child's box, which in one of eight draws is not inside.
pub(crate) fn family(
    random: &mut Random,
    quantization: &Quantization,
    margin: u8,
) -> Option<(Placement, Aabb)> {
    let outer = any_box(random);
    let mut parent = Placement::estimate(&outer, quantization, margin * random.below(2) as u8)?;
    let mut bounds = outer;
    if random.below(2) == 0 {
        // A parent whose own parent was known.
        bounds = box_inside(random, &outer);
        let (_, cells) = parent.encode(&bounds, LEAF, quantization)?;
        parent = parent.child(&cells, quantization);
    }
    let child = match random.below(8) {
        0 => any_box(random),
        _ => box_inside(random, &bounds),
    };
    Some((parent, child))
}

/// Runs `xy_encoder` for `cycles` cycles; returns how many children it was compared on.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run_encoder(
    library: &Path,
    config: ContextConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<u64, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = EncoderPins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut compared = 0;
    while bench.cycle() < cycles {
        // Coordinates stay during a build.
        let coordinates = [Coordinates::Relative, Coordinates::Modulo][random.below(2) as usize];
        let quantization = config.quantization(coordinates);
        let mut pipeline = Pipeline::<Encoded>::new(2);
        for _ in 0..1000 {
            let drawn = family(&mut random, &quantization, config.margin);
            let Some((place, bounds)) = drawn else { continue };
            let estimate = Placement::estimate(&bounds, &quantization, config.margin);
            let Some(old) = estimate else { continue };
            let enable = random.below(8) > 0;
            bench.rtl.set(pins.enable_i, enable);
            bench.rtl.set(pins.modulo_i, coordinates == Coordinates::Modulo);
            bench.rtl.set_bytes(pins.place_i, &place_bytes(&place));
            bench.rtl.set_bytes(pins.box_i, &box_bytes(&bounds));
            bench.rtl.set_bytes(pins.old_i, &place_bytes(&old));
            bench.rtl.settle();
            if let Some(outputs) = pipeline.outputs() {
                let outs = [pins.code_o, pins.old_o, pins.new_o, pins.needed_o, pins.ok_o];
                expect(&bench, outs, outputs, config.bits)?;
                compared += 1;
            }
            if enable {
                let encoded = place.encode(&bounds, LEAF, &quantization);
                pipeline.advance(encoded.map(|(code, cells)| {
                    let new = place.child(&cells, &quantization);
                    (code, [old, new], old.is_outdated(&new, &quantization))
                }));
            }
            bench.edge()?;
        }
    }
    Ok(compared)
}

/// Runs `xy_recoder` for `cycles` cycles; returns how many children it was compared on.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run_recoder(
    library: &Path,
    config: ContextConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<u64, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = RecoderPins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut compared = 0;
    while bench.cycle() < cycles {
        let coordinates = [Coordinates::Relative, Coordinates::Modulo][random.below(2) as usize];
        let quantization = config.quantization(coordinates);
        let mut pipeline = Pipeline::<Encoded>::new(3);
        for _ in 0..1000 {
            // A node's context when it came, and the one that its parent gave it.
            let drawn = family(&mut random, &quantization, config.margin);
            let Some((parent, bounds)) = drawn else { continue };
            let Some(old) = Placement::estimate(&bounds, &quantization, config.margin) else {
                continue;
            };
            let new = match parent.encode(&bounds, LEAF, &quantization) {
                Some((_, cells)) => parent.child(&cells, &quantization),
                None => old,
            };
            let inner = box_inside(&mut random, &bounds);
            let mut child = match old.encode(&inner, LEAF, &quantization) {
                Some((code, _)) => code,
                None => continue,
            };
            if random.below(4) == 0 {
                let axis = random.below(3) as usize;
                child.low[axis] = random.below(1 << config.bits) as u8;
                child.high[axis] = random.below(1 << config.bits) as u8;
            }
            let enable = random.below(8) > 0;
            bench.rtl.set(pins.enable_i, enable);
            bench.rtl.set(pins.modulo_i, coordinates == Coordinates::Modulo);
            bench.rtl.set_bytes(pins.old_i, &place_bytes(&old));
            bench.rtl.set_bytes(pins.new_i, &place_bytes(&new));
            bench.rtl.set_bytes(pins.code_i, &code_bytes(&child, config.bits));
            bench.rtl.settle();
            if let Some(outputs) = pipeline.outputs() {
                let outs = [pins.code_o, pins.old_o, pins.new_o, pins.needed_o, pins.ok_o];
                expect(&bench, outs, outputs, config.bits)?;
                compared += 1;
            }
            if enable {
                let recoded = old.recode(&new, &child, &quantization);
                pipeline.advance(recoded.map(|(code, [old, new])| {
                    (code, [old, new], old.is_outdated(&new, &quantization))
                }));
            }
            bench.edge()?;
        }
    }
    Ok(compared)
}

/// Compares `code_o`, `old_o`, `new_o`, `needed_o` and `ok_o`.
fn expect(
    bench: &Bench,
    [code, old, new, needed, ok]: [crate::rtl::Pin; 5],
    outputs: &Encoded,
    bits: u8,
) -> Result<(), Stop> {
    bench.expect(ok, outputs.is_some())?;
    let Some((child, places, outdated)) = outputs else { return Ok(()) };
    bench.expect_bytes(code, &code_bytes(child, bits))?;
    bench.expect_bytes(old, &place_bytes(&places[0]))?;
    bench.expect_bytes(new, &place_bytes(&places[1]))?;
    bench.expect(needed, *outdated)
}
