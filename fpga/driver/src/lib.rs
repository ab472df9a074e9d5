//! Driver for the Xylem accelerator: builds, compresses and traces trees in hardware.
//!
//! Three layers:
//! - **Access** ([`RegisterAccess`]): 32-bit registers by offset, over memory-mapped I/O ([`Mmio`])
//!   or over SPI ([`Spi`], with its framing in [`spi`]). Offsets and fields come from `xylem-regs`,
//!   which is generated from the same source as the hardware's register block.
//! - **Jobs** ([`BuildJob`], [`CompressJob`], [`TraceJob`]): what to do, in the types of
//!   `xylem-core`. A job is checked against the accelerator's [`Capabilities`] and its regions
//!   against each other before the first register is written: a refused job changes nothing.
//! - **Device** ([`Xylem`]): [`probe`](Xylem::probe), start, [`wait`](Xylem::wait) on the interrupt
//!   line or by polling ([`NoInterrupt`]), read the result and the [`Counters`].
//!
//! Each operation has its own error. A time-out is an error that says what the accelerator was
//! doing; after one, wait again, [`abort`](Xylem::abort) or [`reset`](Xylem::reset).
//!
//! The driver moves registers only. Primitives, nodes and rays are in memory that both sides see;
//! where the processor caches that memory, clean and invalidate it around a job.
//!
//! # Example
//!
//! A build over any bus, with any delay and interrupt line:
//!
//! ```
//! use embedded_hal::{delay::DelayNs, digital::InputPin};
//! use xylem_core::{
//!     mem::Region,
//!     node::Tree,
//!     num::MortonWidth,
//!     pipeline::BuildRegions,
//!     sort::{InputFormat, RecordFormat},
//! };
//! use xylem_driver::{BuildJob, Micros, RegisterAccess, Xylem};
//!
//! fn build<R, D, I>(regs: R, delay: D, interrupt: I) -> Result<Tree, Box<dyn std::error::Error>>
//! where
//!     R: RegisterAccess<Error: 'static>,
//!     D: DelayNs,
//!     I: InputPin<Error: 'static>,
//! {
//!     let mut xylem = Xylem::probe(regs, delay, interrupt)?;
//!     let job = BuildJob {
//!         regions: BuildRegions {
//!             primitives: Region::new(0x8010_0000, 32 * 1024),
//!             runs_a: Region::new(0x8020_0000, 32 * 1024),
//!             nodes: Region::new(0x8030_0000, 64 * 1024),
//!             leaf_table: Region::new(0x8040_0000, 4 * 1024),
//!             ..BuildRegions::default()
//!         },
//!         count: 1024,
//!         input: InputFormat::Box32,
//!         record: RecordFormat::Box32,
//!         morton: MortonWidth::Bits30,
//!         max_leaf_size: 255,
//!         compressed: None,
//!     };
//!     xylem.start_build(&job)?;
//!     xylem.wait(Micros(1_000_000))?;
//!     Ok(xylem.built_tree(&job)?)
//! }
//! ```
//!
//! On a soft core whose accelerator is at `0x4000_0000`, without an interrupt line:
//!
//! ```no_run
//! use core::ptr::NonNull;
//! use xylem_driver::{Mmio, NoInterrupt, Xylem};
//!
//! # fn delay() -> impl embedded_hal::delay::DelayNs { embedded_hal_mock::eh1::delay::NoopDelay }
//! let base = NonNull::new(0x4000_0000 as *mut u32).expect("not null");
//! // SAFETY: the board has the register map there, and nothing else uses it.
//! let regs = unsafe { Mmio::new(base) };
//! let xylem = Xylem::probe(regs, delay(), NoInterrupt)?;
//! # Ok::<(), xylem_driver::ProbeError<xylem_driver::OffsetError>>(())
//! ```
#![no_std]
#![deny(unsafe_code)] // `mmio` allows it, with its reasons; `forbid` would not let it.

mod access;
mod config;
mod counters;
mod device;
mod error;
mod job;
mod mmio;
pub mod spi;
mod wait;

pub use access::{OffsetError, RegisterAccess};
pub use config::ConfigError;
pub use counters::{Counters, CountersError};
pub use device::{Capabilities, MapVersion, Xylem};
pub use error::{JobError, ProbeError, ResultError, StartError, StopError, WaitError};
pub use job::{BuildJob, CompressJob, Compression, TraceJob};
pub use mmio::Mmio;
pub use spi::{Spi, SpiError};
pub use wait::{Completion, Micros, NoInterrupt};
