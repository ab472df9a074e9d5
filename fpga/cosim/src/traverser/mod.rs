//! The traversal unit and its parts: what they are fed, and the lockstep with the model.

pub mod geometry;
pub mod lockstep;
pub mod parts;
pub mod scenes;

use std::path::PathBuf;

use xylem::machine::traverser::TraverserConfig;

use crate::verilate::{self, CosimError, Mutation, Unit};

/// Builds the unit in `config`, with a fault if `mutation` says so, and returns the library's path.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(config: TraverserConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let unit = Unit {
        top: "xy_traverser",
        files: "traverser.f",
        config: config.name,
        parameters: &[
            ("Depth", config.depth.into()),
            ("CacheWidth", config.cache_width.into()),
            ("CacheBlock", config.cache_block.into()),
        ],
    };
    verilate::unit(&unit, mutation)
}

/// Builds one of the unit's modules, with a fault if `mutation` says so, and returns the library's path.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build_part(top: &'static str, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    verilate::unit(&Unit { top, files: "traverser.f", config: "part", parameters: &[] }, mutation)
}
