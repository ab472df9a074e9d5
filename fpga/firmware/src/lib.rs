//! The soft core's job: build, compress and trace a scene that lies in memory, and digest every
//! output.
//!
//! This crate is the job without a machine under it. The binary beside it runs the job on a RISC-V
//! core; the host runs the same code on its own memory and compares.
//!
//! - [`map`]: where things are in the soft core's address space.
//! - [`blob`]: the scene as the host lays it down in memory.
//! - [`job`]: the work itself; [`animation`]: the same for triangles that move; [`layout`]: where they
//!   put their outputs.
//! - [`accelerator`]: the same job by the accelerator, compared; [`accelerated`]: what came of that.
//! - [`report`]: what it found, in numbers, and the bytes that carry them to the host.
#![no_std]
#![forbid(unsafe_code)]

pub mod accelerated;
pub mod accelerator;
pub mod animation;
pub mod blob;
pub mod digest;
pub mod job;
pub mod layout;
pub mod map;
pub mod report;
mod stages;
