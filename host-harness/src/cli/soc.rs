//! `xylem soc`.

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum;
use xylem_core::emit::{CellConfig, EmitterKind};
use xylem_core::geom::Ray;
use xylem_core::pipeline::BuildConfig;
use xylem_firmware::job::MAX_CELLS;

use super::options::{QueryArg, TreeArgs};
use super::render::{Size, Up, camera};
use super::{CliError, Console, build, progress};
use crate::bus::{MEMORIES, MemoryTiming};
use crate::report::SocReport;
use crate::scene::rays::{RayFileError, read_rays};
use crate::scene::{GridRay, SceneRay, convert};
use crate::soc::{self, Engine, Options, SceneBlob, firmware_elf, run_on_host};

/// Run the firmware on a RISC-V soft core
///
/// The same Rust that runs on the host, built for riscv32imc: it finds the scene and the rays in
/// memory, builds, compresses and traces, and logs a digest of every output. The command compares
/// the digest with the host's and prints cycles per primitive and per ray.
///
/// Cycles depend on the engine: sim models the core's cycles, qemu counts instructions, picorv32 is
/// the core's RTL under Verilator.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem soc cornell\n  \
    xylem soc terrain:6 --engine qemu --format cbvh --json\n  \
    xylem soc bunny.obj.gz --rays primary.rays --memory slow\n  \
    xylem soc terrain:6 --top-level binned --bins 8 --cells 512\n\n\
    The firmware is built by `tests/firmware.sh build`; XYLEM_FIRMWARE names another ELF file.")]
pub(super) struct Args {
    #[command(flatten)]
    tree: TreeArgs,
    /// What runs the program: the instruction simulator, QEMU, or PicoRV32's RTL under Verilator
    #[arg(long, value_enum, default_value_t = EngineArg::Sim)]
    engine: EngineArg,
    /// The rays to trace, instead of a camera's
    #[arg(long, value_name = "FILE", conflicts_with_all = ["size", "up"])]
    rays: Option<PathBuf>,
    /// The camera's image in pixels, one ray each
    #[arg(long, value_name = "WxH", default_value = "32x24")]
    size: Size,
    /// The axis that points up in the scene
    #[arg(long, value_enum, default_value_t = Up::Y)]
    up: Up,
    /// What the rays are asked
    #[arg(long, value_enum, default_value_t = QueryArg::Closest)]
    query: QueryArg,
    /// External memory of the simulated core (sim only), see `xylem build --help`
    #[arg(long, default_value = "ideal", value_parser = build::memory_names())]
    memory: String,
    /// Seconds after which the run is given up
    #[arg(long, value_name = "SECONDS", default_value_t = 600,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    timeout: u64,
}

/// `--engine`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EngineArg {
    /// The instruction simulator
    Sim,
    /// QEMU's virt machine
    Qemu,
    /// PicoRV32's RTL
    Picorv32,
}

impl From<EngineArg> for Engine {
    fn from(engine: EngineArg) -> Self {
        match engine {
            EngineArg::Sim => Self::Sim,
            EngineArg::Qemu => Self::Qemu,
            EngineArg::Picorv32 => Self::PicoRv32,
        }
    }
}

/// The cells of the top level, as far as the firmware has storage for them.
///
/// # Errors
/// [`CliError::Usage`] for more than that, and for an emitter that the firmware does not run.
fn cells(args: &TreeArgs, config: &BuildConfig) -> Result<CellConfig, CliError> {
    if config.emitter != EmitterKind::Lbvh {
        let message = "the firmware builds with --emitter lbvh only; leave --emitter out";
        return Err(CliError::Usage(message.into()));
    }
    let most = MAX_CELLS as u32;
    let capacity = args.cells().unwrap_or(most);
    if capacity > most {
        let message = format!("--cells {capacity} is more than the firmware's {most}; use fewer");
        return Err(CliError::Usage(message));
    }
    Ok(CellConfig { capacity, ..config.cells })
}

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let tree = args.tree.build_options()?;
    let engine = Engine::from(args.engine);
    let memory = *MemoryTiming::by_name(&args.memory).unwrap_or(&MEMORIES[0]);
    if engine != Engine::Sim && memory != MEMORIES[0] {
        let message = format!(
            "--memory {} is modelled by --engine sim only; leave it out for {engine}",
            memory.name
        );
        return Err(CliError::Usage(message));
    }
    let cells = cells(&args.tree, &tree.config)?;
    engine.check()?;
    let elf = firmware_elf()?;
    let given = args.rays.as_ref().map(|path| Ok::<_, CliError>((path, read_rays(path)?)));
    let given = given.transpose()?;
    let mesh = args.tree.load()?;
    let scene_rays: Vec<SceneRay> = match &given {
        Some((_, rays)) => rays.clone(),
        None => camera(&mesh, args.up, args.size).rays(),
    };
    let grid_rays = convert::convert(&mesh.frame, &scene_rays).map_err(|source| {
        let path = given.map_or_else(PathBuf::new, |(path, _)| path.clone());
        RayFileError::BadRay { path, source }
    })?;
    // The others are misses by themselves, and the firmware need not be told of them.
    let rays: Vec<Ray> = grid_rays.iter().filter_map(GridRay::core).copied().collect();
    let blob = SceneBlob {
        grid: tree.config.grid,
        morton: tree.config.morton,
        format: tree.format,
        query: args.query.into(),
        max_leaf_size: tree.config.max_leaf_size,
        top_level: tree.config.top_level,
        cells,
        join_leaves: tree.config.join_leaves,
        triangles: mesh.triangles.clone(),
        rays,
        ..SceneBlob::default()
    };
    let host =
        run_on_host(&blob)?.map_err(|source| CliError::Job { scene: mesh.name.clone(), source })?;
    let spinner = progress::spinner(format!("running {} on {engine}", mesh.name));
    let options = Options { time: Duration::from_secs(args.timeout), memory };
    let outcome = soc::run(engine, &elf, &blob, &options)?;
    spinner.finish_and_clear();

    let report = SocReport::new(&mesh.name, &blob, &outcome, &host);
    console.result(&report, || report.to_string())?;
    if report.digest == report.host_digest {
        return Ok(());
    }
    Err(CliError::Mismatch(format!(
        "{}: the digest on {engine} is {}, on the host {} (a defect; rebuild the firmware with \
         `tests/firmware.sh build`, and please report it if they still differ)",
        mesh.name, report.digest, report.host_digest
    )))
}
