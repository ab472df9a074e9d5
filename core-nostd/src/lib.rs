//! BVH building, streaming compression and ray traversal in fixed point, for hardware and for the
//! soft core beside it.
//!
//! This crate states *what* is computed, once: the host harness, the firmware, the cycle models and
//! the RTL all answer to it. It has no clock, no allocation, no floating point and no unsafe code,
//! and gives the same bits on every machine.
#![no_std]
#![forbid(unsafe_code)]

pub mod compress;
pub mod emit;
pub mod error;
pub mod geom;
pub mod mem;
pub mod node;
pub mod num;
pub mod pipeline;
pub mod probe;
pub mod quality;
pub mod sort;
pub mod traverse;
