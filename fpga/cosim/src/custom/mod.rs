//! VexRiscv with `xy_cfu` under Verilator, running the program of `xylem-custom`: what the inner steps take in
//! software and as custom instructions, and beside them what they take in the accelerator.

mod accelerator;

use std::path::{Path, PathBuf};
use std::process::Command;

use thiserror::Error;
use xylem::scene::camera::{Camera, UpAxis};
use xylem::scene::convert::{GridRay, convert};
use xylem::scene::{self, LoadOptions};
use xylem::soc::SceneBlob;
use xylem_core::node::NodeFormat;
use xylem_custom::measure::{Measured, Step};

use crate::verilate::{self, CosimError, Unit};

pub use accelerator::{Accelerated, accelerated};

/// A step in all three ways, in cycles a time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Row {
    /// The step.
    pub step: Step,
    /// How often the soft core did it, in either way.
    pub count: u32,
    /// In software.
    pub software: f64,
    /// With custom instructions.
    pub custom: f64,
    /// In the accelerator's unit.
    pub accelerator: f64,
}

/// Measures every step on `scene` in all three ways; the soft core is given up after `limit` cycles.
///
/// # Errors
/// [`CustomError::Program`] among others if a custom instruction's results are not the software's.
pub fn compare(machine: &Machine, scene: &SceneBlob, limit: u64) -> Result<Vec<Row>, CustomError> {
    let measured = machine.run(scene, limit)?;
    let accelerated = accelerated(scene)?;
    let a_time = |cycles: u64, count: u64| cycles as f64 / count.max(1) as f64;
    let row = |&Measured { step, count, software, custom }: &Measured| {
        let [times, cycles] = match step {
            Step::Heap => accelerated.heap,
            Step::BoxTest => accelerated.boxes,
            Step::Encode | Step::Compress => accelerated.compress,
            Step::Trace => accelerated.trace,
        };
        Row {
            step,
            count,
            software: a_time(software, count.into()),
            custom: a_time(custom, count.into()),
            accelerator: a_time(cycles, times),
        }
    };
    Ok(measured.iter().map(row).collect())
}

/// A scene and the view of it of `side` by `side` rays.
///
/// # Errors
/// [`CustomError::View`].
pub fn view(name: &str, side: u32) -> Result<SceneBlob, CustomError> {
    let view = |error: &dyn std::fmt::Display| CustomError::View(format!("{name}: {error}"));
    let mesh = scene::load(name, &LoadOptions::default()).map_err(|error| view(&error))?;
    let bounds = mesh.bounds().ok_or_else(|| view(&"the scene is empty"))?;
    let rays = Camera::framing(bounds, UpAxis::Y, side, side).rays();
    let on_grid = convert(&mesh.frame, &rays).map_err(|error| view(&error))?;
    Ok(SceneBlob {
        rays: on_grid.iter().filter_map(GridRay::core).copied().collect(),
        triangles: mesh.triangles,
        max_leaf_size: 8,
        // Trees are traced as they were built.
        format: NodeFormat::Bvh2,
        ..SceneBlob::default()
    })
}

/// The bench and the program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Machine {
    bench: PathBuf,
    program: PathBuf,
}

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

impl Machine {
    /// Builds the bench. Program and core are those that `tests/firmware.sh custom` left, or those that
    /// `XYLEM_CUSTOM` and `XYLEM_VEXRISCV` name.
    ///
    /// # Errors
    /// [`CustomError::Missing`] if one of them is not there; [`CustomError::Cosim`].
    pub fn new() -> Result<Self, CustomError> {
        let root = Path::new(ROOT);
        let file = |variable: &'static str, what: &'static str, built: Option<PathBuf>| {
            let path = std::env::var_os(variable).map(PathBuf::from).or(built);
            path.filter(|path| path.is_file()).ok_or(CustomError::Missing { what, variable })
        };
        let built = root.join("target/riscv/riscv32im-unknown-none-elf/release/xylem-custom");
        let program = file("XYLEM_CUSTOM", "the program for VexRiscv", Some(built))?;
        let packaged = packaged(&root.join("target/tools/venv/lib"));
        let core = file("XYLEM_VEXRISCV", "VexRiscv_FullCfu.v", packaged)?;
        let unit = Unit { top: "xy_vexriscv", files: "cfu.f", config: "bench", parameters: &[] };
        let soc = root.join("fpga/soc");
        let wrapper = soc.join("xy_vexriscv.sv");
        let bench = soc.join("vexriscv_tb.cpp");
        let bench = verilate::program(&unit, &[&wrapper, &core], &bench)?;
        Ok(Self { bench, program })
    }

    /// Runs the program on a scene, for `limit` cycles at most.
    fn run(&self, scene: &SceneBlob, limit: u64) -> Result<Vec<Measured>, CustomError> {
        let folder = verilate::target_folder();
        let blob = folder.join(format!("custom-{}.blob", std::process::id()));
        let io = |path: &Path| {
            let path = path.to_owned();
            |error| CustomError::Cosim(CosimError::Io { path, error })
        };
        std::fs::write(&blob, scene.to_bytes(true)?).map_err(io(&blob))?;
        let mut bench = Command::new(&self.bench);
        let output = bench.arg(&self.program).arg(&blob).arg(limit.to_string()).output();
        let _ = std::fs::remove_file(&blob);
        let output = output.map_err(io(&self.bench))?;
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        let end = String::from_utf8_lossy(&output.stderr);
        let end = end.lines().last().unwrap_or_default().to_owned();
        let steps = said.lines().filter_map(|line| line.strip_prefix("step "));
        let steps: Option<Vec<_>> = steps.map(Measured::parse).collect();
        match steps.filter(|steps| steps.len() == Step::ALL.len()) {
            Some(steps) if end.ends_with(" power-off 0") => Ok(steps),
            _ => Err(CustomError::Program { end, said }),
        }
    }
}

/// Looks into every Python version's packages.
fn packaged(lib: &Path) -> Option<PathBuf> {
    let pythons = std::fs::read_dir(lib).ok()?;
    let tail = "site-packages/pythondata_cpu_vexriscv/verilog/VexRiscv_FullCfu.v";
    pythons.flatten().map(|python| python.path().join(tail)).find(|path| path.is_file())
}

/// Why nothing was measured.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CustomError {
    /// A file that the run needs is not there.
    #[error("{what} is missing: run tests/firmware.sh custom, or name the file in {variable}")]
    Missing {
        /// What.
        what: &'static str,
        /// The environment variable that may name it.
        variable: &'static str,
    },
    /// The bench could not be built or started.
    #[error(transparent)]
    Cosim(#[from] CosimError),
    /// There is no such scene, or no view of it.
    #[error("{0}")]
    View(String),
    /// The accelerator's model could not do the job.
    #[error("the accelerator's model: {0}")]
    Model(String),
    /// The scene does not fit the soft core's memory.
    #[error(transparent)]
    Scene(#[from] xylem::soc::SocError),
    /// The program did not end well: results differ, it crashed, or it took too long.
    #[error("the program ended with `{end}` and said:\n{said}")]
    Program {
        /// The bench's last line.
        end: String,
        /// What the program said.
        said: String,
    },
}
