//! The inner steps alone, many times in a row.

use xylem_core::compress::{PairEncoder, Placement, PlacementEncoder};
use xylem_core::geom::{Aabb, Ray};
use xylem_core::mem::Bus;
use xylem_core::node::{Bvh2Node, NodeIndex, Quantization, Subtree};
use xylem_core::num::{MortonCoder, MortonWidth};
use xylem_core::sort::{HeapEntry, ReplaceHeap};
use xylem_core::traverse::{BoxTest, SlabTest};
use xylem_firmware::job::Clock;

use super::bench::Bench;
use super::{Failure, Measured, Step};
use crate::{Cfu, CustomBoxTest, CustomEncoder, CustomHeap, MergeHeap};

/// Runs that are merged: those of P2 with M = 8192 and B = 16.
pub const RUNS: usize = 256;

/// Codes of a run at most.
const RUN: usize = 32;

/// Nodes whose children are tested and encoded.
const NODES: usize = 64;

/// Rays that every box is tested against.
const RAYS: u32 = 8;

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

impl<B: Bus, K: Clock, C: Cfu> Bench<'_, B, K, C> {
    /// Merges sorted runs of the scene's codes.
    pub(super) fn heap(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
        let step = Step::Heap;
        let Storage { codes, heads, matches, entries, orders: [first, second], .. } = storage;
        let header = &self.finished.blob.header;
        let coder = MortonCoder::new(header.grid, MortonWidth::Bits30);
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
    pub(super) fn box_test(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
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
    pub(super) fn encode(&mut self, storage: &mut Storage) -> Result<Measured, Failure> {
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

    /// The nodes that are measured on: parents come behind their children.
    fn last_nodes(&self) -> impl Iterator<Item = NodeIndex> + use<B, K, C> {
        let nodes = self.finished.exact.node_count;
        (nodes.saturating_sub(NODES as u32)..nodes).map(NodeIndex)
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
