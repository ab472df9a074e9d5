//! Runs Xylem's RTL, as Verilator compiles it, in lockstep with the cycle models of `xylem::machine`.
//!
//! - [`verilate`] turns a unit and a configuration into a shared library, at run time and once: the
//!   result is kept below the target directory under a hash of everything it depends on.
//! - [`rtl`] loads such a library: named pins of any width, clocked. It is the only module with
//!   `unsafe`.
//! - [`axi`] is the memory at a unit's AXI4 port, timed by a memory model of `xylem`.
//! - [`random`] draws what units are fed, from a seed.
//! - [`mod@bench`] clocks a unit and holds its outputs against a model's; [`types`] are its pins' bytes.
//! - One module a unit says what it is fed and compares every output of every cycle: [`heap`],
//!   [`mergesort`], [`emitter`], [`emit`], [`compress`], [`context`], [`traverser`], [`cfu`].
//! - [`table`] collects the cycles of both sides.
//! - [`custom`] runs VexRiscv with `xy_cfu`, and compares software, instructions and accelerator.
//! - [`top`] is the whole accelerator, for `xylem-driver`; [`jobs`] is what that gives it.
//!
//! The RTL is data to this crate, not part of its build: `cargo build` needs no Verilator.

#![deny(unsafe_code)]

pub mod axi;
pub mod bench;
pub mod cfu;
pub mod compress;
pub mod context;
pub mod custom;
pub mod emit;
pub mod emitter;
pub mod heap;
pub mod jobs;
pub mod mergesort;
pub mod random;
pub mod rtl;
pub mod table;
pub mod top;
pub mod traverser;
pub mod types;
pub mod verilate;

/// Whether the tools for `test` are there. If not, says that it is skipped.
///
/// # Panics
/// If they are missing and `XYLEM_REQUIRE_TOOLS` is set.
pub fn tools_for(test: &str) -> bool {
    let Err(missing) = verilate::tools() else { return true };
    assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{test}: {missing}");
    println!("skipped: {test}: {missing}");
    false
}
