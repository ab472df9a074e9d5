//! Cycle model of a build job from its start to its report: RTL unit `xy_control` around the builder and
//! [`AxiPort`].
//!
//! | Part | Cycles |
//! |---|---|
//! | Check | one for every two regions, which are compared |
//! | Start | 1, in which the builder takes the job |
//! | Run | those of [`mergetree::build`], and the one in which its end is seen |
//! | Drain | until every line written has its response, and the one in which that is seen |

use xylem_core::pipeline::BuildRegions;

use super::axi::AxiPort;
use super::config::MachineConfig;
use super::mergetree::{self, MachineError, MachineRun};
use super::port::Port;
use crate::bus::FlatMemory;

/// Regions that a job may name.
const REGIONS: u64 = 8;

/// Cycles of the check, if it finds nothing.
pub const CHECK_CYCLES: u64 = REGIONS * (REGIONS - 1) / 2;

/// Cycles in which a builder takes its job.
const START_CYCLES: u64 = 1;

/// What a job came to.
#[derive(Debug)]
pub struct JobRun {
    /// What the builder did.
    pub built: Result<MachineRun, MachineError>,
    /// Cycles from the start of the job to its end, as its counter counts them.
    pub cycles: u64,
    /// Lines that were read.
    pub lines_read: u64,
}

/// Runs a job as [`mergetree::build`] does, in front of `memory_port`, whose lines AXI4 brings.
pub fn build<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    regions: &BuildRegions,
    count: u32,
    memory_port: P,
) -> JobRun {
    let mut port = AxiPort::new(memory_port);
    let built = mergetree::build(config, memory, regions, count, &mut port);
    port.tick();
    drain(&mut port, config.time_out);
    let cycles = CHECK_CYCLES + START_CYCLES + port.cycles();
    JobRun { built, cycles, lines_read: port.lines_read() }
}

/// Lets what is under way come to its end, unless that takes `time_out` cycles.
fn drain<P: Port>(port: &mut AxiPort<P>, time_out: u64) {
    for _ in 0..time_out {
        port.take();
        let ended = port.is_idle();
        port.tick();
        if ended {
            break;
        }
    }
}
