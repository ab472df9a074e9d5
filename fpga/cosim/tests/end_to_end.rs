//! Whole jobs on the clock: from the command that starts one to its report, the accelerator in gates takes
//! the cycles of its model when both see the same memory, and leaves the core's bytes.

use std::ops::Range;
use std::path::{Path, PathBuf};

use xylem::bus::FlatMemory;
use xylem::dram;
use xylem::machine::job;
use xylem::machine::port::{DramPort, IdealPort, Port};
use xylem::machine::traverser::TraverserJob;
use xylem::run::{self, Layout};
use xylem::scene::{self, LoadOptions};
use xylem_core::geom::Triangle;
use xylem_core::node::{Coordinates, LeafEntry, Tree};
use xylem_core::pipeline::{self, BuildConfig};
use xylem_core::sort::InputFormat;
use xylem_core::traverse::Query;
use xylem_cosim::jobs::{COUNTS, build_job, real_scenes, soup, trace_job};
use xylem_cosim::random::Random;
use xylem_cosim::top::{Shared, Top, TopConfig};
use xylem_cosim::traverser::scenes::{FORMATS, Set, damaged, expected};
use xylem_cosim::{table, tools_for};
use xylem_driver::{Micros, WaitError};

/// Memory at the other end of the port, once for the gates and once for the model.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Memory {
    /// Takes everything and answers after so many cycles.
    Ideal(u32),
    /// The DRAM model of P2's middle memory, behind a machine of 1 GHz.
    Dram,
}

impl Memory {
    const ALL: [Self; 3] = [Self::Ideal(1), Self::Ideal(20), Self::Dram];

    /// Its port, `cycles` after its reset: banks are refreshed from then on.
    fn port(self, cycles: u64) -> Box<dyn Port> {
        let mut port: Box<dyn Port> = match self {
            Self::Ideal(latency) => Box::new(IdealPort::new(latency)),
            Self::Dram => Box::new(DramPort::new(dram::Config::by_name("medium").unwrap(), 1000)),
        };
        (0..cycles).for_each(|_| port.tick());
        port
    }
}

/// An accelerator in gates, and its memory.
#[derive(Clone, Copy, Debug)]
struct Setup<'a> {
    config: TopConfig,
    library: &'a Path,
    memory: Memory,
}

impl Setup<'_> {
    /// The accelerator after its reset, with `bytes` in its memory.
    fn top(&self, bytes: &[u8]) -> Shared<Box<dyn Port>> {
        let top = Top::load(self.library, self.memory.port(0), bytes.to_vec(), 0, 6);
        let top = Shared::new(top.unwrap_or_else(|error| panic!("{error}")));
        // The merge clears its slots; a job would wait for that.
        top.with(|top| (0..1000).for_each(|_| top.tick()));
        top
    }

    /// The memory that a model sees whose job was started in the gates' cycle `started`.
    fn memory_from(&self, started: u64) -> Box<dyn Port> {
        // The command is seen in the last cycle of its access; the unit begins a cycle after it has the job.
        self.memory.port(started + job::CHECK_CYCLES + 1)
    }
}

/// A build: what is made of triangles.
#[derive(Clone, Copy, Debug)]
struct Build {
    input: InputFormat,
    compressed: Option<Coordinates>,
}

impl Build {
    const BOXES: Self = Self { input: InputFormat::Box32, compressed: None };
    const TRIANGLES: Self = Self { input: InputFormat::Triangle40, compressed: None };
    const RELATIVE: Self = Self { compressed: Some(Coordinates::Relative), ..Self::BOXES };
    const MODULO: Self = Self { compressed: Some(Coordinates::Modulo), ..Self::TRIANGLES };

    fn name(&self) -> String {
        let nodes = match self.compressed {
            None => "bvh2",
            Some(Coordinates::Relative) => "relative",
            Some(Coordinates::Modulo) => "modulo",
        };
        format!("{:?} to {nodes}", self.input)
    }

    fn config(&self, top: &TopConfig) -> BuildConfig {
        let compression = self.compressed.map(|coordinates| top.compression(coordinates));
        BuildConfig { input: self.input, compression, ..top.build_config() }
    }
}

/// Builds a scene in gates, on the model and in the core; all bytes must be the core's. Gives the model's
/// cycles and the gates'.
fn build(what: &str, triangles: &[Triangle], build: Build, setup: Setup<'_>) -> (u64, u64) {
    let config = build.config(&setup.config);
    let count = triangles.len() as u32;
    let (mut core, layout) = run::load(triangles, &config).unwrap();
    let before = core.clone();
    let mut buffers = run::Buffers::new(&config);
    let (mut work, mut storage) = buffers.parts();
    let (work, storage) = (&mut work, &mut storage);
    let tree =
        pipeline::build_with(&mut core, &config, &layout.build, count, work, storage, &mut ())
            .unwrap();
    let places = bytes_of(&layout, &tree, count);
    let check = |side: &str, bytes: &[u8], built: &Tree| {
        for place in &places {
            assert!(bytes[place.clone()] == core.bytes()[place.clone()], "{what}: {side}");
        }
        let counts = |tree: &Tree| (tree.node_count, tree.leaf_count, tree.entry_count);
        assert_eq!(counts(built), counts(&tree), "{what}: {side}");
        assert_eq!(built.root, tree.root, "{what}: {side}");
    };

    let top = setup.top(before.bytes());
    let mut driver = top.driver().unwrap();
    let cycles = driver.counters().unwrap().cycles;
    let job = build_job(&layout, count, &config);
    driver.start_build(&job).unwrap();
    let started = top.with(|top| top.cycles);
    let waited = driver.wait(Micros(100_000));
    waited.unwrap_or_else(|e| panic!("{what}: {e:?}, {:?}", top.with(|top| top.failure.clone())));
    let built = driver.built_tree(&job).unwrap();
    top.with(|top| check("RTL", &top.memory.bytes, &built));

    let mut modelled = before;
    let machine = setup.config.machine(config);
    let memory = setup.memory_from(started);
    let run = job::build(&machine, &mut modelled, &layout.build, count, memory);
    run.drained.unwrap_or_else(|error| panic!("{what}: {error}"));
    let built = run.unit.unwrap_or_else(|error| panic!("{what}: {error}"));
    check("model", modelled.bytes(), &built.tree);
    (run.cycles, driver.counters().unwrap().cycles - cycles)
}

/// Where a build's nodes and leaf table are.
fn bytes_of(layout: &Layout, tree: &Tree, entries: u32) -> [Range<usize>; 2] {
    let part = |base: u32, bytes: u32| base as usize..(base + bytes) as usize;
    [
        part(layout.build.nodes.base.0, tree.node_count * tree.format.bytes()),
        part(layout.build.leaf_table.base.0, entries * LeafEntry::BYTES as u32),
    ]
}

/// Traces in gates, on the model and in the core; all records must be the core's. Gives the model's cycles and
/// the gates', and whether the job ended well, which it must on both.
fn trace(
    what: &str,
    (memory, job): (FlatMemory, TraverserJob),
    setup: Setup<'_>,
) -> (u64, u64, bool) {
    let (records, error) = expected(&memory, &job);
    let place = job.hits.0 as usize..job.hits.0 as usize + records.len();

    let top = setup.top(memory.bytes());
    let mut driver = top.driver().unwrap();
    let cycles = driver.counters().unwrap().cycles;
    driver.start_trace(&trace_job(&job)).unwrap();
    let started = top.with(|top| top.cycles);
    let rtl = match driver.wait(Micros(100_000)) {
        Ok(_) => true,
        Err(WaitError::Job(_)) => false,
        Err(e) => panic!("{what}: {e:?}, {:?}", top.with(|top| top.failure.clone())),
    };
    top.with(|top| assert!(top.memory.bytes[place.clone()] == records, "{what}: RTL"));

    let mut modelled = memory;
    let (unit, time_out) = (setup.config.traverser(), setup.config.time_out.into());
    let port = setup.memory_from(started);
    let run = job::trace(unit, &mut modelled, job, port, |_, _| true, time_out);
    run.drained.unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(modelled.bytes()[place] == records, "{what}: model");
    let well = error.is_none();
    assert_eq!([rtl, run.unit.1.is_ok()], [well; 2], "{what}: the core says {error:?}");
    (run.cycles, driver.counters().unwrap().cycles - cycles, well)
}

/// The rows of a table, and the most by which cycles differ.
struct Rows {
    rows: Vec<String>,
    worst_percent: f64,
}

impl Rows {
    fn new(first: &str) -> Self {
        let columns = "bytes equal | model cycles | RTL cycles | delta | %";
        let rows = vec![
            format!("| {first} | job | configuration | memory | {columns} |"),
            "|---|---|---|---|---|---:|---:|---:|---:|".to_owned(),
        ];
        Self { rows, worst_percent: 0.0 }
    }

    /// Adds what a job took whose bytes were equal.
    fn add(&mut self, first: &str, job: &str, setup: &Setup<'_>, [model, rtl]: [u64; 2]) {
        let Setup { config: TopConfig { name, .. }, memory, .. } = setup;
        let delta = rtl as i64 - model as i64;
        let percent = 100.0 * delta as f64 / model as f64;
        self.worst_percent = self.worst_percent.max(percent.abs());
        self.rows.push(format!(
            "| {first} | {job} | {name} | {memory:?} | yes | {model} | {rtl} | {delta} | {percent:.2} |",
        ));
    }

    /// Makes them a section of the table.
    ///
    /// # Panics
    /// If a job's cycles differ by more than is allowed.
    fn end(self, section: &str) {
        table::write(section, &self.rows).unwrap();
        let worst = self.worst_percent;
        assert!(worst <= LIMIT_PERCENT, "a delta of {worst:.2} %");
    }
}

/// The most by which cycles may differ.
const LIMIT_PERCENT: f64 = 0.5;

/// Both configurations that do every job.
fn libraries() -> [(TopConfig, PathBuf); 2] {
    [TopConfig::SMALL, TopConfig::PAPER]
        .map(|config| (config, config.build(None).unwrap_or_else(|error| panic!("{error}"))))
}

#[test]
fn builds_in_gates_take_the_model_s_cycles_from_start_to_report() {
    let test = "builds_in_gates_take_the_model_s_cycles_from_start_to_report";
    if !tools_for(test) {
        return;
    }
    // Small scenes with everything; large ones take their time, on `small` and behind DRAM most of it.
    let all = [Build::BOXES, Build::TRIANGLES, Build::RELATIVE, Build::MODULO];
    let mut cases = Vec::new();
    for count in COUNTS {
        let triangles = soup(count, count.into());
        cases.push((format!("soup of {count}"), triangles, &all[..], [&Memory::ALL[..]; 2]));
    }
    let few = [Build::BOXES, Build::MODULO];
    for (name, triangles) in degenerate() {
        cases.push((name, triangles, &few, [&[Memory::Ideal(20)]; 2]));
    }
    let large = [Build::TRIANGLES, Build::MODULO];
    for (name, mesh) in real_scenes(test) {
        let memories = [&[Memory::Ideal(20)][..], &[Memory::Dram]];
        cases.push((name.to_owned(), mesh.triangles, &large, memories));
    }
    let libraries = libraries();
    let mut rows = Rows::new("scene");
    for (name, triangles, builds, memories) in &cases {
        for ((config, library), memories) in libraries.iter().zip(memories) {
            for &with in *builds {
                for &memory in *memories {
                    let setup = Setup { config: *config, library, memory };
                    let what = format!("{name}, {with:?}, {setup:?}");
                    let (model, rtl) = build(&what, triangles, with, setup);
                    let first = format!("{name} ({} primitives)", triangles.len());
                    rows.add(&first, &with.name(), &setup, [model, rtl]);
                }
            }
        }
    }
    rows.end("whole builds");
}

/// Every degenerate scene that reaches a builder: the loader takes it, and it is not empty.
fn degenerate() -> Vec<(String, Vec<Triangle>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/degenerate");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    let mut scenes = Vec::new();
    for path in files {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let mesh = scene::load(&path.to_string_lossy(), &LoadOptions::default());
        let triangles = mesh.map(|mesh| mesh.triangles).unwrap_or_default();
        if !triangles.is_empty() {
            scenes.push((name, triangles));
        }
    }
    assert!(scenes.len() >= 10, "only {} scenes can be built", scenes.len());
    scenes
}

#[test]
fn traces_in_gates_take_the_model_s_cycles_from_start_to_report() {
    if !tools_for("traces_in_gates_take_the_model_s_cycles_from_start_to_report") {
        return;
    }
    let sets = [("degenerate/one_triangle", 1), ("cornell_box", 3), ("sphereflake:2", 2)]
        .map(|(name, count)| Set::new(name, count, 1));
    let mut random = Random::new(5);
    let (mut rows, mut badly) = (Rows::new("scene"), 0);
    for (config, library) in &libraries() {
        for set in &sets {
            for (format_name, format) in FORMATS {
                for query in [Query::Closest, Query::Any] {
                    let scene = set.job(format, query);
                    let (damaged, damaged_job) = damaged(scene.0.clone(), scene.1, &mut random);
                    for memory in Memory::ALL {
                        let setup = Setup { config: *config, library, memory };
                        let what = format!("{}, {format_name}, {query:?}, {setup:?}", set.name);
                        let (model, rtl, _) = trace(&what, scene.clone(), setup);
                        let first = format!("{} ({} rays)", set.name, set.rays.len());
                        let job = format!("{query:?} in {format_name}");
                        rows.add(&first, &job, &setup, [model, rtl]);
                    }
                    let setup = Setup { config: *config, library, memory: Memory::Dram };
                    let what = format!("{}, damaged, {format_name}", set.name);
                    let (model, rtl, well) = trace(&what, (damaged, damaged_job), setup);
                    rows.add(&format!("{}, damaged", set.name), format_name, &setup, [model, rtl]);
                    badly += u32::from(!well);
                }
            }
        }
    }
    rows.end("whole traces");
    assert!(badly > 0, "no job ended with an error");
}
