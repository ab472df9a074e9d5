//! Can these streams run on a programmable core (thesis §5.2)? The inner steps of building, tracing and
//! compressing as custom instructions of VexRiscv, measured beside the core's own software.
//!
//! The instructions are those of `fpga/rtl/xy_cfu.sv`. [`Cfu`] executes one: on the soft core by an instruction,
//! in co-simulation by the RTL alone. On it stand the same three steps that the software has:
//!
//! - [`CustomHeap`]: a match of the merge heap;
//! - [`CustomBoxTest`]: the box test, in the search of [`xylem_core::traverse`];
//! - [`CustomEncoder`]: the encoding of children, in the walk of [`xylem_core::compress`].
//!
//! [`measure`] runs each in both ways on a scene's own data and holds the results equal.
#![cfg_attr(target_arch = "riscv32", no_std)]
#![deny(unsafe_code)]

mod boxes;
mod cfu;
mod encode;
mod heap;
pub mod map;
pub mod measure;

pub use boxes::CustomBoxTest;
pub use cfu::{Cfu, Unit};
pub use encode::CustomEncoder;
pub use heap::{CustomHeap, MergeHeap};
