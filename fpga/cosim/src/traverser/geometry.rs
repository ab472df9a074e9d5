//! Random rays, boxes and triangles, with the corners where box and triangle tests go wrong.

use glam::IVec3;
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::num::{SubGrid, Time};

use crate::random::Random;

/// The lowest and the highest coordinate of the grid.
pub const GRID: [i32; 2] = [-(1 << 23), (1 << 23) - 1];

/// A number from `-limit` to `limit` of any size: as many are short as long. Often at a power of two.
pub fn number(random: &mut Random, limit: i32) -> i32 {
    let bits = random.below(32) as u32;
    let near = (1i64 << bits) + random.below(3) as i64 - 1;
    let any = (random.bits() & ((1u64 << bits) - 1)) as i64;
    let magnitude = [near, any][random.below(4).min(1) as usize].clamp(0, limit.into()) as i32;
    if random.below(2) == 0 { magnitude } else { -magnitude }
}

/// A grid coordinate.
pub fn coordinate(random: &mut Random) -> i32 {
    match random.below(8) {
        0 => GRID[random.below(2) as usize],
        1..4 => number(random, GRID[1]),
        _ => (random.below(1 << 24) as i32) + GRID[0],
    }
}

/// A grid point.
pub fn point(random: &mut Random) -> IVec3 {
    IVec3::from([(); 3].map(|()| coordinate(random)))
}

/// A direction, often along an axis or a diagonal.
pub fn direction(random: &mut Random) -> IVec3 {
    let mut parts = [(); 3].map(|()| match random.below(8) {
        0 => 0,
        1 => 1 << 30,
        2 => (1 << 29) + 1,
        3 => number(random, 1 << 30),
        _ => (random.below(1 << 31) as i64 - (1 << 30)) as i32,
    });
    let major = random.below(3) as usize;
    if parts.iter().all(|part| part.unsigned_abs() <= 1 << 29) {
        parts[major] |= 1 << 29 | 1;
        parts[major] = parts[major].clamp(-(1 << 30), 1 << 30);
        if parts[major].unsigned_abs() <= 1 << 29 {
            parts[major] = 1 << 30;
        }
    }
    let sign = |part: i32| if random.below(2) == 0 { part } else { -part };
    IVec3::from(parts.map(sign))
}

/// A time that a ray may have.
fn time(random: &mut Random) -> Time {
    match random.below(4) {
        0 => -Ray::TIME_LIMIT,
        1 => Time::ZERO,
        2 => Ray::TIME_LIMIT,
        _ => Time::from_bits(number(random, 1 << 30).into()),
    }
}

/// Any ray with an interval that is not empty.
pub fn ray(random: &mut Random) -> Ray {
    let limit = Ray::ORIGIN_LIMIT << 6;
    loop {
        let origin = [(); 3].map(|()| match random.below(8) {
            0 => limit,
            1 => -limit,
            2 | 3 => coordinate(random) << 6,
            _ => number(random, limit),
        });
        let (t_min, t_max) = (time(random), time(random));
        let ray = Ray::new(origin.map(SubGrid::from_bits), direction(random), t_min, t_max);
        if let Some(ray) = ray.ok().filter(|_| t_min < t_max) {
            return ray;
        }
    }
}

/// A ray exactly through a grid point, at a time in the middle of its interval or at its end.
pub fn ray_through(random: &mut Random, target: IVec3) -> Ray {
    loop {
        let mut direction = [(); 3].map(|()| random.below(33) as i32 - 16);
        direction[random.below(3) as usize] = [16, -16][random.below(2) as usize];
        let reach = 1 << random.below(24);
        let steps = random.below(reach) as i64;
        let limit = i64::from(Ray::ORIGIN_LIMIT) << 6;
        // 2^-4 of a grid unit is 4 of the origin's units.
        let origin =
            [0, 1, 2].map(|i| (i64::from(target[i]) << 6) - i64::from(direction[i]) * 4 * steps);
        if origin.iter().any(|o| o.abs() > limit) {
            continue;
        }
        let at = Time::from_bits(64 * steps);
        let least = Time::from_bits(1);
        let t_min = [Time::ZERO, -Ray::TIME_LIMIT, at, at - least][random.below(4) as usize];
        let t_max = [Ray::TIME_LIMIT, Ray::TIME_LIMIT, at, at - least][random.below(4) as usize];
        let origin = origin.map(|o| SubGrid::from_bits(o as i32));
        let ray = Ray::new(origin, IVec3::from(direction) << 26, t_min, t_max);
        if let Some(ray) = ray.ok().filter(|_| t_min < t_max) {
            return ray;
        }
    }
}

/// A box of grid points, often flat or a point, and often large.
pub fn aabb(random: &mut Random) -> Aabb {
    let (a, mut b) = (point(random), point(random));
    for axis in 0..3 {
        if random.below(8) == 0 {
            b[axis] = a[axis];
        }
    }
    Aabb::of_points(&[a, b])
}

/// A triangle, at times without area, and a ray; half of the rays pass exactly through a corner, an
/// edge or an inner point of it.
pub fn aimed(random: &mut Random) -> (Triangle, Ray) {
    let near = point(random);
    let size = random.below(25) as u32;
    let mut vertices = [(); 3].map(|()| {
        let part = |axis: usize, random: &mut Random| {
            let off = random.below(2 << size) as i32 - (1 << size);
            (near[axis] + off).clamp(GRID[0], GRID[1])
        };
        IVec3::new(part(0, random), part(1, random), part(2, random))
    });
    match random.below(16) {
        0 => vertices[1] = vertices[0],
        1 => vertices[2] = vertices[0] + (vertices[1] - vertices[0]) / 2,
        2 => vertices.iter_mut().for_each(|v| v.z = near.z.clamp(GRID[0], GRID[1])),
        _ => {}
    }
    let [a, b, c] = vertices;
    let middle = |a: IVec3, b: IVec3| a + (b - a) / 2;
    let ray = match random.below(8) {
        0 => ray_through(random, a),
        1 => ray_through(random, b),
        2 => ray_through(random, middle(b, c)),
        3 => ray_through(random, middle(a, b)),
        4..6 => ray_through(random, middle(middle(a, b), c)),
        6 => ray_through(random, near.clamp(IVec3::splat(GRID[0]), IVec3::splat(GRID[1]))),
        _ => ray(random),
    };
    (Triangle { vertices, id: random.bits() as u32 }, ray)
}
