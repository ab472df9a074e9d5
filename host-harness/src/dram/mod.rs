//! DRAM, clock by clock: banks, rows, refresh, queues, channels and energy.
//!
//! - [`timing`]: the data sheets and the one table of rules between commands.
//! - [`device`]: what may be issued when; it holds no clock.
//! - [`Memory`]: channels with a controller each, as machines use them. It holds no bytes: machines
//!   take those from a [`Bus`](xylem_core::mem::Bus) and the time from here.
//! - [`config`]: the named memories; [`Energy`]: DRAMPower's equations.
//! - [`replay`](replay()) and [`TraceFile`]: traces of requests without timestamps.
//!
//! # How far it is from other simulators
//!
//! The controller follows Ramulator 1's mechanism, not its figures. On one channel of LPDDR3-1600 and
//! the patterns of `tests/data/dram-reference.csv`, clocks and row hits, misses and conflicts are all
//! equal to Ramulator 1's, in six patterns of six. DRAMsim3 differs from both: it has other write and
//! turnaround timing (CWL 9, read to write 8, write to read 19 clocks), and its counts show fewer rows
//! opened twice.
//!
//! | pattern | clocks, here and Ramulator 1 | DRAMsim3 takes |
//! | --- | ---: | ---: |
//! | sequential reads | 1,121,278 | +0.1 % |
//! | sequential writes | 1,127,514 | +0.0 % |
//! | random 512-byte reads | 1,154,273 | −1.9 % |
//! | random 64-byte reads | 698,183 | +0.5 % |
//! | random merge streams | 2,718,790 | −9.1 % |
//! | alternating reads and writes | 1,272,283 | −5.2 % |
//!
//! Figures for other patterns, more channels and narrow channels have not been compared with any
//! other simulator. A narrow channel serves a request in bursts of its own; Ramulator would take a
//! request for one burst.

pub mod config;
mod controller;
pub mod device;
pub mod energy;
mod mapping;
mod memory;
mod queue;
mod replay;
mod stats;
pub mod timing;
mod trace;

pub use config::{CONFIGS, Config, ControllerConfig};
pub use controller::Issued;
pub use device::Device;
pub use energy::Energy;
pub use mapping::{Mapping, REQUEST_BYTES};
pub use memory::{Memory, Request};
pub use replay::replay;
pub use stats::{ChannelStats, Stats};
pub use trace::{TraceError, TraceFile};
