//! Memory that does not hold what it should: an answer or a typed error, never a panic, and never
//! more work than a whole tree.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use glam::IVec3;
use rayon::prelude::*;
use xylem::bus::{FlatMemory, MemoryError};
use xylem::scene::Random;
use xylem_core::compress::compress_top_down;
use xylem_core::emit::{Emitter, Step};
use xylem_core::error::BuildError;
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Child, NodeFormat, NodeIndex, Quantization};
use xylem_core::quality::{self, Malformed};
use xylem_core::refit::{InPlace, refit};
use xylem_core::sort::{Item, RecordFormat};
use xylem_core::traverse::{Query, Scene};
use xylem_tests::job::{Job, trace};
use xylem_tests::rays::hard_ray;
use xylem_tests::trees::{Forest, soup};

const SEED: u64 = 0x5eed_c0de;

/// Cases of the corrupt-tree test.
const CASES: u64 = 1_000_000;

/// Cases that share a copy of memory.
const BATCH: u64 = 500;

/// What came of the cases: how many ended in which way.
type Outcomes = BTreeMap<String, u64>;

fn merge(mut a: Outcomes, b: Outcomes) -> Outcomes {
    for (what, count) in b {
        *a.entry(what).or_default() += count;
    }
    a
}

/// Three forests and room to compress or refit into.
struct Target {
    triangles: Vec<Triangle>,
    bounds: Aabb,
    forest: Forest,
    room: Region,
}

impl Target {
    /// A random scene; the grid of `shift` fewer bits makes it small.
    fn new(count: usize, shift: i32) -> Self {
        let mut triangles = soup(&mut Random::new(SEED + count as u64), count);
        for vertex in triangles.iter_mut().flat_map(|t| &mut t.vertices) {
            *vertex >>= shift;
        }
        let mut forest = Forest::grow(&triangles);
        let size = forest.memory.bytes().len();
        let room = Region::new(size as u32, 64 * count as u32);
        let mut memory = FlatMemory::new(size + room.size as usize);
        memory.bytes_mut()[..size].copy_from_slice(forest.memory.bytes());
        forest.memory = memory;
        let bounds = forest.exact.tree.root.expect("there are triangles").bounds;
        Self { triangles, bounds, forest, room }
    }
}

/// Memory with a limit on accesses, and on where writes may go.
struct Fused<'a> {
    memory: &'a mut FlatMemory,
    accesses_left: u64,
    room: Region,
}

impl Fused<'_> {
    fn burn(&mut self) {
        assert!(self.accesses_left > 0, "more accesses than a whole tree takes");
        self.accesses_left -= 1;
    }
}

impl Bus for Fused<'_> {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        self.burn();
        self.memory.read(addr, buf)
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        self.burn();
        let inside = addr >= self.room.base
            && addr.0 + bytes.len() as u32 <= self.room.base.0 + self.room.size;
        assert!(inside, "a write to {addr}, outside the target region");
        self.memory.write(addr, bytes)
    }
}

/// Damage to bytes, undone when done.
#[derive(Default)]
struct Damage {
    before: Vec<(usize, u8)>,
}

impl Damage {
    fn set(&mut self, memory: &mut FlatMemory, at: usize, value: u8) {
        let byte = &mut memory.bytes_mut()[at];
        self.before.push((at, *byte));
        *byte = value;
    }

    /// Damages one of the regions that a scene is read from.
    fn strike(&mut self, random: &mut Random, memory: &mut FlatMemory, scene: &Scene) {
        let tree = &scene.tree;
        let stride = tree.format.bytes() as usize;
        let (region, stride) = match random.below(4) {
            0 => (tree.leaf_table, 4),
            1 => (scene.triangles, 40),
            _ => (tree.nodes, stride),
        };
        let records = region.size as usize / stride;
        if records == 0 {
            return;
        }
        let start = region.base.0 as usize + random.below(records) * stride;
        match random.below(5) {
            0 => {
                let at = start + random.below(stride);
                self.set(memory, at, memory.bytes()[at] ^ 1 << random.below(8));
            }
            1 => {
                let at = start + random.below(stride);
                self.set(memory, at, random.bits() as u8);
            }
            2 => {
                let at = start + random.below(stride / 4) * 4;
                for (i, byte) in word(random).to_le_bytes().into_iter().enumerate() {
                    self.set(memory, at + i, byte);
                }
            }
            3 => {
                for at in start..start + stride {
                    self.set(memory, at, random.bits() as u8);
                }
            }
            _ => {
                // A copy of another record: nodes that are reached twice, and cycles.
                let other = region.base.0 as usize + random.below(records) * stride;
                for i in 0..stride {
                    self.set(memory, start + i, memory.bytes()[other + i]);
                }
            }
        }
    }

    fn undo(self, memory: &mut FlatMemory) {
        for (at, byte) in self.before.into_iter().rev() {
            memory.bytes_mut()[at] = byte;
        }
    }
}

/// A 32-bit number, often one at the end of some range.
fn word(random: &mut Random) -> u32 {
    let grid = [1 << 23, (1 << 23) - 1, 0xff80_0000, 0xff7f_ffff];
    let edges = [0, 1, 255, 256, 1 << 27, 1 << 31, i32::MAX as u32, grid[random.below(4)]];
    match random.below(4) {
        0 => edges[random.below(edges.len())],
        1 => u32::MAX - random.below(3) as u32,
        2 => random.below(64) as u32,
        _ => random.bits() as u32,
    }
}

/// Damages the descriptor.
fn forge(random: &mut Random, scene: &mut Scene) {
    let tree = &mut scene.tree;
    match random.below(8) {
        0 => tree.node_count = word(random),
        1 => tree.entry_count = word(random),
        2 => scene.triangle_count = word(random),
        3 => {
            let formats = [
                NodeFormat::Bvh2,
                NodeFormat::Quantized(Quantization::RELATIVE),
                NodeFormat::Quantized(Quantization::MODULO),
            ];
            tree.format = formats[random.below(3)];
        }
        4 => tree.root = None,
        _ => {
            let Some(root) = &mut tree.root else { return };
            match random.below(3) {
                0 => {
                    root.child = match random.below(2) {
                        0 => Child::Inner(NodeIndex(word(random))),
                        _ => Child::Leaf { first: word(random), count: word(random) },
                    }
                }
                1 => {
                    let mut any = || word(random) as i32;
                    root.bounds.min = IVec3::new(any(), any(), any());
                    root.bounds.max = IVec3::new(any(), any(), any());
                }
                _ => {
                    let corner = match random.below(2) {
                        0 => &mut root.bounds.min,
                        _ => &mut root.bounds.max,
                    };
                    corner[random.below(3)] = word(random) as i32;
                }
            }
        }
    }
}

/// One case: damage, one operation, repair.
fn case(target: &Target, memory: &mut FlatMemory, random: &mut Random, rays: &[Ray]) -> String {
    let (_, scene) = target.forest.scenes()[random.below(3)];
    let mut scene = *scene;
    let mut damage = Damage::default();
    if random.below(3) > 0 {
        for _ in 0..=random.below(3) {
            damage.strike(random, memory, &scene);
        }
    }
    if random.below(3) == 0 {
        for _ in 0..=random.below(2) {
            forge(random, &mut scene);
        }
    }
    let tree = &scene.tree;
    let nodes = u64::from(tree.node_count.min(tree.nodes.size / tree.format.bytes()));
    let entries = u64::from(tree.entry_count.min(tree.leaf_table.size / 4));
    let mut bus = Fused { memory, accesses_left: 2 * (nodes + entries), room: target.room };
    let outcome = match random.below(7) {
        0 => {
            let mut seen = vec![0; scene.triangle_count.min(1 << 12).div_ceil(32) as usize];
            match quality::check(&mut bus, &scene, &mut seen) {
                Ok(quality) => {
                    let _ = quality.sah_cost();
                    "check: well formed".to_owned()
                }
                Err(Malformed::Unreadable(error)) => format!("check: {}", first_word(&error)),
                Err(error) => format!("check: {}", first_word(&error)),
            }
        }
        1 => {
            let quantization =
                if random.below(2) == 0 { Quantization::RELATIVE } else { Quantization::MODULO };
            match compress_top_down(&mut bus, tree, target.room, &quantization, &mut ()) {
                Ok(_) => "compress: done".to_owned(),
                Err(error) => format!("compress: {}", first_word(&error)),
            }
        }
        2 => {
            let triangles = (scene.triangles, scene.triangle_count);
            let mut sink = InPlace { nodes: target.room };
            match refit(&mut bus, tree, triangles, &mut sink, &mut ()) {
                Ok(refitted) => {
                    assert_eq!(refitted.root.is_some(), tree.root.is_some());
                    "refit: done".to_owned()
                }
                Err(error) => format!("refit: {}", first_word(&error)),
            }
        }
        n => {
            let ray = &rays[random.below(rays.len())];
            let query = if n == 3 { Query::Any } else { Query::Closest };
            match trace(&mut bus, &scene, ray, query) {
                Ok(Some(hit)) => {
                    assert!(hit.primitive.0 < scene.triangle_count);
                    assert!(hit.t > ray.t_min() && hit.t <= ray.t_max());
                    "trace: hit".to_owned()
                }
                Ok(None) => "trace: miss".to_owned(),
                Err(error) => format!("trace: {}", first_word(&error)),
            }
        }
    };
    damage.undo(memory);
    outcome
}

/// The name of an enum's variant.
fn first_word(value: &impl std::fmt::Debug) -> String {
    let text = format!("{value:?}");
    text.split([' ', '(', '{']).next().unwrap_or_default().to_owned()
}

#[test]
fn corrupt_trees_give_an_answer_or_a_typed_error_in_bounded_work() {
    // The last one is so small that its local grids are the finest, where coordinates are not
    // scaled down before they are counted.
    let targets =
        [(1, 0), (3, 0), (24, 0), (90, 0), (30, 18)].map(|(n, shift)| Target::new(n, shift));
    let run = |batch: u64| {
        let target = &targets[batch as usize % targets.len()];
        let mut random = Random::stream(SEED, batch);
        let mut memory = target.forest.memory.clone();
        let rays: Vec<Ray> =
            (0..32).map(|_| hard_ray(&mut random, &target.triangles, &target.bounds).1).collect();
        let mut outcomes = Outcomes::new();
        for number in 0..BATCH {
            let one = AssertUnwindSafe(|| case(target, &mut memory, &mut random, &rays));
            let outcome = catch_unwind(one)
                .unwrap_or_else(|_| panic!("case {number} of batch {batch}, seed {SEED:#x}"));
            *outcomes.entry(outcome).or_default() += 1;
        }
        assert!(
            memory.bytes()[..target.room.base.0 as usize]
                == target.forest.memory.bytes()[..target.room.base.0 as usize]
        );
        outcomes
    };
    let outcomes = (0..CASES / BATCH).into_par_iter().map(run).reduce(Outcomes::new, merge);
    println!("{CASES} corrupt trees, seed {SEED:#x}: {outcomes:#?}");
    for what in [
        "trace: hit",
        "trace: miss",
        "trace: CorruptNode",
        "trace: CorruptLeaf",
        "trace: CorruptTriangle",
        "trace: OutOfRegion",
        "compress: done",
        "compress: CorruptNode",
        "refit: done",
        "refit: CorruptNode",
        "refit: CorruptLeaf",
        "refit: InvalidPrimitive",
        "refit: RegionFull",
        "check: well formed",
        "check: ChildOutside",
        "check: PrimitiveOutside",
        "check: PrimitiveTwice",
        "check: Unreached",
        "check: CorruptNode",
        "check: CorruptLeaf",
    ] {
        assert!(outcomes.get(what).is_some_and(|&count| count > 10), "{what} hardly ever happened");
    }
}

/// Memory that garbles some reads of the run regions.
struct Forgetful {
    memory: FlatMemory,
    runs: [Region; 2],
    random: Random,
}

impl Bus for Forgetful {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        self.memory.read(addr, buf)?;
        let inside = |r: &Region| addr >= r.base && addr.0 < r.base.0 + r.size;
        if self.runs.iter().any(inside) && self.random.below(4) == 0 {
            for _ in 0..=self.random.below(8) {
                buf[self.random.below(buf.len())] ^= 1 << self.random.below(8);
            }
        }
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        self.memory.write(addr, bytes)
    }
}

#[test]
fn a_build_over_runs_that_change_ends_in_a_tree_or_a_typed_error() {
    let mut outcomes = Outcomes::new();
    for record in [RecordFormat::Box32, RecordFormat::Packed22, RecordFormat::Pair8] {
        let job = Job::new(&mut Random::new(SEED), 300, record);
        let found = (0..2000u64).into_par_iter().map(|number| {
            let runs = [job.layout.build.runs_a, job.layout.build.runs_b];
            let random = Random::stream(SEED, number);
            let mut bus = Forgetful { memory: job.memory.clone(), runs, random };
            let one = AssertUnwindSafe(|| job.build(&mut bus, &mut ()));
            let built = catch_unwind(one)
                .unwrap_or_else(|_| panic!("case {number}, {record:?}, seed {SEED:#x}"));
            let outcome = match built {
                Ok(tree) => {
                    assert_eq!(tree.entry_count, 300);
                    "a tree".to_owned()
                }
                Err(error @ BuildError::Internal) => panic!("case {number}, {record:?}: {error}"),
                Err(error) => first_word(&error),
            };
            Outcomes::from([(format!("{record:?}: {outcome}"), 1)])
        });
        outcomes = merge(outcomes, found.reduce(Outcomes::new, merge));
    }
    println!("builds over runs that change: {outcomes:#?}");
    assert!(outcomes["Box32: a tree"] > 100);
}

#[test]
fn an_emitter_keeps_its_bounds_whatever_order_codes_come_in() {
    // Two codes in turn: the split is at the same bit each time, which sorted codes never do.
    let bounds = Aabb::new(IVec3::ZERO, IVec3::ONE);
    for codes in [[0, 1], [1 << 62, 0], [(1 << 63) - 1, 1 << 20]] {
        let mut emitter = Emitter::new(1);
        let (mut nodes, mut root) = (0, None);
        let mut run = |emitter: &mut Emitter| {
            while !emitter.is_ready() {
                match emitter.step(&mut ()) {
                    Step::Node(_) => nodes += 1,
                    Step::Root(subtree) => root = Some(subtree),
                    Step::Push | Step::Cell(_) | Step::JoinLeaves { .. } | Step::Idle => {}
                }
            }
        };
        for i in 0..1000 {
            let item = Item { code: codes[i % 2], bounds, reference: i as u32 };
            emitter.accept(&item, &mut ()).expect("the emitter is ready");
            run(&mut emitter);
        }
        emitter.finish();
        run(&mut emitter);
        assert_eq!(nodes, 999, "no subtree is lost");
        assert_eq!(root.map(|root| root.child), Some(Child::Inner(NodeIndex(998))));
    }
}
