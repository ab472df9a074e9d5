//! A shaded picture, every ray of it traced by the core in fixed point.
//!
//! Matt clay under a key light with shadows and an open sky: a primary ray a sample (closest hit), a
//! ray to the light and some into the hemisphere (any hit). Only the light's arithmetic is in float.

use std::f64::consts::TAU;

use rayon::prelude::*;
use xylem_core::traverse::{self, Query, Scene, TraceError};

use super::Picture;
use super::colour::{Rgb, encode};
use super::view::{cross, dot, unit, up_vector};
use crate::bus::{FlatMemory, MemoryError};
use crate::scene::{Camera, GridRay, Mesh, Random, SceneRay, UpAxis, sampling};

/// What a shaded picture is made of.
#[derive(Debug)]
pub struct Shading<'a> {
    /// The mesh, for normals.
    pub mesh: &'a Mesh,
    /// The memory that holds the tree.
    pub memory: &'a FlatMemory,
    /// The tree and the triangles.
    pub scene: Scene,
    /// The view.
    pub camera: Camera,
    /// Which way the light comes from.
    pub up: UpAxis,
    /// Rays into the sky for each sample.
    pub sky_rays: u32,
}

type Vec3 = [f64; 3];

/// Light from the sky and reflected by the clay, in linear light.
const SKY: Vec3 = [0.46, 0.53, 0.64];
const SUN: Vec3 = [1.22, 1.10, 0.90];
const CLAY: Vec3 = [0.55, 0.50, 0.44];
/// The background at the bottom and at the top.
const BACKGROUND: [Vec3; 2] = [[0.36, 0.40, 0.46], [0.10, 0.14, 0.22]];

/// How large the light is: soft edges of shadows.
const SUN_RADIUS: f64 = 0.025;

/// How far a sky ray looks, as a share of the scene box's diagonal.
const SKY_REACH: f64 = 0.3;

impl Shading<'_> {
    /// Draws the picture on all threads and calls `row` for each finished row.
    ///
    /// # Errors
    /// The error of a ray that could not be traced.
    pub fn draw(&self, row: impl Fn() + Sync) -> Result<Picture, TraceError<MemoryError>> {
        let light = self.light();
        let (width, height) = (self.camera.width(), self.camera.height());
        let rows: Result<Vec<Vec<Rgb>>, _> = (0..height)
            .into_par_iter()
            .map(|y| {
                let pixels = (0..width).map(|x| self.pixel(y * width + x, &light)).collect();
                row();
                pixels
            })
            .collect();
        Ok(Picture::from_pixels(width, height, rows?.concat()))
    }

    fn pixel(&self, pixel: u32, light: &Light) -> Result<Rgb, TraceError<MemoryError>> {
        let samples = self.camera.rays_per_pixel() as usize;
        let mut sum = [0.0; 3];
        for sample in 0..samples {
            let colour = self.sample(pixel as usize * samples + sample, light)?;
            sum = [0, 1, 2].map(|i| sum[i] + colour[i]);
        }
        Ok(sum.map(|c| encode(c / samples as f64)))
    }

    fn sample(&self, index: usize, light: &Light) -> Result<Vec3, TraceError<MemoryError>> {
        let ray = self.camera.ray(index);
        let grid_ray = self.on_grid(&ray);
        let found = self.trace(&grid_ray, Query::Closest)?;
        let Some((hit, [a, b, c])) =
            found.and_then(|hit| Some((hit, self.mesh.corners(hit.primitive.0 as usize)?)))
        else {
            let row = index / self.camera.rays_per_pixel() as usize / self.camera.width() as usize;
            let t = row as f64 / f64::from(self.camera.height());
            return Ok([0, 1, 2].map(|i| BACKGROUND[0][i] * t + BACKGROUND[1][i] * (1.0 - t)));
        };
        let direction = wide(ray.direction);
        let (a, b, c) = (wide(a), wide(b), wide(c));
        let normal = unit(cross(minus(b, a), minus(c, a)));
        let normal = if dot(normal, direction) > 0.0 { normal.map(|c| -c) } else { normal };
        let lift = sampling::lift(&self.mesh.frame, a);
        let (u, v): (f64, f64) = (hit.u.to_num(), hit.v.to_num());
        let surface = along(along(a, u, minus(b, a)), v, minus(c, a));
        let start = along(surface, lift, normal).map(|c| c as f32);

        let pixel = index / self.camera.rays_per_pixel() as usize;
        let sample = index % self.camera.rays_per_pixel() as usize;
        let mut random = Random::stream(1, pixel as u64);
        let (turn, offset) = (random.unit(), random.unit());
        let blocked = |direction: Vec3, t_max: f64| {
            let direction = direction.map(|c| c as f32);
            let ray = SceneRay { origin: start, direction, t_min: 0.0, t_max: t_max as f32 };
            Ok(self.trace(&self.on_grid(&ray), Query::Any)?.is_some())
        };

        let rays = self.sky_rays * self.camera.rays_per_pixel();
        let mut open = 0u32;
        for i in 0..self.sky_rays {
            // A disc projected up to the hemisphere is cosine-weighted (Malley).
            let at = spiral(sample as u32 * self.sky_rays + i, rays, turn, offset);
            let up = (1.0 - at[0] * at[0] - at[1] * at[1]).max(0.0).sqrt();
            let direction = around(normal, at, up);
            open += u32::from(!blocked(direction, light.reach)?);
        }
        let open = if rays == 0 { 1.0 } else { f64::from(open) / f64::from(self.sky_rays) };

        let at = spiral(sample as u32, self.camera.rays_per_pixel(), offset, turn);
        let towards = unit(around(light.direction, at.map(|c| c * SUN_RADIUS), 1.0));
        let facing = dot(normal, towards);
        let lit = facing > 0.0 && !blocked(towards, f64::INFINITY)?;
        let sun = if lit { facing } else { 0.0 };
        // A little light from the camera gives form to what lies in the shade.
        let head = 0.12 * -dot(normal, direction);
        Ok([0, 1, 2].map(|i| CLAY[i] * (SKY[i] * open + SUN[i] * sun + head)))
    }

    fn on_grid(&self, ray: &SceneRay) -> GridRay {
        GridRay::new(&self.mesh.frame, ray)
    }

    fn trace(
        &self,
        ray: &GridRay,
        query: Query,
    ) -> Result<Option<traverse::Hit>, TraceError<MemoryError>> {
        let Some(ray) = ray.core() else { return Ok(None) };
        traverse::trace(&mut self.memory.snapshot(), &self.scene, ray, query, &mut ())
    }

    /// A light above the camera's left shoulder.
    fn light(&self) -> Light {
        let (width, height) = (self.camera.width(), self.camera.height());
        let middle = (height / 2 * width + width / 2) * self.camera.rays_per_pixel();
        let forward = wide(self.camera.ray(middle as usize).direction);
        let up = up_vector(self.up);
        let right = unit(cross(forward, up));
        let direction = [0, 1, 2].map(|i| 0.9 * up[i] - 0.75 * right[i] - 0.45 * forward[i]);
        let [low, high] = self.mesh.bounds().unwrap_or_default().map(wide);
        let diagonal = minus(high, low);
        Light { direction: unit(direction), reach: SKY_REACH * dot(diagonal, diagonal).sqrt() }
    }
}

struct Light {
    /// Towards the light.
    direction: Vec3,
    /// How far sky rays look, in scene units.
    reach: f64,
}

/// Point `i` of `count` points that are spread evenly over the unit disc (Vogel's spiral), turned
/// and shifted along by fractions of a turn and a step.
fn spiral(i: u32, count: u32, turn: f64, shift: f64) -> [f64; 2] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let radius = ((f64::from(i) + shift) / f64::from(count.max(1))).sqrt();
    let (sin, cos) = (TAU * (f64::from(i) * GOLDEN + turn)).sin_cos();
    [radius * cos, radius * sin]
}

/// A vector that has `up` along a unit vector and `at` across it.
fn around(axis: Vec3, at: [f64; 2], up: f64) -> Vec3 {
    let helper = if axis[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let side = unit(cross(helper, axis));
    let front = cross(axis, side);
    along(along(axis.map(|c| c * up), at[0], side), at[1], front)
}

/// `a + s b`.
fn along(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] + s * b[i])
}

fn wide(a: [f32; 3]) -> Vec3 {
    a.map(f64::from)
}

fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] - b[i])
}
