//! Cycle model of a job from its start to its report: RTL unit `xy_control` around a unit that works and
//! [`AxiPort`].
//!
//! | Part | Cycles |
//! |---|---|
//! | Check | one for every two regions, which are compared |
//! | Start | 1, in which the unit takes the job |
//! | Run | a build: those of [`mergetree::build`], and the one in which its end is seen |
//! | | a trace: those of [`traverser::run_within`], whose last one says so itself |
//! | Drain | until every line has its response, and the one in which that is seen |

use xylem_core::pipeline::BuildRegions;

use super::axi::AxiPort;
use super::config::MachineConfig;
use super::mergetree::{self, MachineError, MachineRun};
use super::port::{Port, PortError, Response};
use super::traverser::script::Records;
use super::traverser::{self, Stop, TraverserConfig, TraverserJob, TraverserRun};
use crate::bus::FlatMemory;

/// Regions that a job may name.
const REGIONS: u64 = 8;

/// Cycles of the check, if it finds nothing.
pub const CHECK_CYCLES: u64 = REGIONS * (REGIONS - 1) / 2;

/// Cycles in which a unit takes its job.
const START_CYCLES: u64 = 1;

/// What a job came to.
#[derive(Debug)]
pub struct JobRun<T> {
    /// What its unit did.
    pub unit: T,
    /// Whether memory did its part after that.
    pub drained: Result<(), Lost>,
    /// Cycles from the start of the job to its end, as its counter counts them.
    pub cycles: u64,
    /// Lines that were read.
    pub lines_read: u64,
}

/// A line that memory did not write, or not in time.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("at {addr:#x}: {error}")]
pub struct Lost {
    /// How.
    pub error: PortError,
    /// The line's first byte.
    pub addr: u32,
}

/// Runs a job as [`mergetree::build`] does, in front of `memory_port`, whose lines AXI4 brings.
pub fn build<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    regions: &BuildRegions,
    count: u32,
    memory_port: P,
) -> JobRun<Result<MachineRun, MachineError>> {
    let mut port = AxiPort::new(memory_port);
    let built = mergetree::build(config, memory, regions, count, &mut port);
    port.tick();
    end(built, port, config.time_out)
}

/// Runs a job as [`traverser::run_within`] does, in front of `memory_port`, whose lines AXI4 brings.
pub fn trace<P: Port>(
    config: TraverserConfig,
    memory: &mut FlatMemory,
    job: TraverserJob,
    memory_port: P,
    may: impl Fn(Option<Records>, u32) -> bool,
    time_out: u64,
) -> JobRun<(TraverserRun, Result<(), Stop>)> {
    let mut port = AxiPort::new(memory_port);
    let traced = traverser::run_within(config, memory, job, &mut port, may, time_out);
    end(traced, port, time_out)
}

/// Drains the port of a unit that has ended.
fn end<T, P: Port>(unit: T, mut port: AxiPort<P>, time_out: u64) -> JobRun<T> {
    let drained = drain(&mut port, time_out);
    let cycles = CHECK_CYCLES + START_CYCLES + port.cycles();
    JobRun { unit, drained, cycles, lines_read: port.lines_read() }
}

/// Lets what is under way come to its end, unless nothing moves for `time_out` cycles. The first error counts.
fn drain<P: Port>(port: &mut AxiPort<P>, time_out: u64) -> Result<(), Lost> {
    let mut drained = Ok(());
    port.forget_time();
    loop {
        if let Some(Response { access, failed: true }) = port.take() {
            let error = if access.write { PortError::Write } else { PortError::Read };
            drained = drained.and(Err(Lost { error, addr: access.addr }));
        }
        let timed_out = port.waited() >= Some(time_out);
        if let (true, Some(addr)) = (timed_out, port.waits_for()) {
            drained = drained.and(Err(Lost { error: PortError::TimeOut, addr }));
        }
        let ended = timed_out || port.is_idle();
        port.tick();
        if ended {
            return drained;
        }
    }
}
