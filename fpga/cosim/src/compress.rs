//! The emitter with the streaming compressor, `xy_emit` as it compresses: what it is fed, and the lockstep with its model.

use std::path::{Path, PathBuf};

use xylem::machine::compress::CompressUnit;
use xylem_core::compress::{Compression, HeldNode, Repairs};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::Region;
use xylem_core::node::{Coordinates, LeafEntry, Quantization};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::sort::Item;

use crate::bench::{Bench, Stop, Waves};
use crate::emitter::items;
use crate::pins;
use crate::random::Random;
use crate::types::{record_bytes, split, subtree_bytes};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// A configuration of emitter and compressor, named as in `configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CompressConfig {
    /// Its name.
    pub name: &'static str,
    /// Lines of a burst of leaf table entries.
    pub burst_lines: u32,
    /// Layers of treelets.
    pub depth: u8,
    /// Bits of a coordinate.
    pub bits: u8,
    /// Margin of estimates.
    pub margin: u8,
    /// Minimum scale.
    pub min_scale: u8,
}

impl CompressConfig {
    /// No treelets, few bits, a wide margin.
    pub const SINGLE: Self =
        Self { name: "single", burst_lines: 2, depth: 1, bits: 4, margin: 2, min_scale: 2 };
    /// Short bursts.
    pub const SMALL: Self =
        Self { name: "small", burst_lines: 2, depth: 2, bits: 5, margin: 1, min_scale: 0 };
    /// The builder's.
    pub const PAPER: Self =
        Self { name: "paper", burst_lines: 8, depth: 2, bits: 6, margin: 1, min_scale: 0 };
    /// All of them.
    pub const ALL: [Self; 3] = [Self::SINGLE, Self::SMALL, Self::PAPER];
}

/// Builds the unit in `config`, with a fault if `mutation` says so.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(config: CompressConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let parameters = [
        ("BurstLines", config.burst_lines.into()),
        ("Depth", config.depth.into()),
        ("Bits", config.bits.into()),
        ("Margin", config.margin.into()),
        ("MinScale", config.min_scale.into()),
    ];
    let unit =
        Unit { top: "xy_emit", files: "emit.f", config: config.name, parameters: &parameters };
    verilate::unit(&unit, mutation)
}

pins!(Pins {
    clear_i, start_i, node_base_i, node_size_i, leaf_base_i, leaf_size_i, max_leaf_i, compress_i,
    modulo_i, item_valid_i, item_i, item_split_i, end_i, rd_ready_i, rsp_valid_i, rsp_data_i,
    node_wr_ready_i, leaf_wr_ready_i;
    item_ready_o, rd_valid_o, rd_addr_o, node_wr_valid_o, node_wr_addr_o, node_wr_data_o,
    node_wr_strb_o, node_wr_last_o, leaf_wr_valid_o, leaf_wr_addr_o, leaf_wr_data_o, leaf_wr_strb_o, leaf_wr_last_o, repaired_o,
    done_o, error_o, root_valid_o, root_o, node_count_o, leaf_count_o, entry_count_o,
});

/// Bytes of the memory that trees go to.
const MEMORY: usize = 1 << 17;

/// What a run without a mismatch amounts to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Summary {
    /// Trees built.
    pub trees: u64,
    /// Nodes in them.
    pub nodes: u64,
    /// Nodes encoded again.
    pub repairs: u64,
    /// Regions that were full.
    pub full: u64,
    /// Cycles that the model took.
    pub model_cycles: u64,
    /// Cycles that the RTL took.
    pub rtl_cycles: u64,
}

impl Summary {
    /// Heads the rows.
    pub const HEADER: &str = "\
        | test | configuration | seed | trees | nodes | repairs | full regions | model cycles \
        | RTL cycles | delta |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|";

    /// A row of the table that [`Summary::HEADER`] heads.
    pub fn row(&self, test: &str, config: &str, seed: u64) -> String {
        let Self { trees, nodes, repairs, full, model_cycles, rtl_cycles } = *self;
        let delta = rtl_cycles as i64 - model_cycles as i64;
        format!(
            "| {test} | {config} | {seed} | {trees} | {nodes} | {repairs} | {full} \
             | {model_cycles} | {rtl_cycles} | {delta} |"
        )
    }
}

/// Builds tree after tree for at least `cycles` cycles, with every output of every cycle, the bytes of
/// every line, and what is in memory at the end compared. Some trees are given up in the middle, and some
/// regions are too small.
///
/// # Errors
/// The first cycle in which the sides differ or the RTL fails.
pub fn run(
    library: &Path,
    config: CompressConfig,
    seed: u64,
    cycles: u64,
    waves: Waves,
) -> Result<Summary, Stop> {
    let mut bench = Bench::load(library, seed, waves)?;
    let pins = Pins::new(&bench.rtl);
    let mut random = Random::new(seed);
    let mut summary = Summary::default();
    while bench.cycle() < cycles {
        let tree = Tree::draw(config, &mut random);
        tree.build(&mut bench, &pins, &mut random, &mut summary)?;
    }
    summary.rtl_cycles = bench.cycle();
    Ok(summary)
}

/// A tree to be built, and how the unit's neighbours behave.
#[derive(Debug)]
struct Tree {
    items: Vec<Item>,
    regions: BuildRegions,
    build: BuildConfig,
    compression: Compression,
    /// Of 4 cycles, without an item.
    pause: u64,
    /// Of 16 cycles, in which the memory takes no read, no node line, no leaf table line.
    stall: [u64; 3],
    /// The longest that a read takes.
    latency: u64,
    /// The cycle in which it is given up; 0 for never.
    give_up: u64,
}

impl Tree {
    fn draw(config: CompressConfig, random: &mut Random) -> Self {
        let items = items(random, 63);
        let len = items.len() as u32;
        let coordinates = [Coordinates::Relative, Coordinates::Modulo][random.below(2) as usize];
        let quantization =
            Quantization { coordinates, bits: config.bits, min_scale: config.min_scale };
        let mut size = |bytes: u32| match random.below(8) {
            0 => random.below(u64::from(len * bytes) + 1) as u32,
            1..=4 => len * bytes,
            _ => (len * bytes).next_multiple_of(64),
        };
        let regions = BuildRegions {
            nodes: Region::new(64, size(16)),
            leaf_table: Region::new(1 << 16, size(LeafEntry::BYTES as u32)),
            ..BuildRegions::default()
        };
        Self {
            items,
            regions,
            build: BuildConfig {
                max_leaf_size: [0, 1, 2, 4, 255][random.below(5) as usize],
                write_burst: 64 * config.burst_lines,
                ..BuildConfig::default()
            },
            compression: Compression {
                quantization,
                treelet_depth: config.depth,
                margin: config.margin,
                repairs: Repairs::InMemory,
            },
            pause: random.below(4),
            stall: [0; 3].map(|_| [0, 8, 14, 15][random.below(4) as usize]),
            latency: [1, 4, 40][random.below(3) as usize],
            give_up: [0, 0, 0, 0, 0, 1 + random.below(800)][random.below(6) as usize],
        }
    }

    fn build(
        &self,
        bench: &mut Bench,
        pins: &Pins,
        random: &mut Random,
        summary: &mut Summary,
    ) -> Result<(), Stop> {
        self.start(bench, pins)?;
        summary.model_cycles += 1;
        let mut held = vec![HeldNode::EMPTY; self.compression.held_nodes()];
        let mut model = CompressUnit::new(&self.build, self.compression, &self.regions, &mut held);
        let (mut image, mut memory) = (vec![0; MEMORY], vec![0; MEMORY]);
        let mut items = self.items.iter().peekable();
        // The code of the last item that was taken: the first one's split says nothing.
        let mut before = u64::MAX >> 1;
        let (mut offered, mut after, mut failed) = (false, 0, 0u64);
        let (mut flying, mut since_failed, mut seen) = (None::<(u64, u64)>, 0, false);
        for cycle in 1.. {
            offered |= random.below(4) >= self.pause;
            let item = if offered { items.peek().copied() } else { None };
            let end = offered && items.peek().is_none();
            let ready = self.stall.map(|stall| random.below(16) >= stall);
            let arrives = flying.filter(|(at, _)| *at <= cycle).map(|(_, addr)| addr as usize);
            after += u64::from(model.is_finished());
            after += 4 * u64::from(seen);
            let clear = after > 3 || cycle == self.give_up;

            let rtl = &mut bench.rtl;
            rtl.set(pins.clear_i, clear);
            rtl.set(pins.item_valid_i, item.is_some());
            let shown = item.copied().unwrap_or(Item::ZERO);
            rtl.set_bytes(pins.item_i, &record_bytes(&shown));
            rtl.set(pins.item_split_i, split(before, shown.code));
            rtl.set(pins.end_i, end);
            rtl.set(pins.rd_ready_i, ready[0]);
            rtl.set(pins.node_wr_ready_i, ready[1]);
            rtl.set(pins.leaf_wr_ready_i, ready[2]);
            rtl.set(pins.rsp_valid_i, arrives.is_some());
            if let Some(addr) = arrives {
                rtl.set_bytes(pins.rsp_data_i, &memory[addr..addr + 64]);
                flying = None;
            }
            rtl.settle();
            let read = rtl.is_set(pins.rd_valid_o) && ready[0];
            let (read_addr, was_set) = (rtl.get(pins.rd_addr_o), rtl.is_set(pins.node_wr_valid_o));
            if read {
                flying = Some((cycle + 1 + random.below(self.latency), read_addr));
            }
            let line = (was_set && ready[1]).then(|| {
                (
                    rtl.get(pins.node_wr_addr_o),
                    rtl.get(pins.node_wr_strb_o),
                    rtl.bytes(pins.node_wr_data_o),
                )
            });
            if let Some((addr, strobe, bytes)) = line {
                for (i, byte) in bytes.into_iter().enumerate().filter(|(i, _)| strobe >> i & 1 > 0)
                {
                    memory[addr as usize + i] = byte;
                }
            }
            summary.model_cycles += 1;

            if failed > 0 {
                // The core knows at once what the gates find when they come to it.
                since_failed += 1;
                seen |= bench.rtl.get(pins.error_o) & failed > 0;
                if since_failed > 20_000 {
                    bench.expect(pins.error_o, failed)?;
                }
                bench.edge()?;
                if clear {
                    summary.full += u64::from(seen);
                    break;
                }
                continue;
            }
            self.expect(bench, pins, &model, &image)?;
            let read = model.compressor().read().is_some() && ready[0];
            let wrote = model.compressor().write().is_some() && ready[1];
            let repairs = model.compressor().events().backtracks();
            let repaired = wrote && model.compressor().is_repairing();
            bench.expect(pins.repaired_o, repaired)?;
            let did = model.tick(item, end, &mut image);
            if let (Ok(did), Some(_)) = (&did, item) {
                bench.expect(pins.item_ready_o, did.accepted)?;
                if did.accepted {
                    before = shown.code;
                    items.next();
                    offered = false;
                }
            }
            if ready[2] && model.leaf_table().offer().is_some() {
                model.leaf_taken();
            }
            let compressor = model.compressor_mut();
            if arrives.is_some() {
                compressor.arrive();
            }
            if read {
                compressor.read_taken();
            }
            if wrote {
                compressor.write_taken();
            }
            let ended = model.end_cycle(&mut image);
            summary.repairs += model.compressor().events().backtracks() - repairs;
            if let Err(error) = did.map(drop).and(ended) {
                failed = match error {
                    BuildError::RegionFull { region: RegionName::LeafTable, .. } => 2,
                    _ => 1,
                };
            }
            bench.edge()?;
            if clear {
                break;
            }
        }
        if model.is_finished() {
            let [nodes, ..] = model.emitter().counts();
            // The leaf table's lines were compared as they left.
            let start = self.regions.nodes.base.0 as usize;
            let range = start..start + 16 * nodes as usize;
            assert_eq!(image[range.clone()], memory[range], "nodes in memory differ");
            summary.trees += 1;
            summary.nodes += u64::from(nodes);
        }
        bench.rtl.set(pins.clear_i, 0u64);
        bench.rtl.set(pins.rsp_valid_i, 0u64);
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
        rtl.set(pins.max_leaf_i, self.build.max_leaf_size);
        let modulo = self.compression.quantization.coordinates == Coordinates::Modulo;
        rtl.set(pins.compress_i, 1u64);
        rtl.set(pins.modulo_i, modulo);
        rtl.set(pins.item_valid_i, 0u64);
        rtl.set(pins.end_i, 0u64);
        rtl.settle();
        bench.edge()?;
        bench.rtl.set(pins.start_i, 0u64);
        Ok(())
    }

    /// Compares all outputs but `item_ready_o`.
    fn expect(
        &self,
        bench: &Bench,
        pins: &Pins,
        model: &CompressUnit<'_>,
        image: &[u8],
    ) -> Result<(), Stop> {
        bench.expect(pins.error_o, 0u64)?;
        bench.expect(pins.done_o, model.is_finished())?;
        let emitter = model.emitter();
        bench.expect(pins.root_valid_o, emitter.root().is_some())?;
        if let Some(root) = emitter.root() {
            bench.expect_bytes(pins.root_o, &subtree_bytes(&root))?;
        }
        let counts = [pins.node_count_o, pins.leaf_count_o, pins.entry_count_o];
        for (pin, count) in counts.into_iter().zip(emitter.counts()) {
            bench.expect(pin, count)?;
        }
        let compressor = model.compressor();
        bench.expect(pins.rd_valid_o, compressor.read().is_some())?;
        if let Some(addr) = compressor.read() {
            bench.expect(pins.rd_addr_o, addr)?;
        }
        bench.expect(pins.node_wr_valid_o, compressor.write().is_some())?;
        if let Some(line) = compressor.write() {
            let from = line.addr % 64;
            bench.expect(pins.node_wr_addr_o, line.addr - from)?;
            bench.expect(pins.node_wr_last_o, 1u64)?;
            expect_line(bench, [pins.node_wr_data_o, pins.node_wr_strb_o], from, &line.bytes)?;
        }
        let leaf_table = model.leaf_table();
        bench.expect(pins.leaf_wr_valid_o, leaf_table.offer().is_some())?;
        if let Some(access) = leaf_table.offer() {
            let (bytes, last) = leaf_table.line();
            bench.expect(pins.leaf_wr_addr_o, access.addr)?;
            bench.expect(pins.leaf_wr_last_o, last)?;
            let line = &image[access.addr as usize..(access.addr + bytes) as usize];
            expect_line(bench, [pins.leaf_wr_data_o, pins.leaf_wr_strb_o], 0, line)?;
        }
        Ok(())
    }
}

/// Compares a line's strobe and the bytes under it, which start at byte `from`.
fn expect_line(
    bench: &Bench,
    [data, strobe]: [crate::rtl::Pin; 2],
    from: u32,
    bytes: &[u8],
) -> Result<(), Stop> {
    bench.expect(strobe, (u64::MAX >> (64 - bytes.len())) << from)?;
    let mut line = bench.rtl.bytes(data);
    line[from as usize..from as usize + bytes.len()].copy_from_slice(bytes);
    bench.expect_bytes(data, &line)
}
