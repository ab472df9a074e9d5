//! Where to stand to see a mesh well.

use crate::scene::{Camera, Mesh, UpAxis};

type Vec3 = [f64; 3];

/// The tangent of half the camera's vertical field of view of 40 degrees.
const HALF_HEIGHT: f64 = 0.363_970_234_266_202_4;

/// How much of the image the mesh may fill.
const FILL: f64 = 0.94;

/// A camera that looks from the same side as [`Camera::framing`], as near as it can be with every
/// vertex in view: it frames the mesh where that frames its box.
///
/// `width` and `height` are in pixels. A mesh without vertices is seen as the unit box would be.
pub fn close_up(mesh: &Mesh, up: UpAxis, width: u32, height: u32) -> Camera {
    let framed = |bounds| Camera::framing(bounds, up, width, height);
    let Some([low, high]) = mesh.bounds() else { return framed([[0.0; 3], [1.0; 3]]) };
    // Only its direction is of use: from the middle of the box to the eye.
    let eye = framed([low, high]).ray(0).origin.map(f64::from);
    let centre = [0, 1, 2].map(|i| f64::from(low[i]) / 2.0 + f64::from(high[i]) / 2.0);
    let forward = unit([0, 1, 2].map(|i| centre[i] - eye[i]));
    let right = unit(cross(forward, up_vector(up)));
    let top = cross(right, forward);

    // A vertex at (x, y, z) along right, top and forward is in view of an eye at (ex, ey, ez) if
    // |x - ex| <= across (z - ez), and likewise for y: four half spaces, of which only the
    // outermost vertex matters.
    let (aspect, down) = (f64::from(width.max(1)) / f64::from(height.max(1)), FILL * HALF_HEIGHT);
    let across = down * aspect;
    let mut outermost = [f64::NEG_INFINITY; 4];
    let mut nearest = f64::INFINITY;
    for position in &mesh.positions {
        // From the centre, so that a scene far from the origin keeps its digits.
        let p = [0, 1, 2].map(|i| f64::from(position[i]) - centre[i]);
        let (x, y, z) = (dot(p, right), dot(p, top), dot(p, forward));
        let planes = [x - across * z, -x - across * z, y - down * z, -y - down * z];
        outermost = [0, 1, 2, 3].map(|i| outermost[i].max(planes[i]));
        nearest = nearest.min(z);
    }
    let [east, west, north, south] = outermost;
    let mut ez = (-(east + west) / (2.0 * across)).min(-(north + south) / (2.0 * down));
    // A point is seen from as far as it is large: from one unit away.
    if nearest - ez <= 0.0 {
        ez = nearest - 1.0;
    }
    let (ex, ey) = ((east - west) / 2.0, (north - south) / 2.0);
    let eye = [0, 1, 2].map(|i| centre[i] + ex * right[i] + ey * top[i] + ez * forward[i]);
    // Looking at a point some way off rather than near keeps the direction's digits.
    let far = (nearest - ez).max(f64::MIN_POSITIVE);
    let target = [0, 1, 2].map(|i| eye[i] + far * forward[i]);
    Camera::new(eye, target, up, width, height)
}

/// The unit vector along the axis that points up.
pub(super) fn up_vector(up: UpAxis) -> Vec3 {
    match up {
        UpAxis::X => [1.0, 0.0, 0.0],
        UpAxis::Y => [0.0, 1.0, 0.0],
        UpAxis::Z => [0.0, 0.0, 1.0],
    }
}

pub(super) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The vector of unit length in that direction; zero stays zero.
pub(super) fn unit(a: Vec3) -> Vec3 {
    let largest = a.into_iter().map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 {
        return a;
    }
    let scaled = a.map(|c| c / largest);
    let length = dot(scaled, scaled).sqrt();
    scaled.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, procedural};

    fn mesh(name: &str) -> Mesh {
        let soup = procedural::soup(name).unwrap().unwrap();
        soup.into_mesh(name, &LoadOptions::default()).unwrap()
    }

    /// How far the vertices reach to the left, right, bottom and top of the image, of which each
    /// side is at -1 or 1.
    fn reach(camera: &Camera, mesh: &Mesh) -> [f64; 4] {
        let (w, h) = (camera.width() as usize, camera.height() as usize);
        let ray = |x: usize, y: usize| camera.ray(y * w + x).direction.map(f64::from);
        let eye = camera.ray(0).origin.map(f64::from);
        // Pixel centres: the image plane from three of them.
        let (corner, along, below) = (ray(0, 0), ray(w - 1, 0), ray(0, h - 1));
        let forward = unit([0, 1, 2].map(|i| along[i] + below[i]));
        let flat = |v: Vec3| v.map(|c| c / dot(v, forward));
        let (corner, along, below) = (flat(corner), flat(along), flat(below));
        let side = |to: Vec3| [0, 1, 2].map(|i| (to[i] - corner[i]) / 2.0);
        let (right, down) = (side(along), side(below));
        let mut reach = [0.0f64; 4];
        for p in &mesh.positions {
            let out = [0, 1, 2].map(|i| f64::from(p[i]) - eye[i]);
            assert!(dot(out, forward) > 0.0, "behind the eye");
            let (x, y) = (
                dot(flat(out), right) / dot(right, right),
                -dot(flat(out), down) / dot(down, down),
            );
            reach = [reach[0].max(-x), reach[1].max(x), reach[2].max(-y), reach[3].max(y)];
        }
        reach
    }

    #[test]
    fn every_vertex_is_in_view_and_two_opposite_sides_are_reached() {
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            for (width, height) in [(640, 480), (100, 300)] {
                let mesh = mesh("sphereflake:1");
                let [left, right, bottom, top] = reach(&close_up(&mesh, up, width, height), &mesh);
                let largest = left.max(right).max(bottom).max(top);
                // Measured between the centres of the outer pixels, which are within the image.
                assert!(largest < 0.98, "{largest}");
                assert!(left.min(right) > 0.92 || bottom.min(top) > 0.92, "{up:?} {width}");
            }
        }
    }

    #[test]
    fn scenes_without_extent_or_vertices_are_looked_at() {
        for case in procedural::degenerate::CASES {
            let mesh = mesh(&format!("degenerate/{}", case.name));
            for ray in close_up(&mesh, UpAxis::Y, 3, 2).rays() {
                assert_eq!(ray.check(0), Ok(()), "{}", case.name);
            }
        }
    }
}
