//! The traversal unit in gates against its cycle model, cycle by cycle, and against the core, record by
//! record.

use xylem::machine::traverser::{TraverserConfig, TraverserError};
use xylem_core::traverse::{Hit, Query};
use xylem_cosim::random::Random;
use xylem_cosim::tools_for;
use xylem_cosim::traverser;
use xylem_cosim::traverser::lockstep::{Pace, Stop, Summary, TraverserRtl};
use xylem_cosim::traverser::scenes::{FORMATS, Set, damaged, expected};
use xylem_cosim::verilate::Mutation;

const PACES: [Pace; 3] = [
    Pace { eager: 4, latency: 1, constant: true },
    Pace { eager: 2, latency: 40, constant: false },
    Pace { eager: 4, latency: 14, constant: true },
];

fn load(config: TraverserConfig, mutation: Option<Mutation>, seed: u32) -> TraverserRtl {
    let library = traverser::build(config, mutation).unwrap_or_else(|error| panic!("{error}"));
    TraverserRtl::load(&library, config, seed).unwrap()
}

/// The code's part of what the core says, and the index where the unit's must be the core's.
fn said(error: Option<TraverserError>) -> Option<String> {
    error.map(|error| match error {
        TraverserError::BadRay(index) => format!("ray {index}"),
        TraverserError::CorruptNode(_) => "node".into(),
        TraverserError::CorruptLeaf(entry) => format!("leaf {entry}"),
        TraverserError::CorruptTriangle(primitive) => format!("triangle {primitive}"),
        TraverserError::Regions => error.to_string(),
    })
}

/// Runs a set in one format and compares the records with the core's.
fn check(
    rtl: &mut TraverserRtl,
    set: &Set,
    which: (usize, Query),
    pace: Pace,
    random: &mut Random,
) -> Result<Summary, String> {
    let (mut memory, job) = set.job(FORMATS[which.0].1, which.1);
    let (records, error) = expected(&memory, &job);
    let at = |stop: Stop| format!("{} {} {:?}: {stop}", set.name, FORMATS[which.0].0, which.1);
    let summary = rtl.run(&mut memory, &job, pace, random, None).map_err(at)?;
    let base = job.hits.0 as usize;
    if said(summary.error) != error {
        return Err(format!("{}: {:?}, not {error:?}", set.name, summary.error));
    }
    if memory.bytes()[base..base + records.len()] != records {
        return Err(format!("{}: records differ from the core's", set.name));
    }
    Ok(summary)
}

const SCENES: [(&str, usize); 16] = [
    ("degenerate/one_triangle", 12),
    ("degenerate/two_triangles", 24),
    ("degenerate/identical", 8),
    ("degenerate/coplanar", 20),
    ("degenerate/flat", 20),
    ("degenerate/zero_area", 12),
    ("degenerate/all_one_point", 8),
    ("degenerate/huge", 12),
    ("degenerate/tiny", 12),
    ("degenerate/needles", 20),
    ("degenerate/far_away", 12),
    ("degenerate/duplicate_faces", 12),
    ("cornell_box", 40),
    ("terrain_small", 40),
    ("hair_small", 20),
    ("flake_small", 40),
];

#[test]
fn rtl_model_and_core_agree_on_every_scene() {
    if !tools_for("rtl_model_and_core_agree_on_every_scene") {
        return;
    }
    println!("| scene | format | query | rays | hits | nodes | triangles | cycles | a ray |");
    println!("|---|---|---|--:|--:|--:|--:|--:|--:|");
    for config in TraverserConfig::ALL {
        let mut rtl = load(config, None, 3);
        let mut random = Random::new(3);
        let mut total = 0;
        for (i, (name, count)) in SCENES.into_iter().enumerate() {
            let set = Set::new(name, count, i as u64);
            for which in 0..FORMATS.len() {
                for query in [Query::Closest, Query::Any] {
                    let pace = PACES[(i + which) % PACES.len()];
                    let summary = check(&mut rtl, &set, (which, query), pace, &mut random)
                        .unwrap_or_else(|message| panic!("{}: {message}", config.name));
                    assert_eq!(summary.error, None, "{name}");
                    total += summary.cycles;
                    let rays = set.rays.len();
                    println!(
                        "| {name} | {} | {query:?} | {rays} | {} | {} | {} | {} | {:.0} |",
                        FORMATS[which].0,
                        summary.hits,
                        summary.counts[0],
                        summary.counts[2],
                        summary.cycles,
                        summary.cycles as f64 / rays as f64
                    );
                }
            }
        }
        println!("{}: {total} cycles in lockstep", config.name);
        assert!(total > 100_000);
    }
}

#[test]
fn corrupt_memory_ends_in_an_error_and_nothing_foreign_is_touched() {
    if !tools_for("corrupt_memory_ends_in_an_error_and_nothing_foreign_is_touched") {
        return;
    }
    let mut rtl = load(TraverserConfig::SMALL, None, 5);
    let mut random = Random::new(5);
    let mut seen = [0; 5];
    for (name, trials) in
        [("degenerate/two_triangles", 60), ("degenerate/identical", 60), ("cornell_box", 120)]
    {
        let set = Set::new(name, 4, 5);
        for trial in 0..trials {
            let query = if trial % 4 == 0 { Query::Any } else { Query::Closest };
            let (memory, job) = set.job(FORMATS[trial % 3].1, query);
            let (mut memory, job) = damaged(memory, job, &mut random);
            let (records, error) = expected(&memory, &job);
            let summary = rtl
                .run(&mut memory, &job, PACES[trial % 3], &mut random, None)
                .unwrap_or_else(|stop| panic!("{name}, trial {trial}: {stop}"));
            assert_eq!(said(summary.error), error, "{name}, trial {trial}");
            let base = job.hits.0 as usize;
            assert!(memory.bytes()[base..base + records.len()] == records, "{name}, trial {trial}");
            seen[summary.error.map_or(0, |error| error.code().0 as usize)] += 1;
        }
    }
    let [good, ray, node, leaf, triangle] = seen;
    println!(
        "{good} jobs done; errors: {ray} rays, {node} nodes, {leaf} entries, {triangle} triangles"
    );
    assert!(seen.iter().all(|&count| count > 3), "{seen:?}");
}

#[test]
fn a_job_that_is_given_up_leaves_nothing_behind() {
    if !tools_for("a_job_that_is_given_up_leaves_nothing_behind") {
        return;
    }
    let set = Set::new("cornell_box", 8, 9);
    let mut rtl = load(TraverserConfig::SMALL, None, 9);
    let mut random = Random::new(9);
    for trial in 0..60 {
        let which = (trial % 3, [Query::Closest, Query::Any][trial % 2]);
        let (mut memory, job) = set.job(FORMATS[which.0].1, which.1);
        let until = random.below(6_000);
        rtl.run(&mut memory, &job, PACES[trial % 3], &mut random, Some(until))
            .unwrap_or_else(|stop| panic!("trial {trial}: {stop}"));
        rtl.clear().unwrap();
        let small = Set {
            name: set.name.clone(),
            triangles: set.triangles.clone(),
            rays: set.rays[..5].to_vec(),
        };
        check(&mut rtl, &small, which, PACES[trial % 3], &mut random).unwrap();
    }
}

#[test]
fn a_tree_that_is_deeper_than_the_unit_is_an_error() {
    if !tools_for("a_tree_that_is_deeper_than_the_unit_is_an_error") {
        return;
    }
    let set = Set::new("flake_small", 4, 13);
    for depth in [5, 12] {
        let config = TraverserConfig { name: "shallow", depth, ..TraverserConfig::SMALL };
        let mut rtl = load(config, None, depth);
        let mut random = Random::new(depth.into());
        for (name, format) in FORMATS {
            let (mut memory, job) = set.job(format, Query::Closest);
            let summary = rtl
                .run(&mut memory, &job, PACES[0], &mut random, None)
                .unwrap_or_else(|stop| panic!("depth {depth}, {name}: {stop}"));
            let error = summary.error;
            assert!(matches!(error, Some(TraverserError::CorruptNode(_))), "{depth}: {error:?}");
        }
    }
}

#[test]
fn configurations_are_the_same_in_rust_and_rtl() {
    let text = include_str!("../../rtl/configs.toml");
    let table: toml::Table = text.parse().unwrap();
    let units = table["traverser"].as_table().unwrap();
    assert_eq!(units.len(), TraverserConfig::ALL.len());
    for config in TraverserConfig::ALL {
        let values = units[config.name].as_table().unwrap();
        for (key, value) in [
            ("depth", config.depth),
            ("cache_width", config.cache_width),
            ("cache_block", config.cache_block.into()),
        ] {
            assert_eq!(values[key].as_integer(), Some(value.into()), "{}: {key}", config.name);
        }
    }
    assert_eq!(Hit::BYTES, 24);
}
