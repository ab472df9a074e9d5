//! The soft core: the firmware's program on three RISC-V engines, and its log decoded.
//!
//! [`run`] loads one ELF and one scene blob into an [`Engine`], lets it run to its power-off and
//! returns the decoded log with the [`Report`] that the program logged last, and for an animation that of each
//! frame. The same job on the
//! host is [`run_on_host`]; its report has the same [`Report::digest`] or something is wrong.
//!
//! The memory map is [`xylem_firmware::map`], the same for all engines.
//!
//! | engine              | cycles in the report are…                                   |
//! |---------------------|-------------------------------------------------------------|
//! | [`Engine::Sim`]     | modelled: [`Costs`] per instruction, and waits for memory   |
//! | [`Engine::Qemu`]    | instructions, as QEMU counts one cycle for each              |
//! | [`Engine::PicoRv32`]| measured: clock cycles of the core's RTL under Verilator     |
//!
//! Beside the core there may be an accelerator ([`Beside`]), which does the job after the software; the
//! firmware compares both and reports what each part took ([`Accelerated`]).
//!
//! The model is one of PicoRV32 on memory that answers at once. There, the cycles of every stage
//! are the same as those of the RTL, exactly; a test holds it to that.

mod accelerator;
mod blob;
mod costs;
mod error;
mod host;
mod image;
mod jobs;
mod log;
mod picorv32;
mod process;
mod qemu;
mod sim;

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::bus::{MEMORIES, MemoryTiming, Tally};

pub use xylem_driver::Counters;
pub use xylem_firmware::accelerated::{Accelerated, PARTS, Part, PartReport};
pub use xylem_firmware::animation::FrameReport;
pub use xylem_firmware::report::{OUTPUTS, Output, Report, STAGES};

pub use accelerator::AcceleratorConfig;
pub use blob::{Motion, SceneBlob};
pub use costs::{Costs, Step};
pub use error::SocError;
pub use host::{HostRun, run_on_host};
pub use image::{Image, Segment};
pub use log::Line;

/// What runs the program.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub enum Engine {
    /// The instruction simulator on the harness's own memory.
    Sim,
    /// QEMU's `virt` machine, counting instructions.
    Qemu,
    /// PicoRV32's RTL under Verilator.
    PicoRv32,
}

impl Engine {
    /// All engines, fastest to start first.
    pub const ALL: [Self; 3] = [Self::Sim, Self::Qemu, Self::PicoRv32];

    /// The engine's name.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Sim => "sim",
            Self::Qemu => "qemu",
            Self::PicoRv32 => "picorv32",
        }
    }

    /// What this engine's cycles are.
    pub const fn cycles_are(self) -> &'static str {
        match self {
            Self::Sim => "modelled cycles",
            Self::Qemu => "instructions",
            Self::PicoRv32 => "RTL cycles",
        }
    }

    /// Whether the engine can run here, or [`SocError::ToolMissing`] that names what it lacks.
    ///
    /// # Errors
    /// [`SocError::ToolMissing`].
    pub fn check(self) -> Result<(), SocError> {
        match self {
            Self::Sim => Ok(()),
            Self::Qemu => qemu::check(),
            Self::PicoRv32 => picorv32::check(),
        }
    }
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// How to run a program.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Options {
    /// The wall-clock time after which the run is given up.
    pub time: Duration,
    /// What external memory takes beyond the cycle of its answer, on [`Engine::Sim`] only. The core
    /// waits for every access to its end; cycles are the core's.
    pub memory: MemoryTiming,
    /// The accelerator beside the core: the cycle model on [`Engine::Sim`], the RTL on
    /// [`Engine::PicoRv32`].
    pub accelerator: Option<Beside>,
}

/// An accelerator beside the core, on a memory port of its own.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Beside {
    /// Which one.
    pub config: AcceleratorConfig,
    /// Cycles from a read at its memory port to the answer, at least 1. Lines follow one another in
    /// every cycle.
    pub latency: u32,
}

impl Default for Options {
    /// Two minutes, memory that answers at once, and no accelerator.
    fn default() -> Self {
        Self { time: Duration::from_secs(120), memory: MEMORIES[0], accelerator: None }
    }
}

/// What a run to power-off gave.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// What ran it.
    pub engine: Engine,
    /// The decoded log, without the machine-readable lines.
    pub log: Vec<Line>,
    /// What the job reported.
    pub report: Report,
    /// What it reported of each frame, if the scene is animated.
    pub frames: Vec<FrameReport>,
    /// What it reported of the accelerator, if the scene says that there is one.
    pub accelerated: Option<Accelerated>,
    /// Instructions from reset to power-off, where the engine counts them.
    pub instructions: Option<u64>,
    /// Cycles from reset to power-off, where the engine counts them.
    pub cycles: Option<u64>,
    /// What the core accessed in external memory, where the engine counts it.
    pub external: Option<Tally>,
    /// Wall-clock time of the run, without building the engine.
    pub time: Duration,
}

impl Outcome {
    /// Simulation speed in millions of instructions a second, where the engine counts them.
    pub fn mips(&self) -> Option<f64> {
        Some(self.instructions? as f64 / self.time.as_secs_f64() / 1e6)
    }

    /// Simulation speed in millions of cycles a second, where the engine counts them.
    pub fn mega_cycles_per_second(&self) -> Option<f64> {
        Some(self.cycles? as f64 / self.time.as_secs_f64() / 1e6)
    }
}

/// Runs a program on a scene until it powers off.
///
/// # Errors
/// [`SocError`]; a run that crashed, failed or timed out carries the log so far.
pub fn run(
    engine: Engine,
    elf: &Path,
    scene: &SceneBlob,
    options: &Options,
) -> Result<Outcome, SocError> {
    let image = Image::read(elf)?;
    let ran = match engine {
        Engine::Sim => sim::run(&image, &scene.to_bytes(false)?, Costs::PICORV32, options),
        Engine::Qemu => qemu::run(elf, &scene.to_bytes(true)?, options),
        Engine::PicoRv32 => picorv32::run(&image, &scene.to_bytes(false)?, options),
    }?;
    let mut log = log::decode(&image, &ran.uart)?;
    match ran.end {
        End::PowerOff { code: 0 } => {}
        End::PowerOff { code } => return Err(SocError::Failed { engine, code, log }),
        End::Crash(what) => return Err(SocError::Crash { engine, what, log }),
        End::TimeOut(after) => return Err(SocError::TimeOut { engine, after, log }),
    }
    let frames = log::take_frames(&mut log);
    let accelerated = log::take_accelerated(&mut log);
    let Some(report) = log::take_report(&mut log) else {
        return Err(SocError::NoReport { engine, log });
    };
    if scene.accelerator && accelerated.is_none() {
        return Err(SocError::NoReport { engine, log });
    }
    let Ran { instructions, cycles, external, time, .. } = ran;
    Ok(Outcome { engine, log, report, frames, accelerated, instructions, cycles, external, time })
}

/// Where `tests/firmware.sh build` leaves the program, or what `XYLEM_FIRMWARE` names.
///
/// # Errors
/// [`SocError::NotBuilt`] if there is no file.
pub fn firmware_elf() -> Result<PathBuf, SocError> {
    let path = match std::env::var_os("XYLEM_FIRMWARE") {
        Some(path) => PathBuf::from(path),
        None => workspace()
            .join("target/riscv/riscv32imc-unknown-none-elf/release")
            .join("xylem-firmware"),
    };
    if path.is_file() { Ok(path) } else { Err(SocError::NotBuilt { path }) }
}

/// The root of the source tree that this harness was built from.
fn workspace() -> &'static Path {
    let harness = Path::new(env!("CARGO_MANIFEST_DIR"));
    harness.parent().unwrap_or(harness)
}

/// What an engine hands back.
#[derive(Debug)]
struct Ran {
    /// Every byte that left the UART.
    uart: Vec<u8>,
    end: End,
    instructions: Option<u64>,
    cycles: Option<u64>,
    external: Option<Tally>,
    time: Duration,
}

/// How a run ended.
#[derive(Debug)]
enum End {
    PowerOff { code: u8 },
    Crash(String),
    TimeOut(Duration),
}

/// How the word that was written to the power switch ends a run.
fn power_off(word: u32) -> End {
    match word & 0xffff {
        0x5555 => End::PowerOff { code: 0 },
        0x3333 => End::PowerOff { code: (word >> 16) as u8 },
        _ => End::Crash(format!("the power switch was set to {word:#010x}, which means nothing")),
    }
}
