//! Simulated memory behind the core's [`Bus`](xylem_core::mem::Bus).
//!
//! [`FlatMemory`] holds the bytes. The others wrap any bus: [`Metered`] counts traffic by stage and
//! region and adds modelled cycles, [`Faulty`] fails on purpose.

mod faulty;
mod flat;
mod metered;

pub use faulty::{Fault, Faulty, FaultyError};
pub use flat::{FlatMemory, MemoryError, Snapshot};
pub use metered::{MEMORIES, MemoryTiming, Metered, StageClock, Tally, Traffic};
