//! `xylem soc`.

use std::path::PathBuf;
use std::time::Duration;

use clap::ValueEnum;
use xylem_core::compress::Compression;
use xylem_core::emit::{CellConfig, EmitterKind};
use xylem_core::geom::Ray;
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::num::Grid;
use xylem_core::pipeline::BuildConfig;
use xylem_core::refit::{Factor, RebuildRule};
use xylem_core::toplevel::TopLevel;
use xylem_firmware::blob::Header;
use xylem_firmware::job::MAX_CELLS;

use super::options::{self, QueryArg, TreeArgs};
use super::render::{Size, Up, camera};
use super::{CliError, Console, build, progress};
use crate::bus::{MEMORIES, MemoryTiming};
use crate::report::SocReport;
use crate::scene::rays::{RayFileError, read_rays};
use crate::scene::{Animation, GridRay, LoadOptions, Mesh, Movement, SceneRay, convert};
use crate::soc::{
    self, AcceleratorConfig, Beside, Engine, FrameReport, Motion, OUTPUTS, Options, Output,
    SceneBlob, firmware_elf, run_on_host,
};

/// Run the firmware on a RISC-V soft core
///
/// The same Rust that runs on the host, built for riscv32imc: it finds the scene and the rays in
/// memory, builds, compresses and traces, and logs a digest of every output. The command compares
/// the digest with the host's and prints cycles per primitive and per ray.
///
/// With --animate the triangles move. Every frame lies in the core's memory; the firmware refits the
/// tree or builds it anew, by the SAH cost that the refit measures, and traces the same rays. The
/// command also compares the hits of every frame with those of a tree built for it.
///
/// With --accelerator the accelerator does the job after the software, driven by the same program
/// through its registers: the core makes the input that the hardware takes, starts a build, one that
/// compresses, and a trace of the rays, waits for the interrupt of each and compares every byte. The command
/// prints cycles in software, cycles with the accelerator and the speed-up, part by part. What the
/// accelerator has no unit for stays software.
///
/// Cycles depend on the engine: sim models the core's cycles, qemu counts instructions, picorv32 is
/// the core's RTL under Verilator.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem soc cornell\n  \
    xylem soc terrain:6 --engine qemu --format cbvh --json\n  \
    xylem soc bunny.obj.gz --rays primary.rays --memory slow\n  \
    xylem soc terrain:6 --top-level binned --bins 8 --cells 512\n  \
    xylem soc flag:cells=24 --animate 64 --rebuild-at 1.2\n  \
    xylem soc terrain:6 --accelerator model --accelerator-config small\n  \
    xylem soc terrain:6 --engine picorv32 --accelerator rtl\n\n\
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
    /// Move the triangles through N frames, at most 1024, and refit or rebuild the tree in each
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    animate: Option<u32>,
    /// With --animate: the scene where it moves to, with the same triangles; several are passed
    /// through in turn [default: the scene is twisted]
    #[arg(long, value_name = "SCENE", requires = "animate")]
    key: Vec<String>,
    /// With --animate: rebuild when the SAH cost has grown by this factor since the last time
    /// [default: 1.3]
    #[arg(long, value_name = "FACTOR", requires = "animate", value_parser = factor)]
    rebuild_at: Option<Factor>,
    /// With --animate: rebuild when that is cheaper in the long run, where a rebuild costs as much more
    /// than a refit as tracing a frame's rays costs at this SAH cost
    #[arg(long, value_name = "COST", conflicts_with = "rebuild_at", requires = "animate",
          value_parser = factor)]
    rebuild_price: Option<Factor>,
    /// External memory of the simulated core (sim only), see `xylem build --help`
    #[arg(long, default_value = "ideal", value_parser = build::memory_names())]
    memory: String,
    /// The accelerator beside the core: the cycle model (with --engine sim) or the RTL of xy_top (with
    /// --engine picorv32)
    #[arg(long, value_enum, default_value_t = AcceleratorArg::None, conflicts_with = "animate")]
    accelerator: AcceleratorArg,
    /// With --accelerator: its sizes; small has M = 128 and B = 4, paper M = 8192 and B = 16 (P2)
    #[arg(long, value_name = "NAME", default_value = "paper", value_parser = config_names())]
    accelerator_config: String,
    /// With --accelerator: cycles from a read at its memory port to the answer, 1 to 1000
    #[arg(long, value_name = "CYCLES", default_value_t = 10,
          value_parser = clap::value_parser!(u32).range(1..=1000))]
    accelerator_latency: u32,
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

/// `--accelerator`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum AcceleratorArg {
    /// There is none
    None,
    /// The cycle models of its units
    Model,
    /// The RTL of xy_top
    Rtl,
}

/// The names that `--accelerator-config` takes.
fn config_names() -> clap::builder::PossibleValuesParser {
    AcceleratorConfig::ALL.map(|config| config.name).into()
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

/// How the firmware compresses: the depth of treelets, or 0 from the root down. As the accelerator does, if
/// there is one and nothing else is asked for.
///
/// # Errors
/// [`CliError::Usage`] for what the firmware does not do.
fn treelet_depth(config: &BuildConfig, beside: Option<&Beside>) -> Result<u8, CliError> {
    let Some(compression) = config.compression else {
        let plain = config.format() == NodeFormat::Bvh2;
        let message = "the firmware makes bvh2 and cbvh nodes only; use --format cbvh or bvh2";
        let depth = beside.map_or(0, |beside| beside.config.treelet_depth);
        return if plain { Ok(depth) } else { Err(CliError::Usage(message.into())) };
    };
    let depth = compression.treelet_depth;
    let like = Compression { treelet_depth: depth, ..Compression::DEFAULT };
    let Quantization { coordinates, .. } = compression.quantization;
    let quantization = Quantization { coordinates, ..Quantization::RELATIVE };
    let ours = compression == Compression { quantization, ..like }
        && depth <= Header::MAX_TREELET_DEPTH
        && (depth == 1 || config.top_level == TopLevel::None);
    let message = "the firmware compresses to cbvh nodes of 6 bits: --compress topdown, or bottomup with \
                   --treelet-depth 1 or, without --top-level, 2";
    if ours { Ok(depth) } else { Err(CliError::Usage(message.into())) }
}

/// A number from 0 to 65535 with 16 binary places.
fn factor(text: &str) -> Result<Factor, String> {
    let range = 0.0..f64::from(1u32 << 16);
    let number = text.parse::<f64>().ok().filter(|number| range.contains(number));
    number.map(Factor::from_num).ok_or_else(|| "write a number from 0 to 65535".into())
}

impl Args {
    /// The accelerator asked for, if one is.
    ///
    /// # Errors
    /// [`CliError::Usage`] for one that is not beside this core, or a tree that none builds.
    fn beside(&self, config: &BuildConfig) -> Result<Option<Beside>, CliError> {
        let usage = |message: String| Err(CliError::Usage(message));
        let engine = match self.accelerator {
            AcceleratorArg::None => return Ok(None),
            AcceleratorArg::Model => EngineArg::Sim,
            AcceleratorArg::Rtl => EngineArg::Picorv32,
        };
        if self.engine != engine {
            let engine = Engine::from(engine);
            return usage(format!(
                "this accelerator is beside the core of --engine {engine}; use that, or model with \
                 sim and rtl with picorv32"
            ));
        }
        if config.top_level != TopLevel::None
            || config.join_leaves > 0
            || config.grid != Grid::DEFAULT
        {
            let message = "the accelerator builds on the 24-bit grid, without a top level or joined \
                           leaves; leave out --top-level, --join-leaves and --grid";
            return usage(message.into());
        }
        // The parser lets no other names through.
        let config = AcceleratorConfig::by_name(&self.accelerator_config);
        let config = *config.unwrap_or(&AcceleratorConfig::PAPER);
        Ok(Some(Beside { config, latency: self.accelerator_latency }))
    }

    /// The scene, or the frames of its animation.
    fn load(&self) -> Result<Animation, CliError> {
        let mesh = self.tree.load()?;
        let Some(frames) = self.animate else { return Ok(Animation { frames: vec![mesh] }) };
        let grid = mesh.frame.grid();
        let keys = self.key.iter().map(|key| options::load(key, grid));
        let movement = match keys.collect::<Result<Vec<_>, _>>()? {
            keys if keys.is_empty() => Movement::Twist,
            keys => Movement::Keys(keys),
        };
        let options = LoadOptions { grid, frame: None };
        Ok(Animation::new(&mesh, &movement, frames, &options)?)
    }

    /// The rule for rebuilding.
    fn rule(&self) -> RebuildRule {
        match (self.rebuild_at, self.rebuild_price) {
            (_, Some(price)) => RebuildRule::Amortised(price),
            (Some(factor), None) => RebuildRule::Drift(factor),
            (None, None) => RebuildRule::default(),
        }
    }
}

/// The digest of the hits of each frame of an animation in a tree that is built for it, on the host.
fn fresh_hits(blob: &SceneBlob, frames: &[Mesh]) -> Result<Vec<u32>, CliError> {
    let hits = OUTPUTS.iter().position(|output| *output == Output::Hits);
    let one = |mesh: &Mesh| {
        let still =
            SceneBlob { triangles: mesh.triangles.clone(), animation: None, ..blob.clone() };
        let run = run_on_host(&still)?
            .map_err(|source| CliError::Job { scene: mesh.name.clone(), source })?;
        Ok(hits.map_or(0, |hits| run.report.outputs[hits].crc))
    };
    let animated = blob.animation.is_some();
    frames.iter().filter(|_| animated).map(one).collect()
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
    let accelerator = args.beside(&tree.config)?;
    engine.check()?;
    let elf = firmware_elf()?;
    let given = args.rays.as_ref().map(|path| Ok::<_, CliError>((path, read_rays(path)?)));
    let given = given.transpose()?;
    let animation = args.load()?;
    let [mesh, later @ ..] = &animation.frames[..] else { return Ok(()) };
    let scene_rays: Vec<SceneRay> = match &given {
        Some((_, rays)) => rays.clone(),
        None => camera(mesh, args.up, args.size).rays(),
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
        treelet_depth: treelet_depth(&tree.config, accelerator.as_ref())?,
        query: args.query.into(),
        max_leaf_size: tree.config.max_leaf_size,
        top_level: tree.config.top_level,
        cells,
        join_leaves: tree.config.join_leaves,
        triangles: mesh.triangles.clone(),
        animation: args.animate.map(|_| Motion {
            later: later.iter().map(|mesh| mesh.triangles.clone()).collect(),
            rule: args.rule(),
        }),
        rays,
        accelerator: accelerator.is_some(),
        ..SceneBlob::default()
    };
    let host =
        run_on_host(&blob)?.map_err(|source| CliError::Job { scene: mesh.name.clone(), source })?;
    let spinner = progress::spinner(format!("running {} on {engine}", mesh.name));
    let options = Options { time: Duration::from_secs(args.timeout), memory, accelerator };
    let outcome = soc::run(engine, &elf, &blob, &options)?;
    spinner.finish_and_clear();

    let fresh = fresh_hits(&blob, &animation.frames)?;
    let report =
        SocReport::new(&mesh.name, &blob, &outcome, &host.report, &fresh, accelerator.as_ref());
    console.result(&report, || report.to_string())?;
    let unlike =
        |(a, b): (&FrameReport, &FrameReport)| FrameReport { cycles: b.cycles, ..*a } != *b;
    let frames = outcome.frames.iter().zip(&host.frames).position(unlike);
    let what = if report.digest != report.host_digest {
        format!("the digest on {engine} is {}, on the host {}", report.digest, report.host_digest)
    } else if let Some(frame) = frames {
        format!("frame {frame} on {engine} is another than on the host")
    } else if outcome.frames.len() != host.frames.len() {
        format!("{} frames on {engine}, {} on the host", outcome.frames.len(), host.frames.len())
    } else if let Some(frame) = report.frames.iter().find(|frame| !frame.fresh_hits_equal) {
        format!("frame {}: the hits are not those of a fresh tree", frame.frame)
    } else if report.accelerator.as_ref().is_some_and(|accelerator| !accelerator.equal) {
        "the accelerator's outputs are not the software's".into()
    } else {
        return Ok(());
    };
    Err(CliError::Mismatch(format!(
        "{}: {what} (a defect; rebuild the firmware with `tests/firmware.sh build`, and please report \
         it if they still differ)",
        mesh.name
    )))
}
