//! The firmware uses the accelerator through its registers, and both make the same bytes: the cycle model
//! beside the simulated core, and the RTL of `xy_top` beside the RTL of PicoRV32.

use std::path::PathBuf;

use glam::IVec3;
use xylem::soc::{
    self, Accelerated, AcceleratorConfig, Beside, Engine, Options, Outcome, PARTS, Part, SceneBlob,
    SocError, firmware_elf,
};
use xylem_core::geom::{Ray, Triangle};
use xylem_core::num::{MortonWidth, SubGrid, Time};
use xylem_core::sort::SortConfig;

/// The firmware and the engine, or `None` after saying what is missing.
fn ready(test: &str, engine: Engine) -> Option<PathBuf> {
    match engine.check().and_then(|()| firmware_elf()) {
        Ok(elf) => Some(elf),
        Err(missing @ (SocError::NotBuilt { .. } | SocError::ToolMissing { .. })) => {
            assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{test}: {missing}");
            println!("skipped: {test}: {missing}");
            None
        }
        Err(error) => panic!("{test}: {error}"),
    }
}

/// Triangles strewn over the grid, some of them twice, and a few rays.
fn scene(config: &AcceleratorConfig, count: u32, morton: MortonWidth) -> SceneBlob {
    let mut state = 7u64;
    let mut around = |reach: i64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((((state >> 33) as i64 * reach) >> 30) - reach) as i32
    };
    let mut point = |reach| IVec3::new(around(reach), around(reach), around(reach));
    let mut triangles: Vec<Triangle> = Vec::new();
    for id in 0..count {
        let centre = point(7 << 20);
        let vertices = [0; 3].map(|_| centre + point(1 << 20));
        let twin = triangles.last().filter(|_| id % 5 == 0).map(|last| last.vertices);
        triangles.push(Triangle { vertices: twin.unwrap_or(vertices), id });
    }
    let rays = (0..4).map(|_| {
        let origin = point(6 << 20).to_array().map(SubGrid::from_num);
        Ray::new(origin, IVec3::Z * (1 << 30), Time::ZERO, Ray::TIME_LIMIT).expect("in range")
    });
    let rays = rays.collect();
    let sort = SortConfig { capacity: 64, burst: 4, ..SortConfig::PAPER };
    let accelerator = true;
    let treelet_depth = config.treelet_depth;
    SceneBlob { morton, sort, triangles, rays, treelet_depth, accelerator, ..SceneBlob::default() }
}

fn run(engine: Engine, elf: &std::path::Path, scene: &SceneBlob, beside: Beside) -> Outcome {
    let options = Options { accelerator: Some(beside), ..Options::default() };
    match soc::run(engine, elf, scene, &options) {
        Ok(outcome) => outcome,
        Err(error) => panic!("{} on {engine}: {error}", beside.config.name),
    }
}

fn accelerated(outcome: &Outcome) -> Accelerated {
    outcome.accelerated.expect("what the accelerator did")
}

fn print(outcome: &Outcome, beside: &Beside) {
    let report = &outcome.report;
    let software: u64 = report.cycles[..3].iter().sum();
    print!("{} on {}, {} primitives", beside.config.name, outcome.engine, report.primitives);
    print!(": build in software {software} cycles");
    for (part, done) in PARTS.iter().zip(accelerated(outcome).parts) {
        if let Some(done) = done {
            print!(", {} {} (busy {})", part.as_str(), done.cycles, done.counters.cycles);
        }
    }
    println!();
}

#[test]
fn the_model_makes_what_the_firmware_makes() {
    let test = "the_model_makes_what_the_firmware_makes";
    let Some(elf) = ready(test, Engine::Sim) else { return };
    for (config, morton) in [
        (AcceleratorConfig::SMALL, MortonWidth::Bits63),
        (AcceleratorConfig::PAPER, MortonWidth::Bits30),
    ] {
        let beside = Beside { config, latency: 10 };
        let scene = scene(&config, 900, morton);
        let outcome = run(Engine::Sim, &elf, &scene, beside);
        let report = accelerated(&outcome);
        assert!(report.is_equal(), "{report:?}");
        assert_eq!(report.outputs, [Some(true); 4]);
        let build = report.parts[Part::Build as usize].expect("a build");
        assert!(build.cycles * 20 < outcome.report.cycles[..3].iter().sum::<u64>(), "{build:?}");
        print(&outcome, &beside);
        // Whether there is an accelerator makes no difference to the software.
        let alone = SceneBlob { accelerator: false, ..scene };
        let alone = soc::run(Engine::Sim, &elf, &alone, &Options::default()).expect("a run");
        assert_eq!(alone.report, outcome.report);
        assert_eq!(alone.accelerated, None);
    }
}

#[test]
fn the_rtl_makes_what_the_firmware_makes_on_the_rtl_of_a_core() {
    let test = "the_rtl_makes_what_the_firmware_makes_on_the_rtl_of_a_core";
    let Some(elf) = ready(test, Engine::PicoRv32) else { return };
    let beside = Beside { config: AcceleratorConfig::SMALL, latency: 10 };
    for (count, morton) in [(1, MortonWidth::Bits30), (300, MortonWidth::Bits63)] {
        let scene = scene(&beside.config, count, morton);
        let outcome = run(Engine::PicoRv32, &elf, &scene, beside);
        let report = accelerated(&outcome);
        assert!(report.is_equal(), "{report:?}");
        print(&outcome, &beside);
        // The model says the same of the software, and counts the same in the accelerator.
        let model = run(Engine::Sim, &elf, &scene, beside);
        assert_eq!(model.report, outcome.report);
        assert_eq!(report.outputs, [Some(true); 4]);
        for part in [Part::Build, Part::BuildCompressed, Part::Trace] {
            let counted = |outcome| {
                let part = accelerated(outcome).parts[part as usize].expect("a part");
                (part.cycles, part.counters)
            };
            let ((rtl_cycles, rtl), (model_cycles, model)) = (counted(&outcome), counted(&model));
            println!("{}: core's cycles: RTL {rtl_cycles}, model {model_cycles}", part.as_str());
            println!("counters: RTL {rtl:?}\n        model {model:?}");
            let built = |c: &soc::Counters| [c.nodes, c.leaves, c.heap_replaces, c.bytes_written];
            let traced = |c: &soc::Counters| [c.node_fetches, c.box_tests, c.triangle_tests];
            assert_eq!(built(&rtl), built(&model), "{}", part.as_str());
            assert_eq!(traced(&rtl), traced(&model), "{}", part.as_str());
        }
    }
}

#[test]
fn a_core_whose_accelerator_is_missing_says_so() {
    let test = "a_core_whose_accelerator_is_missing_says_so";
    for engine in [Engine::Sim, Engine::PicoRv32] {
        let Some(elf) = ready(test, engine) else { continue };
        let scene = scene(&AcceleratorConfig::SMALL, 5, MortonWidth::Bits30);
        let error = soc::run(engine, &elf, &scene, &Options::default()).unwrap_err();
        assert!(matches!(error, SocError::Failed { code: 4, .. }), "{engine}: {error}");
        assert!(error.to_string().contains("NotFound"), "{engine}: {error}");
    }
}

#[test]
fn an_engine_without_an_accelerator_refuses_one() {
    let test = "an_engine_without_an_accelerator_refuses_one";
    let Some(elf) = ready(test, Engine::Qemu) else { return };
    let beside = Beside { config: AcceleratorConfig::SMALL, latency: 1 };
    let options = Options { accelerator: Some(beside), ..Options::default() };
    let error =
        soc::run(Engine::Qemu, &elf, &scene(&beside.config, 1, MortonWidth::Bits30), &options);
    assert!(matches!(error, Err(SocError::NoAccelerator { .. })), "{error:?}");
}
