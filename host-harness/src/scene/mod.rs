//! Meshes, grids, rays and procedural scenes.
