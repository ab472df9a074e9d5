//! What the workspace tests share.
//!
//! - [`places`]: where scenes and answers are found, which run is asked for, what is skipped.
//! - [`results`]: the record of long runs, `tests/RESULTS.md`.
//! - [`trees`]: one scene in every node format, and small random scenes.
//! - [`streams`]: ways of compressing, and equal hits in two trees.
//! - [`dram`]: request patterns for memories; [`commands`]: the rules of LPDDR3, written once more.
//! - [`job`]: a small job on any bus.
//! - [`rays`]: rays that are hard for box and triangle tests.
//! - [`planes`]: a ray against a box, exactly, in integers.
//! - [`rational`]: a ray against triangles, exactly, in fractions of any size.
//! - [`lbvh`]: the tree that a build must give, made top-down and recursively.

pub mod cases;
pub mod clocked;
pub mod commands;
pub mod dram;
pub mod job;
pub mod lbvh;
pub mod places;
pub mod planes;
pub mod rational;
pub mod rays;
pub mod results;
pub mod streams;
pub mod trees;
