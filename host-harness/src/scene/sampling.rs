//! Sets of rays for measuring and for testing: diffuse bounces, random segments, and rays that are
//! aimed at the places where tracers lose hits.
//!
//! Every set depends on its arguments alone, ray by ray: ray `i` draws from a stream of its own.

use super::frame::SceneFrame;
use super::mesh::Mesh;
use super::random::Random;
use super::rays::{Hit, SceneRay};
use super::vec3::{Vec3, along, cross, dot, narrow, normalize, sub, tangents, widen};

/// The diffuse bounce of a ray that hit something: cosine-weighted around the geometric normal, on
/// the side that the ray came from. `None` for a miss and for a triangle without area.
///
/// It starts a little above the surface, see [`lift`], and has unit length and no end. Ray `index`
/// of a seed is always the same.
pub fn bounce(mesh: &Mesh, ray: &SceneRay, hit: &Hit, seed: u64, index: usize) -> Option<SceneRay> {
    let [a, b, c] = mesh.corners(hit.prim as usize).filter(|_| hit.is_hit())?.map(widen);
    let normal = normalize(cross(sub(b, a), sub(c, a)));
    if normal == [0.0; 3] {
        return None;
    }
    let against = dot(normal, widen(ray.direction)) > 0.0;
    let normal = if against { normal.map(|c| -c) } else { normal };
    let (u, v) = (f64::from(hit.u), f64::from(hit.v));
    let point = along(along(along(a, u, sub(b, a)), v, sub(c, a)), lift(&mesh.frame, a), normal);
    // A point in the disc, projected up to the hemisphere, is cosine-weighted (Malley).
    let [x, y] = Random::stream(seed, index as u64).in_disc();
    let [side, front] = tangents(normal);
    let up = (1.0 - x * x - y * y).sqrt();
    let direction = along(along(side.map(|c| x * c), y, front), up, normal);
    Some(SceneRay {
        origin: narrow(point),
        direction: narrow(direction),
        t_min: 0.0,
        t_max: f32::INFINITY,
    })
}

/// How far above a surface near `point` a bounce starts, in scene units: two grid units, for vertices
/// are snapped by up to half a unit on each axis and origins by a 128th, and four steps of an f32 of
/// the size of the point's largest coordinate, for the origin is stored as f32.
pub fn lift(frame: &SceneFrame, point: Vec3) -> f64 {
    let largest = point.into_iter().map(f64::abs).fold(0.0, f64::max);
    2.0 * frame.cell() + 4.0 * largest * f64::from(f32::EPSILON)
}

/// Segments between random points in and around the scene box (a quarter larger on every side): the
/// direction is the difference, the interval `0 < t <= 1`.
pub fn segments(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let (from, to) = (space.near(random), space.near(random));
        SceneRay { t_max: 1.0, ..ray(from, sub(to, from)) }
    })
}

/// Rays along an axis, either way, from outside the scene box through it; the two zero components
/// are +0 or −0 at random.
pub fn axis_parallel(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let target = space.inside(random);
        along_axis(&space, target, random)
    })
}

/// Rays along an axis exactly through a vertex of a triangle, as the f32 mesh has it.
pub fn axis_parallel_through_vertices(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let [target, _, _] = some_triangle(mesh, random);
        along_axis(&space, target, random)
    })
}

/// Rays from random points around the scene towards a vertex of a triangle.
pub fn through_vertices(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let [target, _, _] = some_triangle(mesh, random);
        let from = space.near(random);
        ray(from, sub(target, from))
    })
}

/// Rays from random points around the scene towards a point on an edge of a triangle.
pub fn through_edges(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let [a, b, _] = some_triangle(mesh, random);
        let target = along(a, random.unit(), sub(b, a));
        let from = space.near(random);
        ray(from, sub(target, from))
    })
}

/// Rays that lie in a face of the scene box, where a box test's interval has no width.
pub fn in_box_faces(mesh: &Mesh, count: usize, seed: u64) -> Vec<SceneRay> {
    let space = Space::new(mesh);
    each(count, seed, |random| {
        let axis = random.below(3);
        let face = if random.below(2) == 0 { space.low[axis] } else { space.high[axis] };
        let (mut from, mut to) = (space.near(random), space.inside(random));
        (from[axis], to[axis]) = (face, face);
        ray(from, sub(to, from))
    })
}

/// The space that rays are drawn from.
struct Space {
    low: Vec3,
    high: Vec3,
    /// The margin around the box, and what stands for a side without extent.
    margin: f64,
}

impl Space {
    fn new(mesh: &Mesh) -> Self {
        let [low, high] = mesh.bounds().unwrap_or([[0.0; 3], [1.0; 3]]).map(widen);
        let extent = [0, 1, 2].map(|i| high[i] - low[i]).into_iter().fold(0.0, f64::max);
        let margin = if extent > 0.0 { extent / 4.0 } else { 4096.0 * mesh.frame.cell() };
        Self { low, high, margin }
    }

    /// A point in the box.
    fn inside(&self, random: &mut Random) -> Vec3 {
        [0, 1, 2].map(|i| self.low[i] + random.unit() * (self.high[i] - self.low[i]))
    }

    /// A point in the box or in the margin around it.
    fn near(&self, random: &mut Random) -> Vec3 {
        [0, 1, 2].map(|i| {
            let (low, high) = (self.low[i] - self.margin, self.high[i] + self.margin);
            low + random.unit() * (high - low)
        })
    }
}

/// A ray along a random axis through `target` from the margin on one side.
fn along_axis(space: &Space, target: Vec3, random: &mut Random) -> SceneRay {
    let axis = random.below(3);
    let forwards = random.below(2) == 0;
    let mut from = target;
    from[axis] =
        if forwards { space.low[axis] - space.margin } else { space.high[axis] + space.margin };
    let mut direction = [0.0; 3].map(|zero: f64| if random.below(2) == 0 { zero } else { -zero });
    direction[axis] = if forwards { 1.0 } else { -1.0 };
    ray(from, direction)
}

/// The corners of a random triangle, beginning at a random one; the origin for an empty mesh.
fn some_triangle(mesh: &Mesh, random: &mut Random) -> [Vec3; 3] {
    let corners = mesh.corners(random.below(mesh.indices.len()));
    let mut corners = corners.unwrap_or([[0.0; 3]; 3]).map(widen);
    corners.rotate_left(random.below(3));
    corners
}

fn ray(from: Vec3, direction: Vec3) -> SceneRay {
    SceneRay {
        origin: narrow(from),
        direction: narrow(direction),
        t_min: 0.0,
        t_max: f32::INFINITY,
    }
}

fn each(count: usize, seed: u64, mut one: impl FnMut(&mut Random) -> SceneRay) -> Vec<SceneRay> {
    (0..count as u64).map(|index| one(&mut Random::stream(seed, index))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::convert::GridRay;
    use super::super::mesh::LoadOptions;
    use super::super::procedural;
    use super::*;
    use xylem_core::geom::PrimIndex;
    use xylem_core::traverse;

    fn mesh(name: &str) -> Mesh {
        let soup = procedural::soup(name).unwrap().unwrap();
        soup.into_mesh(name, &LoadOptions::default()).unwrap()
    }

    /// The closest hit, by trying all triangles.
    fn closest(mesh: &Mesh, ray: &SceneRay) -> Hit {
        let grid = GridRay::new(&mesh.frame, ray);
        let Some(core) = grid.core() else { return Hit::MISS };
        let hits =
            mesh.triangles.iter().filter_map(|t| Some((t.id, t.intersect(core, core.t_max())?)));
        let first = hits.min_by_key(|(id, at)| (at.t, *id));
        grid.hit(first.map(|(id, at)| traverse::Hit::new(PrimIndex(id), &at)).as_ref())
    }

    #[test]
    fn bounces_leave_the_surface_on_the_side_they_came_from() {
        let mesh = mesh("degenerate/duplicate_faces");
        let rays = segments(&mesh, 2000, 5);
        let (mut bounced, mut cosine) = (0, 0.0);
        for (i, first) in rays.iter().enumerate() {
            let hit = closest(&mesh, first);
            let Some(next) = bounce(&mesh, first, &hit, 1, i) else {
                assert!(!hit.is_hit());
                continue;
            };
            assert_eq!(Some(next), bounce(&mesh, first, &hit, 1, i));
            let [a, b, c] = mesh.corners(hit.prim as usize).unwrap().map(widen);
            let normal = normalize(cross(sub(b, a), sub(c, a)));
            let (before, after) =
                (dot(normal, widen(first.direction)), dot(normal, widen(next.direction)));
            assert!(before * after < 0.0, "{first:?} {next:?}");
            // The ball is convex: from outside no bounce meets it again.
            let outside = dot(widen(next.origin), normal) * after > 0.0;
            assert!(!(outside && closest(&mesh, &next).is_hit()), "{next:?}");
            bounced += 1;
            cosine += after.abs();
        }
        assert!(bounced > 300, "{bounced}");
        // The mean of a cosine-weighted cosine is 2/3.
        assert!((cosine / f64::from(bounced) - 2.0 / 3.0).abs() < 0.03);
    }

    #[test]
    fn aimed_rays_pass_where_they_are_aimed() {
        let mesh = mesh("degenerate/duplicate_faces");
        let distance = |ray: &SceneRay, p: Vec3| {
            let d = normalize(widen(ray.direction));
            let off = cross(sub(p, widen(ray.origin)), d);
            dot(off, off).sqrt()
        };
        let vertices: Vec<Vec3> = mesh.positions.iter().copied().map(widen).collect();
        for rays in [through_vertices(&mesh, 100, 3), axis_parallel_through_vertices(&mesh, 100, 3)]
        {
            for ray in &rays {
                let near = vertices.iter().map(|&p| distance(ray, p)).fold(1.0, f64::min);
                assert!(near < 1e-6, "{ray:?}: {near}");
            }
        }
        for ray in axis_parallel(&mesh, 100, 4) {
            assert_eq!(ray.direction.iter().filter(|c| **c == 0.0).count(), 2);
        }
        for ray in in_box_faces(&mesh, 100, 4) {
            let in_face = |i: usize| ray.direction[i] == 0.0 && ray.origin[i].abs() > 0.9;
            assert!((0..3).any(in_face), "{ray:?}");
        }
        let hit =
            through_edges(&mesh, 200, 6).iter().filter(|r| closest(&mesh, r).is_hit()).count();
        assert!(hit > 190, "{hit} of 200 rays at edges of a closed ball hit it");
    }

    #[test]
    fn sets_are_deterministic_and_exist_for_every_degenerate_scene() {
        type Set = fn(&Mesh, usize, u64) -> Vec<SceneRay>;
        let sets: [Set; 6] = [
            segments,
            axis_parallel,
            axis_parallel_through_vertices,
            through_vertices,
            through_edges,
            in_box_faces,
        ];
        for case in procedural::degenerate::CASES {
            let mesh = mesh(&format!("degenerate/{}", case.name));
            for set in sets {
                let rays = set(&mesh, 20, 9);
                assert_eq!(rays.len(), 20);
                assert_eq!(rays[..5], set(&mesh, 5, 9));
                assert_ne!(rays, set(&mesh, 20, 10), "{}", case.name);
                assert!(rays.iter().enumerate().all(|(i, r)| r.check(i).is_ok()), "{}", case.name);
            }
        }
    }
}
