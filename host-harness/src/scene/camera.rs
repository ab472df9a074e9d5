//! A pinhole camera and its rays.

use super::random::Random;
use super::rays::SceneRay;
use super::vec3::{Vec3, along, cross, dot, narrow, normalize, sub, tangents, widen};

/// The axis that points up in a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum UpAxis {
    /// +x.
    X,
    /// +y, as in most scanned models.
    #[default]
    Y,
    /// +z, as in most CAD models.
    Z,
}

/// A pinhole camera.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Camera {
    eye: Vec3,
    /// Towards the centre of the image; unit length.
    forward: Vec3,
    /// Half an image width to the right, at distance 1.
    right: Vec3,
    /// Half an image height up, at distance 1.
    up: Vec3,
    width: u32,
    height: u32,
    strata: u32,
    seed: u64,
}

/// Half the vertical field of view, as a tangent: 40 degrees in all.
const HALF_HEIGHT: f64 = 0.363_970_234_266_202_4;

impl Camera {
    /// A camera that has the whole box from `low` to `high` in view, from the front, a little from
    /// above and from the right. One ray a pixel, through its middle.
    ///
    /// `width` and `height` are in pixels; at least 1 each is taken.
    pub fn framing([low, high]: [[f32; 3]; 2], up: UpAxis, width: u32, height: u32) -> Self {
        let (low, high) = (widen(low), widen(high));
        let centre = [0, 1, 2].map(|i| low[i] + (high[i] - low[i]) / 2.0);
        // With y up, the front is +z; the other axes follow by rotating the names.
        let from = match up {
            UpAxis::Y => [0.45, 0.35, 1.0],
            UpAxis::Z => [0.45, -1.0, 0.35],
            UpAxis::X => [0.35, 1.0, 0.45],
        };
        let from = normalize(from);
        let camera = Self::new(centre, along(centre, -1.0, from), up, width, height);
        // Step back until every corner is inside the image.
        let mut distance = 0.0f64;
        for corner in 0..8 {
            let corner = [0, 1, 2].map(|i| if corner >> i & 1 == 1 { high[i] } else { low[i] });
            let out = sub(corner, centre);
            for side in [camera.right, camera.up] {
                let across = dot(out, side).abs() / dot(side, side);
                distance = distance.max(across - dot(out, camera.forward));
            }
        }
        // A scene that is a point is seen from one unit away.
        let distance = if distance > 0.0 { distance * 1.05 } else { 1.0 };
        Self { eye: along(centre, distance, from), ..camera }
    }

    /// A camera at `eye` that looks at `target` with a vertical field of view of 40 degrees. One ray
    /// a pixel, through its middle.
    pub fn new(eye: [f64; 3], target: [f64; 3], up: UpAxis, width: u32, height: u32) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let vertical = match up {
            UpAxis::X => [1.0, 0.0, 0.0],
            UpAxis::Y => [0.0, 1.0, 0.0],
            UpAxis::Z => [0.0, 0.0, 1.0],
        };
        let forward = match normalize(sub(target, eye)) {
            [0.0, 0.0, 0.0] => [0.0, 0.0, -1.0],
            forward => forward,
        };
        let right = match normalize(cross(forward, vertical)) {
            // Looking straight up or down: any right will do.
            [0.0, 0.0, 0.0] => tangents(forward)[0],
            right => right,
        };
        let up = cross(right, forward).map(|c| c * HALF_HEIGHT);
        let right = right.map(|c| c * HALF_HEIGHT * f64::from(width) / f64::from(height));
        Self { eye, forward, right, up, width, height, strata: 1, seed: 0 }
    }

    /// The same view with `strata` × `strata` rays a pixel, each at a random place in its own part of
    /// the pixel; the places depend on `seed` and the pixel alone. One stratum is the pixel's middle.
    pub fn with_strata(self, strata: u32, seed: u64) -> Self {
        Self { strata: strata.max(1), seed, ..self }
    }

    /// Width of the image in pixels.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Height of the image in pixels.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Rays a pixel.
    pub const fn rays_per_pixel(&self) -> u32 {
        self.strata * self.strata
    }

    /// Rays of the whole image.
    pub const fn len(&self) -> usize {
        self.width as usize * self.height as usize * self.rays_per_pixel() as usize
    }

    /// Whether there are no rays; never so.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ray `index` of [`Self::len`]: all rays of the first pixel, of the next in its row, and so on
    /// from the top row down. Its direction has unit length, its interval is all of `t > 0`.
    pub fn ray(&self, index: usize) -> SceneRay {
        let (pixel, sample) =
            (index / self.rays_per_pixel() as usize, index as u32 % self.rays_per_pixel());
        let (x, y) = (pixel % self.width as usize, pixel / self.width as usize);
        let (mut dx, mut dy) = (0.5, 0.5);
        if self.strata > 1 {
            let mut random = Random::stream(self.seed, index as u64);
            dx = (f64::from(sample % self.strata) + random.unit()) / f64::from(self.strata);
            dy = (f64::from(sample / self.strata) + random.unit()) / f64::from(self.strata);
        }
        let across = 2.0 * (x as f64 + dx) / f64::from(self.width) - 1.0;
        let down = 2.0 * (y as f64 + dy) / f64::from(self.height) - 1.0;
        let direction = along(along(self.forward, across, self.right), -down, self.up);
        SceneRay {
            origin: narrow(self.eye),
            direction: narrow(normalize(direction)),
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// All rays, in order.
    pub fn rays(&self) -> Vec<SceneRay> {
        (0..self.len()).map(|index| self.ray(index)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: [[f32; 3]; 2] = [[-1.0, 0.0, 2.0], [3.0, 5.0, 4.0]];

    /// Where a point is in the image, from -1 to 1 across and up.
    fn project(camera: &Camera, point: Vec3) -> [f64; 2] {
        let out = sub(point, camera.eye);
        let depth = dot(out, camera.forward);
        [camera.right, camera.up].map(|side| dot(out, side) / dot(side, side) / depth)
    }

    #[test]
    fn the_whole_box_is_in_view_and_fills_it() {
        for up in [UpAxis::X, UpAxis::Y, UpAxis::Z] {
            for (width, height) in [(640, 480), (100, 300), (7, 1)] {
                let camera = Camera::framing(BOX, up, width, height);
                let mut reach = 0.0f64;
                for corner in 0..8usize {
                    let at = [0, 1, 2].map(|i| f64::from(BOX[corner >> i & 1][i]));
                    let [x, y] = project(&camera, at);
                    assert!(x.abs() <= 1.0 && y.abs() <= 1.0, "{up:?} {width}x{height}: {x} {y}");
                    reach = reach.max(x.abs()).max(y.abs());
                }
                assert!(reach > 0.8, "{up:?} {width}x{height}: {reach}");
            }
        }
    }

    #[test]
    fn rays_go_through_their_pixels_from_the_top_left() {
        let camera = Camera::framing(BOX, UpAxis::Y, 4, 2);
        assert_eq!(camera.len(), 8);
        let at =
            |index| project(&camera, along(camera.eye, 10.0, widen(camera.ray(index).direction)));
        for (index, x, y) in [(0, -0.75, 0.5), (3, 0.75, 0.5), (4, -0.75, -0.5), (7, 0.75, -0.5)] {
            let [px, py] = at(index);
            assert!((px - x).abs() < 1e-6 && (py - y).abs() < 1e-6, "{index}: {px} {py}");
        }
    }

    #[test]
    fn strata_stay_in_their_part_of_the_pixel_and_repeat() {
        let camera = Camera::framing(BOX, UpAxis::Z, 3, 3).with_strata(4, 11);
        assert_eq!(camera.len(), 9 * 16);
        for index in 0..camera.len() {
            let ray = camera.ray(index);
            assert_eq!(ray, camera.ray(index));
            let [x, y] = project(&camera, along(camera.eye, 10.0, widen(ray.direction)));
            let (pixel, sample) = (index / 16, index % 16);
            let column = (x + 1.0) / 2.0 * 12.0;
            let row = (1.0 - y) / 2.0 * 12.0;
            let expect = (pixel % 3 * 4 + sample % 4, pixel / 3 * 4 + sample / 4);
            // A ray may be rounded across its edge by a hair.
            assert!((column - expect.0 as f64 - 0.5).abs() < 0.5001, "{index}: {column}");
            assert!((row - expect.1 as f64 - 0.5).abs() < 0.5001, "{index}: {row}");
        }
        let other = camera.with_strata(4, 12);
        assert_ne!(camera.ray(0), other.ray(0));
    }

    #[test]
    fn scenes_without_extent_and_views_along_the_vertical_have_rays() {
        for [low, high] in [[[5.0; 3]; 2], [[0.0; 3], [1e30; 3]], [[0.0; 3], [1e-30; 3]]] {
            for ray in Camera::framing([low, high], UpAxis::Y, 2, 2).rays() {
                assert_eq!(ray.check(0), Ok(()));
            }
        }
        let down = Camera::new([0.0, 5.0, 0.0], [0.0; 3], UpAxis::Y, 1, 1);
        assert_eq!(down.ray(0).direction, [0.0, -1.0, 0.0]);
    }
}
