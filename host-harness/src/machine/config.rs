//! Every parameter of the clocked builder in one place.

use xylem_core::compress::HeldNode;
use xylem_core::emit::{Cell, EmitterKind};
use xylem_core::error::ConfigError;
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::RecordFormat;
use xylem_core::toplevel::TopLevel;

use super::port::LINE_BYTES;

/// The builder as hardware: what it builds, and the sizes of its units.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MachineConfig {
    /// What is built; also `M`, `B`, the record and the read schedule of the sorter, and the bursts
    /// of the node and leaf table writers.
    pub build: BuildConfig,
    /// Clock of the builder in MHz.
    pub clock_mhz: u32,
    /// Insertion sorters, each with room for one piece of two bursts.
    pub sorters: u32,
    /// Records that the FIFO between the multi-merge and what takes its output holds; at least 2.
    pub fifo: u32,
    /// Lines of 64 bytes that the primitive reader has room for.
    pub read_ahead: u32,
    /// Spare buffers of `B` records that forecasting reads into, beyond the `M` of the scratchpad.
    pub spare_buffers: u32,
    /// Whether one half of the scratchpad is filled while the other is merged (P1 §5). Runs are then
    /// `M / 2` records long, which halves what one pass can sort.
    pub overlap: bool,
    /// Whether few runs share the whole scratchpad, as queues of more than two bursts. The papers'
    /// unit leaves the rest of it idle.
    pub share: bool,
    /// Cycles without any progress after which the machine gives up waiting for memory.
    pub time_out: u64,
}

impl MachineConfig {
    /// P2 §6.2: `M` = 8192, `B` = 16, eight sorters, 1 GHz. FIFO depths are ours; P2 gives none.
    pub fn p2(build: BuildConfig) -> Self {
        Self {
            build,
            clock_mhz: 1000,
            sorters: 8,
            fifo: 16,
            read_ahead: 32,
            spare_buffers: 16,
            overlap: false,
            share: false,
            time_out: 1 << 20,
        }
    }

    /// P1 §5: `M` = 4096, `B` = 8, four sorters, 1 GHz, leaves of one primitive.
    pub fn p1(mut build: BuildConfig) -> Self {
        build.sort.capacity = 4096;
        build.sort.burst = 8;
        build.max_leaf_size = 1;
        Self { sorters: 4, ..Self::p2(build) }
    }

    /// P2's with what the papers propose or leave open turned on: halves of the scratchpad that
    /// overlap, and queues that share it.
    pub fn improved(build: BuildConfig) -> Self {
        Self { overlap: true, share: true, ..Self::p2(build) }
    }

    /// What the runs in memory are like: the sorter's configuration, whose capacity is the length of
    /// a run.
    pub fn runs(&self) -> BuildConfig {
        let mut build = self.build;
        if self.overlap {
            build.sort.capacity /= 2;
        }
        build
    }

    /// How many runs are merged at once. The whole scratchpad serves the merge, also where its
    /// halves were filled in turn.
    pub fn width(&self) -> u32 {
        self.build.sort.width()
    }

    /// How many primitives one merge pass can bring in order.
    pub fn one_pass_capacity(&self) -> u64 {
        u64::from(self.run_len()) * u64::from(self.width())
    }

    /// Records of a run.
    pub fn run_len(&self) -> u32 {
        self.runs().sort.capacity
    }

    /// How many merge passes must write runs back before one merge can take them all.
    pub fn further_passes(&self, count: u32) -> u32 {
        let mut runs = count.div_ceil(self.run_len());
        let mut passes = 0;
        while runs > self.width() {
            runs = runs.div_ceil(self.width());
            passes += 1;
        }
        passes
    }

    /// Bytes of on-chip record storage: scratchpad, spare buffers, sorters and FIFO, at 32 bytes a
    /// record.
    pub fn storage_bytes(&self) -> u64 {
        let sort = self.build.sort;
        let spare = match sort.schedule {
            xylem_core::sort::ReadSchedule::DoubleBuffer => 0,
            xylem_core::sort::ReadSchedule::Forecast => self.spare_buffers * sort.burst,
        };
        let records = sort.capacity + spare + self.sorters * sort.piece() + self.fifo;
        u64::from(records) * 32
    }

    /// Sweeps of the clustering chain, if that emits.
    pub(super) fn sweeps(&self) -> u32 {
        match self.build.emitter {
            EmitterKind::Lbvh => 0,
            EmitterKind::Ploc(ploc) => ploc.chain,
        }
    }

    /// The buffer of the top-level builder, if there is one.
    pub(super) fn top_cells(&self) -> Vec<Cell> {
        let capacity = match self.build.top_level {
            TopLevel::None => 0,
            _ => self.build.cells.capacity,
        };
        vec![Cell::EMPTY; capacity as usize]
    }

    /// Storage for the compressor's treelets.
    pub(super) fn held_nodes(&self) -> Vec<HeldNode> {
        vec![HeldNode::EMPTY; self.build.compression.map_or(0, |c| c.held_nodes())]
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// [`MachineConfigError`].
    pub fn check(&self) -> Result<(), MachineConfigError> {
        use MachineConfigError as Error;
        self.build.check()?;
        self.runs().check()?;
        let sort = self.build.sort;
        if sort.record != RecordFormat::Box32 {
            return Err(Error::Record);
        }
        if self.build.sharing.is_some() {
            return Err(Error::Sharing);
        }
        if self.build.collapse {
            return Err(Error::Collapse);
        }
        if matches!(self.build.top_level, TopLevel::Atrbvh(_)) {
            return Err(Error::TopLevel);
        }
        if !(sort.burst * sort.record.bytes()).is_multiple_of(LINE_BYTES) {
            return Err(Error::Burst);
        }
        if self.build.write_burst == 0 || !self.build.write_burst.is_multiple_of(LINE_BYTES) {
            return Err(Error::WriteBurst);
        }
        let positive = self.clock_mhz.min(self.sorters).min(self.spare_buffers).min(self.fifo / 2);
        if positive == 0 || self.read_ahead < 2 || self.time_out == 0 {
            return Err(Error::Zero);
        }
        Ok(())
    }
}

/// Why a machine cannot be built.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum MachineConfigError {
    /// The core refuses the build.
    #[error("{0}")]
    Build(#[from] ConfigError),
    /// The machine sorts 32-byte records.
    #[error("the clocked builder sorts 32-byte boxes; other records have the function engine only")]
    Record,
    /// There is no unit that shares planes.
    #[error("shared-plane nodes have no unit; use the function engine, or 16-byte nodes")]
    Sharing,
    /// There is no unit that collapses nodes.
    #[error("nodes of four children have no unit; use the function engine, or 16-byte nodes")]
    Collapse,
    /// There is no unit that restructures treelets.
    #[error("ATRBVH is software on the soft core, no unit; use the function engine, or `binned`")]
    TopLevel,
    /// Bursts of records are whole lines.
    #[error("the clocked builder reads lines of 64 bytes; a burst B must be at least 2 records")]
    Burst,
    /// Bursts of nodes are whole lines.
    #[error(
        "the clocked builder writes lines of 64 bytes; a write burst must be a multiple of that"
    )]
    WriteBurst,
    /// Some size is nothing.
    #[error(
        "clock, sorters, spare buffers and time-out must be at least 1, FIFO and read-ahead at least 2"
    )]
    Zero,
}
