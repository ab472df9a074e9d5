//! Builds on the clock, measured.

use std::time::{Duration, Instant};

use xylem_core::node::{NodeFormat, Tree};

use super::Layout;
use crate::bus::{FlatMemory, MemoryTiming};
use crate::dram::{self, ChannelStats, Energy};
use crate::machine::config::MachineConfig;
use crate::machine::mergetree::{self, MachineError, MachineRun};
use crate::machine::port::{DramPort, IdealPort, Port};
use crate::machine::topdown;

/// A build on the clock: what the machine and the memory behind it did.
#[derive(Debug, Clone)]
pub struct ClockedRun {
    /// The machine.
    pub config: MachineConfig,
    /// What it did, with the pass that compressed its tree, if there was one.
    pub machine: MachineRun,
    /// The tree of 64-byte nodes, if there is one.
    pub exact: Option<Tree>,
    /// What its memory did; none for an ideal one.
    pub memory: Option<MemoryRun>,
    /// How long the host simulated, measured.
    pub host_time: Duration,
}

/// What a DRAM did during a run.
#[derive(Debug, Clone)]
pub struct MemoryRun {
    /// Its name.
    pub name: &'static str,
    /// Clocks of the memory.
    pub clocks: u64,
    /// The most that it moves, in 10^9 bytes a second.
    pub peak_gb_per_s: f64,
    /// What was counted, over all channels.
    pub stats: ChannelStats,
    /// Energy, where there are currents for the device: **modelled**.
    pub energy: Option<Energy>,
}

impl ClockedRun {
    /// Cycles of the machine that the host simulates in a second, measured.
    pub fn cycles_per_second(&self) -> f64 {
        self.machine.cycles as f64 / self.host_time.as_secs_f64()
    }

    /// The build's time on the machine in milliseconds: **modelled**.
    pub fn milliseconds(&self) -> f64 {
        self.machine.cycles as f64 / (f64::from(self.config.clock_mhz) * 1e3)
    }

    /// Bytes moved over the time of the build, in 10^9 a second.
    pub fn gb_per_s(&self) -> f64 {
        self.machine.traffic.total().bytes() as f64 / (self.milliseconds() * 1e6)
    }

    /// The share of the memory's peak rate that was used, from 0 to 1.
    pub fn bus_utilisation(&self) -> Option<f64> {
        self.memory.as_ref().map(|memory| self.gb_per_s() / memory.peak_gb_per_s)
    }
}

/// Builds over the primitives in `memory` with `config`, behind the DRAM of the name of `timing`, or
/// behind an ideal memory where there is none. A tree of 64-byte nodes is then compressed, if `format`
/// asks for it.
///
/// # Errors
/// [`MachineError`].
pub fn run(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    layout: &Layout,
    count: u32,
    format: NodeFormat,
    timing: &MemoryTiming,
) -> Result<ClockedRun, MachineError> {
    match dram::Config::by_name(timing.name) {
        Some(dram) => {
            let mut port = DramPort::new(dram, config.clock_mhz);
            let mut run = on(config, memory, layout, count, format, &mut port)?;
            let device = port.dram();
            run.memory = device.map(|(memory, clocks)| MemoryRun {
                name: dram.name,
                clocks,
                peak_gb_per_s: dram.peak_gb_per_s(),
                stats: memory.stats().total(),
                energy: memory.energy(clocks),
            });
            Ok(run)
        }
        None => on(config, memory, layout, count, format, &mut IdealPort::new(1)),
    }
}

fn on<P: Port>(
    config: &MachineConfig,
    memory: &mut FlatMemory,
    layout: &Layout,
    count: u32,
    format: NodeFormat,
    port: &mut P,
) -> Result<ClockedRun, MachineError> {
    let start = Instant::now();
    let mut machine = mergetree::build(config, memory, &layout.build, count, port)?;
    let exact = (machine.tree.format == NodeFormat::Bvh2).then_some(machine.tree);
    if let (Some(tree), NodeFormat::Quantized(quantization)) = (&exact, format) {
        let (target, time_out) = (layout.quantized_nodes, config.time_out);
        let pass = topdown::compress(memory, tree, target, &quantization, port, time_out)?;
        machine.tree = pass.tree;
        machine.cycles += pass.cycles;
        machine.traffic += &pass.traffic;
    }
    let host_time = start.elapsed();
    Ok(ClockedRun { config: *config, machine, exact, memory: None, host_time })
}
