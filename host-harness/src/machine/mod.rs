//! One cycle model per hardware unit.
//!
//! A model has the name of its RTL unit, one `tick(inputs) -> outputs` per clock, and the same named
//! configurations. It adds *when* to what the core computes; co-simulation holds it equal to the RTL
//! in every output of every cycle.

pub mod heap;
