//! The accelerator beside the simulated core: the register map in front of the cycle model.
//!
//! Registers behave as `fpga/regs/registers.md` says, locks and commands included. A job runs on the cycle
//! model of its unit when it is started, on a copy of memory; its bytes, counters and status appear when
//! the modelled cycles have passed on the core's clock. Neither side slows the other's memory down.

use xylem_core::mem::Region;
use xylem_regs::{
    Access, COUNTERS_CYCLES_LO, CTRL, Ctrl, ERROR_ADDR, ERROR_INFO, ErrorCode, INT_ENABLE,
    INT_STATUS, JOB_ENTRIES, JOB_NODES, JOB_PRIMITIVES, JOB_RAYS, MAP_SIZE, REGISTERS,
    RESULT_NODES, ROOT_HI_X, ROOT_LEAF_SIZE, ROOT_LO_X, ROOT_POINTER, RegionId, Register,
    RegisterInfo, STATUS, Status,
};

use super::jobs::{self, Failure, JobRun, Parameters, Site};
use crate::bus::FlatMemory;
use crate::machine::config::MachineConfig;
use crate::machine::fault::Fault;
use crate::machine::traverser::TraverserConfig;
use glam::IVec3;
use xylem_core::compress::Compression;
use xylem_core::geom::{Aabb, Ray};
use xylem_core::node::{Quantization, Subtree};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::{InputFormat, SortConfig};
use xylem_core::traverse::Hit;

/// A named configuration of the accelerator: that of `fpga/rtl/configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AcceleratorConfig {
    /// Its name.
    pub name: &'static str,
    /// The scratchpad `M`, in records.
    pub capacity: u32,
    /// The burst `B`, in records.
    pub burst: u32,
    /// Insertion sorters.
    pub sorters: u32,
    /// Records of the FIFO behind the merge.
    pub fifo: u32,
    /// Lines of input that are read ahead.
    pub read_ahead: u32,
    /// Cycles without movement after which memory is given up.
    pub time_out: u64,
    /// Bits of the longest Morton code.
    pub code_bits: u32,
    /// Depth of the compressor's treelets; 0 without compressor.
    pub treelet_depth: u8,
    /// The traversal unit, if there is one.
    pub traverser: Option<TraverserConfig>,
}

impl AcceleratorConfig {
    /// For simulation.
    pub const SMALL: Self = Self {
        name: "small",
        capacity: 128,
        burst: 4,
        sorters: 2,
        fifo: 4,
        read_ahead: 8,
        time_out: 2000,
        code_bits: 63,
        treelet_depth: 1,
        traverser: Some(TraverserConfig::SMALL),
    };

    /// P2's sorter.
    pub const PAPER: Self = Self {
        name: "paper",
        capacity: 8192,
        burst: 16,
        sorters: 8,
        fifo: 16,
        read_ahead: 32,
        time_out: 1 << 20,
        code_bits: 63,
        treelet_depth: 2,
        traverser: Some(TraverserConfig::LARGE),
    };

    /// What fits an LFE5U-85F.
    pub const ECP5: Self = Self {
        name: "ecp5",
        capacity: 2048,
        burst: 8,
        sorters: 2,
        fifo: 8,
        read_ahead: 16,
        time_out: 1 << 20,
        code_bits: 30,
        treelet_depth: 0,
        traverser: None,
    };

    /// All of them.
    pub const ALL: [Self; 3] = [Self::SMALL, Self::PAPER, Self::ECP5];

    /// Whether it has a unit that knows quantized nodes.
    fn quantizes(&self) -> bool {
        self.treelet_depth > 0 || self.traverser.is_some()
    }

    /// The configuration of that name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|config| config.name == name)
    }

    /// The cycle model of the builder.
    pub(super) fn machine(
        &self,
        input: InputFormat,
        morton: MortonWidth,
        max_leaf_size: u32,
        compression: Option<Compression>,
    ) -> MachineConfig {
        let (capacity, burst) = (self.capacity, self.burst);
        let sort = SortConfig { capacity, burst, ..SortConfig::PAPER };
        let build = BuildConfig {
            input,
            morton,
            max_leaf_size,
            sort,
            compression,
            ..BuildConfig::default()
        };
        MachineConfig {
            sorters: self.sorters,
            fifo: self.fifo,
            read_ahead: self.read_ahead,
            time_out: self.time_out,
            ..MachineConfig::p2(build)
        }
    }
}

/// The accelerator: registers, and the job that runs.
#[derive(Debug)]
pub(super) struct Accelerator {
    config: AcceleratorConfig,
    latency: u32,
    /// What memory's first byte is called on the bus.
    origin: u32,
    words: Vec<u32>,
    running: Option<Running>,
    /// What goes wrong with memory in the next job.
    fault: Option<Fault>,
}

/// A job under way: what it will have come to, and when.
#[derive(Debug)]
struct Running {
    since: u64,
    run: JobRun,
}

impl Accelerator {
    /// An idle accelerator whose memory answers after `latency` cycles and starts at `origin`.
    pub fn new(config: AcceleratorConfig, latency: u32, origin: u32) -> Self {
        let mut words = vec![0; MAP_SIZE as usize / 4];
        for register in &REGISTERS {
            words[register.offset as usize / 4] = register.reset;
        }
        let width = config.capacity / (2 * config.burst);
        let features = jobs::features(&config);
        let plane_bits =
            if config.quantizes() { u32::from(Quantization::RELATIVE.bits) } else { 0 };
        let trace = config
            .traverser
            .map_or(0, |unit| Ray::BYTES as u32 | (Hit::BYTES as u32) << 8 | unit.depth << 16);
        let depth = u32::from(config.treelet_depth);
        let capabilities = [
            ("cap.sort", config.capacity | config.burst << 24),
            ("cap.merge", width | 255 << 16),
            ("cap.geometry", 24 | config.code_bits << 8 | plane_bits << 16 | depth << 24),
            ("cap.features", features),
            ("cap.trace", trace),
        ];
        for (path, value) in capabilities {
            let register = REGISTERS.iter().find(|register| register.path == path);
            words[register.map_or(0, |register| register.offset as usize / 4)] = value;
        }
        Self { config, latency, origin, words, running: None, fault: None }
    }

    /// The interrupt line.
    pub fn interrupt(&self) -> bool {
        self.word(INT_STATUS.offset()) & self.word(INT_ENABLE.offset()) != 0
    }

    /// The cycle in which something will happen by itself; `u64::MAX` while idle.
    pub fn due(&self) -> u64 {
        self.running.as_ref().map_or(u64::MAX, |running| running.since + running.run.cycles)
    }

    /// The register at `offset` in cycle `now`; 0 where the map has a hole.
    pub fn read(&self, offset: u32, now: u64) -> u32 {
        let Some(info) = RegisterInfo::at(offset) else { return 0 };
        let word = match &self.running {
            Some(running) if offset == STATUS.offset() => {
                1 | (running.run.stage_at(now - running.since) as u32) << 8
            }
            _ => self.word(offset),
        };
        word & info.readable()
    }

    /// Writes the register at `offset` in cycle `now`, which has no effect where the map has a hole.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, memory: &mut FlatMemory) {
        let Some(info) = RegisterInfo::at(offset) else { return };
        let locked = if self.running.is_some() { info.locked() } else { 0 };
        let kept = info.mask(|access| access == Access::ReadWrite) & !locked;
        let cleared = value & info.mask(|access| access == Access::WriteOneToClear);
        let word = &mut self.words[offset as usize / 4];
        *word = (*word & !kept | value & kept) & !cleared;
        if offset == CTRL.offset() {
            self.command(value, now, memory);
        }
    }

    /// Ends the job if `now` is its time.
    pub fn advance(&mut self, now: u64, memory: &mut FlatMemory) {
        if self.due() > now {
            return;
        }
        let Some(Running { run, .. }) = self.running.take() else { return };
        for (at, bytes) in &run.written {
            memory.bytes_mut()[*at..*at + bytes.len()].copy_from_slice(bytes);
        }
        for (at, count) in (COUNTERS_CYCLES_LO.offset()..).step_by(8).zip(run.counts) {
            let total = u64::from(self.word(at)) | u64::from(self.word(at + 4)) << 32;
            let total = total.wrapping_add(count);
            self.set(at, total as u32);
            self.set(at + 4, (total >> 32) as u32);
        }
        match run.outcome {
            Ok(results) => {
                if let Some(root) = results.root {
                    let corners = [(ROOT_LO_X, root.bounds.min), (ROOT_HI_X, root.bounds.max)];
                    for (x, corner) in corners {
                        for (at, value) in (x.offset()..).step_by(4).zip(corner.to_array()) {
                            self.set(at, value as u32);
                        }
                    }
                    let (index, leaf_size) = jobs::pointer(root.child);
                    self.set(ROOT_POINTER.offset(), index);
                    self.set(ROOT_LEAF_SIZE.offset(), leaf_size);
                }
                for (at, count) in (RESULT_NODES.offset()..).step_by(4).zip(results.counts) {
                    self.set(at, count);
                }
                self.end(None);
            }
            Err(failure) => self.end(Some(failure)),
        }
    }

    fn command(&mut self, value: u32, now: u64, memory: &FlatMemory) {
        let is = |command: Ctrl| value & command.bits() != 0;
        if is(Ctrl::RESET.with_soft_reset(true)) {
            // Its outstanding bursts are the model's business, and that has none.
            self.running = None;
            self.forget();
            for at in (COUNTERS_CYCLES_LO.offset()..MAP_SIZE).step_by(4) {
                self.set(at, 0);
            }
        } else if is(Ctrl::RESET.with_abort_job(true)) {
            if let Some(running) = self.running.take() {
                let stage = running.run.stage_at(now - running.since);
                self.end(Some(Failure { stage, ..Failure::of(ErrorCode::Aborted) }));
            }
        } else if is(Ctrl::RESET.with_start(true)) && self.running.is_none() {
            self.forget();
            let site = Site { memory, latency: self.latency, fault: self.fault.take() };
            let run = jobs::run(&self.config, &self.parameters(), site);
            self.running = Some(Running { since: now, run });
        }
    }

    /// Forgets how the last job ended, and what it gave.
    fn forget(&mut self) {
        for at in [STATUS.offset(), ERROR_INFO.offset(), ERROR_ADDR.offset()] {
            self.set(at, 0);
        }
        for at in (RESULT_NODES.offset()..).step_by(4).take(4) {
            self.set(at, 0);
        }
    }

    fn end(&mut self, failure: Option<Failure>) {
        let event = if failure.is_some() { 0b10 } else { 0b01 };
        let status = Status::from_bits(0b010 | u32::from(failure.is_some()) << 2);
        self.set(STATUS.offset(), status.bits());
        self.set(INT_STATUS.offset(), self.word(INT_STATUS.offset()) | event);
        if let Some(Failure { code, stage, region, addr }) = failure {
            let region = region.map_or(0, |id: RegionId| (id as u32) << 16 | 1 << 15);
            self.set(ERROR_INFO.offset(), code as u32 | (stage as u32) << 8 | region);
            self.set(ERROR_ADDR.offset(), addr);
        }
    }

    fn parameters(&self) -> Parameters {
        let region = |id: usize| {
            let at = xylem_regs::REGION_PRIMITIVES_BASE.offset() + 8 * id as u32;
            Region::new(self.word(at), self.word(at + 4))
        };
        let corner = |x: u32| IVec3::from_array([0, 4, 8].map(|i| self.word(x + i) as i32));
        let bounds = Aabb { min: corner(ROOT_LO_X.offset()), max: corner(ROOT_HI_X.offset()) };
        let leaf_size = self.word(ROOT_LEAF_SIZE.offset());
        let child = jobs::child(self.word(ROOT_POINTER.offset()), leaf_size);
        Parameters {
            origin: self.origin,
            job: Ctrl::from_bits(self.word(CTRL.offset())).job().ok(),
            primitives: self.word(JOB_PRIMITIVES.offset()),
            rays: self.word(JOB_RAYS.offset()),
            nodes: self.word(JOB_NODES.offset()),
            entries: self.word(JOB_ENTRIES.offset()),
            root: Subtree { bounds, child },
            format: Register::from_bits(self.word(xylem_regs::JOB_FORMAT.offset())),
            limits: Register::from_bits(self.word(xylem_regs::JOB_LIMITS.offset())),
            regions: std::array::from_fn(region),
        }
    }

    fn word(&self, offset: u32) -> u32 {
        self.words.get(offset as usize / 4).copied().unwrap_or(0)
    }

    fn set(&mut self, offset: u32, value: u32) {
        if let Some(word) = self.words.get_mut(offset as usize / 4) {
            *word = value;
        }
    }
}

#[cfg(test)]
mod tests;
