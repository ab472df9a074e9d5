//! Rays that are hard for box and triangle tests.
//!
//! They are made on the grid, where "exactly through a vertex" and "exactly in a plane" can be said.

use glam::IVec3;
use xylem::scene::Random;
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::num::{SubGrid, Time};

/// What is hard about a ray.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Nothing: anywhere, in any direction.
    Plain,
    /// Along an axis.
    Axis,
    /// Along an axis, exactly through a vertex.
    AxisThroughVertex,
    /// Along an axis or with one zero component, in a face plane of a triangle's box.
    InFacePlane,
    /// Exactly through a vertex, in a slanted direction.
    ThroughVertex,
    /// Along an edge of a triangle.
    AlongEdge,
    /// Two components so small that the ray hardly moves on their axes.
    Creeping,
    /// From the farthest origins that there are.
    Far,
    /// From a vertex, or from inside a box, with times before zero.
    Within,
}

/// All kinds of rays.
pub const KINDS: [Kind; 9] = [
    Kind::Plain,
    Kind::Axis,
    Kind::AxisThroughVertex,
    Kind::InFacePlane,
    Kind::ThroughVertex,
    Kind::AlongEdge,
    Kind::Creeping,
    Kind::Far,
    Kind::Within,
];

/// The highest origin, in units of 2⁻⁶.
const LIMIT: i32 = Ray::ORIGIN_LIMIT << 6;

const ONE: i32 = 1 << 30;

/// A ray of a kind at random, aimed at the triangles, of which there must be some.
///
/// # Panics
/// If `triangles` is empty.
pub fn hard_ray(random: &mut Random, triangles: &[Triangle], bounds: &Aabb) -> (Kind, Ray) {
    let kind = KINDS[random.below(KINDS.len())];
    let triangle = &triangles[random.below(triangles.len())];
    let target = triangle.vertices[random.below(3)].to_array().map(|c| c << 6);
    let away = anywhere(random, bounds);
    let (origin, direction) = match kind {
        Kind::Plain => (away, slanted(random)),
        Kind::Axis => (away, along(random)),
        Kind::AxisThroughVertex => {
            let direction = along(random);
            let moving = |i: usize| direction[i] != 0;
            ([0, 1, 2].map(|i| if moving(i) { away[i] } else { target[i] }), direction)
        }
        Kind::InFacePlane => {
            let face = triangle.bounds();
            let corner = if random.below(2) == 0 { face.min } else { face.max };
            let axis = random.below(3);
            let mut direction = if random.below(2) == 0 { slanted(random) } else { along(random) };
            direction[axis] = 0;
            if direction == [0; 3] {
                direction[(axis + 1) % 3] = ONE * sign(random);
            }
            let mut origin = if random.below(2) == 0 { away } else { target };
            origin[axis] = corner[axis] << 6;
            (origin, direction)
        }
        Kind::ThroughVertex => {
            // Sixteenths and a whole number of steps back, so that the vertex is hit exactly.
            let mut sixteenths = || random.below(33) as i32 - 16;
            let mut direction = [sixteenths(), sixteenths(), sixteenths()];
            direction[random.below(3)] = 16;
            let steps = random.below(1 << 24) as i32;
            (
                [0, 1, 2].map(|i| target[i].saturating_sub(direction[i].saturating_mul(steps))),
                direction.map(|d| d << 26),
            )
        }
        Kind::AlongEdge => {
            let [a, b, _] = triangle.vertices;
            (a.to_array().map(|c| c << 6), normalised((b - a).to_array().map(f64::from)))
        }
        Kind::Creeping => {
            let mut direction = along(random);
            for d in &mut direction {
                if *d == 0 {
                    let power = 1i32 << random.below(24);
                    *d = (power + random.below(3) as i32 - 1) * sign(random);
                }
            }
            let beside = |random: &mut Random, c: i32| c + random.below(5) as i32 - 2;
            (
                [0, 1, 2].map(|i| match direction[i].abs() == ONE {
                    true => away[i],
                    false => beside(random, target[i]),
                }),
                direction,
            )
        }
        Kind::Far => {
            let origin = [(); 3].map(|()| match random.below(3) {
                0 => LIMIT * sign(random),
                1 => (LIMIT - random.below(200) as i32) * sign(random),
                _ => (random.bits() >> 32) as i32 % LIMIT,
            });
            let towards = [0, 1, 2].map(|i| f64::from(target[i]) - f64::from(origin[i]));
            (origin, normalised(towards))
        }
        Kind::Within => {
            let origin = if random.below(2) == 0 { target } else { away };
            (origin, if random.below(2) == 0 { slanted(random) } else { along(random) })
        }
    };
    // A component that was set to zero may have been the largest one.
    let short = direction.iter().all(|d| d.unsigned_abs() <= 1 << 29);
    let direction = if short { normalised(direction.map(f64::from)) } else { direction };
    let origin = origin.map(|c| SubGrid::from_bits(c.clamp(-LIMIT, LIMIT)));
    let (t_min, t_max) = interval(random, kind);
    let ray = Ray::new(origin, IVec3::from(direction), t_min, t_max);
    (kind, ray.unwrap_or_else(|e| panic!("{kind:?} {origin:?} {direction:?}: {e}")))
}

/// The interval of a ray: mostly all times from zero on, else cut off anywhere.
fn interval(random: &mut Random, kind: Kind) -> (Time, Time) {
    let mut some = || {
        let bits = random.below(33) as u32;
        Time::from_bits((random.bits() >> (63 - bits)) as i64)
    };
    let (a, b) = (some(), some());
    match random.below(8) {
        0 => (a.min(b), a.max(b) + Time::DELTA),
        1 => (Time::ZERO, a + Time::DELTA),
        2 => (-a, b + Time::DELTA),
        _ if kind == Kind::Within => (-Ray::TIME_LIMIT, Ray::TIME_LIMIT),
        _ => (Time::ZERO, Ray::TIME_LIMIT),
    }
}

fn sign(random: &mut Random) -> i32 {
    if random.below(2) == 0 { 1 } else { -1 }
}

/// An origin within three times the box, in units of 2⁻⁶.
fn anywhere(random: &mut Random, bounds: &Aabb) -> [i32; 3] {
    [0, 1, 2].map(|i| {
        let (low, high) = (i64::from(bounds.min[i]) << 6, i64::from(bounds.max[i]) << 6);
        let side = (high - low).max(64);
        let at = low - side + random.below(3 * side as usize) as i64;
        at.clamp(-i64::from(LIMIT), i64::from(LIMIT)) as i32
    })
}

fn along(random: &mut Random) -> [i32; 3] {
    let mut direction = [0; 3];
    direction[random.below(3)] = ONE * sign(random);
    direction
}

fn slanted(random: &mut Random) -> [i32; 3] {
    normalised([random.signed(), random.signed(), random.signed()])
}

/// Integers in that direction, the largest above 2²⁹ and at most 2³⁰; along x for no direction.
fn normalised(direction: [f64; 3]) -> [i32; 3] {
    let largest = direction.iter().fold(0f64, |m, d| m.max(d.abs()));
    if largest == 0.0 {
        return [ONE, 0, 0];
    }
    // Not always to the top of the range, to vary the reciprocals' mantissas.
    let part = 0.5 + 0.5 * ((largest.to_bits() % 1024) + 1) as f64 / 1024.0;
    let scale = f64::from(ONE) * part / largest;
    direction.map(|d| (d * scale).round() as i32)
}
