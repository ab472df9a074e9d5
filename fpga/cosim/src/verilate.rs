//! RTL to a shared library: Verilator, a C++ compiler, and a folder named by a hash of all inputs.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use sha2::{Digest, Sha256};
use thiserror::Error;

const RTL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../rtl");
const SHIM: &str = include_str!("../shim/unit.cpp");
const CLASS: &str = "Vunit";
const LIBRARY: &str = "libunit.so";
const CXX: &str = "g++";
const CXX_FLAGS: [&str; 6] = [
    "-std=c++17",
    "-fPIC",
    "-DVL_USER_STOP",
    "-DVL_USER_FATAL",
    "-DVL_USER_FINISH",
    "-DVM_TRACE=1",
];
const RUNTIME: [&str; 3] = ["verilated.cpp", "verilated_vcd_c.cpp", "verilated_threads.cpp"];

/// Why a co-simulation could not be built or run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CosimError {
    /// A tool did not start.
    #[error("{tool} does not run ({error}); install it, on Debian: apt-get install {package}")]
    Tool {
        /// What was called.
        tool: &'static str,
        /// The Debian package that has it.
        package: &'static str,
        /// What the system said.
        error: io::Error,
    },
    /// A tool ended with an error.
    #[error("{tool} failed:\n{output}")]
    Failed {
        /// What was called.
        tool: &'static str,
        /// Everything it printed.
        output: String,
    },
    /// A file or folder could not be read or written.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// What the system said.
        error: io::Error,
    },
    /// The text that a mutation replaces is not there exactly once.
    #[error("{file} has {count} places that read `{from}`; a mutation needs exactly 1: update it")]
    Mutation {
        /// The RTL file.
        file: &'static str,
        /// The text sought.
        from: &'static str,
        /// How often it was found.
        count: usize,
    },
    /// The library could not be loaded.
    #[error("{path}: {error}; delete its folder to have it built again", path = path.display())]
    Load {
        /// The library.
        path: PathBuf,
        /// What the loader said.
        error: libloading::Error,
    },
    /// An assertion in the RTL failed.
    #[error("RTL: {0}")]
    Assertion(String),
}

/// A deliberate fault in the RTL: what a test must be able to see.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mutation {
    /// RTL file, such as `xy_heap_stage.sv`.
    pub file: &'static str,
    /// Text that stands there exactly once.
    pub from: &'static str,
    /// What to put in its place.
    pub to: &'static str,
}

/// Checks that Verilator and the C++ compiler run, and returns Verilator's version line.
///
/// # Errors
///
/// [`CosimError::Tool`] names the missing one and its Debian package.
pub fn tools() -> Result<String, CosimError> {
    run("g++", "g++", Command::new(CXX).arg("--version"))?;
    run("verilator", "verilator", Command::new("verilator").arg("--version"))
        .map(|version| version.trim().to_owned())
}

/// A unit of the RTL and the configuration to build it in.
#[derive(Clone, Copy, Debug)]
pub struct Unit<'a> {
    /// The module; it has a clock `clk_i` and a reset `rst_ni`.
    pub top: &'static str,
    /// The list of its files in `fpga/rtl`, each after those it uses.
    pub files: &'static str,
    /// Name of the configuration, for messages and folders.
    pub config: &'a str,
    /// The module's parameters.
    pub parameters: &'a [(&'static str, u64)],
}

/// Builds `unit`, with a fault if `mutation` says so, and returns the library's path.
///
/// Built once for all processes: the folder's name is a hash of the sources, the configuration and
/// the tool's version, and a lock file keeps a second builder waiting for the first.
///
/// # Errors
/// All of [`CosimError`] but `Load` and `Assertion`.
pub fn unit(unit: &Unit<'_>, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let version = tools()?;
    let sources = sources(unit.files, mutation)?;
    let parameters: Vec<String> =
        unit.parameters.iter().map(|(name, value)| format!("-G{name}={value}")).collect();

    let mut hash = Sha256::new();
    let texts = sources.iter().flat_map(|(name, text)| [name.as_str(), text.as_str()]);
    let flags = CXX_FLAGS.iter().copied().chain([version.as_str(), SHIM]);
    for text in texts.chain(flags).chain(parameters.iter().map(String::as_str)) {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    }
    let key: String = hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let name = format!("{}-{}-{key}", unit.top, unit.config);
    let folder = target_folder().join("cosim").join(name);

    once(&folder, |folder| {
        let rtl = folder.join("rtl");
        create_folder(&rtl)?;
        let mut verilator = Command::new("verilator");
        verilator
            .current_dir(&rtl)
            .args(["--cc", "--trace", "--assert", "-O3", "--x-initial", "unique"])
            .args(["--top-module", unit.top, "--prefix", CLASS, "-Mdir", "../obj"])
            .args(&parameters);
        for (name, text) in &sources {
            // Some lie in a folder of their own; their names differ all the same.
            let name = Path::new(name).file_name().unwrap_or_default();
            write(&rtl.join(name), text)?;
            verilator.arg(name);
        }
        run("verilator", "verilator", &mut verilator)?;

        let root = verilator_root()?;
        let runtime = runtime(&root, &version)?;
        let obj = folder.join("obj");
        write(&obj.join("ports.h"), &ports_header(&read(&obj.join(format!("{CLASS}.h")))?))?;
        write(&obj.join("shim.cpp"), SHIM)?;
        // Two translation units, so that the compiler reads Verilator's headers twice and not for each file,
        // and takes its time only for what runs in every cycle: waveforms and what Verilator calls
        // slow runs once are a third of the text.
        let (mut hot, mut cold) = (String::new(), String::new());
        for file in files_ending(&obj, ".cpp")? {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let once = ["Slow.cpp", "Syms.cpp"].iter().any(|end| name.ends_with(end));
            let unit = if once || name.contains("__Trace") { &mut cold } else { &mut hot };
            *unit += &format!("#include {name:?}\n");
        }
        // A faulty unit is built to fail soon: compiling it fast counts for more.
        let optimize = if mutation.is_none() { "-O2" } else { "-O0" };
        let compile = |name: &str, text: &str, optimize: &str| {
            let source = folder.join(name).with_extension("cpp");
            write(&source, text)?;
            let mut compiler = Command::new(CXX);
            compiler
                .args(CXX_FLAGS)
                .args([optimize, "-c", "-o"])
                .args([&folder.join(name).with_extension("o"), &source])
                .args([Path::new("-I"), &root.join("include"), Path::new("-I"), &obj])
                .arg("-I")
                .arg(root.join("include/vltstd"));
            run("g++", "g++", &mut compiler).map(drop)
        };
        std::thread::scope(|scope| {
            let cold = scope.spawn(|| compile("cold", &cold, "-O0"));
            let hot = compile("hot", &hot, optimize);
            hot.and(cold.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })?;
        let mut linker = Command::new(CXX);
        linker
            .args(["-shared", "-Wl,-Bsymbolic,--no-undefined", "-o"])
            .arg(folder.join(LIBRARY))
            .args(["hot.o", "cold.o"].map(|name| folder.join(name)))
            .args(files_ending(&runtime, ".o")?);
        run("g++", "g++", linker.arg("-pthread"))?;
        Ok(())
    })?;
    Ok(folder.join(LIBRARY))
}

/// Builds a program from `unit`, Verilog that is not this project's, and the C++ file `bench`, and returns its path.
/// Only the unit's own files have been linted.
///
/// # Errors
/// As [`unit()`].
pub fn program(unit: &Unit<'_>, others: &[&Path], bench: &Path) -> Result<PathBuf, CosimError> {
    let version = tools()?;
    let mut hash = Sha256::new();
    hash.update(&version);
    for (name, text) in sources(unit.files, None)? {
        hash.update(name);
        hash.update(text);
    }
    for path in others.iter().chain([&bench]) {
        hash.update(read(path)?);
    }
    let key: String = hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    let folder = target_folder().join("cosim").join(format!("{}-bench-{key}", unit.top));
    once(&folder, |folder| {
        let mut verilator = Command::new("verilator");
        verilator
            .args(["--cc", "--exe", "--build", "-O3", "-CFLAGS", "-O2", "-Wno-fatal", "-Wno-lint"])
            .args(["-Wno-TIMESCALEMOD", "--top-module", unit.top, "--prefix", "Vbench", "-Mdir"])
            .arg(folder)
            .arg(Path::new(RTL).join("waivers.vlt"))
            .args(read(&Path::new(RTL).join(unit.files))?.lines().map(|f| Path::new(RTL).join(f)))
            .args(others)
            .arg(bench);
        run("verilator", "verilator", &mut verilator).map(drop)
    })?;
    Ok(folder.join("Vbench"))
}

/// The text of `ports.h`, which the shim includes, from the header that Verilator wrote for the
/// unit: it declares each port as `VL_IN8(&NAME,MSB,LSB);` or the like.
fn ports_header(header: &str) -> String {
    let mut table = String::new();
    let (mut put, mut get) = (String::new(), String::new());
    let mut input_words = 0;
    for line in header.lines().map(str::trim) {
        let Some((kind, rest)) = line.strip_prefix("VL_").and_then(|l| l.split_once("(&")) else {
            continue;
        };
        let mut parts = rest.split([',', ')']);
        let name = parts.next().unwrap_or_default();
        let mut bound = || parts.next().and_then(|part| part.parse::<u32>().ok()).unwrap_or(0);
        let bits = bound() + 1 - bound();
        if name == "clk_i" || name == "rst_ni" {
            continue;
        }
        if kind.starts_with("IN") {
            table += &format!("in {name} {bits}\\n");
            put += &format!("    put(unit.{name}, words);\n");
            input_words += bits.div_ceil(32);
        } else {
            table += &format!("out {name} {bits}\\n");
            get += &format!("    get(unit.{name}, words);\n");
        }
    }
    format!(
        "#include \"{CLASS}.h\"\n\nusing Unit = {CLASS};\n\
         constexpr const char* ports = \"{table}\";\n\
         constexpr unsigned input_words = {input_words};\n\n\
         void put_inputs(Unit& unit, const uint32_t* words) {{\n{put}}}\n\
         void get_outputs(const Unit& unit, uint32_t* words) {{\n{get}}}\n"
    )
}

/// The folder for what co-simulation makes: `xylem` below cargo's target directory.
pub fn target_folder() -> PathBuf {
    // Cargo marks its target directory; a test or program built by it lies below.
    let target = std::env::current_exe().ok().and_then(|exe| {
        let mut above = exe.ancestors();
        above.find(|folder| folder.join("CACHEDIR.TAG").exists()).map(Path::to_owned)
    });
    target
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target"))
        .join("xylem")
}

/// Verilator's C++ runtime, compiled once for all units.
fn runtime(root: &Path, version: &str) -> Result<PathBuf, CosimError> {
    let key: String = Sha256::digest(format!("{version} {CXX_FLAGS:?}"))[..8]
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let folder = target_folder().join("cosim").join(format!("runtime-{key}"));
    once(&folder, |folder| {
        let include = root.join("include");
        let mut compiler = Command::new(CXX);
        compiler.current_dir(folder).args(CXX_FLAGS).args(["-O1", "-c", "-I"]).arg(&include);
        compiler.arg("-I").arg(include.join("vltstd"));
        compiler.args(RUNTIME.map(|file| include.join(file)));
        run("g++", "g++", &mut compiler).map(drop)
    })?;
    Ok(folder)
}

/// Runs `build` unless it has succeeded before; one process at a time.
fn once(
    folder: &Path,
    build: impl FnOnce(&Path) -> Result<(), CosimError>,
) -> Result<(), CosimError> {
    let done = folder.join("done");
    if done.exists() {
        return Ok(());
    }
    create_folder(folder)?;
    let path = folder.join("lock");
    let io = |error| CosimError::Io { path: path.clone(), error };
    let lock = File::create(&path).map_err(io)?;
    lock.lock().map_err(io)?; // Released when `lock` is dropped, also if this process dies.
    if done.exists() {
        return Ok(());
    }
    build(folder)?;
    write(&done, "")
}

/// The RTL files of a list in order, as (name, text), with the lint waivers first.
fn sources(files: &str, mutation: Option<Mutation>) -> Result<Vec<(String, String)>, CosimError> {
    let rtl = Path::new(RTL);
    let list = read(&rtl.join(files))?;
    let mut sources = Vec::new();
    for name in ["waivers.vlt"].into_iter().chain(list.lines()) {
        sources.push((name.to_owned(), read(&rtl.join(name))?));
    }
    if let Some(Mutation { file, from, to }) = mutation {
        let text = sources.iter_mut().find(|(name, _)| name == file).map(|(_, text)| text);
        let count = text.as_ref().map_or(0, |text| text.matches(from).count());
        match text {
            Some(text) if count == 1 => *text = text.replace(from, to),
            _ => return Err(CosimError::Mutation { file, from, count }),
        }
    }
    Ok(sources)
}

fn verilator_root() -> Result<PathBuf, CosimError> {
    let root = run(
        "verilator",
        "verilator",
        Command::new("verilator").args(["--getenv", "VERILATOR_ROOT"]),
    )?;
    Ok(PathBuf::from(root.trim()))
}

/// Runs a command to its end and returns its standard output.
fn run(
    tool: &'static str,
    package: &'static str,
    command: &mut Command,
) -> Result<String, CosimError> {
    let output = command.output().map_err(|error| CosimError::Tool { tool, package, error })?;
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if output.status.success() {
        return Ok(text(&output.stdout));
    }
    Err(CosimError::Failed { tool, output: text(&output.stdout) + &text(&output.stderr) })
}

fn files_ending(folder: &Path, ending: &str) -> Result<Vec<PathBuf>, CosimError> {
    let io = |error| CosimError::Io { path: folder.to_owned(), error };
    let mut files = Vec::new();
    for file in fs::read_dir(folder).map_err(io)? {
        let path = file.map_err(io)?.path();
        if path.to_string_lossy().ends_with(ending) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn read(path: &Path) -> Result<String, CosimError> {
    fs::read_to_string(path).map_err(|error| CosimError::Io { path: path.to_owned(), error })
}

fn write(path: &Path, text: &str) -> Result<(), CosimError> {
    fs::write(path, text).map_err(|error| CosimError::Io { path: path.to_owned(), error })
}

fn create_folder(path: &Path) -> Result<(), CosimError> {
    fs::create_dir_all(path).map_err(|error| CosimError::Io { path: path.to_owned(), error })
}
