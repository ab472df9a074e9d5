//! The whole unit against its cycle model, on memory that answers when it likes.

use std::fmt;
use std::path::Path;

use xylem::bus::FlatMemory;
use xylem::machine::traverser::{
    Traverser, TraverserConfig, TraverserError, TraverserInputs, TraverserJob, TraverserOutputs,
};
use xylem_core::geom::Ray;
use xylem_core::mem::Region;
use xylem_core::node::{Child, Coordinates, NodeFormat, NodeIndex, Quantization};
use xylem_core::traverse::{Hit, Query};

use crate::random::Random;
use crate::rtl::{Pin, Rtl};
use crate::verilate::CosimError;

/// How memory behaves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pace {
    /// Of four reads or writes that are offered, how many are taken at once on average: 1 to 4.
    pub eager: u64,
    /// The longest time from a read's cycle to its answer's, at least 1.
    pub latency: u64,
    /// Whether every answer takes that long.
    pub constant: bool,
}

/// What a job without a mismatch came to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Summary {
    /// Cycles of both sides.
    pub cycles: u64,
    /// Rays that hit something.
    pub hits: u32,
    /// Nodes, boxes and triangles.
    pub counts: [u64; 3],
    /// Why it ended early.
    pub error: Option<TraverserError>,
}

/// Why a run stopped.
#[derive(Debug)]
pub enum Stop {
    /// The sides differ in an output of a cycle.
    Mismatch {
        /// The cycle, counted from the one after the start.
        cycle: u64,
        /// What the model shows.
        model: Box<TraverserOutputs>,
        /// What the RTL shows, in the same terms.
        rtl: Box<TraverserOutputs>,
    },
    /// The RTL asked for a line that is in no region of the job, or wrote beyond its records.
    Outside {
        /// The cycle.
        cycle: u64,
        /// The line.
        addr: u32,
    },
    /// An assertion of the RTL failed.
    Rtl {
        /// The cycle.
        cycle: u64,
        /// Which.
        error: CosimError,
    },
    /// Neither side ended in a time that is far too long.
    Endless,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mismatch { cycle, model, rtl } => {
                write!(f, "cycle {cycle}: RTL and model differ\n  model {model:?}\n  RTL   {rtl:?}")
            }
            Self::Outside { cycle, addr } => write!(f, "cycle {cycle}: line {addr:#x} is foreign"),
            Self::Rtl { cycle, error } => write!(f, "cycle {cycle}: {error}"),
            Self::Endless => f.write_str("no end after 20 million cycles"),
        }
    }
}

/// `xy_traverser` in gates.
#[derive(Debug)]
pub struct TraverserRtl {
    config: TraverserConfig,
    rtl: Rtl,
    pins: Pins,
}

#[derive(Debug)]
struct Pins {
    start: Pin,
    clear: Pin,
    rd_ready: Pin,
    rsp_valid: Pin,
    rsp_data: Pin,
    wr_ready: Pin,
    busy: Pin,
    done: Pin,
    hits: Pin,
    error: Pin,
    error_index: Pin,
    events: [Pin; 3],
    rd_valid: Pin,
    rd_addr: Pin,
    wr_valid: Pin,
    wr_addr: Pin,
    wr_data: Pin,
    wr_strb: Pin,
    wr_last: Pin,
}

impl TraverserRtl {
    /// Loads a library that [`build`](super::build) built in `config` and resets the unit.
    ///
    /// # Errors
    /// As [`Rtl::load`].
    pub fn load(library: &Path, config: TraverserConfig, seed: u32) -> Result<Self, CosimError> {
        let rtl = Rtl::load(library, seed)?;
        let pins = Pins {
            start: rtl.input("start_i"),
            clear: rtl.input("clear_i"),
            rd_ready: rtl.input("rd_ready_i"),
            rsp_valid: rtl.input("rsp_valid_i"),
            rsp_data: rtl.input("rsp_data_i"),
            wr_ready: rtl.input("wr_ready_i"),
            busy: rtl.output("busy_o"),
            done: rtl.output("done_o"),
            hits: rtl.output("hits_o"),
            error: rtl.output("error_o"),
            error_index: rtl.output("error_index_o"),
            events: ["node_fetch_o", "box_test_o", "triangle_test_o"].map(|name| rtl.output(name)),
            rd_valid: rtl.output("rd_valid_o"),
            rd_addr: rtl.output("rd_addr_o"),
            wr_valid: rtl.output("wr_valid_o"),
            wr_addr: rtl.output("wr_addr_o"),
            wr_data: rtl.output("wr_data_o"),
            wr_strb: rtl.output("wr_strb_o"),
            wr_last: rtl.output("wr_last_o"),
        };
        Ok(Self { config, rtl, pins })
    }

    /// Writes a waveform of the following cycles.
    ///
    /// # Errors
    /// As [`Rtl::record`].
    pub fn record(&mut self, path: &Path) -> Result<(), CosimError> {
        self.rtl.record(path)
    }

    /// Runs a cycle in which the unit is cleared and memory takes and answers nothing.
    ///
    /// # Errors
    /// As [`Rtl::tick`].
    pub fn clear(&mut self) -> Result<(), CosimError> {
        for pin in [self.pins.rd_ready, self.pins.rsp_valid, self.pins.wr_ready] {
            self.rtl.set(pin, 0u32);
        }
        self.rtl.set(self.pins.clear, 1u32);
        self.rtl.tick()?;
        self.rtl.set(self.pins.clear, 0u32);
        Ok(())
    }

    /// Gives the unit a job and runs the cycle in which it starts.
    fn start(&mut self, job: &TraverserJob) -> Result<(), CosimError> {
        let rtl = &mut self.rtl;
        let mut set = |name: &str, value: u32| {
            let pin = rtl.input(name);
            rtl.set(pin, value);
        };
        let tree = &job.scene.tree;
        let modulo = matches!(
            tree.format,
            NodeFormat::Quantized(Quantization { coordinates: Coordinates::Modulo, .. })
        );
        set("quantized_i", u32::from(tree.format != NodeFormat::Bvh2));
        set("modulo_i", u32::from(modulo));
        set("any_i", u32::from(job.query == Query::Any));
        set("ray_count_i", job.ray_count);
        set("node_count_i", tree.node_count);
        set("entry_count_i", tree.entry_count);
        set("triangle_count_i", job.scene.triangle_count);
        set("rays_base_i", job.rays.0);
        set("nodes_base_i", tree.nodes.base.0);
        set("entries_base_i", tree.leaf_table.base.0);
        set("triangles_base_i", job.scene.triangles.base.0);
        set("hits_base_i", job.hits.0);
        if let Some(root) = tree.root {
            let (index, count) = match root.child {
                Child::Inner(NodeIndex(index)) => (index, 0),
                Child::Leaf { first, count } => (first, count),
            };
            set("root_index_i", index);
            set("root_count_i", count);
            let corners = [root.bounds.min, root.bounds.max];
            let bytes: Vec<u8> = corners
                .iter()
                .flat_map(|corner| corner.to_array())
                .flat_map(|c| c.to_le_bytes().into_iter().take(3))
                .collect();
            let pin = rtl.input("root_box_i");
            rtl.set_bytes(pin, &bytes);
        }
        rtl.set(self.pins.rd_ready, 0u32);
        rtl.set(self.pins.rsp_valid, 0u32);
        rtl.set(self.pins.wr_ready, 0u32);
        rtl.set(self.pins.start, 1u32);
        rtl.tick()?;
        rtl.set(self.pins.start, 0u32);
        Ok(())
    }

    /// The outputs of the cycle at hand, in the model's terms.
    fn outputs(&self) -> TraverserOutputs {
        let (rtl, pins) = (&self.rtl, &self.pins);
        let write = rtl.is_set(pins.wr_valid).then(|| {
            let strobe = rtl.get(pins.wr_strb);
            let mut line = xylem::machine::traverser::records::LineWrite {
                addr: rtl.get(pins.wr_addr) as u32,
                data: [0; 64],
                words: 0,
            };
            let bytes = rtl.bytes(pins.wr_data);
            for word in 0..8 {
                if strobe >> (8 * word) & 0xff == 0xff {
                    line.words |= 1 << word;
                    let range = 8 * word..8 * word + 8;
                    line.data[range.clone()].copy_from_slice(&bytes[range]);
                }
            }
            assert_eq!(
                strobe.count_ones(),
                8 * line.words.count_ones(),
                "part of a word is written"
            );
            assert!(rtl.is_set(pins.wr_last), "a line is a burst");
            line
        });
        let index = rtl.get(pins.error_index) as u32;
        let error = match rtl.get(pins.error) {
            1 => Some(TraverserError::BadRay(index)),
            2 => Some(TraverserError::CorruptNode(index)),
            3 => Some(TraverserError::CorruptLeaf(index)),
            4 => Some(TraverserError::CorruptTriangle(index)),
            _ => None,
        };
        TraverserOutputs {
            busy: rtl.is_set(pins.busy),
            done: rtl.is_set(pins.done),
            read: rtl.is_set(pins.rd_valid).then(|| rtl.get(pins.rd_addr) as u32),
            write,
            node_fetch: rtl.is_set(pins.events[0]),
            box_test: rtl.is_set(pins.events[1]),
            triangle_test: rtl.is_set(pins.events[2]),
            hits: rtl.get(pins.hits) as u32,
            error,
        }
    }

    /// Runs a job on both sides until it ends, or until cycle `until`, or soon after, with no read
    /// under way. Records go to `memory` as the RTL writes them.
    ///
    /// # Errors
    /// The first cycle in which the sides differ or the RTL fails.
    pub fn run(
        &mut self,
        memory: &mut FlatMemory,
        job: &TraverserJob,
        pace: Pace,
        random: &mut Random,
        until: Option<u64>,
    ) -> Result<Summary, Stop> {
        let before = memory.clone();
        let mut model = Traverser::new(self.config, &before, *job);
        self.start(job).map_err(|error| Stop::Rtl { cycle: 0, error })?;
        let readable = regions(job);
        let records = Region { base: job.hits, size: Hit::BYTES as u32 * job.ray_count };
        let mut flying = None::<(u64, u32)>;
        let mut counts = [0; 3];
        for cycle in 0..20_000_000 {
            let eager = |random: &mut Random| random.below(4) < pace.eager;
            let (read_ready, write_ready) = (eager(random), eager(random));
            let answer = flying.filter(|(at, _)| *at <= cycle);
            let inputs = TraverserInputs { read_ready, write_ready, response: answer.is_some() };
            let (rtl, pins) = (&mut self.rtl, &self.pins);
            rtl.set(pins.rd_ready, u32::from(read_ready));
            rtl.set(pins.wr_ready, u32::from(write_ready));
            rtl.set(pins.rsp_valid, u32::from(answer.is_some()));
            if let Some((_, addr)) = answer {
                flying = None;
                rtl.set_bytes(pins.rsp_data, &line(memory, addr));
            }
            rtl.settle();
            let (seen, expected) = (self.outputs(), model.tick(&inputs));
            if seen != expected {
                return Err(Stop::Mismatch {
                    cycle,
                    model: Box::new(expected),
                    rtl: Box::new(seen),
                });
            }
            for (count, event) in
                counts.iter_mut().zip([seen.node_fetch, seen.box_test, seen.triangle_test])
            {
                *count += u64::from(event);
            }
            if let Some(addr) = seen.read.filter(|_| read_ready) {
                if !readable.iter().any(|region| overlaps(region, addr)) {
                    return Err(Stop::Outside { cycle, addr });
                }
                let after =
                    if pace.constant { pace.latency } else { 1 + random.below(pace.latency) };
                flying = Some((cycle + after, addr));
            }
            if let Some(line) = seen.write.filter(|_| write_ready) {
                for word in (0..8).filter(|word| line.words >> word & 1 == 1) {
                    let at = line.addr + 8 * word;
                    if at < records.base.0 || at - records.base.0 >= records.size {
                        return Err(Stop::Outside { cycle, addr: at });
                    }
                    let (from, to) = (8 * word as usize, at as usize);
                    memory.bytes_mut()[to..to + 8].copy_from_slice(&line.data[from..from + 8]);
                }
            }
            self.rtl.edge().map_err(|error| Stop::Rtl { cycle, error })?;
            let stopped = until.is_some_and(|until| cycle >= until) && flying.is_none();
            if seen.done || stopped {
                return Ok(Summary {
                    cycles: cycle + 1,
                    hits: seen.hits,
                    counts,
                    error: seen.error,
                });
            }
        }
        Err(Stop::Endless)
    }
}

/// The regions that a job may read.
fn regions(job: &TraverserJob) -> [Region; 4] {
    let (scene, tree) = (&job.scene, &job.scene.tree);
    [
        Region { base: job.rays, size: Ray::BYTES as u32 * job.ray_count },
        Region { base: tree.nodes.base, size: tree.format.bytes() * tree.node_count },
        Region { base: tree.leaf_table.base, size: 4 * tree.entry_count },
        Region { base: scene.triangles.base, size: 40 * scene.triangle_count },
    ]
}

fn overlaps(region: &Region, line: u32) -> bool {
    line >= region.base.0 && line < region.base.0 + region.size
}

/// The line at `addr`, with zeros beyond the memory's end.
fn line(memory: &FlatMemory, addr: u32) -> [u8; 64] {
    let mut line = [0; 64];
    let bytes = memory.region(Region { base: xylem_core::mem::ByteAddr(addr), size: 64 });
    line[..bytes.len()].copy_from_slice(bytes);
    line
}
