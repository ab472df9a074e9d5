//! Each step in software and with custom instructions, on a scene's own data.

use core::fmt;

use xylem_core::compress::{
    PairEncoder, Placement, PlacementEncoder, compress_encoding, compress_top_down,
};
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{Bvh2Node, Bvh2View, NodeIndex, Quantization, Subtree, Tree};
use xylem_core::num::MortonCoder;
use xylem_core::sort::{HeapEntry, ReplaceHeap};
use xylem_core::traverse::{BoxTest, Hit, Query, Scene, SlabTest, trace_testing};
use xylem_firmware::job::{Clock, Finished};

use crate::{Cfu, CustomBoxTest, CustomEncoder, CustomHeap, MergeHeap};

/// Runs that are merged: those of P2 with M = 8192 and B = 16.
pub const RUNS: usize = 256;

/// Codes of a run at most.
const RUN: usize = 32;

/// Nodes whose children are tested and encoded.
const NODES: usize = 64;

/// Rays that every box is tested against.
const RAYS: u32 = 8;

/// What was measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// Replacing the top of a heap of [`RUNS`] runs, and fetching the next code of its run.
    Heap,
    /// Testing an exact box.
    BoxTest,
    /// Encoding the two children of a node.
    Encode,
    /// All of [`compress_top_down`], a node.
    Compress,
    /// All of tracing, a ray.
    Trace,
}

impl Step {
    /// All steps, in the order in which they are measured.
    pub const ALL: [Self; 5] =
        [Self::Heap, Self::BoxTest, Self::Encode, Self::Compress, Self::Trace];

    /// The step's name, a word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Heap => "heap",
            Self::BoxTest => "box-test",
            Self::Encode => "encode",
            Self::Compress => "compress",
            Self::Trace => "trace",
        }
    }
}

/// A step in both ways, with equal results.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Measured {
    /// Which.
    pub step: Step,
    /// How often it was done.
    pub count: u32,
    /// Cycles of all in software.
    pub software: u64,
    /// Cycles of all with custom instructions.
    pub custom: u64,
}

impl fmt::Display for Measured {
    /// The step's name, its count, and the cycles of software and of custom instructions.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {} {}", self.step.as_str(), self.count, self.software, self.custom)
    }
}

impl Measured {
    /// What [`Display`](fmt::Display) wrote.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let name = words.next()?;
        let step = Step::ALL.into_iter().find(|step| step.as_str() == name)?;
        let mut number = || words.next()?.parse().ok();
        let (count, software, custom) = (number()?, number()?, number()?);
        Some(Self { step, count: u32::try_from(count).ok()?, software, custom })
    }
}

/// Why nothing was measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Failure {
    /// The results of a step differ.
    Differ(Step),
    /// A step could not be done: memory does not hold what the job left there, or lacks room.
    Impossible(Step),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Differ(step) => write!(f, "{}: the results differ", step.as_str()),
            Self::Impossible(step) => {
                write!(f, "{}: memory does not hold what the job leaves", step.as_str())
            }
        }
    }
}

impl core::error::Error for Failure {}

/// Room for what is measured on.
#[derive(Debug)]
pub struct Storage {
    codes: [u32; RUNS * RUN],
    heads: [u32; RUNS],
    matches: [u64; RUNS],
    entries: heapless::Vec<HeapEntry, RUNS>,
    orders: [[u32; RUNS * RUN]; 2],
    boxes: [Aabb; 2 * NODES],
    times: [[Option<Option<i64>>; 2 * NODES]; 2],
    families: heapless::Vec<(Placement, [Subtree; 2]), NODES>,
    pairs: [heapless::Vec<Encoded, NODES>; 2],
}

/// What an encoder says of a node.
type Encoded = Option<([u8; 20], [Option<Placement>; 2])>;

impl Storage {
    /// Room with nothing in it.
    pub const fn new() -> Self {
        let none = Aabb::EMPTY;
        Self {
            codes: [0; RUNS * RUN],
            heads: [0; RUNS],
            matches: [0; RUNS],
            entries: heapless::Vec::new(),
            orders: [[0; RUNS * RUN]; 2],
            boxes: [none; 2 * NODES],
            times: [[None; 2 * NODES]; 2],
            families: heapless::Vec::new(),
            pairs: [heapless::Vec::new(), heapless::Vec::new()],
        }
    }
}

impl Default for Storage {
    fn default() -> Self {
        Self::new()
    }
}

/// Measures every step on what a job left in memory and hands each to `observe`.
///
/// # Errors
/// [`Failure`], at the first step of which results differ.
pub fn all<B: Bus, K: Clock, C: Cfu>(
    bus: &mut B,
    finished: &Finished,
    storage: &mut Storage,
    clock: &mut K,
    cfu: &C,
    observe: &mut impl FnMut(&Measured),
) -> Result<(), Failure> {
    let mut bench = Bench { bus, finished, clock, cfu };
    observe(&bench.heap(storage)?);
    observe(&bench.box_test(storage)?);
    observe(&bench.encode(storage)?);
    observe(&bench.compress()?);
    observe(&bench.trace()?);
    Ok(())
}

struct Bench<'a, B, K, C> {
    bus: &'a mut B,
    finished: &'a Finished,
    clock: &'a mut K,
    cfu: &'a C,
}

impl<B: Bus, K: Clock, C: Cfu> Bench<'_, B, K, C> {
    fn timed<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> (u64, T) {
        let start = self.clock.cycles();
        let result = work(self);
        (self.clock.cycles().wrapping_sub(start), result)
    }

    /// Merges sorted runs of the scene's codes.
    fn heap(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
        let step = Step::Heap;
        let Storage { codes, heads, matches, entries, orders: [first, second], .. } = storage;
        let header = &self.finished.blob.header;
        let coder = MortonCoder::new(header.grid, xylem_core::num::MortonWidth::Bits30);
        let count = (header.triangles as usize).min(codes.len()) / RUNS * RUNS;
        let run = count / RUNS;
        if run == 0 {
            return Err(Failure::Impossible(step));
        }
        for (index, code) in (0..).zip(&mut codes[..count]) {
            let triangle = self.triangle(index).ok_or(Failure::Impossible(step))?;
            let bounds = triangle.bounds();
            *code = coder.code(bounds.min, bounds.max) as u32;
        }
        for codes in codes[..count].chunks_exact_mut(run) {
            codes.sort_unstable();
        }
        let codes = &codes[..count];
        let starts = || codes.iter().step_by(run).map(|&code| u64::from(code));

        heads.fill(1);
        let bits = MortonCoder::bits(&coder);
        let heap = ReplaceHeap::new(entries.as_mut_view(), RUNS, bits);
        let mut heap = heap.map_err(|_| Failure::Impossible(step))?;
        for (slot, code) in (0..).zip(starts()) {
            heap.insert(HeapEntry { code, slot });
        }
        let (software, ()) =
            self.timed(|_| merge(&mut heap, codes, run, heads, &mut first[..count]));

        heads.fill(1);
        let mut heap =
            CustomHeap::new(self.cfu, matches, starts()).ok_or(Failure::Impossible(step))?;
        let (custom, ()) =
            self.timed(|_| merge(&mut heap, codes, run, heads, &mut second[..count]));
        if first != second {
            return Err(Failure::Differ(step));
        }
        Ok(Measured { step, count: count as u32, software, custom })
    }

    /// Tests the boxes of the last nodes, which are the upper ones, against some rays.
    fn box_test(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
        let step = Step::BoxTest;
        let Storage { boxes, times: [first, second], .. } = storage;
        let mut count = 0;
        for (node, two) in self.last_nodes().zip(boxes.chunks_exact_mut(2)) {
            let node = self.node(node).ok_or(Failure::Impossible(step))?;
            two.copy_from_slice(&node.children.map(|child| child.bounds));
            count += 2;
        }
        let boxes = &boxes[..count];
        let mut measured = Measured { step, count: 0, software: 0, custom: 0 };
        let rays = self.finished.blob.header.rays;
        for index in (0..rays).step_by((rays / RAYS).max(1) as usize) {
            let ray = self.ray(index).ok_or(Failure::Impossible(step))?;
            let t_max = ray.t_max().to_bits();
            let (software, ()) =
                self.timed(|_| test(&SlabTest, &ray, boxes, t_max, &mut first[..count]));
            let (custom, ()) = self.timed(|bench| {
                let custom = CustomBoxTest::new(bench.cfu, &ray);
                test(&custom, &ray, boxes, t_max, &mut second[..count]);
            });
            if first != second {
                return Err(Failure::Differ(step));
            }
            measured.count += count as u32;
            measured.software += software;
            measured.custom += custom;
        }
        Ok(measured)
    }

    /// Encodes the children of the last nodes, each as if it were a root.
    fn encode(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
        let step = Step::Encode;
        let quantization = Quantization::RELATIVE;
        let Storage { families, pairs: [first, second], .. } = storage;
        families.clear();
        for node in self.last_nodes() {
            let Bvh2Node { children } = self.node(node).ok_or(Failure::Impossible(step))?;
            let bounds = children[0].bounds.union(&children[1].bounds);
            let placement =
                Placement::root(&bounds, &quantization).ok_or(Failure::Impossible(step))?;
            families.push((placement, children)).map_err(|_| Failure::Impossible(step))?;
        }
        let families = families.as_slice();
        let (software, ()) =
            self.timed(|_| encode(&mut PlacementEncoder, &quantization, families, first));
        let (custom, ()) = self.timed(|bench| {
            let mut custom = CustomEncoder::new(bench.cfu, quantization);
            encode(&mut custom, &quantization, families, second);
        });
        if first != second {
            return Err(Failure::Differ(step));
        }
        Ok(Measured { step, count: families.len() as u32, software, custom })
    }

    /// Compresses the whole tree.
    fn compress(&mut self) -> Result<Measured, Failure> {
        let step = Step::Compress;
        let impossible = Failure::Impossible(step);
        let Finished { layout, exact, .. } = *self.finished;
        let quantization = Quantization::RELATIVE;
        let size = exact.node_count * quantization.node_bytes();
        let target = Region { size, ..layout.quantized_nodes };
        let beside = Region { size, ..layout.free };
        if size > layout.free.size {
            return Err(impossible);
        }
        let (software, tree) = self.timed(|bench| {
            compress_top_down(bench.bus, &exact, target, &quantization, &mut ()).ok()
        });
        tree.ok_or(impossible)?;
        let (custom, tree) = self.timed(|bench| {
            let mut encoder = CustomEncoder::new(bench.cfu, quantization);
            compress_encoding(&mut encoder, bench.bus, &exact, beside, &quantization, &mut ()).ok()
        });
        tree.ok_or(impossible)?;
        self.equal(step, target, beside)?;
        Ok(Measured { step, count: exact.node_count, software, custom })
    }

    /// Traces all rays through 64-byte nodes.
    fn trace(&mut self) -> Result<Measured, Failure> {
        let step = Step::Trace;
        let impossible = Failure::Impossible(step);
        let (hits, free) = (self.finished.layout.hits, self.finished.layout.free);
        let beside = Region { size: hits.size, ..free };
        if hits.size > free.size {
            return Err(impossible);
        }
        let (software, done) = self.timed(|bench| bench.trace_all(hits, |_, _| SlabTest));
        done.ok_or(impossible)?;
        let (custom, done) = self.timed(|bench| bench.trace_all(beside, CustomBoxTest::new));
        done.ok_or(impossible)?;
        self.equal(step, hits, beside)?;
        Ok(Measured { step, count: self.finished.blob.header.rays, software, custom })
    }

    /// Traces all rays, each with the box test that `test` makes for it.
    fn trace_all<'a, T: BoxTest>(
        &'a mut self,
        hits: Region,
        test: impl Fn(&'a C, &Ray) -> T,
    ) -> Option<()> {
        let Finished { blob, exact, .. } = self.finished;
        let (triangles, triangle_count) = (blob.triangles, blob.header.triangles);
        let scene = Scene { tree: Tree { ..*exact }, triangles, triangle_count };
        for index in 0..blob.header.rays {
            let ray = self.ray(index)?;
            let test = test(self.cfu, &ray);
            let hit = trace_testing(test, self.bus, &scene, &ray, Query::Closest, &mut ());
            let bytes = Hit::to_bytes(hit.ok()?.as_ref());
            self.bus.write(hits.record(index, Hit::BYTES as u32)?, &bytes).ok()?;
        }
        Some(())
    }

    /// Compares two regions of one size.
    fn equal(&mut self, step: Step, a: Region, b: Region) -> Result<(), Failure> {
        for word in 0..a.size / 4 {
            let (Some(a), Some(b)) = (self.word(a, word), self.word(b, word)) else {
                return Err(Failure::Impossible(step));
            };
            if a != b {
                return Err(Failure::Differ(step));
            }
        }
        Ok(())
    }

    fn word(&mut self, region: Region, index: u32) -> Option<[u8; 4]> {
        let mut bytes = [0; 4];
        self.bus.read(region.record(index, 4)?, &mut bytes).ok()?;
        Some(bytes)
    }

    /// The nodes that are measured on: parents come behind their children.
    fn last_nodes(&self) -> impl Iterator<Item = NodeIndex> + use<B, K, C> {
        let nodes = self.finished.exact.node_count;
        (nodes.saturating_sub(NODES as u32)..nodes).map(NodeIndex)
    }

    fn node(&mut self, NodeIndex(index): NodeIndex) -> Option<Bvh2Node> {
        let mut bytes = [0; Bvh2Node::BYTES];
        let addr = self.finished.exact.nodes.record(index, Bvh2Node::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Bvh2View::new(&bytes).to_repr()
    }

    fn ray(&mut self, index: u32) -> Option<Ray> {
        let mut bytes = [0; Ray::BYTES];
        let addr = self.finished.blob.rays.record(index, Ray::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Ray::from_bytes(&bytes).ok()
    }

    fn triangle(&mut self, index: u32) -> Option<Triangle> {
        let mut bytes = [0; Triangle::BYTES];
        let addr = self.finished.blob.triangles.record(index, Triangle::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Some(Triangle::from_bytes(&bytes))
    }
}

/// Merges runs of `run` codes; `order` gets the slot of each. `heads` has the place of the next code of each.
#[inline(never)]
fn merge<H: MergeHeap>(
    heap: &mut H,
    codes: &[u32],
    run: usize,
    heads: &mut [u32; RUNS],
    order: &mut [u32],
) {
    for out in order {
        let HeapEntry { slot, .. } = heap.top();
        *out = slot;
        let Some(head) = heads.get_mut(slot as usize) else { return };
        let next = codes.get(slot as usize * run + *head as usize);
        let next = next.filter(|_| (*head as usize) < run);
        *head += 1;
        let code = next.map_or(HeapEntry::INFINITE, |&code| u64::from(code));
        heap.replace(HeapEntry { code, slot });
    }
}

#[inline(never)]
fn test<T: BoxTest>(
    test: &T,
    ray: &Ray,
    boxes: &[Aabb],
    t_max: i64,
    times: &mut [Option<Option<i64>>],
) {
    for (bounds, time) in boxes.iter().zip(times) {
        *time = test.entry(ray, bounds, t_max);
    }
}

#[inline(never)]
fn encode<E: PairEncoder>(
    encoder: &mut E,
    quantization: &Quantization,
    families: &[(Placement, [Subtree; 2])],
    pairs: &mut heapless::Vec<Encoded, NODES>,
) {
    pairs.clear();
    for (placement, children) in families {
        // As many as there is room for.
        let _ = pairs.push(encoder.encode(placement, children, quantization));
    }
}
