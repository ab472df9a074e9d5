//! A shaded picture, every ray of it traced by the core in fixed point.
//!
//! Matt clay under a key light with shadows and an open sky: a primary ray a sample (closest hit), a
//! ray to the light and some into the hemisphere (any hit). Only the light's arithmetic is in float.

use rayon::prelude::*;
use xylem_core::traverse::{self, Query, Scene, TraceError};

use super::Picture;
use super::colour::{Rgb, encode};
use super::view::{cross, dot, unit, up_vector};
use crate::bus::{FlatMemory, MemoryError};
use crate::scene::{Camera, GridRay, Mesh, SceneRay, UpAxis, sampling};

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
        let answer = grid_ray.hit(Some(&hit));

        let mut open = 0;
        let seed = index * self.sky_rays as usize;
        for i in 0..self.sky_rays as usize {
            if let Some(sky) = sampling::bounce(self.mesh, &ray, &answer, 1, seed + i) {
                let sky = SceneRay { t_max: light.reach as f32, ..sky };
                open += u32::from(self.trace(&self.on_grid(&sky), Query::Any)?.is_none());
            }
        }
        let open = if self.sky_rays == 0 { 1.0 } else { f64::from(open) / f64::from(self.sky_rays) };

        let facing = dot(normal, light.direction);
        let mut sun = 0.0;
        // The bounce gives the point off the surface that a shadow ray starts from, too.
        if facing > 0.0
            && let Some(start) = sampling::bounce(self.mesh, &ray, &answer, 1, index)
        {
            let shadow = SceneRay { direction: light.direction.map(|c| c as f32), ..start };
            if self.trace(&self.on_grid(&shadow), Query::Any)?.is_none() {
                sun = facing;
            }
        }
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

fn wide(a: [f32; 3]) -> Vec3 {
    a.map(f64::from)
}

fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|i| a[i] - b[i])
}
