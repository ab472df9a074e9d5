//! The papers' machines, as builds are asked for.

use xylem_core::emit::CellConfig;
use xylem_core::pipeline::BuildConfig;
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

/// P2's memories.
pub const MEMORIES: [&str; 3] = ["slow", "medium", "fast"];

/// A build on the clock.
pub fn clocked(machine: MachineConfig, memory: &str) -> BuildOptions {
    let default = BuildOptions::default();
    let memory = MemoryTiming::by_name(memory).copied().unwrap_or(default.memory);
    BuildOptions { config: machine.build, memory, machine: Some(machine), ..default }
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
    BuildOptions { config, ..BuildOptions::default() }
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
