//! The emitter with its write ports: what it is fed, and the lockstep with its model.

use std::path::{Path, PathBuf};

use xylem::machine::emit::EmitUnit;
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::Region;
use xylem_core::node::{Bvh2Node, LeafEntry};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::sort::Item;

use crate::bench::{Bench, Stop, Waves};
use crate::emitter::{Summary, items};
use crate::pins;
use crate::random::Random;
use crate::types::{record_bytes, split, subtree_bytes};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// A configuration of the emitter with its write ports, named as in `configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EmitConfig {
    /// Its name.
    pub name: &'static str,
    /// Lines of a burst of nodes or leaf table entries.
    pub burst_lines: u32,
    /// Layers of treelets of the compressor beside it, which does nothing here.
    pub depth: u32,
}

impl EmitConfig {
    /// Bursts of two lines, no compressor.
    pub const SMALL: Self = Self { name: "small", burst_lines: 2, depth: 0 };
    /// Bursts of eight lines, the builder's.
    pub const PAPER: Self = Self { name: "paper", burst_lines: 8, depth: 2 };
    /// All of them.
    pub const ALL: [Self; 2] = [Self::SMALL, Self::PAPER];
}

/// Builds the unit in `config`, with a fault if `mutation` says so.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(config: EmitConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let parameters = [("BurstLines", config.burst_lines.into()), ("Depth", config.depth.into())];
    let unit =
        Unit { top: "xy_emit", files: "emit.f", config: config.name, parameters: &parameters };
    verilate::unit(&unit, mutation)
}

pins!(Pins {
    clear_i, start_i, node_base_i, node_size_i, leaf_base_i, leaf_size_i, max_leaf_i, compress_i,
    item_valid_i, item_i, item_split_i, end_i, node_wr_ready_i, leaf_wr_ready_i;
    item_ready_o, rd_valid_o, node_wr_valid_o, node_wr_addr_o, node_wr_data_o, node_wr_strb_o, node_wr_last_o,
    leaf_wr_valid_o, leaf_wr_addr_o, leaf_wr_data_o, leaf_wr_strb_o, leaf_wr_last_o, done_o, error_o,
    root_valid_o, root_o, node_count_o, leaf_count_o, entry_count_o,
});

/// Bytes of the memory that trees go to.
const MEMORY: usize = 1 << 17;

/// Builds tree after tree for at least `cycles` cycles, with every output of every cycle and the bytes
/// of every line compared. Some trees are given up in the middle, and some regions are too small.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run(
    library: &Path,
    config: EmitConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    while bench.cycle() < cycles {
        let items = items(&mut random, 63);
        let len = items.len() as u32;
        let mut size = |bytes: usize| match random.below(6) {
            0 => random.below(u64::from(len) * bytes as u64 + 1) as u32,
            _ => len * bytes as u32,
        };
        let regions = BuildRegions {
            nodes: Region::new(64, size(Bvh2Node::BYTES)),
            leaf_table: Region::new(1 << 16, size(LeafEntry::BYTES)),
            ..BuildRegions::default()
        };
        let tree = Tree {
            items: &items,
            regions,
            max_leaf: [0, 1, 2, 4, 255][random.below(5) as usize],
            burst: 64 * config.burst_lines,
            pause: random.below(4),
            stall: [0; 2].map(|_| [0, 32, 60, 63][random.below(4) as usize]),
            give_up: [0, 0, 0, 1 + random.below(400)][random.below(4) as usize],
        };
        tree.build(&mut bench, &pins, &mut random, &mut summary)?;
    }
    summary.rtl_cycles = bench.cycle();
    Ok(summary)
}

/// A tree to be built, and how the unit's neighbours behave: they pause in `pause` of 4
/// cycles, or `stall` of 64.
#[derive(Debug)]
struct Tree<'a> {
    items: &'a [Item],
    regions: BuildRegions,
    max_leaf: u32,
    burst: u32,
    pause: u64,
    /// Of the memory for nodes and for the leaf table.
    stall: [u64; 2],
    /// The cycle in which it is given up; 0 for never.
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
        self.start(bench, pins)?;
        summary.model_cycles += 1;
        let build = BuildConfig {
            max_leaf_size: self.max_leaf,
            write_burst: self.burst,
            ..BuildConfig::default()
        };
        let mut model = EmitUnit::new(&build, &self.regions);
        let mut image = vec![0; MEMORY];
        let mut items = self.items.iter().peekable();
        // The code of the last item that was taken: the first one's split says nothing.
        let mut before = u64::MAX >> 1;
        let (mut offered, mut after, mut failed) = (false, 0, 0u64);
        for cycle in 1.. {
            offered |= random.below(4) >= self.pause;
            let item = if offered { items.peek().copied() } else { None };
            let end = offered && items.peek().is_none();
            let ready = self.stall.map(|stall| random.below(64) >= stall);
            after += u64::from(model.is_finished() || failed > 0);
            let clear = after > 3 || cycle == self.give_up;

            let rtl = &mut bench.rtl;
            rtl.set(pins.clear_i, clear);
            rtl.set(pins.item_valid_i, item.is_some());
            let shown = item.copied().unwrap_or(Item::ZERO);
            rtl.set_bytes(pins.item_i, &record_bytes(&shown));
            rtl.set(pins.item_split_i, split(before, shown.code));
            rtl.set(pins.end_i, end);
            rtl.set(pins.node_wr_ready_i, ready[0]);
            rtl.set(pins.leaf_wr_ready_i, ready[1]);
            rtl.settle();
            summary.model_cycles += 1;
            if after <= 1 {
                bench.expect(pins.error_o, failed)?;
            }
            if failed > 0 {
                // The machine above stops here; what the unit still does is not the model's.
                bench.edge()?;
                if clear {
                    break;
                }
                continue;
            }

            bench.expect(pins.done_o, model.is_finished())?;
            bench.expect(pins.rd_valid_o, 0u64)?;
            let emitter = model.emitter();
            bench.expect(pins.root_valid_o, emitter.root().is_some())?;
            if let Some(root) = emitter.root() {
                bench.expect_bytes(pins.root_o, &subtree_bytes(&root))?;
            }
            for (pin, count) in [pins.node_count_o, pins.leaf_count_o, pins.entry_count_o]
                .into_iter()
                .zip(emitter.counts())
            {
                bench.expect(pin, count)?;
            }
            self.expect_lines(bench, pins, &model, &image)?;
            let did = model.tick(item, end, &mut image);
            match did {
                Ok(did) => {
                    if item.is_some() {
                        bench.expect(pins.item_ready_o, did.accepted)?;
                    }
                    if did.accepted {
                        before = shown.code;
                        items.next();
                        offered = false;
                    }
                }
                Err(error) => {
                    // The model names one region where both are full.
                    let nodes = model.emitter().counts()[0] * Bvh2Node::BYTES as u32;
                    let leaves = matches!(error, BuildError::RegionFull { region, .. }
                        if region == RegionName::LeafTable);
                    failed = u64::from(nodes > self.regions.nodes.size) | u64::from(leaves) << 1;
                }
            }
            for (writer, ready) in ready.into_iter().enumerate() {
                if ready && model.writers()[writer].offer().is_some() {
                    model.taken(writer);
                }
            }
            model.tick_writers(&mut image);
            bench.edge()?;
            if clear {
                break;
            }
        }
        if model.is_finished() {
            let [nodes, _, entries] = model.emitter().counts();
            summary.trees += 1;
            summary.items += u64::from(entries);
            summary.nodes += u64::from(nodes);
        }
        bench.rtl.set(pins.clear_i, 0u64);
        Ok(())
    }

    /// One cycle that hands over the regions.
    fn start(&self, bench: &mut Bench, pins: &Pins) -> Result<(), Stop> {
        let rtl = &mut bench.rtl;
        rtl.set(pins.start_i, 1u64);
        rtl.set(pins.node_base_i, self.regions.nodes.base.0);
        rtl.set(pins.node_size_i, self.regions.nodes.size);
        rtl.set(pins.leaf_base_i, self.regions.leaf_table.base.0);
        rtl.set(pins.leaf_size_i, self.regions.leaf_table.size);
        rtl.set(pins.max_leaf_i, self.max_leaf);
        rtl.set(pins.compress_i, 0u64);
        rtl.set(pins.item_valid_i, 0u64);
        rtl.set(pins.end_i, 0u64);
        rtl.settle();
        bench.edge()?;
        bench.rtl.set(pins.start_i, 0u64);
        Ok(())
    }

    /// Compares both write ports.
    fn expect_lines(
        &self,
        bench: &Bench,
        pins: &Pins,
        model: &EmitUnit,
        image: &[u8],
    ) -> Result<(), Stop> {
        let ports = [
            [
                pins.node_wr_valid_o,
                pins.node_wr_addr_o,
                pins.node_wr_data_o,
                pins.node_wr_strb_o,
                pins.node_wr_last_o,
            ],
            [
                pins.leaf_wr_valid_o,
                pins.leaf_wr_addr_o,
                pins.leaf_wr_data_o,
                pins.leaf_wr_strb_o,
                pins.leaf_wr_last_o,
            ],
        ];
        for ([valid, addr, data, strobe, last], writer) in ports.into_iter().zip(model.writers()) {
            let offered = writer.offer();
            bench.expect(valid, offered.is_some())?;
            let Some(access) = offered else { continue };
            let (bytes, is_last) = writer.line();
            bench.expect(addr, access.addr)?;
            bench.expect(strobe, u64::MAX >> (64 - bytes))?;
            bench.expect(last, is_last)?;
            // What the strobe leaves out is nobody's business.
            let mut line = bench.rtl.bytes(data);
            let start = access.addr as usize;
            line[..bytes as usize].copy_from_slice(&image[start..start + bytes as usize]);
            bench.expect_bytes(data, &line)?;
        }
        Ok(())
    }
}
