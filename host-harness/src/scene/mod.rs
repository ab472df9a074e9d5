//! Meshes, grids, rays and procedural scenes: everything between a user's floats and the core's
//! integers.
//!
//! - [`frame`]: the cubic grid laid over the scene box; vertices are snapped to it.
//! - [`mesh`]: a loaded mesh, on the grid for the core and in f32 for pictures.
//! - [`obj`]: Wavefront OBJ, plain or gzipped.
//! - [`find`]: where a scene's name is looked for.
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

pub mod convert;
pub mod error;
pub mod find;
pub mod frame;
pub mod mesh;
pub mod obj;
pub mod rays;

pub use convert::{ConversionCounts, GridRay, TimeMap};
pub use error::SceneError;
pub use frame::SceneFrame;
pub use mesh::{LoadOptions, Mesh};
pub use rays::{Hit, SceneRay};

/// Loads the scene that a path or a name stands for; see [`find`] for where it is looked for.
///
/// # Errors
/// [`SceneError`] when there is no such scene or it cannot be put on the grid.
pub fn load(name_or_path: &str, options: &LoadOptions) -> Result<Mesh, SceneError> {
    let path = find::Library::default().find(name_or_path)?;
    obj::load(&path, options)
}
