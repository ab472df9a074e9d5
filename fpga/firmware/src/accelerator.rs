//! The same job, done by the accelerator and compared with what the software did.
//!
//! The accelerator gets regions of its own behind the software's. What its capabilities do not name stays
//! software, and what needs that takes the software's: rays go through the accelerator's own tree if it can make one of
//! the traced format. Outputs are compared byte by byte.

use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin};
use xylem_core::geom::{PrimIndex, Ray, Triangle};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{Bvh2Node, Coordinates, LeafEntry, NodeFormat, Quantization, Tree};
use xylem_core::num::Grid;
use xylem_core::pipeline::BuildRegions;
use xylem_core::sort::{InputFormat, Item, RecordFormat};
use xylem_core::toplevel::TopLevel;
use xylem_core::traverse::Hit;
use xylem_driver::{
    BuildJob, Capabilities, CompressJob, Compression, Counters, CountersError, Micros, ProbeError,
    RegisterAccess, ResultError, StartError, TraceJob, WaitError, Xylem,
};

use crate::accelerated::{Accelerated, Part, PartReport};
use crate::blob::{ALIGN, Header};
use crate::job::{Clock, Finished};
use crate::layout::Places;
use crate::report::Output;

/// Why the accelerator did not do the job. `B` is the memory bus' error, `R` that of the register
/// access, `P` that of the interrupt line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
#[non_exhaustive]
pub enum AcceleratorError<B, R, P> {
    /// There is none, or one that this driver does not know.
    Probe(ProbeError<R>),
    /// It cannot build the tree that the blob asks for.
    Unsupported {
        /// What it cannot do.
        what: &'static str,
    },
    /// The memory behind the software's outputs is too small for the accelerator's.
    WorkSpace {
        /// Bytes that are needed, at most `u32::MAX`.
        needed: u32,
        /// Bytes that there are.
        size: u32,
    },
    /// A triangle is off the grid.
    Triangle(PrimIndex),
    /// A job was not started.
    Start {
        /// Which one.
        part: Part,
        /// Why.
        error: StartError<R>,
    },
    /// A job did not end well, or in time.
    Wait {
        /// Which one.
        part: Part,
        /// How it ended.
        error: WaitError<R, P>,
    },
    /// A job's result could not be read.
    Result(ResultError<R>),
    /// The counters could not be read.
    Counters(CountersError<R>),
    /// The bus failed while the core prepared or compared.
    Bus(B),
}

impl<B: fmt::Debug, R: fmt::Display, P: fmt::Debug> fmt::Display for AcceleratorError<B, R, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Probe(error) => write!(f, "{error}"),
            Self::Unsupported { what } => {
                write!(f, "the accelerator does not do {what}; ask for a tree without")
            }
            Self::WorkSpace { needed, size } => write!(
                f,
                "the accelerator needs {needed} bytes behind the software's outputs, memory has \
                 {size}; use a smaller scene"
            ),
            Self::Triangle(PrimIndex(index)) => {
                write!(f, "triangle {index} is off the grid; write the scene blob anew")
            }
            Self::Start { part, error } => write!(f, "{}: {error}", part.as_str()),
            Self::Wait { part, error } => write!(f, "{}: {error}", part.as_str()),
            Self::Result(error) => write!(f, "{error}"),
            Self::Counters(error) => write!(f, "{error}"),
            Self::Bus(error) => write!(f, "bus error: {error:?}"),
        }
    }
}

impl<B: fmt::Debug, R: core::error::Error, P: fmt::Debug> core::error::Error
    for AcceleratorError<B, R, P>
{
}

/// Does the finished job again with the accelerator at `registers`, as far as that can, and compares.
///
/// # Errors
/// [`AcceleratorError`]; after a time-out the accelerator may still run.
pub fn run<B: Bus, C: Clock, R: RegisterAccess, D: DelayNs, I: InputPin>(
    bus: &mut B,
    software: &Finished,
    clock: &mut C,
    (registers, delay, interrupt): (R, D, I),
) -> Result<Accelerated, ErrorWith<B::Error, R, I>> {
    let mut xylem = Xylem::probe(registers, delay, interrupt).map_err(AcceleratorError::Probe)?;
    xylem.set_poll_interval(Micros(1));
    let can = *xylem.capabilities();
    let header = software.blob.header;
    check(&header, &can)?;
    let places = Own::new(software)?;
    let timeout = timeout(&header);
    let machine = Machine { xylem, clock, timeout, can };
    let report = Accelerated { same_counts: true, ..Accelerated::default() };
    let mut run = Run { bus, software, places, machine, report };
    let job = run.prepare()?;
    let exact = if can.features.build() { Some(run.build(&job)?) } else { None };
    let mut quantized = None;
    if header.treelet_depth == 0 {
        if let Some(exact) = exact.filter(|tree| can.features.compress() && tree.node_count > 0) {
            quantized = Some(run.compress(exact)?);
        }
    } else if can.features.build_compressed()
        && header.treelet_depth == can.geometry.treelet_depth()
    {
        quantized = Some(run.build_compressed(&job)?);
    }
    if can_trace(&header, &can) && header.rays > 0 {
        run.trace(if header.format == NodeFormat::Bvh2 { exact } else { quantized })?;
    }
    Ok(run.report)
}

/// The job on the accelerator.
struct Run<'a, B, C, R, D, I> {
    bus: &'a mut B,
    software: &'a Finished,
    places: Own,
    machine: Machine<'a, R, D, I, C>,
    report: Accelerated,
}

impl<B: Bus, C: Clock, R: RegisterAccess, D: DelayNs, I: InputPin> Run<'_, B, C, R, D, I> {
    /// Makes the input that the accelerator takes, and describes the build.
    fn prepare(&mut self) -> Result<BuildJob, ErrorWith<B::Error, R, I>> {
        let header = &self.software.blob.header;
        let triangles = self.software.blob.triangles;
        let mut job = BuildJob {
            regions: self.places.build,
            count: header.triangles,
            input: InputFormat::Triangle40,
            record: RecordFormat::Box32,
            morton: header.morton,
            max_leaf_size: header.max_leaf_size,
            compressed: None,
        };
        if self.machine.can.features.input_triangle() {
            job.regions.primitives = padded(triangles);
            return Ok(job);
        }
        job.input = InputFormat::Box32;
        let clock = &mut self.machine.clock;
        let start = clock.cycles();
        write_boxes(self.bus, header.grid, triangles, header.triangles, self.places.boxes)?;
        let cycles = clock.cycles().wrapping_sub(start);
        let counters = Counters::default();
        self.report.parts[Part::Prepare as usize] = Some(PartReport { cycles, counters });
        Ok(job)
    }

    /// Builds the tree of 64-byte nodes.
    fn build(&mut self, job: &BuildJob) -> Result<Tree, ErrorWith<B::Error, R, I>> {
        let (tree, done) = self.machine.part(
            Part::Build,
            |xylem| xylem.start_build(job),
            |xylem| xylem.built_tree(job),
        )?;
        self.report.parts[Part::Build as usize] = Some(done);
        self.compare_tree(&tree)?;
        self.compare(Output::Nodes, used(tree.nodes, tree.node_count, Bvh2Node::BYTES))?;
        Ok(tree)
    }

    /// Builds the tree of quantized nodes.
    fn build_compressed(&mut self, job: &BuildJob) -> Result<Tree, ErrorWith<B::Error, R, I>> {
        let treelet_depth = self.software.blob.header.treelet_depth;
        let mut job = BuildJob { compressed: Some(self.compression(treelet_depth)), ..*job };
        job.regions.nodes = Region::default();
        job.regions.leaf_table = self.places.second_leaf_table;
        let (tree, done) = self.machine.part(
            Part::BuildCompressed,
            |xylem| xylem.start_build(&job),
            |xylem| xylem.built_tree(&job),
        )?;
        self.report.parts[Part::BuildCompressed as usize] = Some(done);
        self.compare_tree(&tree)?;
        self.compare_pairs(&tree)?;
        Ok(tree)
    }

    /// Compresses the tree of 64-byte nodes.
    fn compress(&mut self, tree: Tree) -> Result<Tree, ErrorWith<B::Error, R, I>> {
        let job = CompressJob { tree, compression: self.compression(1) };
        let (tree, done) = self.machine.part(
            Part::Compress,
            |xylem| xylem.start_compress(&job),
            |_| Ok(job.tree()),
        )?;
        self.report.parts[Part::Compress as usize] = Some(done);
        self.compare_pairs(&tree)?;
        Ok(tree)
    }

    /// Traces the rays through a tree, or through the software's.
    fn trace(&mut self, own: Option<Tree>) -> Result<(), ErrorWith<B::Error, R, I>> {
        let Finished { blob, traced, .. } = self.software;
        let borrowed =
            Tree { nodes: padded(traced.nodes), leaf_table: padded(traced.leaf_table), ..*traced };
        let job = TraceJob {
            tree: own.unwrap_or(borrowed),
            triangles: padded(blob.triangles),
            triangle_count: blob.header.triangles,
            rays: padded(blob.rays),
            hits: self.places.hits,
            ray_count: blob.header.rays,
            query: blob.header.query,
        };
        let (hits, done) = self.machine.part(
            Part::Trace,
            |xylem| xylem.start_trace(&job),
            |xylem| xylem.hit_count(),
        )?;
        self.report.parts[Part::Trace as usize] = Some(done);
        self.report.same_counts &= hits == self.software.report.hits;
        self.compare(Output::Hits, used(job.hits, job.ray_count, Hit::BYTES))
    }

    fn compression(&self, treelet_depth: u8) -> Compression {
        let coordinates = coordinates(&self.software.blob.header);
        Compression { target: self.places.quantized, coordinates, treelet_depth }
    }

    /// Compares root, counts and leaf table.
    fn compare_tree(&mut self, tree: &Tree) -> Result<(), ErrorWith<B::Error, R, I>> {
        let theirs = &self.software.exact;
        self.report.same_counts &= tree.root == theirs.root
            && tree.node_count == theirs.node_count
            && tree.leaf_count == theirs.leaf_count;
        let leaf_table = used(tree.leaf_table, tree.entry_count, LeafEntry::BYTES);
        self.compare(Output::LeafTable, leaf_table)
    }

    fn compare_pairs(&mut self, tree: &Tree) -> Result<(), ErrorWith<B::Error, R, I>> {
        let stride = Quantization::RELATIVE.node_bytes() as usize;
        self.compare(Output::QuantizedNodes, used(tree.nodes, tree.node_count, stride))
    }

    /// Compares an output with the software's; one that is made twice is equal if it is both times.
    fn compare(&mut self, output: Output, ours: Region) -> Result<(), ErrorWith<B::Error, R, I>> {
        let theirs = self.software.layout.outputs(&self.software.exact)[output as usize];
        let same = same_bytes(self.bus, ours, theirs).map_err(AcceleratorError::Bus)?;
        let equal = &mut self.report.outputs[output as usize];
        *equal = Some(equal.unwrap_or(true) && same);
        Ok(())
    }
}

/// The error of a run with these, where `E` is the memory bus' own.
type ErrorWith<E, R, I> =
    AcceleratorError<E, <R as RegisterAccess>::Error, <I as ErrorType>::Error>;

/// The accelerator and the clock that its jobs are timed with.
struct Machine<'a, R, D, I, C> {
    xylem: Xylem<R, D, I>,
    clock: &'a mut C,
    timeout: Micros,
    can: Capabilities,
}

impl<R: RegisterAccess, D: DelayNs, I: InputPin, C: Clock> Machine<'_, R, D, I, C> {
    /// Starts a job, waits for it and reads its result.
    fn part<T, E>(
        &mut self,
        part: Part,
        start: impl FnOnce(&mut Xylem<R, D, I>) -> Result<(), StartError<R::Error>>,
        result: impl FnOnce(&mut Xylem<R, D, I>) -> Result<T, ResultError<R::Error>>,
    ) -> Result<(T, PartReport), ErrorWith<E, R, I>> {
        let before = self.counters()?;
        let since = self.clock.cycles();
        start(&mut self.xylem).map_err(|error| AcceleratorError::Start { part, error })?;
        let waited = self.xylem.wait(self.timeout);
        waited.map_err(|error| AcceleratorError::Wait { part, error })?;
        let value = result(&mut self.xylem).map_err(AcceleratorError::Result)?;
        let cycles = self.clock.cycles().wrapping_sub(since);
        Ok((value, PartReport { cycles, counters: self.counters()? - before }))
    }

    /// The counters; all 0 where there are none.
    fn counters<E>(&mut self) -> Result<Counters, ErrorWith<E, R, I>> {
        if !self.can.features.counters() {
            return Ok(Counters::default());
        }
        self.xylem.counters().map_err(AcceleratorError::Counters)
    }
}

/// The accelerator's own regions, each as long as the accelerator's registers can say: a multiple of
/// 64 bytes.
struct Own {
    boxes: Region,
    build: BuildRegions,
    /// That of the tree that is compressed while it is built.
    second_leaf_table: Region,
    quantized: Region,
    hits: Region,
}

impl Own {
    fn new<B, R, P>(software: &Finished) -> Result<Self, AcceleratorError<B, R, P>> {
        let free = software.layout.free;
        let header = &software.blob.header;
        let mut places = Places::new(free);
        let mut place =
            |count: u32, bytes: u32| padded(places.place(u64::from(count) * u64::from(bytes)));
        let count = header.triangles;
        let run = RecordFormat::Box32.bytes();
        let boxes = place(count, InputFormat::Box32.bytes());
        let own = Self {
            boxes,
            build: BuildRegions {
                primitives: boxes,
                runs_a: place(count, run),
                // How many passes there are is the accelerator's business.
                runs_b: place(count, run),
                nodes: place(count, Bvh2Node::BYTES as u32),
                leaf_table: place(count, LeafEntry::BYTES as u32),
            },
            second_leaf_table: place(count, LeafEntry::BYTES as u32),
            quantized: place(count, Quantization::RELATIVE.node_bytes()),
            hits: place(header.rays, Hit::BYTES as u32),
        };
        let refused = |needed| AcceleratorError::WorkSpace { needed, size: free.size };
        places.rest().map(|_| own).map_err(refused)
    }
}

/// Refuses what no accelerator of this map builds, and what this one does not.
fn check<B, R, P>(header: &Header, can: &Capabilities) -> Result<(), AcceleratorError<B, R, P>> {
    let grid = header.grid.bits() == can.geometry.grid_bits();
    for (holds, what) in [
        (header.top_level == TopLevel::None, "a top level"),
        (header.join_leaves == 0, "joined leaves"),
        (grid, "this grid"),
    ] {
        if !holds {
            return Err(AcceleratorError::Unsupported { what });
        }
    }
    Ok(())
}

/// Whether it traces the blob's rays through its format, in records of the core's size.
fn can_trace(header: &Header, can: &Capabilities) -> bool {
    let format = match header.format {
        NodeFormat::Bvh2 => can.features.node_bvh2(),
        _ => can.features.node_cbvh(),
    };
    let sizes = [can.trace.ray_bytes(), can.trace.hit_bytes()].map(usize::from);
    can.features.trace() && format && sizes == [Ray::BYTES, Hit::BYTES]
}

const fn coordinates(header: &Header) -> Coordinates {
    match header.format {
        NodeFormat::Quantized(quantization) => quantization.coordinates,
        _ => Coordinates::Relative,
    }
}

/// A second, and 10 µs for each primitive and ray: some hundred times what they take.
fn timeout(header: &Header) -> Micros {
    let records = header.triangles.saturating_add(header.rays);
    Micros(records.saturating_mul(10).saturating_add(1_000_000))
}

/// Bytes that start on a word, so that the core moves whole words.
#[repr(C, align(4))]
struct Aligned<const N: usize>([u8; N]);

/// Records that are read or written at once.
const TOGETHER: u32 = 8;

/// Writes the boxes of `count` triangles with their positions.
fn write_boxes<B: Bus, R, P>(
    bus: &mut B,
    grid: Grid,
    triangles: Region,
    count: u32,
    boxes: Region,
) -> Result<(), AcceleratorError<B::Error, R, P>> {
    const BOX: usize = InputFormat::Box32.bytes() as usize;
    let mut read = Aligned([0; Triangle::BYTES * TOGETHER as usize]);
    let mut written = Aligned([0; BOX * TOGETHER as usize]);
    for first in (0..count).step_by(TOGETHER as usize) {
        let some = (count - first).min(TOGETHER);
        // Both regions were made for this many records.
        let (Some(from), Some(to)) = (
            triangles.at(first * Triangle::BYTES as u32, some * Triangle::BYTES as u32),
            boxes.at(first * BOX as u32, some * BOX as u32),
        ) else {
            break;
        };
        let (from_bytes, to_bytes) =
            (&mut read.0[..some as usize * Triangle::BYTES], &mut written.0[..some as usize * BOX]);
        bus.read(from, from_bytes).map_err(AcceleratorError::Bus)?;
        let records = from_bytes.as_chunks().0.iter().zip(to_bytes.chunks_exact_mut(BOX));
        for (reference, (triangle, record)) in (first..).zip(records) {
            let bounds = Triangle::from_bytes(triangle).bounds();
            if !grid.contains(bounds.min) || !grid.contains(bounds.max) {
                return Err(AcceleratorError::Triangle(PrimIndex(reference)));
            }
            RecordFormat::Box32.encode(&Item { bounds, reference, ..Item::ZERO }, record);
        }
        bus.write(to, to_bytes).map_err(AcceleratorError::Bus)?;
    }
    Ok(())
}

/// Whether two regions have the same length and bytes.
fn same_bytes<B: Bus>(bus: &mut B, ours: Region, theirs: Region) -> Result<bool, B::Error> {
    const BURST: u32 = 64;
    if ours.size != theirs.size {
        return Ok(false);
    }
    let mut offset = 0;
    while offset < ours.size {
        let len = (ours.size - offset).min(BURST);
        let (Some(a), Some(b)) = (ours.at(offset, len), theirs.at(offset, len)) else { break };
        let (mut one, mut other) = (Aligned([0; BURST as usize]), Aligned([0; BURST as usize]));
        bus.read(a, &mut one.0[..len as usize])?;
        bus.read(b, &mut other.0[..len as usize])?;
        if one.0 != other.0 {
            return Ok(false);
        }
        offset += len;
    }
    Ok(true)
}

/// The region with its size rounded up; all of the job's regions leave room for that.
const fn padded(region: Region) -> Region {
    Region { size: region.size.next_multiple_of(ALIGN), ..region }
}

/// The first `count` records of a region.
fn used(region: Region, count: u32, stride: usize) -> Region {
    Region { size: region.size.min(count.saturating_mul(stride as u32)), ..region }
}
