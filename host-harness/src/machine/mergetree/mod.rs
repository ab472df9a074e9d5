//! MergeTree: the streaming builder, assembled and clocked (P1 §4, P2 §5).
//!
//! ```text
//!            ┌────────┐   ┌───────────┐   ┌────────────┐   ┌──────┐   ┌─────────┐   ┌───────┐
//!  memory ──►│ reader │──►│ insertion │──►│ scratchpad │──►│ heap │──►│  FIFO   │─┬►│ runs  │──► memory
//!     │      └────────┘   │  sorters  │   │            │   │      │   └─────────┘ │ └───────┘
//!     └──────── runs, in bursts ─────────►│            │   └──────┘               │ ┌─────────┐ nodes
//!                                         └────────────┘                          └►│ emitter │──► memory
//!                                                                                   └─────────┘ leaf table
//! ```
//!
//! In a cycle, every unit sees what the others held when it began, so a value passes one unit a cycle; the
//! port takes at most one line in each direction. The control alternates filling the scratchpad and
//! merging it out until all runs are written, then merges runs until one merge can take them all,
//! and feeds that into the emitter. A change from one to the next takes a cycle. Up to the FIFO this is
//! the RTL unit `xy_mergesort`, cycle by cycle.

mod control;
mod lines;

use xylem_core::emit::{EmitterKind, list_bound};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::Region;
use xylem_core::node::Tree;
use xylem_core::pipeline::{BuildRegions, TreeStorage, TreeStream};
use xylem_core::sort::RecordFormat;
use xylem_core::toplevel::TopStorage;

use self::control::Machine;
use super::activity::Activity;
use super::compressor::CompressorEvents;
use super::config::{MachineConfig, MachineConfigError};
use super::port::{LINE_BYTES, Port, PortError};
use super::tail::{Sink, Tail, TapeUnit};
use super::tape::Tape;
use super::toplevel::TopEvents;
use crate::bus::{FlatMemory, Traffic};

pub use super::tail::Take;

/// What a build on the clock took.
#[derive(Clone, Debug)]
pub struct MachineRun {
    /// The tree; its bytes are in memory.
    pub tree: Tree,
    /// Cycles of the machine's clock.
    pub cycles: u64,
    /// Bytes and cycles by stage and region. Emission overlaps the last merge, whose cycles count as
    /// the merge's; those after the last record left the merge are the emission's.
    pub traffic: Traffic,
    /// How busy each unit was.
    pub activity: Activity,
    /// Why the multi-merge stood still.
    pub stalls: Stalls,
    /// What the top-level builder did.
    pub top: TopEvents,
    /// What the compressor did.
    pub compressor: CompressorEvents,
    /// Further merge passes before the last.
    pub passes: u32,
}

/// Cycles in which the multi-merge could have done an operation and did none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
pub struct Stalls {
    /// The successor of the lowest record had not come from memory.
    pub data_cycles: u64,
    /// Its output had no room.
    pub room_cycles: u64,
    /// The scratchpad was being filled by the insertion sorters.
    pub fill_cycles: u64,
}

/// Why a machine stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum MachineError {
    /// The machine cannot be built.
    #[error("{0}")]
    Config(#[from] MachineConfigError),
    /// A region does not start on a line of 64 bytes, or memory is shorter than the region.
    #[error("region `{0}` must lie in memory and start on a multiple of 64 bytes")]
    Alignment(RegionName),
    /// The build failed; what was written before stays in memory.
    #[error("{0}")]
    Build(#[from] BuildError<PortError>),
}

/// Builds a tree on the clock: the same bytes as `xylem_core::pipeline::build`.
///
/// `memory` holds the regions; `port` says when its lines move.
///
/// # Errors
/// [`MachineError`].
pub fn build<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    regions: &BuildRegions,
    count: u32,
    port: &mut P,
) -> Result<MachineRun, MachineError> {
    config.check()?;
    check_regions(config, memory, regions, count)?;
    let build = config.runs();
    let tape = Tape::new(config.sweeps(), regions);
    let mut cells = config.top_cells();
    let top = TopStorage { cells: &mut cells, nodes: &mut [] };
    let mut held = config.held_nodes();
    let mut storage = TreeStorage { top, held: &mut held, open: &mut [] };
    let passes = config.further_passes(count);
    let tail = if Tail::has_units(&build) {
        Tail::units(&build, regions, storage.held)
    } else {
        // The last merge reads from one region of runs, so the other one is free.
        let lists = match passes % 2 {
            0 => (regions.runs_b, RegionName::RunsB),
            _ => (regions.runs_a, RegionName::RunsA),
        };
        if let EmitterKind::Ploc(_) = build.emitter {
            let needed = u64::from(list_bound(count)) * u64::from(RecordFormat::Box32.bytes());
            let (Region { size: available, .. }, region) = lists;
            if needed > u64::from(available) {
                return Err(BuildError::RegionFull { region, needed, available }.into());
            }
        }
        let stream =
            TreeStream::new(&build, regions, lists, count, &mut storage, &mut tape.probe());
        let scratchpad = config.build.sort.capacity as usize;
        // A burst is taken whole.
        let sort = config.build.sort;
        let burst = sort.burst * sort.record.bytes() / LINE_BYTES;
        let room = config.read_ahead.max(burst);
        Tail::Tape(TapeUnit::new(&tape, stream, scratchpad, room))
    };
    let mut machine = Machine::new(config, memory, regions, count, port, tail);
    machine.run(passes)?;
    machine.finish(passes)
}

/// Runs the builder without an emitter: what comes out of the merge's FIFO goes to `take`, which is asked in
/// every cycle of the last merge, with the record offered, if there is one, and whether all have left. Gives
/// the cycles up to the one in which all had left.
///
/// This is what the RTL unit `xy_mergesort` does.
///
/// # Errors
/// [`MachineError`].
pub fn sort<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    regions: &BuildRegions,
    count: u32,
    port: &mut P,
    take: Take<'_>,
) -> Result<u64, MachineError> {
    config.check()?;
    check_regions(config, memory, regions, count)?;
    let tail = Tail::Sink(Sink::new(take));
    let mut machine = Machine::new(config, memory, regions, count, port, tail);
    machine.run(config.further_passes(count))?;
    Ok(machine.now)
}

fn check_regions(
    config: &MachineConfig,
    memory: &FlatMemory,
    regions: &BuildRegions,
    count: u32,
) -> Result<(), MachineError> {
    // Runs of the same length merged no less widely: no more passes, and no more room for them.
    regions.check::<PortError>(&config.runs(), count)?;
    for (region, name) in [
        (regions.primitives, RegionName::Primitives),
        (regions.runs_a, RegionName::RunsA),
        (regions.runs_b, RegionName::RunsB),
        (regions.nodes, RegionName::Nodes),
        (regions.leaf_table, RegionName::LeafTable),
    ] {
        let end = u64::from(region.base.0) + u64::from(region.size);
        let inside = end <= memory.bytes().len() as u64 || region.size == 0;
        if !inside || !region.base.0.is_multiple_of(LINE_BYTES) {
            return Err(MachineError::Alignment(name));
        }
    }
    Ok(())
}
