//! `xy_cfu` executing instructions as the soft core would, and the steps that stand on them against the core's.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use heapless::Vec;
use xylem_core::compress::{PairEncoder, PlacementEncoder};
use xylem_core::geom::Aabb;
use xylem_core::node::{Child, Coordinates, NodeIndex, Quantization, QuantizedPair, Subtree};
use xylem_core::sort::{HeapEntry, ReplaceHeap};
use xylem_core::traverse::{BoxTest, SlabTest};
use xylem_custom::{Cfu, CustomBoxTest, CustomEncoder, CustomHeap, MergeHeap, Unit as CfuUnit};

use crate::bench::{Bench, Stop, Waves};
use crate::context::family;
use crate::pins;
use crate::random::Random;
use crate::traverser::geometry;
use crate::verilate::{self, CosimError, Mutation, Unit};

/// Builds the unit, with a fault if `mutation` says so, and returns the library's path.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    verilate::unit(
        &Unit { top: "xy_cfu", files: "cfu.f", config: "default", parameters: &[] },
        mutation,
    )
}

pins!(Pins {
    cmd_valid_i, cmd_function_i, cmd_a_i, cmd_b_i, rsp_ready_i;
    cmd_ready_o, rsp_valid_o, rsp_output_o,
});

/// The unit on the bench. Commands come after random pauses and responses are taken after others, at times in the
/// cycle of the next command.
#[derive(Debug)]
pub struct CfuRtl(RefCell<Core>);

/// The soft core's side of the port.
#[derive(Debug)]
struct Core {
    bench: Bench,
    pins: Pins,
    random: Random,
    /// A response stands that was not taken yet.
    pending: Option<u64>,
    /// From which cycle on a verdict, and what is said of a child, are ready.
    verdict_ready: u64,
    child_ready: u64,
    commands: u64,
    stop: Option<Stop>,
}

impl CfuRtl {
    /// Loads the unit of a library.
    ///
    /// # Errors
    /// As [`Bench::load`].
    pub fn load(library: &Path, seed: u64, waves: Waves) -> Result<Self, Stop> {
        let bench = Bench::load(library, seed, waves)?;
        let pins = Pins::new(&bench.rtl);
        Ok(Self(RefCell::new(Core {
            bench,
            pins,
            random: Random::new(seed),
            pending: None,
            verdict_ready: 0,
            child_ready: 0,
            commands: 0,
            stop: None,
        })))
    }

    /// How many instructions were executed.
    ///
    /// # Errors
    /// The first cycle in which a handshake was not as the unit's header says, or the RTL failed. Answers since then
    /// are 0.
    pub fn finish(self) -> Result<u64, Stop> {
        let core = self.0.into_inner();
        core.stop.map_or(Ok(core.commands), Err)
    }

    fn mismatch(&self, what: &str, model: String, rtl: String) -> Stop {
        let mut core = self.0.borrow_mut();
        let cycle = core.bench.cycle();
        core.stop.take().unwrap_or(Stop::Mismatch { cycle, port: what.to_owned(), model, rtl })
    }
}

impl Cfu for CfuRtl {
    fn call<const UNIT: u32, const OP: u32>(&self, a: u32, b: u32) -> u32 {
        let core = &mut *self.0.borrow_mut();
        if core.stop.is_some() {
            return 0;
        }
        core.execute(OP << 3 | UNIT, a, b).unwrap_or_else(|stop| {
            core.stop = Some(stop);
            0
        })
    }
}

impl Core {
    fn execute(&mut self, function: u32, a: u32, b: u32) -> Result<u32, Stop> {
        // Nobody looks at the payload before it is valid.
        self.bench.rtl.set(self.pins.cmd_valid_i, false);
        self.bench.rtl.set(self.pins.cmd_function_i, self.random.bits());
        for _ in 0..self.random.below(8).saturating_sub(4) {
            self.cycle()?;
        }
        self.bench.rtl.set(self.pins.cmd_valid_i, true);
        self.bench.rtl.set(self.pins.cmd_function_i, function);
        self.bench.rtl.set(self.pins.cmd_a_i, a);
        self.bench.rtl.set(self.pins.cmd_b_i, b);
        while !self.cycle()? {}
        self.commands += 1;

        let taken = self.bench.cycle() - 1;
        let (unit, op) = (function & 7, function >> 3);
        if unit == CfuUnit::BOXES && op == 10 {
            self.verdict_ready = taken + 5;
        }
        if unit == CfuUnit::ENCODE && op < 16 {
            self.child_ready = taken + 3;
        }
        // The answer stands in the cycle after the command.
        self.bench.rtl.set(self.pins.cmd_valid_i, false);
        self.bench.rtl.set(self.pins.rsp_ready_i, false);
        self.bench.rtl.settle();
        self.bench.expect(self.pins.rsp_valid_o, true)?;
        let answer = self.bench.rtl.get(self.pins.rsp_output_o);
        self.pending = Some(answer);
        Ok(answer as u32)
    }

    /// A cycle with the command as it is set; whether that is taken.
    fn cycle(&mut self) -> Result<bool, Stop> {
        let Self { bench, pins, random, .. } = self;
        let ready = random.below(4) > 0;
        bench.rtl.set(pins.rsp_ready_i, ready);
        bench.rtl.settle();
        bench.expect(pins.rsp_valid_o, self.pending.is_some())?;
        if let Some(answer) = self.pending {
            bench.expect(pins.rsp_output_o, answer)?;
        }
        let valid = bench.rtl.get_input(pins.cmd_valid_i) != 0;
        let function = bench.rtl.get_input(pins.cmd_function_i) as u32;
        let (unit, op) = (function & 7, function >> 3);
        let wanted = match unit {
            CfuUnit::BOXES if op == 16 => self.verdict_ready,
            CfuUnit::ENCODE if op >= 16 => self.child_ready,
            _ => 0,
        };
        let room = self.pending.is_none() || ready;
        let taken = valid && room && bench.cycle() >= wanted;
        if valid {
            bench.expect(pins.cmd_ready_o, taken)?;
        }
        if ready {
            self.pending = None;
        }
        bench.edge()?;
        Ok(taken)
    }
}

/// Merges random codes by [`CustomHeap`] and by the core's heap; returns how many tops were replaced.
///
/// # Errors
/// The first difference.
pub fn check_heap(cfu: &CfuRtl, random: &mut Random, replaces: u64) -> Result<u64, Stop> {
    let mut done = 0;
    while done < replaces {
        let slots = 1 << (1 + random.below(5));
        // Few codes make ties, which slots decide.
        let codes = [4, 1 << 30][random.below(2) as usize];
        let first: std::vec::Vec<u64> = (0..slots).map(|_| random.below(codes)).collect();
        let mut storage = Vec::<HeapEntry, 64>::new();
        let heap = ReplaceHeap::new(storage.as_mut_view(), slots as usize, 30);
        let mut software = heap.unwrap_or_else(|lacks| unreachable!("{lacks} entries lack"));
        for (slot, &code) in (0..).zip(&first) {
            software.insert(HeapEntry { code, slot });
        }
        let mut matches = vec![0; slots as usize];
        let custom = CustomHeap::new(cfu, &mut matches, first.iter().copied());
        let Some(mut custom) = custom else { unreachable!("a power of two of slots") };
        for _ in 0..4 * slots {
            let (a, b) = (MergeHeap::top(&software), custom.top());
            if a != b {
                return Err(cfu.mismatch("top", format!("{a:?}"), format!("{b:?}")));
            }
            let ended = random.below(16) == 0;
            let code = if ended { HeapEntry::INFINITE } else { random.below(codes) };
            let next = HeapEntry { code, ..a };
            MergeHeap::replace(&mut software, next);
            custom.replace(next);
            done += 1;
        }
    }
    Ok(done)
}

/// Tests random boxes by [`CustomBoxTest`] and by the core; returns how many were hit, missed, and off the grid.
///
/// # Errors
/// The first difference.
pub fn check_boxes(cfu: &CfuRtl, random: &mut Random, boxes: u64) -> Result<[u64; 3], Stop> {
    let mut counts = [0; 3];
    while counts.iter().sum::<u64>() < boxes {
        let mut bounds = geometry::aabb(random);
        let ray = match random.below(3) {
            0 => geometry::ray(random),
            1 => geometry::ray_through(random, bounds.max),
            _ => geometry::ray_through(random, bounds.min + (bounds.max - bounds.min) / 2),
        };
        let custom = CustomBoxTest::new(cfu, &ray);
        for _ in 0..4 {
            if random.below(16) == 0 {
                let beyond = [1 << 23, -(1 << 23) - 1, i32::MAX, i32::MIN];
                let corner = if random.below(2) == 0 { &mut bounds.min } else { &mut bounds.max };
                corner[random.below(3) as usize] = beyond[random.below(4) as usize];
            }
            let (t_min, t_max) = (ray.t_min().to_bits(), ray.t_max().to_bits());
            let limit = t_min + random.below((t_max - t_min) as u64 + 1) as i64;
            let t_max = [t_max, limit][random.below(2) as usize];
            let wanted = SlabTest.entry(&ray, &bounds, t_max);
            let got = custom.entry(&ray, &bounds, t_max);
            if wanted != got {
                return Err(cfu.mismatch("entry", format!("{wanted:?}"), format!("{got:?}")));
            }
            counts[wanted.map_or(2, |entry| usize::from(entry.is_none()))] += 1;
            bounds = geometry::aabb(random);
        }
    }
    Ok(counts)
}

/// Encodes the children of random nodes by [`CustomEncoder`] and by the core; returns for how many nodes both
/// children were inside, and for how many not.
///
/// # Errors
/// The first difference.
pub fn check_encoder(cfu: &CfuRtl, random: &mut Random, nodes: u64) -> Result<[u64; 2], Stop> {
    let mut counts = [0; 2];
    while counts.iter().sum::<u64>() < nodes {
        let coordinates = [Coordinates::Relative, Coordinates::Modulo][random.below(2) as usize];
        let quantization = Quantization { coordinates, ..Quantization::RELATIVE };
        let mut custom = CustomEncoder::new(cfu, quantization);
        for _ in 0..16 {
            let Some((place, bounds)) = family(random, &quantization, 1) else { continue };
            let mut child = |bounds: Aabb| {
                let index = random.below(u64::from(QuantizedPair::MAX_POINTER) + 1) as u32;
                let leaf = Child::Leaf { first: index, count: Child::TO_MARK };
                let child =
                    if random.below(2) == 0 { leaf } else { Child::Inner(NodeIndex(index)) };
                Subtree { bounds, child }
            };
            let centre = (bounds.min + bounds.max) >> 1;
            let mut children = [child(bounds), child(Aabb::new(centre, bounds.max))];
            if random.below(16) == 0 {
                // Off the grid by what the unit does not keep.
                let bounds = &mut children[random.below(2) as usize].bounds;
                let axis = random.below(3) as usize;
                bounds.min[axis] += 1 << 24;
                bounds.max[axis] += 1 << 24;
            }
            let wanted = PlacementEncoder.encode(&place, &children, &quantization);
            let got = custom.encode(&place, &children, &quantization);
            if wanted != got {
                return Err(cfu.mismatch("pair", format!("{wanted:?}"), format!("{got:?}")));
            }
            counts[usize::from(wanted.is_none())] += 1;
        }
    }
    Ok(counts)
}
