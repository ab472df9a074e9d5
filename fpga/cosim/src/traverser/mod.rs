//! The traversal unit and its parts: what they are fed.

pub mod geometry;

use std::path::PathBuf;

use crate::verilate::{self, CosimError, Mutation, Unit};

/// Builds one of the traversal unit's modules, with a fault if `mutation` says so, and returns the
/// library's path.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build_part(top: &'static str, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    verilate::unit(&Unit { top, files: "traverser.f", config: "part", parameters: &[] }, mutation)
}
