//! A whole job against a memory model.

use super::script::Records;
use super::{Traverser, TraverserConfig, TraverserError, TraverserInputs, TraverserJob};
use crate::bus::FlatMemory;
use crate::machine::port::{Access, Port, PortError};

/// What a job came to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct TraverserRun {
    /// Cycles from the one after its start to its last one.
    pub cycles: u64,
    /// Rays that hit something.
    pub hits: u32,
    /// Nodes fetched.
    pub nodes: u64,
    /// Boxes tested.
    pub box_tests: u64,
    /// Triangles tested.
    pub triangle_tests: u64,
    /// Lines read.
    pub reads: u64,
    /// Lines written, whole or in part.
    pub writes: u64,
    /// Bytes of them.
    pub write_bytes: u64,
}

/// Why a job came to no good end.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Stop {
    /// The unit reports it.
    #[error("{0}")]
    Unit(#[from] TraverserError),
    /// A line that it may not touch was asked for, or was to be written where `records` is none.
    #[error("the line at {addr:#x} is outside of its region")]
    Outside {
        /// What was to be read.
        records: Option<Records>,
        /// The line's first byte.
        addr: u32,
    },
    /// Memory went wrong.
    #[error("at {addr:#x}: {error}")]
    Port {
        /// How.
        error: PortError,
        /// The line's first byte.
        addr: u32,
    },
}

/// Runs `job` to its end; hit records go to `memory`.
///
/// # Errors
/// [`Stop`]: what the unit reports, or memory.
pub fn run(
    config: TraverserConfig,
    memory: &mut FlatMemory,
    job: TraverserJob,
    port: &mut impl Port,
) -> Result<TraverserRun, Stop> {
    let (run, result) = run_within(config, memory, job, port, |_, _| true, u64::MAX);
    result.map(|()| run)
}

/// Runs `job` to its end like [`run`]. Lines that `may` refuses, told what they are read for
/// or `None` for those of hits, are not touched and end it, as do memory's errors and `time_out` cycles in
/// which memory owes something and nothing moves; they are the port's, where it counts them.
///
/// Gives what was done in any case, and why it ended early if it did.
pub fn run_within(
    config: TraverserConfig,
    memory: &mut FlatMemory,
    job: TraverserJob,
    port: &mut impl Port,
    may: impl Fn(Option<Records>, u32) -> bool,
    time_out: u64,
) -> (TraverserRun, Result<(), Stop>) {
    let mut run = TraverserRun::default();
    let mut written = Vec::new();
    let mut unit = Traverser::new(config, memory, job);
    let (mut asked, mut still) = (None, 0);
    let mut result = Ok(());
    while result.is_ok() && !unit.is_done() {
        // The port is asked before the unit, with what it shows in this cycle.
        let (read, write) = unit.shown();
        let records = unit.reads();
        let outside = read.map(|addr| (records, addr)).filter(|(of, addr)| !may(*of, *addr));
        let outside =
            outside.or(write.map(|line| (None, line.addr)).filter(|(_, a)| !may(None, *a)));
        if let Some((records, addr)) = outside {
            result = Err(Stop::Outside { records, addr });
        }
        let legal = outside.is_none();
        let mut offer = |addr, write| legal && port.offer(Access { addr, write, tag: 0 });
        let read_ready = read.is_some_and(|addr| offer(addr, false));
        let write_ready = write.is_some_and(|line| offer(line.addr, true));
        let response = port.take();
        if let Some(response) = response.filter(|response| response.failed) {
            let Access { addr, write, .. } = response.access;
            let error = if write { PortError::Write } else { PortError::Read };
            result = Err(Stop::Port { error, addr });
        }
        let response = response.is_some_and(|response| !response.failed);
        if read_ready {
            asked = read;
        } else if response {
            asked = None;
        }
        let owed = asked.or(read).or(write.map(|line| line.addr));
        still = if read_ready || write_ready || response { 0 } else { still + 1 };
        let late = port.waited().map_or(still > time_out, |waited| waited >= time_out);
        if let (Some(addr), true, true) = (owed, late, result.is_ok()) {
            result = Err(Stop::Port { error: PortError::TimeOut, addr });
        } else if owed.is_none() {
            still = 0;
        }
        let out = unit.tick(&TraverserInputs { read_ready, response, write_ready });
        run.cycles += 1;
        run.nodes += u64::from(out.node_fetch);
        run.box_tests += u64::from(out.box_test);
        run.triangle_tests += u64::from(out.triangle_test);
        run.reads += u64::from(read_ready);
        if let Some(line) = out.write.filter(|_| write_ready) {
            run.writes += 1;
            run.write_bytes += 8 * u64::from(line.words.count_ones());
            written.push(line);
        }
        run.hits = out.hits;
        if let (Some(error), true) = (out.error, unit.is_done()) {
            result = result.and(Err(Stop::Unit(error)));
        }
        port.tick();
    }
    for line in written {
        for word in (0..8).filter(|word| line.words >> word & 1 == 1) {
            let at = line.addr as usize + 8 * word;
            if let Some(bytes) = memory.bytes_mut().get_mut(at..at + 8) {
                bytes.copy_from_slice(&line.data[8 * word..8 * word + 8]);
            }
        }
    }
    (run, result)
}
