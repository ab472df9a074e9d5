//! The hierarchy emitter: what it is fed, and the lockstep with its model.

use std::path::{Path, PathBuf};

use glam::IVec3;
use xylem::machine::emitter::{EmitterUnit, Inputs};
use xylem_core::geom::Aabb;
use xylem_core::sort::Item;

use crate::bench::{Bench, Stop, Waves};
use crate::pins;
use crate::random::Random;
use crate::types::{record_bytes, split, subtree_bytes};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// Builds the emitter, with a fault if `mutation` says so.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let unit = Unit { top: "xy_emitter", files: "emitter.f", config: "default", parameters: &[] };
    verilate::unit(&unit, mutation)
}

/// Primitives with boxes of all sizes; codes are often equal, in some sequences always. A few sequences
/// are not sorted, as after a fault in memory.
pub fn items(random: &mut Random, code_bits: u32) -> Vec<Item> {
    let longest = [0, 1, 3, 40, 700][random.below(5) as usize];
    let count = random.below(longest + 1);
    let alike = [0, 0, 1, 3, 200][random.below(5) as usize];
    // Codes that differ in their lowest bits alone, or in all.
    let base = random.bits() >> (64 - code_bits);
    let below = [2, 5, u64::from(code_bits)][random.below(3) as usize];
    let mut codes: Vec<u64> = Vec::new();
    while (codes.len() as u64) < count {
        let code = base ^ (random.bits() >> (64 - below));
        let times = 1 + random.below(alike + 1);
        codes.extend((0..times).map(|_| code));
    }
    codes.truncate(count as usize);
    if random.below(6) > 0 {
        codes.sort_unstable();
    }
    let near = random.below(2) == 0;
    let mut item = |code| {
        let mut corner = || match near {
            // Where the code is, as far as it says.
            true => cell(code) + IVec3::from_array([0; 3].map(|_| random.bits() as i32 >> 22)),
            false => IVec3::from_array([0; 3].map(|_| random.bits() as i32 >> 8)),
        };
        let edge = IVec3::splat(1 << 23);
        let [a, b] = [corner(), corner()].map(|c| c.clamp(-edge, edge - 1));
        Item { code, bounds: Aabb::new(a.min(b), a.max(b)), reference: 0 }
    };
    let mut items: Vec<Item> = codes.into_iter().map(&mut item).collect();
    for item in &mut items {
        item.reference = random.bits() as u32 >> 1;
    }
    items
}

/// The lowest corner of the cell of a 63-bit code.
fn cell(code: u64) -> IVec3 {
    let axis = |axis: u32| {
        let bit = |i: u32| ((code >> (3 * i + axis) & 1) as i32) << (i + 3);
        (0..21).map(bit).sum::<i32>() - (1 << 23)
    };
    IVec3::new(axis(0), axis(1), axis(2))
}

/// What a run without a mismatch amounts to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Summary {
    /// Trees built.
    pub trees: u64,
    /// Primitives in them.
    pub items: u64,
    /// Nodes in them.
    pub nodes: u64,
    /// Cycles that the model took.
    pub model_cycles: u64,
    /// Cycles that the RTL took.
    pub rtl_cycles: u64,
}

impl Summary {
    /// Heads the rows.
    pub const HEADER: &str = "\
        | test | configuration | seed | trees | primitives | nodes | model cycles | RTL cycles \
        | delta |\n|---|---|---:|---:|---:|---:|---:|---:|---:|";

    /// A row of the table that [`Summary::HEADER`] heads.
    pub fn row(&self, test: &str, config: &str, seed: u64) -> String {
        let Self { trees, items, nodes, model_cycles, rtl_cycles } = *self;
        let delta = rtl_cycles as i64 - model_cycles as i64;
        format!(
            "| {test} | {config} | {seed} | {trees} | {items} | {nodes} | {model_cycles} \
             | {rtl_cycles} | {delta} |"
        )
    }
}

pins!(Pins {
    clear_i, max_leaf_i, item_valid_i, item_i, item_split_i, end_i, node_ready_i, entry_ready_i;
    item_ready_o, node_valid_o, node_o, left_o, right_o, entry_valid_o, entry_o, done_o, root_valid_o,
    root_o, node_count_o, leaf_count_o, entry_count_o,
});

/// Builds tree after tree over codes of `code_bits` bits for at least `cycles` cycles, with every output of
/// every cycle compared. Some trees are given up in the middle.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run(
    library: &Path,
    code_bits: u32,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    while bench.cycle() < cycles {
        let items = items(&mut random, code_bits);
        let max_leaf = [0, 1, 2, 4, 255][random.below(5) as usize];
        let tree = Tree {
            items: &items,
            max_leaf,
            pause: random.below(4),
            stall: random.below(4),
            // 0: to the end.
            give_up: [0, 0, 0, 1 + random.below(400)][random.below(4) as usize],
        };
        tree.build(&mut bench, &pins, &mut random, &mut summary)?;
    }
    summary.rtl_cycles = bench.cycle();
    Ok(summary)
}

/// A tree to be built, and how the unit's neighbours behave: they pause in `pause` or `stall` of 4
/// cycles.
#[derive(Debug)]
struct Tree<'a> {
    items: &'a [Item],
    max_leaf: u32,
    pause: u64,
    stall: u64,
    give_up: u64,
}

impl Tree<'_> {
    fn build(
        &self,
        bench: &mut Bench,
        pins: &Pins,
        random: &mut Random,
        summary: &mut Summary,
    ) -> Result<(), Stop> {
        let mut model = EmitterUnit::new(self.max_leaf);
        let mut items = self.items.iter().peekable();
        // The code of the last item that was taken: the first one's split says nothing.
        let mut before = u64::MAX >> 1;
        let (mut offered, mut entry_ready) = (false, false);
        bench.rtl.set(pins.max_leaf_i, self.max_leaf);
        let mut after = 0;
        for cycle in 1.. {
            // What is offered stays, and so does a ready while there is something to be taken.
            offered |= random.below(4) >= self.pause;
            let node_ready = random.below(4) >= self.stall;
            entry_ready |= random.below(4) >= self.stall;
            let item = if offered { items.peek().copied() } else { None };
            let end = offered && items.peek().is_none();
            let inputs = Inputs { item, end, node_ready, entry_ready };
            after += u64::from(model.is_done());
            let clear = after > 3 || cycle == self.give_up;

            let rtl = &mut bench.rtl;
            rtl.set(pins.clear_i, clear);
            rtl.set(pins.item_valid_i, item.is_some());
            let shown = item.copied().unwrap_or(Item::ZERO);
            rtl.set_bytes(pins.item_i, &record_bytes(&shown));
            rtl.set(pins.item_split_i, split(before, shown.code));
            rtl.set(pins.end_i, end);
            rtl.set(pins.node_ready_i, node_ready);
            rtl.set(pins.entry_ready_i, entry_ready);
            rtl.settle();

            bench.expect(pins.done_o, model.is_done())?;
            bench.expect(pins.root_valid_o, model.root().is_some())?;
            if let Some(root) = model.root() {
                bench.expect_bytes(pins.root_o, &subtree_bytes(&root))?;
            }
            for (pin, count) in [pins.node_count_o, pins.leaf_count_o, pins.entry_count_o]
                .into_iter()
                .zip(model.counts())
            {
                bench.expect(pin, count)?;
            }
            let (node, entry) = model.offers(&inputs);
            let outputs = model.tick(&inputs);
            bench.expect(pins.item_ready_o, outputs.item_ready)?;
            bench.expect(pins.node_valid_o, node.is_some())?;
            bench.expect(pins.entry_valid_o, entry.is_some())?;
            if let Some(node) = node {
                bench.expect_bytes(pins.node_o, &node.to_bytes())?;
                bench.expect_bytes(pins.left_o, &subtree_bytes(&node.children[0]))?;
                bench.expect_bytes(pins.right_o, &subtree_bytes(&node.children[1]))?;
            }
            if let Some(entry) = entry {
                bench.expect_bytes(pins.entry_o, &entry.to_bytes())?;
            }
            bench.edge()?;

            summary.model_cycles += 1;
            if outputs.item_ready && item.is_some() {
                before = shown.code;
                items.next();
                offered = false;
            }
            entry_ready &= outputs.entry.is_none();
            if node.is_none() && entry.is_none() {
                entry_ready &= random.below(8) > 0;
            }
            if clear {
                break;
            }
        }
        if model.is_done() {
            let [nodes, _, entries] = model.counts();
            summary.trees += 1;
            summary.items += u64::from(entries);
            summary.nodes += u64::from(nodes);
        }
        bench.rtl.set(pins.clear_i, 0u64);
        Ok(())
    }
}
