//! Meshes, grids, rays and procedural scenes: everything between a user's floats and the core's
//! integers.
//!
//! - [`frame`]: the cubic grid laid over the scene box; vertices are snapped to it.
//! - [`mesh`]: a loaded mesh, on the grid for the core and in f32 for pictures.
//! - [`obj`]: Wavefront OBJ, plain or gzipped.
//! - [`find`]: where a scene's name is looked for.
//! - [`camera`], [`sampling`]: rays of a pinhole view, diffuse bounces, and rays that are hard.
//! - [`procedural`]: scenes that are computed.
//! - [`manifest`]: every scene with its source, licence and hash.
//! - [`rays`]: rays and hits in scene units and their files.
//! - [`convert`]: a scene ray as the core's fixed-point ray, and its times back.
//! - [`error`]: what can be wrong with any of them.
//!
//! [`load`] is the front door:
//!
//! ```no_run
//! use xylem::scene::{self, LoadOptions};
//!
//! let bunny = scene::load("bunny", &LoadOptions::default())?;
//! println!("{} triangles, one grid unit is {}", bunny.triangles.len(), bunny.frame.cell());
//! # Ok::<(), scene::SceneError>(())
//! ```

pub mod animation;
pub mod camera;
pub mod convert;
pub mod error;
pub mod find;
pub mod frame;
pub mod manifest;
pub mod mesh;
pub mod obj;
pub mod procedural;
mod random;
pub mod rays;
pub mod sampling;
mod vec3;

pub use animation::{Animation, Movement};
pub use camera::{Camera, UpAxis};
pub use convert::{ConversionCounts, GridRay, TimeMap};
pub use error::SceneError;
pub use frame::SceneFrame;
pub use mesh::{LoadOptions, Mesh};
pub use random::Random;
pub use rays::{Hit, SceneRay};

/// Loads the scene that a path or a name stands for: a file where [`find`] looks for one, else a
/// [`procedural`] scene.
///
/// # Errors
/// [`SceneError`] when there is no such scene or it cannot be put on the grid.
pub fn load(name_or_path: &str, options: &LoadOptions) -> Result<Mesh, SceneError> {
    match find::Library::default().find(name_or_path)? {
        find::Found::File(path) => obj::load(&path, options),
        find::Found::Procedural(soup) => soup.into_mesh(name_or_path, options),
    }
}
