//! The papers' machines, as builds are asked for.

use xylem_core::compress::{Compression, Repairs};
use xylem_core::emit::CellConfig;
use xylem_core::node::{Coordinates, NodeFormat, Quantization};
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::InputFormat;
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};

use crate::bus::MemoryTiming;
use crate::machine::config::MachineConfig;
use crate::run::BuildOptions;

/// P1's machine, in words.
pub const P1_MACHINE: &str = "Machine: M = 4096, B = 8, four insertion sorters, 1 GHz, leaves of one \
                              primitive, every unit on the clock (P1 §5).";
/// P1's memories, in words.
pub const P1_MEMORIES: &str = "Memory: 2 x 32 bit GDDR3 at 1 GHz (16 GB/s) and 2 GHz (32 GB/s), \
                               FR-FCFS, clock by clock.";
/// P2's machine, in words.
pub const P2_MACHINE: &str = "Machine: M = 8192, B = 16, eight insertion sorters, 1 GHz, equal codes \
                              in one leaf, every unit on the clock (P2 §6.2).";
/// P2's memories, in words.
pub const P2_MEMORIES: &str = "Memory: slow is 1 x 64 bit LPDDR3-1600 (12.8 GB/s), medium 2 x (25.6), \
                               fast 4 x LPDDR3-1333 (42.7), clock by clock.";

/// The papers' top level on the clock, in words.
pub const TOP_LEVEL: &str = "Top level: binned SAH over at most 2048 cells of a 32^3 grid, one cell a \
                             cycle and 32 cycles after each sweep, after the rest (P1 §4.5).";

/// P3's machine, in words.
pub const P3_MACHINE: &str = "Machine: M = 8192, eight insertion sorters, 1 GHz, equal codes in one leaf, \
                              triangles of 40 bytes in, every unit on the clock (P3 §5.3).";
/// P3's memory, in words.
pub const P3_MEMORY: &str = "Memory: 2 x 32 bit LPDDR3-1600 (12.8 GB/s), clock by clock.";
/// P3's traffic, in words.
pub const P3_TRAFFIC: &str = "Triangles of 40 bytes in, boxes of 32 bytes sorted in one pass, nodes of 16 \
                              bytes, leaf table of 4 bytes; a repair reads and writes a line of 64 bytes \
                              (P3 §5.2). Every byte counted on the bus.";

/// P2's memories.
pub const MEMORIES: [&str; 3] = ["slow", "medium", "fast"];

/// A build on the clock.
pub fn clocked(machine: MachineConfig, memory: &str) -> BuildOptions {
    let default = BuildOptions::default();
    let memory = MemoryTiming::by_name(memory).copied().unwrap_or(default.memory);
    let format = machine.build.format();
    BuildOptions { config: machine.build, format, memory, machine: Some(machine) }
}

/// P1's machine, with its top level of 8 bins (P1 §4.5).
pub fn p1() -> MachineConfig {
    MachineConfig::p1(with_binned(BuildConfig::default(), Bins::Eight))
}

/// P2's machine, without a top level.
pub fn p2() -> MachineConfig {
    MachineConfig::p2(BuildConfig::default())
}

/// A build whose function alone is of interest.
pub fn function(config: BuildConfig) -> BuildOptions {
    BuildOptions { config, format: config.format(), ..BuildOptions::default() }
}

/// The cells of the papers' top levels: P2 §6.1 has "ca. 500-2,000 nodes". 15 bits are a grid of 32^3,
/// of which surfaces meet about so many.
pub const PAPER_CELLS: CellConfig = CellConfig { capacity: 2048, bits: 15 };

/// A build with the papers' binned SAH top level.
pub fn with_binned(config: BuildConfig, bins: Bins) -> BuildConfig {
    let top_level = TopLevel::Binned(Binned { bins });
    BuildConfig { top_level, cells: PAPER_CELLS, ..config }
}

/// A build with P2's ATRBVH top level: treelets of eight, two iterations, over the Morton order.
pub fn with_atrbvh(config: BuildConfig) -> BuildConfig {
    let atrbvh = Atrbvh { treelet: 8, iterations: 2, start: None };
    BuildConfig { top_level: TopLevel::Atrbvh(atrbvh), cells: PAPER_CELLS, ..config }
}

/// The same builders with what Xylem adds: a cell buffer as large as the scratchpad, leaves joined up
/// to four primitives, and ATRBVH started from the binned tree.
pub fn improved(mut config: BuildConfig) -> BuildConfig {
    config.cells = CellConfig::default();
    config.join_leaves = 4;
    if let TopLevel::Atrbvh(atrbvh) = &mut config.top_level {
        atrbvh.start = Some(Binned::default());
    }
    config
}

/// Repairs in 16 lines on chip.
pub const HELD: Repairs = Repairs::InLines(16);

/// P3's build of quantized nodes, streamed: triangles in, as P3 §5 has them.
pub fn streamed(coordinates: Coordinates, treelet_depth: u8) -> BuildConfig {
    let quantization = Quantization { coordinates, ..Quantization::MODULO };
    let compression = Compression { quantization, treelet_depth, ..Compression::DEFAULT };
    BuildConfig { compression: Some(compression), ..triangles() }
}

/// P3's build of 64-byte nodes.
pub fn triangles() -> BuildConfig {
    BuildConfig { input: InputFormat::Triangle40, ..BuildConfig::default() }
}

/// P3's baseline: quantized by a separate pass, in relative coordinates.
pub fn separate() -> BuildOptions {
    let format = NodeFormat::Quantized(Quantization::RELATIVE);
    BuildOptions { format, ..function(triangles()) }
}
