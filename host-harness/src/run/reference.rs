//! The exact answer to a ray by trying every triangle.
//!
//! Written without the core's test, so that one can convict the other: the signs of three volumes
//! decide whether the line passes inside the triangle's edges (Plücker), where the core solves for
//! weights (Möller and Trumbore). A quick estimate in `f64` with a bound on its error sorts out the
//! triangles that are clearly missed; everything else is decided in integers.

use xylem_core::geom::{Ray, Triangle};

/// The closest hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Answer {
    /// The triangle; of several at the same representable time, the lowest.
    pub primitive: u32,
    /// The time, rounded up, in units of 2⁻⁶.
    pub t: i64,
}

/// All triangles of a scene, ready to be tried.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Vertices in units of 2⁻⁶ grid units.
    vertices: Vec<[[i64; 3]; 3]>,
    /// The same, as floats; exact, as they have 31 bits.
    floats: Vec<[[f64; 3]; 3]>,
}

impl Reference {
    /// Prepares the triangles of a scene.
    pub fn new(triangles: &[Triangle]) -> Self {
        let scaled = |t: &Triangle| t.vertices.map(|v| v.to_array().map(|c| i64::from(c) << 6));
        let vertices: Vec<_> = triangles.iter().map(scaled).collect();
        let floats = vertices.iter().map(|t| t.map(|v| v.map(|c| c as f64))).collect();
        Self { vertices, floats }
    }

    /// The closest hit within the ray's interval.
    pub fn closest(&self, ray: &Ray) -> Option<Answer> {
        let mut best: Option<Answer> = None;
        self.visit(ray, |primitive, t| {
            if best.is_none_or(|b| (t, primitive) < (b.t, b.primitive)) {
                best = Some(Answer { primitive, t });
            }
            true
        });
        best
    }

    /// Whether anything is hit within the ray's interval.
    pub fn any(&self, ray: &Ray) -> bool {
        let mut found = false;
        self.visit(ray, |_, _| {
            found = true;
            false
        });
        found
    }

    /// The rounded-up time at which the ray hits one triangle.
    pub fn hit(&self, ray: &Ray, primitive: u32) -> Option<i64> {
        exact(ray, self.vertices.get(primitive as usize)?)
    }

    /// Calls `visit` with every hit, in order of primitives, until it returns false.
    pub fn visit(&self, ray: &Ray, mut visit: impl FnMut(u32, i64) -> bool) {
        let origin = ray.origin().map(|c| f64::from(c.to_bits()));
        let direction = ray.direction().to_array().map(f64::from);
        for (i, triangle) in self.floats.iter().enumerate() {
            if clearly_missed(&origin, &direction, triangle) {
                continue;
            }
            if let Some(t) = exact(ray, &self.vertices[i])
                && !visit(i as u32, t)
            {
                return;
            }
        }
    }
}

/// Whether two of the three volumes certainly have opposite signs.
///
/// The differences of vertices and origin are exact (33 bits). Each volume is a sum of six products
/// of three such numbers; rounding errs by less than 2⁻⁴⁹ of the sum of their magnitudes.
#[inline]
fn clearly_missed(o: &[f64; 3], d: &[f64; 3], triangle: &[[f64; 3]; 3]) -> bool {
    const ERROR: f64 = 1.0 / (1u64 << 49) as f64;
    let [a, b, c] = triangle.map(|v| [v[0] - o[0], v[1] - o[1], v[2] - o[2]]);
    let volume = |p: &[f64; 3], q: &[f64; 3]| {
        let (x1, x2) = (p[1] * q[2], p[2] * q[1]);
        let (y1, y2) = (p[2] * q[0], p[0] * q[2]);
        let (z1, z2) = (p[0] * q[1], p[1] * q[0]);
        let value = d[0] * (x1 - x2) + d[1] * (y1 - y2) + d[2] * (z1 - z2);
        let magnitude = d[0].abs() * (x1.abs() + x2.abs())
            + d[1].abs() * (y1.abs() + y2.abs())
            + d[2].abs() * (z1.abs() + z2.abs());
        (value, magnitude * ERROR)
    };
    let (w_c, e_c) = volume(&a, &b);
    let (w_a, e_a) = volume(&b, &c);
    let (w_b, e_b) = volume(&c, &a);
    let positive = w_a > e_a || w_b > e_b || w_c > e_c;
    let negative = w_a < -e_a || w_b < -e_b || w_c < -e_c;
    positive && negative
}

/// The rounded-up time at which the ray hits the triangle within its interval.
fn exact(ray: &Ray, triangle: &[[i64; 3]; 3]) -> Option<i64> {
    let o = ray.origin().map(|c| i64::from(c.to_bits()));
    let d = ray.direction().to_array().map(i128::from);
    let [a, b, c] = triangle.map(|v| [0, 1, 2].map(|i| i128::from(v[i] - o[i])));
    let cross = |p: &[i128; 3], q: &[i128; 3]| {
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    };
    let dot = |p: &[i128; 3], q: &[i128; 3]| p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
    let volumes = [dot(&d, &cross(&a, &b)), dot(&d, &cross(&b, &c)), dot(&d, &cross(&c, &a))];
    let outside = volumes.iter().any(|v| *v > 0) && volumes.iter().any(|v| *v < 0);
    let edge = |p: &[i128; 3], q: &[i128; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let normal = cross(&edge(&b, &a), &edge(&c, &a));
    let slope = dot(&d, &normal);
    if outside || slope == 0 {
        return None;
    }
    // a · normal = direction · normal · time, with lengths in 2^-6 and the direction in 2^-30.
    let numerator = (dot(&a, &normal) * slope.signum()) << 30;
    let t = -((-numerator).div_euclid(slope.abs()));
    let inside = t > i128::from(ray.t_min().to_bits()) && t <= i128::from(ray.t_max().to_bits());
    inside.then_some(t as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::IVec3;
    use xylem_core::num::{SubGrid, Time};

    /// Small coordinates make edges, corners and coplanar rays common.
    #[test]
    fn the_cores_test_and_the_reference_agree_on_rays_through_edges_and_corners() {
        let mut seed = 3u64;
        let mut below = |n: u64| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((seed >> 33) % n) as i32
        };
        let (mut hits, mut misses) = (0, 0);
        for _ in 0..200_000 {
            let mut point = |n: u64| IVec3::new(below(n), below(n), below(n)) - (n / 2) as i32;
            let triangle = Triangle { vertices: [point(5), point(5), point(5)], id: 0 };
            let (o, d) = (point(7), point(5));
            let largest = d.abs().max_element();
            if largest == 0 {
                continue;
            }
            // The largest component is 1 or 2, so the scaled direction is exact.
            let d = d * ((1 << 30) / largest);
            let origin = o.to_array().map(SubGrid::from_num);
            let (t_min, t_max) = (Time::from_num(-9), Time::from_num(9));
            let ray = Ray::new(origin, d, t_min, t_max).unwrap();
            let core = triangle.intersect(&ray, t_max).map(|at| at.t.to_bits());
            let reference = Reference::new(&[triangle]);
            let closest = reference.closest(&ray).map(|answer| answer.t);
            assert_eq!(core, closest, "{triangle:?} {ray:?}");
            assert_eq!(reference.any(&ray), core.is_some());
            *(if core.is_some() { &mut hits } else { &mut misses }) += 1;
        }
        assert!(hits > 10_000 && misses > 10_000, "{hits} {misses}");
    }
}
