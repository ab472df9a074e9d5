//! Triangles and the exact ray–triangle test.

use glam::IVec3;

use super::{Aabb, Ray};
use crate::num::Time;

/// The index of a primitive in the input.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PrimIndex(pub u32);

/// A triangle with vertices on the grid.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct Triangle {
    /// The three vertices, in grid units.
    pub vertices: [IVec3; 3],
    /// The caller's identifier; not interpreted.
    pub id: u32,
}

/// Where a ray's line meets a triangle: exact barycentric weights over a common denominator, and
/// the time rounded up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Intersection {
    /// The time, rounded up to the next representable [`Time`].
    ///
    /// Rounding up keeps interval tests exact: for a representable `m`, the exact time is at most
    /// `m` if and only if the rounded one is.
    pub t: Time,
    /// Numerator of the weight of vertex 1, in `0 ..= denominator`.
    pub u: i128,
    /// Numerator of the weight of vertex 2, in `0 ..= denominator - u`.
    pub v: i128,
    /// The common denominator, positive.
    pub denominator: i128,
}

/// Where a ray's line, without regard to the ray's interval, meets a triangle: exact fractions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Crossing {
    /// Numerator of the time in units of 2⁻⁶, over `determinant`.
    pub time: i128,
    /// Numerator of the weight of vertex 1, over `determinant << 6`.
    pub u: i128,
    /// Numerator of the weight of vertex 2, over `determinant << 6`.
    pub v: i128,
    /// The determinant, positive.
    pub determinant: i128,
}

impl Triangle {
    /// Bytes of a triangle record in memory: three vertices of 3 × i32 and the identifier as u32,
    /// little-endian (P3 §5: 36 + 4 bytes).
    pub const BYTES: usize = 40;

    /// The smallest box around the triangle.
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(&self.vertices)
    }

    /// The record of this triangle.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let words = self.vertices.iter().flat_map(|v| v.to_array());
        for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        bytes[36..].copy_from_slice(&self.id.to_le_bytes());
        bytes
    }

    /// The triangle of a record.
    #[inline]
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let word = |i: usize| {
            i32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        let vertex = |i: usize| IVec3::new(word(3 * i), word(3 * i + 1), word(3 * i + 2));
        Self { vertices: [vertex(0), vertex(1), vertex(2)], id: word(9) as u32 }
    }

    /// Intersects the ray with the closed triangle, exactly, within `t_min < t <= t_max`.
    ///
    /// `t_max` replaces the ray's own end: it is the time of the best hit so far.
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: Time) -> Option<Intersection> {
        let Crossing { time, u, v, determinant } = self.crossing(ray)?;
        let after = time > determinant * i128::from(ray.t_min().to_bits());
        let before = time <= determinant * i128::from(t_max.to_bits());
        (after && before).then(|| {
            let floor = time.div_euclid(determinant);
            let up = i128::from(floor * determinant != time);
            let denominator = determinant << 6;
            Intersection { t: Time::from_bits((floor + up) as i64), u, v, denominator }
        })
    }

    /// Where the ray's line meets the closed triangle, or `None` if it passes the triangle by.
    ///
    /// The test is Möller
    /// and Trumbore's in integers: every quantity below is the exact value of a polynomial of the
    /// inputs, so a point on an edge belongs to both triangles that share the edge (a ray cannot
    /// slip between them) and no epsilon is needed. A ray in the triangle's plane and a triangle
    /// without area have determinant zero and are missed.
    ///
    /// Widths, for vertices on a 24-bit grid and a [`Ray`] in its ranges (magnitudes):
    /// edges 2²⁴, origin to vertex 2³¹ (in 2⁻⁶ units), `direction × edge` 2⁵⁵,
    /// `(origin − vertex) × edge` 2⁵⁶; the products of these with one more vector stay below 2⁹⁰,
    /// and the time's numerator, shifted to units of 2⁻⁶, below 2¹¹³.
    #[inline]
    pub fn crossing(&self, ray: &Ray) -> Option<Crossing> {
        let [v0, v1, v2] = self.vertices.map(|v| v.to_array().map(i64::from));
        let e1 = sub(v1, v0);
        let e2 = sub(v2, v0);
        let d = ray.direction().to_array().map(i64::from);
        let p = cross(d, e2);
        let det = dot(e1, p);
        if det == 0 {
            return None;
        }
        let o = ray.axes().each_ref().map(|axis| i64::from(axis.origin));
        let from_v0 = sub(o, v0.map(|c| c << 6));
        // Make the determinant positive; flipping all signs flips none of the ratios.
        let sign = if det < 0 { -1 } else { 1 };
        let determinant = det * i128::from(sign);
        // u and v carry the 2^-6 of the origin, so their denominator does.
        let denominator = determinant << 6;
        let u = dot(from_v0, p) * i128::from(sign);
        if u < 0 || u > denominator {
            return None;
        }
        let q = cross(from_v0, e1);
        let v = dot(d, q) * i128::from(sign);
        if v < 0 || u + v > denominator {
            return None;
        }
        // t = (e2 · q) / denominator in units of one direction vector; · 2^30 in time units;
        // · 2^6 in its smallest step. Together: the product << 30 over the determinant.
        let time = (dot(e2, q) * i128::from(sign)) << 30;
        Some(Crossing { time, u, v, determinant })
    }
}

#[inline]
fn sub(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn cross(a: [i64; 3], b: [i64; 3]) -> [i64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
fn dot(a: [i64; 3], b: [i64; 3]) -> i128 {
    let product = |i: usize| i128::from(a[i]) * i128::from(b[i]);
    product(0) + product(1) + product(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::SubGrid;

    fn triangle(v: [[i32; 3]; 3]) -> Triangle {
        Triangle { vertices: v.map(IVec3::from), id: 7 }
    }

    fn down_z(x: f32, y: f32) -> Ray {
        let o = [SubGrid::from_num(x), SubGrid::from_num(y), SubGrid::from_num(100)];
        Ray::new(o, IVec3::new(0, 0, -(1 << 30)), Time::ZERO, Ray::TIME_LIMIT).unwrap()
    }

    #[test]
    fn records_round_trip() {
        let t = triangle([[1, -2, 3], [4, 5, -6], [-8_388_608, 8, 8_388_607]]);
        assert_eq!(Triangle::from_bytes(&t.to_bytes()), t);
    }

    #[test]
    fn weights_and_time_are_exact() {
        let t = triangle([[0, 0, 0], [8, 0, 0], [0, 8, 0]]);
        let hit = t.intersect(&down_z(2.0, 4.0), Ray::TIME_LIMIT).unwrap();
        assert_eq!(hit.t, Time::from_num(100));
        assert_eq!((hit.u * 4, hit.v * 2), (hit.denominator, hit.denominator));
    }

    #[test]
    fn edges_and_corners_belong_to_the_triangle_and_points_beyond_do_not() {
        let t = triangle([[0, 0, 0], [8, 0, 0], [0, 8, 0]]);
        let flipped = triangle([[0, 0, 0], [0, 8, 0], [8, 0, 0]]);
        for (x, y, inside) in [
            (0.0, 0.0, true),
            (8.0, 0.0, true),
            (0.0, 8.0, true),
            (4.0, 4.0, true),
            (4.0, 0.0, true),
            (4.015625, 4.0, false),
            (-0.015625, 1.0, false),
            (4.0, -0.015625, false),
        ] {
            for t in [t, flipped] {
                assert_eq!(
                    t.intersect(&down_z(x, y), Ray::TIME_LIMIT).is_some(),
                    inside,
                    "{x} {y}"
                );
            }
        }
    }

    #[test]
    fn the_interval_is_open_below_and_closed_above() {
        let t = triangle([[0, 0, 0], [8, 0, 0], [0, 8, 0]]);
        let at = |t_min: i32, t_max: i32| {
            let r = down_z(1.0, 1.0);
            let (lo, hi) = (Time::from_num(t_min), Time::from_num(t_max));
            t.intersect(&Ray::new(r.origin(), r.direction(), lo, hi).unwrap(), hi).is_some()
        };
        assert!(at(99, 100));
        assert!(!at(100, 101));
        assert!(!at(0, 99));
    }

    #[test]
    fn a_triangle_seen_edge_on_or_without_area_is_missed() {
        let edge_on = triangle([[0, 0, 0], [0, 8, 0], [0, 0, 8]]);
        assert_eq!(edge_on.intersect(&down_z(0.0, 1.0), Ray::TIME_LIMIT), None);
        let point = triangle([[1, 1, 0]; 3]);
        assert_eq!(point.intersect(&down_z(1.0, 1.0), Ray::TIME_LIMIT), None);
    }

    #[test]
    fn extreme_coordinates_do_not_overflow() {
        let (lo, hi) = (-(1 << 23), (1 << 23) - 1);
        let t = triangle([[lo, lo, lo], [hi, lo, hi], [lo, hi, hi]]);
        let far = SubGrid::from_num(Ray::ORIGIN_LIMIT);
        for signs in 0..8 {
            let s = |bit: i32| if signs >> bit & 1 == 1 { -1 } else { 1 };
            let o = [0, 1, 2].map(|i| far * s(i));
            let d = IVec3::new(-s(0), -s(1), -s(2)) * (1 << 30);
            let ray = Ray::new(o, d, -Ray::TIME_LIMIT, Ray::TIME_LIMIT).unwrap();
            // In debug builds an overflow would panic here.
            let _ = t.intersect(&ray, Ray::TIME_LIMIT);
        }
    }
}
