//! One cycle model per hardware unit, and the assembled machines.
//!
//! A model has the name of its RTL unit, one `tick(inputs) -> outputs` per clock, and the same named
//! configurations. It adds *when* to what the core computes; co-simulation holds it equal to the RTL
//! in every output of every cycle.
//!
//! [`mergetree::build`] is the whole builder: [`reader`], [`sorter`], [`multimerge`] around [`heap`],
//! [`emit`] or [`compress`], and [`writer`], behind a [`port`] to the memory model of [`crate::dram`]; [`job`]
//! puts the accelerator's control and its [`axi`] port around it. Emitters and
//! top-level builders without a unit of their own run from [`tape`]. [`traverser`] traces rays.

pub mod activity;
pub mod axi;
pub mod compress;
pub mod compressor;
pub mod config;
pub mod emit;
pub mod emitter;
pub mod fault;
pub mod heap;
pub mod job;
pub mod mergetree;
pub mod multimerge;
pub mod player;
pub mod ploc;
pub mod port;
pub mod reader;
pub mod sorter;
mod tail;
pub mod tape;
pub mod topdown;
pub mod toplevel;
pub mod traverser;
pub mod writer;
