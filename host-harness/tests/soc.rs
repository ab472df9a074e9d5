//! The firmware gives the host's results on every engine, and failures are told apart.

use std::path::PathBuf;
use std::time::Duration;

use glam::IVec3;
use object::{Object as _, ObjectSegment as _, ObjectSymbol as _, SymbolKind};
use xylem::soc::{
    self, Engine, FrameReport, Motion, OUTPUTS, Options, Outcome, Output, Report, STAGES,
    SceneBlob, SocError, firmware_elf, run_on_host,
};
use xylem_core::emit::CellConfig;
use xylem_core::error::{BuildError, ConfigError};
use xylem_core::geom::{Ray, Triangle};
use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::num::{MortonWidth, SubGrid, Time};
use xylem_core::probe::Stage;
use xylem_core::quality::SahCost;
use xylem_core::refit::{Factor, RebuildRule, Update};
use xylem_core::sort::{RecordFormat, SortConfig};
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};
use xylem_core::traverse::Query;
use xylem_firmware::job::{JobError, MAX_CELLS};

/// The firmware, or `None` after saying what is missing.
fn firmware(test: &str) -> Option<PathBuf> {
    or_skip(test, firmware_elf())
}

/// A missing tool skips a test, unless the tests are told that all tools are there.
fn or_skip<T>(test: &str, found: Result<T, SocError>) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(missing @ (SocError::NotBuilt { .. } | SocError::ToolMissing { .. })) => {
            assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{test}: {missing}");
            println!("skipped: {test}: {missing}");
            None
        }
        Err(error) => panic!("{test}: {error}"),
    }
}

/// A generator of numbers that need not be good, only the same everywhere.
struct Numbers(u64);

impl Numbers {
    /// A number from `-reach` to `reach - 1`.
    fn around(&mut self, reach: i32) -> i32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let unit = (self.0 >> 33) as i64;
        (((unit * i64::from(reach)) >> 30) - i64::from(reach)) as i32
    }

    fn point(&mut self, reach: i32) -> IVec3 {
        IVec3::new(self.around(reach), self.around(reach), self.around(reach))
    }
}

/// Triangles strewn over the grid.
fn soup(triangles: u32, numbers: &mut Numbers) -> Vec<Triangle> {
    let one = |id| {
        let centre = numbers.point(7 << 20);
        Triangle { vertices: [0; 3].map(|_| centre + numbers.point(1 << 20)), id }
    };
    (0..triangles).map(one).collect()
}

/// A square sheet of `2 · side²` triangles that waves, with shared edges and equal vertices.
fn cloth(side: i32) -> Vec<Triangle> {
    let cell = (1 << 24) / (side + 1);
    let at = |x: i32, y: i32| {
        let height = (x * y * 7919 % 1024 - 512) * (1 << 10);
        IVec3::new(x * cell - (1 << 23), y * cell - (1 << 23), height)
    };
    let corners = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    let halves = corners.flat_map(|(x, y)| {
        let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
        [[a, b, c], [d, c, b]]
    });
    (0..).zip(halves).map(|(id, vertices)| Triangle { vertices, id }).collect()
}

/// Rays in all directions from all places; some along an axis, some with an empty interval.
fn rays(count: u32, numbers: &mut Numbers) -> Vec<Ray> {
    let one = |i| {
        let origin = numbers.point(6 << 20).to_array().map(SubGrid::from_num);
        let mut direction = numbers.point(1 << 30);
        direction[i as usize % 3] = if i % 2 == 0 { 1 << 30 } else { -(1 << 30) };
        if i % 5 == 0 {
            direction = IVec3::Z * (1 << 30);
        }
        let end = if i % 11 == 0 { Time::ZERO } else { Ray::TIME_LIMIT };
        Ray::new(origin, direction, Time::ZERO, end).expect("a ray in range")
    };
    (0..count).map(one).collect()
}

/// Scenes that fit a slow engine: random, regular, and full of equal keys, with sorters that need
/// several runs and passes, in all formats; and with all builders of the top of the tree, over few and
/// many cells.
fn scenes() -> Vec<(&'static str, SceneBlob)> {
    let numbers = &mut Numbers(1);
    let twins: Vec<Triangle> = soup(20, numbers).into_iter().flat_map(|t| [t; 10]).collect();
    let sort =
        |capacity, burst, record| SortConfig { capacity, burst, record, ..SortConfig::PAPER };
    let base = SceneBlob::default();
    vec![
        (
            "soup",
            SceneBlob {
                sort: sort(64, 4, RecordFormat::Box32),
                triangles: soup(400, numbers),
                rays: rays(60, numbers),
                ..base.clone()
            },
        ),
        (
            "cloth",
            SceneBlob {
                morton: MortonWidth::Bits63,
                format: NodeFormat::Quantized(Quantization::MODULO),
                sort: sort(32, 8, RecordFormat::Packed22),
                triangles: cloth(16),
                rays: rays(60, numbers),
                ..base.clone()
            },
        ),
        (
            "twins",
            SceneBlob {
                format: NodeFormat::Bvh2,
                query: Query::Any,
                sort: sort(128, 16, RecordFormat::Pair8),
                max_leaf_size: 4,
                triangles: twins,
                rays: rays(60, numbers),
                ..base.clone()
            },
        ),
        ("one", SceneBlob { triangles: soup(1, numbers), rays: rays(10, numbers), ..base.clone() }),
        ("empty", SceneBlob { rays: rays(10, numbers), ..base.clone() }),
        (
            "binned",
            SceneBlob {
                format: NodeFormat::Quantized(Quantization::MODULO),
                sort: sort(64, 4, RecordFormat::Box32),
                top_level: TopLevel::Binned(Binned { bins: Bins::Eight }),
                cells: CellConfig { capacity: 64, bits: 20 },
                join_leaves: 4,
                triangles: soup(400, numbers),
                rays: rays(60, numbers),
                ..base.clone()
            },
        ),
        (
            "treelets",
            SceneBlob {
                morton: MortonWidth::Bits63,
                sort: sort(64, 4, RecordFormat::Box32),
                top_level: TopLevel::Atrbvh(Atrbvh::default()),
                triangles: cloth(14),
                rays: rays(60, numbers),
                ..base.clone()
            },
        ),
        (
            "both",
            SceneBlob {
                format: NodeFormat::Bvh2,
                sort: sort(64, 4, RecordFormat::Pair8),
                top_level: TopLevel::Atrbvh(Atrbvh {
                    start: Some(Binned { bins: Bins::Sixteen }),
                    ..Atrbvh::default()
                }),
                cells: CellConfig { capacity: 100, bits: 30 },
                triangles: soup(200, numbers),
                rays: rays(60, numbers),
                ..base
            },
        ),
    ]
}

fn on_host(scene: &SceneBlob) -> Report {
    run_on_host(scene).expect("a scene that fits").expect("a job that ends well").report
}

/// Runs all scenes on an engine and compares everything but the cycles with the host.
fn agrees_with_the_host(test: &str, engine: Engine) {
    let Some(elf) = firmware(test) else { return };
    if or_skip(test, engine.check()).is_none() {
        return;
    }
    for (name, scene) in scenes() {
        let outcome = match soc::run(engine, &elf, &scene, &Options::default()) {
            Ok(outcome) => outcome,
            Err(error) => panic!("{name} on {engine}: {error}"),
        };
        let host = on_host(&scene);
        let report = outcome.report;
        assert_eq!(Report { cycles: host.cycles, ..report }, host, "{name} on {engine}");
        assert_eq!(report.digest(), host.digest(), "{name} on {engine}");
        assert!(report.cycles.iter().sum::<u64>() > 0, "{name} on {engine}: no cycles counted");
        let has_top = scene.top_level != TopLevel::None;
        assert_eq!(top_cycles(&report) > 0, has_top, "{name} on {engine}: {report:?}");
        assert!(!outcome.log.is_empty(), "{name} on {engine}: nothing logged");
        print_cycles(name, &outcome);
        if engine == Engine::PicoRv32 {
            // The simulator's costs are a model of this core, and an exact one.
            let model = soc::run(Engine::Sim, &elf, &scene, &Options::default()).expect("a run");
            assert_eq!(model.report.cycles, report.cycles, "{name}: cycles by stage");
        }
    }
}

/// The cycles of the top-level build.
fn top_cycles(report: &Report) -> u64 {
    let top = STAGES.iter().zip(report.cycles).find(|(stage, _)| **stage == Stage::TopLevel);
    top.expect("a counted stage").1
}

fn print_cycles(name: &str, outcome: &Outcome) {
    let Outcome { engine, report, time, .. } = outcome;
    print!("{name:8} on {engine:8}: digest {:08x}", report.digest());
    for (stage, cycles) in STAGES.iter().zip(report.cycles) {
        let (count, unit) = match stage {
            Stage::Trace => (report.rays, "ray"),
            _ => (report.primitives, "primitive"),
        };
        if count > 0 && cycles > 0 {
            print!(", {stage:?} {} a {unit}", cycles / u64::from(count));
        }
    }
    if report.cells > 0 {
        print!(
            ", TopLevel {} a cell of {}",
            top_cycles(report) / u64::from(report.cells),
            report.cells
        );
    }
    print!(" ({}; {:.1} s", engine.cycles_are(), time.as_secs_f64());
    if let Some(mips) = outcome.mips() {
        print!(", {mips:.0} MIPS");
    }
    if let Some(speed) = outcome.mega_cycles_per_second() {
        print!(", {speed:.2} Mcycles/s");
    }
    println!(")");
}

#[test]
fn the_simulator_gives_the_host_s_digests() {
    agrees_with_the_host("the_simulator_gives_the_host_s_digests", Engine::Sim);
}

#[test]
fn qemu_gives_the_host_s_digests() {
    agrees_with_the_host("qemu_gives_the_host_s_digests", Engine::Qemu);
}

#[test]
fn the_rtl_of_picorv32_gives_the_host_s_digests_and_the_simulator_s_cycles() {
    let test = "the_rtl_of_picorv32_gives_the_host_s_digests_and_the_simulator_s_cycles";
    agrees_with_the_host(test, Engine::PicoRv32);
}

#[test]
fn another_scene_has_another_digest_in_every_output() {
    let scenes = scenes();
    let (soup, cloth) = (on_host(&scenes[0].1), on_host(&scenes[1].1));
    assert_ne!(soup.digest(), cloth.digest());
    for (output, (a, b)) in OUTPUTS.iter().zip(soup.outputs.iter().zip(cloth.outputs)) {
        assert_ne!(a.crc, b.crc, "{output:?}");
    }
    assert!(soup.hits > 0 && soup.hits < soup.rays, "rays that hit and rays that miss");
}

#[test]
fn a_top_level_makes_another_tree_of_the_same_primitives_over_at_most_the_cells_there_are() {
    let scenes: Vec<_> =
        scenes().into_iter().filter(|(_, s)| s.top_level != TopLevel::None).collect();
    assert_eq!(scenes.len(), 3);
    for (name, scene) in scenes {
        let joined = on_host(&scene);
        // Leaves are joined within cells only.
        let scene = SceneBlob { join_leaves: 0, ..scene };
        let plain = SceneBlob { top_level: TopLevel::None, ..scene.clone() };
        let (with, without) = (on_host(&scene), on_host(&plain));
        assert!(with.cells > 1 && with.cells <= scene.cells.capacity, "{name}: {}", with.cells);
        assert_eq!(without.cells, 0, "{name}");
        assert_eq!(joined.leaves < with.leaves, name == "binned", "{name}: joined leaves");
        for (i, output) in OUTPUTS.iter().enumerate() {
            let (with, without) = (with.outputs[i], without.outputs[i]);
            assert_eq!(with.bytes, without.bytes, "{name}: {output:?}");
            // Neither the order of primitives nor what rays hit depends on the top of the tree.
            let same = matches!(output, Output::LeafTable | Output::Hits);
            assert_eq!(with.crc == without.crc, same, "{name}: {output:?}");
        }
    }
}

/// A sheet that is folded further from frame to frame.
fn folding(side: i32, frames: i32) -> (Vec<Triangle>, Motion) {
    let flat = cloth(side);
    let fold = |frame: i32| {
        let mut triangles = flat.clone();
        for vertex in triangles.iter_mut().flat_map(|t| &mut t.vertices) {
            let x = i64::from(vertex.x).abs() * i64::from(frame) / i64::from(frames);
            (vertex.x, vertex.z) = (vertex.x - (x as i32) * vertex.x.signum(), x as i32 + vertex.z);
        }
        triangles
    };
    let later = (1..frames).map(fold).collect();
    (flat, Motion { later, rule: RebuildRule::Drift(Factor::from_num(1.1)) })
}

/// The trees of an animation by all formats: what was done in each frame, on the host.
fn animations() -> Vec<(&'static str, SceneBlob)> {
    let numbers = &mut Numbers(3);
    let (triangles, motion) = folding(8, 10);
    let rays = rays(40, numbers);
    let base = SceneBlob { triangles, animation: Some(motion), rays, ..SceneBlob::default() };
    let sort = SortConfig { capacity: 64, burst: 4, ..base.sort };
    vec![
        ("exact", SceneBlob { format: NodeFormat::Bvh2, ..base.clone() }),
        ("relative", SceneBlob { query: Query::Any, sort, ..base.clone() }),
        ("modulo", SceneBlob { format: NodeFormat::Quantized(Quantization::MODULO), ..base }),
    ]
}

#[test]
fn animated_frames_have_the_hits_of_fresh_trees_and_costs_within_the_rule() {
    let mut decisions = Vec::new();
    for (name, scene) in animations() {
        let run = run_on_host(&scene).expect("a scene that fits").expect("a job that ends well");
        let motion = scene.animation.as_ref().expect("an animation");
        assert_eq!(run.frames.len(), 1 + motion.later.len());
        let mut fresh_cost = SahCost::ZERO;
        for (frame, triangles) in
            run.frames.iter().zip([&scene.triangles].into_iter().chain(&motion.later))
        {
            let still =
                SceneBlob { triangles: triangles.clone(), animation: None, ..scene.clone() };
            let fresh = on_host(&still);
            let at = format!("{name}, frame {}", frame.frame);
            assert_eq!(frame.hits, fresh.hits, "{at}");
            if scene.query == Query::Closest {
                let hits = OUTPUTS.iter().position(|o| *o == Output::Hits).expect("an output");
                assert_eq!(frame.hits_crc, fresh.outputs[hits].crc, "{at}");
            }
            let drifted = frame.refitted.to_num::<f64>() > 1.1 * fresh_cost.to_num::<f64>();
            let expect = if frame.frame == 0 || drifted { Update::Rebuild } else { Update::Refit };
            assert_eq!(frame.update, expect, "{at}: {frame:?}");
            match frame.update {
                Update::Refit => assert_eq!(frame.cost, frame.refitted, "{at}"),
                Update::Rebuild => fresh_cost = frame.cost,
            }
        }
        decisions.push(run.frames.iter().map(|frame| frame.update).collect::<Vec<_>>());
    }
    // The rule looks at exact boxes: the format is no matter.
    assert!(decisions.windows(2).all(|pair| pair[0] == pair[1]), "{decisions:?}");
    let count = |update| decisions[0].iter().filter(|u| **u == update).count();
    assert!(count(Update::Refit) > 2 && count(Update::Rebuild) > 1, "{decisions:?}");
}

/// Runs animations on an engine and compares every frame with the host.
fn animations_agree_with_the_host(test: &str, engine: Engine) {
    let Some(elf) = firmware(test) else { return };
    if or_skip(test, engine.check()).is_none() {
        return;
    }
    for (name, scene) in animations() {
        let outcome = match soc::run(engine, &elf, &scene, &Options::default()) {
            Ok(outcome) => outcome,
            Err(error) => panic!("{name} on {engine}: {error}"),
        };
        let host = run_on_host(&scene).expect("a scene that fits").expect("a job that ends well");
        assert_eq!(outcome.report.digest(), host.report.digest(), "{name} on {engine}");
        assert_eq!(outcome.frames.len(), host.frames.len(), "{name} on {engine}");
        for (frame, expect) in outcome.frames.iter().zip(&host.frames) {
            let what = format!("{name} on {engine}, frame {}", frame.frame);
            assert_eq!(FrameReport { cycles: expect.cycles, ..*frame }, *expect, "{what}");
            let refitted =
                STAGES.iter().zip(frame.cycles).any(|(s, c)| *s == Stage::Refit && c > 0);
            assert_eq!(refitted, frame.frame > 0, "{what}: {frame:?}");
        }
        print_cycles(name, &outcome);
    }
}

#[test]
fn the_simulator_animates_as_the_host_does() {
    animations_agree_with_the_host("the_simulator_animates_as_the_host_does", Engine::Sim);
}

#[test]
fn qemu_animates_as_the_host_does() {
    animations_agree_with_the_host("qemu_animates_as_the_host_does", Engine::Qemu);
}

#[test]
fn frames_of_other_lengths_are_refused() {
    let (triangles, mut motion) = folding(2, 3);
    motion.later[1].pop();
    let scene = SceneBlob { triangles, animation: Some(motion), ..SceneBlob::default() };
    let error = run_on_host(&scene).expect_err("a blob has frames of one length");
    assert!(matches!(error, SocError::Frames { first: 8, frame: 2, triangles: 7 }), "{error}");
}

#[test]
fn more_cells_than_the_firmware_has_storage_for_are_refused() {
    let cells = |capacity| CellConfig { capacity, ..CellConfig::default() };
    let with = |capacity| {
        let top_level = TopLevel::Binned(Binned::default());
        let scene = SceneBlob { top_level, cells: cells(capacity), ..SceneBlob::default() };
        run_on_host(&scene).expect("a scene that fits").map(|run| run.report.cells)
    };
    let error = JobError::Build(BuildError::Config(ConfigError::TopLevel));
    assert_eq!(with(MAX_CELLS as u32), Ok(0));
    assert_eq!(with(MAX_CELLS as u32 + 1), Err(error));
    assert_eq!(with(0), Err(error));
}

#[test]
fn a_program_that_takes_too_long_is_stopped_with_its_log() {
    let test = "a_program_that_takes_too_long_is_stopped_with_its_log";
    let Some(elf) = firmware(test) else { return };
    let numbers = &mut Numbers(2);
    let scene = SceneBlob {
        triangles: soup(20_000, numbers),
        rays: rays(20_000, numbers),
        ..SceneBlob::default()
    };
    let options = Options { time: Duration::from_millis(700), ..Options::default() };
    for engine in [Engine::Sim, Engine::Qemu] {
        if or_skip(test, engine.check()).is_none() {
            continue;
        }
        let error = soc::run(engine, &elf, &scene, &options).unwrap_err();
        assert!(matches!(error, SocError::TimeOut { .. }), "{engine}: {error}");
        assert!(error.log()[0].text.contains("xylem firmware"), "{engine}: {error}");
    }
}

#[test]
fn a_job_that_fails_says_why_in_the_log() {
    let test = "a_job_that_fails_says_why_in_the_log";
    let Some(elf) = firmware(test) else { return };
    let numbers = &mut Numbers(3);
    // Memory holds this scene but not what the job would write.
    let scene = SceneBlob { triangles: soup(1_400_000, numbers), ..SceneBlob::default() };
    for engine in Engine::ALL {
        if or_skip(test, engine.check()).is_none() {
            continue;
        }
        let error = soc::run(engine, &elf, &scene, &Options::default()).unwrap_err();
        assert!(matches!(error, SocError::Failed { code: 1, .. }), "{engine}: {error}");
        assert!(error.to_string().contains("WorkSpace"), "{engine}: {error}");
    }
}

#[test]
fn a_program_that_crashes_is_told_apart_from_one_that_fails() {
    let test = "a_program_that_crashes_is_told_apart_from_one_that_fails";
    let Some(elf) = firmware(test) else { return };
    // No instruction is all zeros; put that where sorting starts.
    let mut bytes = std::fs::read(elf).unwrap();
    let at = file_offset(&bytes, "partial_sort");
    bytes[at..at + 4].fill(0);
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken");
    std::fs::write(&broken, bytes).unwrap();
    for engine in Engine::ALL {
        if or_skip(test, engine.check()).is_none() {
            continue;
        }
        let scene = &scenes()[0].1;
        let error = soc::run(engine, &broken, scene, &Options::default()).unwrap_err();
        match engine {
            // The program catches the exception itself where the core lets it.
            Engine::Qemu => {
                assert!(matches!(error, SocError::Failed { code: 3, .. }), "{error}");
                assert!(error.to_string().contains("trap: cause 2 at 0x800"), "{error}");
            }
            Engine::Sim | Engine::PicoRv32 => {
                assert!(matches!(error, SocError::Crash { .. }), "{engine}: {error}");
                assert!(error.to_string().contains("0x800"), "{engine}: {error}");
            }
        }
        assert!(error.log()[0].text.contains("xylem firmware"), "{engine}: {error}");
    }
}

/// Where in an ELF file the code of a function is whose symbol contains `name`.
fn file_offset(elf: &[u8], name: &str) -> usize {
    let file = object::File::parse(elf).unwrap();
    // A function's constants may bear its name too.
    let is_code = |s: &object::Symbol| {
        s.kind() == SymbolKind::Text && s.name().is_ok_and(|n| n.contains(name)) && s.size() > 0
    };
    let symbol = file.symbols().find(is_code).unwrap_or_else(|| panic!("no function {name}"));
    let holds =
        |s: &object::Segment| (s.address()..s.address() + s.size()).contains(&symbol.address());
    let segment = file.segments().find(holds).unwrap();
    (segment.file_range().0 + symbol.address() - segment.address()) as usize
}

#[test]
fn a_file_that_is_no_program_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not-an-elf");
    std::fs::write(&path, b"hello").unwrap();
    let run = |path| soc::run(Engine::Sim, path, &SceneBlob::default(), &Options::default());
    assert!(matches!(run(&path), Err(SocError::Elf { .. })));
    let this = std::env::current_exe().unwrap();
    let error = run(&this).unwrap_err().to_string();
    assert!(error.contains("not Riscv32"), "{error}");
    let error = run(&folder.path().join("missing")).unwrap_err();
    assert!(matches!(error, SocError::Io { .. }));
}
