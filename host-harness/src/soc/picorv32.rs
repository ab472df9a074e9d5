//! PicoRV32's RTL under Verilator, and beside it, if asked for, the accelerator's.
//!
//! The core's Verilog is the one file of the PyPI package `pythondata-cpu-picorv32`; the test bench
//! around it is `fpga/soc/picorv32_tb.cpp`, and the accelerator is `xy_top` of `fpga/rtl`. Together they
//! make a program, built once into a folder below `target/` whose name is the digest of all that goes
//! into it. Core and accelerator are translated apart, the second into a library of the first.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use sha2::{Digest as _, Sha256};
use xylem_firmware::map::LOCAL;

use super::{
    AcceleratorConfig, End, Engine, Image, Options, Ran, SocError, power_off, process, workspace,
};

/// The core's parameters: what the firmware is compiled for, and its reset address.
const PARAMETERS: [&str; 6] = [
    "-GCOMPRESSED_ISA=1",
    "-GENABLE_FAST_MUL=1",
    "-GENABLE_DIV=1",
    "-GBARREL_SHIFTER=1",
    "-GENABLE_COUNTERS64=1",
    "-GPROGADDR_RESET=32'h80000000",
];

/// Whether Verilator and the core's Verilog are installed.
pub(super) fn check() -> Result<(), SocError> {
    verilator_version()?;
    verilog()?;
    Ok(())
}

/// Runs a program until it powers off, crashes or exceeds the limits.
pub(super) fn run(image: &Image, blob: &[u8], options: &Options) -> Result<Ran, SocError> {
    let bench = build(options.accelerator.as_ref().map(|beside| &beside.config))?;
    let folder = process::Folder::new("picorv32")?;
    let local = folder.write("local.bin", &image.local_memory())?;
    let blob = folder.write("scene.blob", blob)?;
    let mut command = Command::new(bench);
    command.arg(local).arg(blob).arg(image.protected_end().to_string());
    command.arg(options.accelerator.map_or(1, |beside| beside.latency).to_string());
    let finished = process::run(&mut command, options.time)?;
    let (end, cycles) = match finished.status {
        None => (End::TimeOut(options.time), None),
        Some(_) => parse_end(&finished.stderr),
    };
    Ok(Ran {
        uart: finished.stdout,
        end,
        instructions: None,
        cycles,
        external: None,
        time: finished.time,
    })
}

/// Parses the bench's last words: `CYCLES power-off WORD` or `CYCLES crash TEXT`.
fn parse_end(words: &str) -> (End, Option<u64>) {
    let last = words.lines().last().unwrap_or_default();
    let mut parts = last.splitn(3, ' ');
    let cycles = parts.next().and_then(|cycles| cycles.parse().ok());
    let end = match (cycles, parts.next(), parts.next()) {
        (Some(_), Some("power-off"), Some(word)) => word.parse().ok().map(power_off),
        (Some(_), Some("crash"), Some(what)) => Some(End::Crash(what.into())),
        _ => None,
    };
    (end.unwrap_or_else(|| End::Crash(format!("the test bench said: {}", words.trim()))), cycles)
}

/// The path of the built bench; builds it first where that was not done.
fn build(accelerator: Option<&AcceleratorConfig>) -> Result<PathBuf, SocError> {
    let version = verilator_version()?;
    let verilog = verilog()?;
    let source = workspace().join("fpga/soc/picorv32_tb.cpp");
    let top = accelerator.map(Top::new).transpose()?;
    let name = top.as_ref().map_or("picorv32", |top| top.name);
    let mut key = Sha256::new();
    key.update(&version);
    let mut files = vec![&verilog, &source];
    files.extend(top.iter().flat_map(|top| top.files.iter().chain([&top.header])));
    for file in files {
        let text = std::fs::read(file);
        key.update(text.map_err(SocError::io(format!("reading {}", file.display())))?);
    }
    key.update(PARAMETERS.concat());
    key.update(top.as_ref().map_or(String::new(), |top| top.parameters.concat()));
    let key: String = key.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    let done = workspace().join("target/soc").join(format!("{name}-{key}"));
    let bench = done.join("Vpicorv32");
    // Threads of this process share a process id, and with it the folder aside.
    static BUILDING: Mutex<()> = Mutex::new(());
    let _one = BUILDING.lock().unwrap_or_else(PoisonError::into_inner);
    if bench.is_file() {
        return Ok(bench);
    }
    // Another process may build the same thing: each builds aside, and the first to rename wins.
    let aside = done.with_extension(std::process::id().to_string());
    std::fs::create_dir_all(&aside)
        .map_err(SocError::io(format!("creating {}", aside.display())))?;
    let built = translate(&aside, &verilog, &source, top.as_ref());
    if built.is_err() {
        let _ = std::fs::remove_dir_all(&aside);
    }
    built?;
    if std::fs::rename(&aside, &done).is_err() {
        let _ = std::fs::remove_dir_all(&aside);
    }
    if bench.is_file() { Ok(bench) } else { Err(failed(format!("no {}", bench.display()))) }
}

/// The accelerator's RTL.
struct Top {
    name: &'static str,
    parameters: Vec<String>,
    /// Waivers, then modules in order.
    files: Vec<PathBuf>,
    /// Its side of the bench.
    header: PathBuf,
}

impl Top {
    fn new(config: &AcceleratorConfig) -> Result<Self, SocError> {
        let rtl = workspace().join("fpga/rtl");
        let list = rtl.join("top.f");
        let text = std::fs::read_to_string(&list);
        let text = text.map_err(SocError::io(format!("reading {}", list.display())))?;
        let modules = text.lines().map(str::trim).filter(|line| line.ends_with(".sv"));
        let cache = config.traverser.as_ref();
        let parameters = [
            ("Capacity", config.capacity),
            ("Burst", config.burst),
            ("Sorters", config.sorters),
            ("Fifo", config.fifo),
            ("ReadAhead", config.read_ahead),
            ("CodeWidth", config.code_bits),
            ("Depth", config.treelet_depth.into()),
            ("Tracer", cache.is_some().into()),
            ("CacheWidth", cache.map_or(1, |unit| unit.cache_width)),
            ("CacheBlock", cache.is_some_and(|unit| unit.cache_block).into()),
        ];
        Ok(Self {
            name: config.name,
            parameters: parameters.map(|(name, value)| format!("-G{name}={value}")).to_vec(),
            files: ["waivers.vlt"].into_iter().chain(modules).map(|file| rtl.join(file)).collect(),
            header: workspace().join("fpga/soc/accelerator.h"),
        })
    }
}

/// Builds the bench in `folder`.
fn translate(
    folder: &Path,
    verilog: &Path,
    source: &Path,
    top: Option<&Top>,
) -> Result<(), SocError> {
    let verilator = |module: &str, folder: &Path| {
        let mut command = Command::new("verilator");
        command
            .args(["--cc", "--build", "-O3", "-CFLAGS", "-O2", "-Wno-fatal", "-Wno-lint"])
            .args(["--top-module", module, "--Mdir"])
            .arg(folder);
        command
    };
    let mut core = verilator("picorv32", folder);
    core.arg("--exe").args(PARAMETERS).arg(verilog).arg(source);
    if let Some(top) = top {
        let library = folder.join("xy_top");
        let mut command = verilator("xy_top", &library);
        run_tool(command.args(&top.parameters).args(&top.files))?;
        // The compiler runs in the folder.
        let includes = format!("-DXY_TOP -Ixy_top -I{}", workspace().join("fpga/soc").display());
        core.arg("-CFLAGS").arg(includes).arg("xy_top/Vxy_top__ALL.a");
    }
    run_tool(&mut core)
}

fn run_tool(command: &mut Command) -> Result<(), SocError> {
    let finished = process::run(command, Duration::from_secs(900))?;
    match finished.status {
        Some(status) if status.success() => Ok(()),
        Some(_) => Err(failed(format!("verilator said:\n{}", finished.stderr.trim()))),
        None => Err(failed("verilator took too long".into())),
    }
}

fn failed(what: String) -> SocError {
    SocError::Build { engine: Engine::PicoRv32, what }
}

/// Verilator's version line.
fn verilator_version() -> Result<String, SocError> {
    let missing = || SocError::ToolMissing {
        engine: Engine::PicoRv32,
        tool: "verilator".into(),
        hint: "install Debian's verilator or the like, and a C++ compiler".into(),
    };
    let output = Command::new("verilator").arg("--version").output().map_err(|_| missing())?;
    if !output.status.success() {
        return Err(missing());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The core's Verilog: what `XYLEM_PICORV32` names, or the package in the project's tools folder.
fn verilog() -> Result<PathBuf, SocError> {
    let path = match std::env::var_os("XYLEM_PICORV32") {
        Some(path) => Some(PathBuf::from(path)),
        None => packaged(&workspace().join("target/tools/venv/lib")),
    };
    path.filter(|path| path.is_file()).ok_or_else(|| SocError::ToolMissing {
        engine: Engine::PicoRv32,
        tool: "picorv32.v".into(),
        hint: "run `tests/firmware.sh tools`, or name the file in XYLEM_PICORV32".into(),
    })
}

/// Looks into every Python version's packages.
fn packaged(lib: &Path) -> Option<PathBuf> {
    let pythons = std::fs::read_dir(lib).ok()?;
    let tail = "site-packages/pythondata_cpu_picorv32/verilog/picorv32.v";
    pythons.flatten().map(|python| python.path().join(tail)).find(|path| path.is_file())
}

// The reset address is spelled out in PARAMETERS.
const _: () = assert!(LOCAL.base.0 == 0x8000_0000);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bench_s_last_words_are_understood() {
        let end = |words| format!("{:?}", parse_end(words));
        assert_eq!(end("12 power-off 21845"), "(PowerOff { code: 0 }, Some(12))");
        assert_eq!(end("x\n9 power-off 144179"), "(PowerOff { code: 2 }, Some(9))");
        assert_eq!(end("7 crash no such word"), r#"(Crash("no such word"), Some(7))"#);
        assert!(end("Segmentation fault").contains("Segmentation fault"));
    }
}
