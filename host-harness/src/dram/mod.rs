//! DRAM, clock by clock: banks, rows, refresh, queues, channels and energy.
//!
//! - [`timing`]: the data sheets and the one table of rules between commands.
//! - [`device`]: what may be issued when; it holds no clock.
//! - [`Memory`]: channels with a controller each, as machines use them.
//! - [`config`]: the named memories; [`Energy`]: DRAMPower's equations.

pub mod config;
mod controller;
pub mod device;
pub mod energy;
mod mapping;
mod memory;
mod replay;
mod stats;
pub mod timing;

pub use config::{CONFIGS, Config, ControllerConfig};
pub use controller::Issued;
pub use device::Device;
pub use energy::Energy;
pub use mapping::{Mapping, REQUEST_BYTES};
pub use memory::{Memory, Request};
pub use replay::replay;
pub use stats::{ChannelStats, Stats};
