//! Runs Xylem's RTL, as Verilator compiles it, in lockstep with the cycle models of `xylem::machine`.
//!
//! - [`verilate`] turns a unit and a configuration into a shared library, at run time and once: the
//!   result is kept below the target directory under a hash of everything it depends on.
//! - [`rtl`] loads such a library. It is the only module with `unsafe`.
//! - [`traffic`] draws what a unit is fed, from a seed.
//! - [`lockstep`] feeds both sides and compares every output of every cycle.
//!
//! The RTL is data to this crate, not part of its build: `cargo build` needs no Verilator.

#![deny(unsafe_code)]

pub mod lockstep;
pub mod rtl;
pub mod traffic;
pub mod verilate;
