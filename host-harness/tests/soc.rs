//! The firmware gives the host's results on every engine, and failures are told apart.

use std::path::PathBuf;
use std::time::Duration;

use glam::IVec3;
use object::{Object as _, ObjectSegment as _, ObjectSymbol as _};
use xylem::soc::{
    self, Engine, OUTPUTS, Options, Outcome, Report, STAGES, SceneBlob, SocError, firmware_elf,
    run_on_host,
};
use xylem_core::geom::{Ray, Triangle};
use xylem_core::node::NodeFormat;
use xylem_core::num::{MortonWidth, SubGrid, Time};
use xylem_core::probe::Stage;
use xylem_core::sort::{RecordFormat, SortConfig};
use xylem_core::traverse::Query;

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
/// several runs and passes, in all formats.
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
                format: NodeFormat::QuantizedModulo,
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
        ("empty", SceneBlob { rays: rays(10, numbers), ..base }),
    ]
}

fn on_host(scene: &SceneBlob) -> Report {
    run_on_host(scene).expect("a scene that fits").expect("a job that ends well")
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
        assert!(!outcome.log.is_empty(), "{name} on {engine}: nothing logged");
        print_cycles(name, &outcome);
        if engine == Engine::PicoRv32 {
            // The simulator's costs are a model of this core, and an exact one.
            let model = soc::run(Engine::Sim, &elf, &scene, &Options::default()).expect("a run");
            assert_eq!(model.report.cycles, report.cycles, "{name}: cycles by stage");
        }
    }
}

fn print_cycles(name: &str, outcome: &Outcome) {
    let Outcome { engine, report, time, .. } = outcome;
    print!("{name:6} on {engine:8}: digest {:08x}", report.digest());
    for (stage, cycles) in STAGES.iter().zip(report.cycles) {
        let (count, unit) = match stage {
            Stage::Trace => (report.rays, "ray"),
            _ => (report.primitives, "primitive"),
        };
        if count > 0 {
            print!(", {stage:?} {} a {unit}", cycles / u64::from(count));
        }
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
    // No instruction is all zeros; put that where compression starts.
    let mut bytes = std::fs::read(elf).unwrap();
    let at = file_offset(&bytes, "compress_top_down");
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
                assert!(error.to_string().contains("trap: cause 2 at 0x8000"), "{error}");
            }
            Engine::Sim | Engine::PicoRv32 => {
                assert!(matches!(error, SocError::Crash { .. }), "{engine}: {error}");
                assert!(error.to_string().contains("0x8000"), "{engine}: {error}");
            }
        }
        assert!(error.log()[0].text.contains("xylem firmware"), "{engine}: {error}");
    }
}

/// Where in an ELF file the code of a function is whose symbol contains `name`.
fn file_offset(elf: &[u8], name: &str) -> usize {
    let file = object::File::parse(elf).unwrap();
    let is_code = |s: &object::Symbol| s.name().is_ok_and(|n| n.contains(name)) && s.size() > 0;
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
