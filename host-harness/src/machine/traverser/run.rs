//! A whole job against a memory model.

use super::{Traverser, TraverserConfig, TraverserError, TraverserInputs, TraverserJob};
use crate::bus::FlatMemory;
use crate::machine::port::{Access, Port};

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
}

/// Runs `job` to its end; hit records go to `memory`.
///
/// # Errors
/// What the unit reports.
pub fn run(
    config: TraverserConfig,
    memory: &mut FlatMemory,
    job: TraverserJob,
    port: &mut impl Port,
) -> Result<TraverserRun, TraverserError> {
    let mut run = TraverserRun::default();
    let mut written = Vec::new();
    let mut unit = Traverser::new(config, memory, job);
    let mut last = None;
    while !unit.is_done() {
        // The port is asked before the unit, with what it shows in this cycle.
        let shown = unit.shown();
        let offer = |port: &mut _, addr, write| Port::offer(port, Access { addr, write, tag: 0 });
        let inputs = TraverserInputs {
            read_ready: shown.0.is_some_and(|addr| offer(port, addr, false)),
            response: port.take().is_some(),
            write_ready: shown.1.is_some_and(|line| offer(port, line.addr, true)),
        };
        let out = unit.tick(&inputs);
        run.cycles += 1;
        run.nodes += u64::from(out.node_fetch);
        run.box_tests += u64::from(out.box_test);
        run.triangle_tests += u64::from(out.triangle_test);
        run.reads += u64::from(inputs.read_ready);
        if let Some(line) = out.write.filter(|_| inputs.write_ready) {
            run.writes += 1;
            written.push(line);
        }
        run.hits = out.hits;
        last = out.error;
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
    last.map_or(Ok(run), Err)
}
