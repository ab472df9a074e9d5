//! The traversal unit: one ray at a time through a tree, and a hit record for each.
//!
//! What is found, and in which order memory is read for it, is the core's ([`script`]); this adds when. The
//! unit is `xy_traverser`, and every output of every cycle is the same: states that read words take a cycle a
//! word and wait for [`lines`], all others take the cycles that [`script`] lists.

pub mod lines;
pub mod records;
mod run;
pub mod script;

use xylem_core::geom::Ray;
use xylem_core::mem::ByteAddr;
use xylem_core::traverse::{Hit, Query, Scene};

use self::lines::LineCache;
use self::records::{LineWrite, RecordWriter};
use self::script::{Records, Script, Step};
use crate::bus::FlatMemory;

pub use run::{Stop, TraverserRun, run, run_within};

/// Sizes of the unit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TraverserConfig {
    /// Its name in `configs.toml`.
    pub name: &'static str,
    /// Levels of nodes that a tree may have.
    pub depth: u32,
    /// The cache holds `2^cache_width` lines of 64 bytes.
    pub cache_width: u32,
    /// Whether those lines are in block memory; no cycle depends on it.
    pub cache_block: bool,
}

impl TraverserConfig {
    /// Any tree that the core builds, and sixteen lines.
    pub const SMALL: Self = Self { name: "small", depth: 95, cache_width: 4, cache_block: false };
    /// Any tree that the core builds, and as many lines as block memory has for the same price: 32 KiB.
    pub const LARGE: Self = Self { name: "large", depth: 95, cache_width: 9, cache_block: true };

    /// All named configurations.
    pub const ALL: [Self; 2] = [Self::SMALL, Self::LARGE];
}

/// What the unit is asked to do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TraverserJob {
    /// The tree, of 64-byte nodes or quantized pairs of 6 bits and minimum scale 0, and the triangles. Every
    /// region begins on a line and has room for its count.
    pub scene: Scene,
    /// What is asked of each ray.
    pub query: Query,
    /// Where the ray records begin, on a line.
    pub rays: ByteAddr,
    /// How many there are.
    pub ray_count: u32,
    /// Where the hit records go, on a line.
    pub hits: ByteAddr,
}

/// Why a job ended early.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum TraverserError {
    /// A record is no ray.
    #[error("ray record {0} is not a ray")]
    BadRay(u32),
    /// A node is off the tree, met too often, too deep, or has a child outside of its box.
    #[error("node {0} in memory is corrupt")]
    CorruptNode(u32),
    /// A leaf table entry is off the table, met too often, or names a triangle that there is not.
    #[error("leaf table entry {0} is corrupt")]
    CorruptLeaf(u32),
    /// A triangle has a vertex off the grid.
    #[error("triangle {0} in memory is off the grid")]
    CorruptTriangle(u32),
    /// A region lacks room for its count, or memory for the region; the unit would not have been started.
    #[error("the job's regions do not hold what its counts say")]
    Regions,
}

impl TraverserError {
    /// The code and the index that the unit reports.
    pub const fn code(self) -> (u32, u32) {
        match self {
            Self::BadRay(index) => (1, index),
            Self::CorruptNode(index) => (2, index),
            Self::CorruptLeaf(index) => (3, index),
            Self::CorruptTriangle(index) => (4, index),
            Self::Regions => (0, 0),
        }
    }
}

/// Inputs of a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct TraverserInputs {
    /// Whether a read that is offered is taken.
    pub read_ready: bool,
    /// Whether the line that was asked for arrives.
    pub response: bool,
    /// Whether a write that is offered is taken.
    pub write_ready: bool,
}

/// Outputs of a cycle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TraverserOutputs {
    /// A job is under way.
    pub busy: bool,
    /// This is its last cycle.
    pub done: bool,
    /// The line that is asked for.
    pub read: Option<u32>,
    /// The line that is offered to be written.
    pub write: Option<LineWrite>,
    /// A node arrived.
    pub node_fetch: bool,
    /// A box test ended.
    pub box_test: bool,
    /// A triangle test ended.
    pub triangle_test: bool,
    /// Rays that hit something, so far.
    pub hits: u32,
    /// Why the job ended early.
    pub error: Option<TraverserError>,
}

/// The unit at work on a job, from the cycle after its start on.
#[derive(Debug)]
pub struct Traverser<'m> {
    memory: &'m FlatMemory,
    job: TraverserJob,
    config: TraverserConfig,
    lines: LineCache,
    records: RecordWriter,
    script: Script,
    /// Cycles spent in the first step of the script.
    spent: u32,
    ray: u32,
    hits: u32,
    error: Option<TraverserError>,
    done: bool,
}

impl<'m> Traverser<'m> {
    /// A unit that begins `job` on `memory`.
    pub fn new(config: TraverserConfig, memory: &'m FlatMemory, job: TraverserJob) -> Self {
        let bounds = job.scene.tree.root.map(|root| root.bounds);
        let mut script = Script::default();
        script.push(Step::Wait { cycles: script::root_cycles(bounds.as_ref()), tests: [0; 2] });
        let mut this = Self {
            memory,
            job,
            config,
            lines: LineCache::new(config.cache_width),
            records: RecordWriter::new(job.hits.0),
            script,
            spent: 0,
            ray: 0,
            hits: 0,
            error: None,
            done: false,
        };
        if job.ray_count == 0 {
            this.script.push(Step::Flush { error: None });
        }
        this
    }

    /// Whether the job has ended.
    pub const fn is_done(&self) -> bool {
        self.done
    }

    /// The line that is asked for in this cycle, and the one that is offered to be written.
    pub fn shown(&self) -> (Option<u32>, Option<LineWrite>) {
        (self.lines.asked(), self.records.offered())
    }

    /// What the line that is asked for in this cycle is of.
    pub fn reads(&self) -> Option<Records> {
        match self.script.first() {
            Some(Step::Word { of, .. }) => Some(of),
            _ => None,
        }
    }

    /// Runs a cycle.
    pub fn tick(&mut self, inputs: &TraverserInputs) -> TraverserOutputs {
        let mut out = TraverserOutputs {
            busy: !self.done,
            done: false,
            read: self.lines.asked(),
            write: self.records.offered(),
            node_fetch: false,
            box_test: false,
            triangle_test: false,
            hits: self.hits,
            error: self.error,
        };
        if self.done {
            return out;
        }
        let Some(step) = self.script.first() else { return out };
        let (mut record, mut flush, mut ended) = (None, false, false);
        match step {
            Step::Word { addr, of } => {
                ended = self.lines.tick(addr, inputs.read_ready, inputs.response);
                out.node_fetch = of == Records::Nodes && ended;
            }
            Step::Wait { cycles, tests } => {
                self.spent += 1;
                out.box_test = tests.contains(&self.spent);
                ended = self.spent == cycles;
            }
            Step::Triangle { cycles } => {
                self.spent += 1;
                ended = self.spent == cycles;
                out.triangle_test = ended;
            }
            Step::Record(hit) => record = Some(Hit::to_bytes(hit.as_ref())),
            Step::Flush { .. } => {
                flush = true;
                ended = self.records.is_empty();
                out.done = ended;
                self.done = ended;
            }
        }
        let written = self.records.tick(record.as_ref(), flush, inputs.write_ready);
        if let (Step::Record(hit), true) = (step, written) {
            ended = true;
            self.hits += u32::from(hit.is_some());
            self.ray += 1;
        }
        if ended {
            self.script.pop();
            self.spent = 0;
            self.prepare();
        }
        out
    }

    /// Sees to it that the script goes on, and tells of an error as its last step begins.
    fn prepare(&mut self) {
        if self.script.first().is_none() && !self.done {
            if self.ray == self.job.ray_count {
                self.script.push(Step::Flush { error: None });
            } else {
                let at = u64::from(self.job.rays.0) + u64::from(self.ray) * Ray::BYTES as u64;
                self.script.trace(&self.config, self.memory, &self.job, (self.ray, at as u32));
            }
        }
        if let Some(Step::Flush { error }) = self.script.first() {
            self.error = error;
        }
    }
}
