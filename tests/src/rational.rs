//! A ray against triangles, exactly, in fractions of any size.
//!
//! This is the last instance: it knows nothing of grids, rounding or widths. Floats and grid
//! coordinates alike become fractions without error.

use num_bigint::BigInt;
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use xylem::scene::{SceneFrame, SceneRay};
use xylem_core::geom::{Ray, Triangle};

/// A fraction.
pub type Fraction = BigRational;

/// A point or a vector.
pub type Vector = [Fraction; 3];

/// A ray over `t_min < t <= t_max`; `None` is without bound.
#[derive(Clone, Debug)]
pub struct ExactRay {
    /// Where time is zero.
    pub origin: Vector,
    /// The movement in one unit of time.
    pub direction: Vector,
    /// The exclusive start.
    pub t_min: Option<Fraction>,
    /// The inclusive end.
    pub t_max: Option<Fraction>,
}

/// The fraction that a finite float is.
///
/// # Panics
/// If it is not finite.
pub fn fraction(value: f64) -> Fraction {
    Fraction::from_float(value).expect("the value is finite")
}

/// `numerator / denominator`.
pub fn ratio(numerator: impl Into<BigInt>, denominator: impl Into<BigInt>) -> Fraction {
    Fraction::new(numerator.into(), denominator.into())
}

impl ExactRay {
    /// A ray in scene units, as it is.
    pub fn of_scene(ray: &SceneRay) -> Self {
        let vector = |v: [f32; 3]| v.map(|c| fraction(c.into()));
        let bound = |t: f32| t.is_finite().then(|| fraction(t.into()));
        Self {
            origin: vector(ray.origin),
            direction: vector(ray.direction),
            t_min: bound(ray.t_min),
            t_max: bound(ray.t_max),
        }
    }

    /// A ray on the grid, in grid units.
    pub fn of_grid(ray: &Ray) -> Self {
        Self {
            origin: ray.origin().map(|c| ratio(c.to_bits(), 64)),
            direction: ray.direction().to_array().map(|c| ratio(c, 1 << 30)),
            t_min: Some(ratio(ray.t_min().to_bits(), 64)),
            t_max: Some(ratio(ray.t_max().to_bits(), 64)),
        }
    }

    /// A ray on the grid, in scene units of space and grid units of time.
    pub fn of_grid_in(frame: &SceneFrame, ray: &Ray) -> Self {
        let on_grid = Self::of_grid(ray);
        let cell = fraction(frame.cell());
        Self {
            origin: scene_point(frame, &on_grid.origin),
            direction: on_grid.direction.map(|d| d * &cell),
            ..on_grid
        }
    }

    /// The point at a time.
    pub fn at(&self, t: &Fraction) -> Vector {
        [0, 1, 2].map(|i| &self.origin[i] + t * &self.direction[i])
    }

    /// The time at which the ray hits the closed triangle within its interval. A ray in the
    /// triangle's plane, and a triangle without area, are missed.
    pub fn hit(&self, corners: &[Vector; 3]) -> Option<Fraction> {
        let [a, b, c] = corners;
        let (e1, e2) = (minus(b, a), minus(c, a));
        let p = cross(&self.direction, &e2);
        let determinant = dot(&e1, &p);
        if determinant.is_zero() {
            return None;
        }
        let s = minus(&self.origin, a);
        let q = cross(&s, &e1);
        let (u, v) = (dot(&s, &p) / &determinant, dot(&self.direction, &q) / &determinant);
        let one = ratio(1, 1);
        if u.is_negative() || v.is_negative() || u + v > one {
            return None;
        }
        let t = dot(&e2, &q) / determinant;
        let inside = self.t_min.as_ref().is_none_or(|low| t > *low)
            && self.t_max.as_ref().is_none_or(|high| t <= *high);
        inside.then_some(t)
    }

    /// The first hit among some numbered triangles: its time and all that are hit at that time.
    pub fn closest(
        &self,
        triangles: impl IntoIterator<Item = (u32, [Vector; 3])>,
    ) -> Option<(Fraction, Vec<u32>)> {
        let mut best: Option<(Fraction, Vec<u32>)> = None;
        for (index, corners) in triangles {
            let Some(t) = self.hit(&corners) else { continue };
            match &mut best {
                Some((first, tied)) if t == *first => tied.push(index),
                Some((first, _)) if t > *first => {}
                _ => best = Some((t, vec![index])),
            }
        }
        best
    }
}

/// The corners of a triangle on the grid, in grid units.
pub fn grid_corners(triangle: &Triangle) -> [Vector; 3] {
    triangle.vertices.map(|v| v.to_array().map(|c| ratio(c, 1)))
}

/// A point in grid units, in scene units.
pub fn scene_point(frame: &SceneFrame, point: &Vector) -> Vector {
    let (origin, cell) = (frame.origin(), fraction(frame.cell()));
    let low = ratio(frame.grid().min(), 1);
    [0, 1, 2].map(|i| fraction(origin[i]) + &cell * (&point[i] - &low))
}

/// The componentwise difference.
pub fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

/// The largest component's magnitude.
pub fn largest(v: &Vector) -> Fraction {
    v.iter().map(Signed::abs).fold(Fraction::zero(), Fraction::max)
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    let term = |i: usize, j: usize| &a[i] * &b[j] - &a[j] * &b[i];
    [term(1, 2), term(2, 0), term(0, 1)]
}

fn dot(a: &Vector, b: &Vector) -> Fraction {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_through_a_shared_edge_hits_both_triangles_at_one_time() {
        let point = |x: f64, y: f64| [x, y, 0.25].map(fraction);
        let (a, b) = (point(0.0, 0.0), point(1.0, 1.0));
        let left = [a.clone(), b.clone(), point(0.0, 1.0)];
        let right = [a, point(1.0, 0.0), b];
        let ray = ExactRay::of_scene(&SceneRay {
            origin: [0.3, 0.3, 0.0],
            direction: [0.0, -0.0, 3.0],
            t_min: 0.0,
            t_max: f32::INFINITY,
        });
        let (t, tied) = ray.closest([(4, left.clone()), (7, right.clone())]).unwrap();
        assert_eq!((t, tied), (ratio(1, 12), vec![4, 7]));
        let short = ExactRay { t_max: Some(ratio(1, 13)), ..ray };
        assert!(short.closest([(4, left), (7, right)]).is_none());
    }
}
