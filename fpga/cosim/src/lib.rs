//! Runs Xylem's RTL, as Verilator compiles it, in lockstep with the cycle models of `xylem::machine`.
//!
//! - [`verilate`] turns a unit and a configuration into a shared library, at run time and once: the
//!   result is kept below the target directory under a hash of everything it depends on.
//! - [`rtl`] loads such a library: named pins of any width, clocked. It is the only module with
//!   `unsafe`.
//! - [`random`] draws what units are fed, from a seed.
//! - One module a unit says what it is fed and compares every output of every cycle: [`heap`].
//!
//! The RTL is data to this crate, not part of its build: `cargo build` needs no Verilator.

#![deny(unsafe_code)]

pub mod heap;
pub mod random;
pub mod rtl;
pub mod verilate;
