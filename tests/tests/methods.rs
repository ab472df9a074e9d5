//! Quantized trees are searched in three ways, and the hits are always those of the exact boxes.

use std::fmt::Write as _;
use std::ops::AddAssign;

use rayon::prelude::*;
use xylem::run::{self, BuildOptions, BuildRun, TraceRun};
use xylem::scene::rays::read_rays;
use xylem::scene::{LoadOptions, Random, convert, obj};
use xylem_core::compress::Compression;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::node::{Coordinates, NodeFormat, Quantization};
use xylem_core::pipeline::BuildConfig;
use xylem_core::traverse::{Method, Multipliers, Query};
use xylem_tests::rays::hard_ray;
use xylem_tests::trees::soup;
use xylem_tests::{places, results};

const SEED: u64 = 0x5eed_00c3;

/// Every width, with the finest and with coarser minimum scales, in both coordinates.
fn quantizations() -> Vec<Quantization> {
    let mut all = Vec::new();
    for bits in Quantization::WIDTHS {
        for min_scale in [0, 4, Quantization::MAX_MIN_SCALE] {
            for coordinates in [Coordinates::Relative, Coordinates::Modulo] {
                all.push(Quantization { coordinates, bits, min_scale });
            }
        }
    }
    all
}

fn scenes() -> Vec<(String, Vec<Triangle>)> {
    let soups = [1, 2, 40, 3000].map(|count| {
        (format!("soup of {count}"), soup(&mut Random::new(SEED + count as u64), count))
    });
    // Without triangles there is nothing to aim at.
    let names = places::small_scenes().into_iter().filter(|name| name != "degenerate/empty");
    let named = names.map(|name| {
        let triangles = places::procedural(&name).triangles;
        (name, triangles)
    });
    named.chain(soups).collect()
}

/// The tree of 64-byte nodes.
fn exact(triangles: &[Triangle]) -> BuildRun {
    run::build(triangles, &BuildOptions::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// A quantized tree, compressed from the root down.
fn top_down(triangles: &[Triangle], quantization: Quantization) -> BuildRun {
    let format = NodeFormat::Quantized(quantization);
    let options = BuildOptions { format, ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{quantization:?}: {e}"))
}

/// A quantized tree, compressed as its nodes are emitted, with as many repairs as can be.
fn streamed(triangles: &[Triangle], quantization: Quantization) -> BuildRun {
    let compression =
        Compression { quantization, treelet_depth: 1, margin: 0, ..Compression::DEFAULT };
    let config = BuildConfig { compression: Some(compression), ..BuildConfig::default() };
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{quantization:?}, streamed: {e}"))
}

/// What a method tested, beside what is tested with exact boxes.
#[derive(Clone, Copy, Debug, Default)]
struct Tests {
    boxes: u64,
    triangles: u64,
}

impl AddAssign<&TraceRun> for Tests {
    fn add_assign(&mut self, run: &TraceRun) {
        self.boxes += run.sums.box_tests;
        self.triangles += run.sums.triangle_tests;
    }
}

fn trace(method: Method, run: &BuildRun, rays: &[Option<Ray>], query: Query) -> TraceRun {
    run::trace_by(method, &run.memory, &run.scene, rays, query)
        .unwrap_or_else(|e| panic!("{method:?}, {query:?}: {e}"))
}

/// Traces by every method and compares all hits with those of exact boxes; returns what was tested,
/// the exact boxes first.
fn compare(what: &str, exact: &TraceRun, run: &BuildRun, rays: &[Option<Ray>]) -> [Tests; 4] {
    let mut tests = [Tests::default(); 4];
    tests[0] += exact;
    for (method, tests) in Method::ALL.into_iter().zip(&mut tests[1..]) {
        let [closest, any] =
            [Query::Closest, Query::Any].map(|query| trace(method, run, rays, query));
        for (i, hit) in exact.hits.iter().enumerate() {
            let ray = &rays[i];
            assert_eq!(closest.hits[i], *hit, "{what}, {method:?}, ray {i}: {ray:?}");
            let found = any.hits[i].is_some();
            assert_eq!(found, hit.is_some(), "{what}, {method:?}, any, ray {i}: {ray:?}");
        }
        *tests += &closest;
    }
    tests
}

/// The cost of each method at each width, as the core says it.
fn costs() -> String {
    let mut table = String::from(
        "| bits | method | box tests | a descent | a pop | partial products, a node and a descent | stack \
         entry, relative | modulo |\n|--:|---|--:|--:|--:|--:|--:|--:|\n",
    );
    for bits in Quantization::WIDTHS {
        for method in Method::ALL {
            let [relative, modulo] = [Quantization::RELATIVE, Quantization::MODULO]
                .map(|quantization| method.cost(&Quantization { bits, ..quantization }));
            let say = |m: Multipliers| format!("{} of {} × {}", m.count, m.left, m.right);
            let (descend, resume) = (modulo.descend.map(say), modulo.resume.map(say));
            let products = modulo.test.partial_products()
                + modulo.descend.map_or(0, |descend| descend.partial_products());
            writeln!(
                table,
                "| {bits} | {method:?} | {} | {} | {} | {products} | {} | {} |",
                say(modulo.test),
                descend.unwrap_or_default(),
                resume.unwrap_or_default(),
                relative.stack_entry_bits,
                modulo.stack_entry_bits
            )
            .unwrap();
        }
    }
    table
}

#[test]
fn every_method_finds_the_hits_of_exact_boxes_in_every_quantization() {
    let scenes = scenes();
    let jobs: Vec<_> = scenes
        .iter()
        .flat_map(|scene| quantizations().into_iter().map(move |q| (scene, q)))
        .collect();
    let count = if places::full() { 20_000 } else { 200 };
    let hits: usize = jobs
        .par_iter()
        .map(|((name, triangles), quantization)| {
            let exact = exact(triangles);
            let bounds = exact.scene.tree.root.expect("the scene has triangles").bounds;
            let mut random = Random::new(SEED);
            let mut ray = || Some(hard_ray(&mut random, triangles, &bounds).1);
            let rays: Vec<_> = (0..count).map(|_| ray()).collect();
            let exact = trace(Method::default(), &exact, &rays, Query::Closest);
            for build in [top_down, streamed] {
                let run = build(triangles, *quantization);
                compare(&format!("{name}, {quantization:?}"), &exact, &run, &rays);
            }
            exact.hits.iter().flatten().count()
        })
        .sum();
    println!("{} times two trees, {count} rays each, {hits} hits, seed {SEED:#x}", jobs.len());
    assert!(hits > jobs.len() * count / 10);
}

#[test]
fn every_method_finds_the_hits_of_exact_boxes_in_every_mesh() {
    let test = "every_method_finds_the_hits_of_exact_boxes_in_every_mesh";
    let Some(folder) = places::folder("XYLEM_ORACLE", test) else { return };
    let sets = if places::full() { &["primary", "diffuse", "random"][..] } else { &["diffuse"] };
    let mut table = String::from(
        "| rays | number | box tests, exact | decompress | point | incremental | triangle tests, \
         exact | decompress | point | incremental |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    for path in places::meshes_in(&folder) {
        let mesh = obj::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let exact = exact(&mesh.triangles);
        let (run, streamed) = (
            top_down(&mesh.triangles, Quantization::MODULO),
            streamed(&mesh.triangles, Quantization::MODULO),
        );
        for set in sets {
            let rays = folder.join(format!("{}.{set}.rays.gz", mesh.name));
            let rays = read_rays(&rays).unwrap_or_else(|e| panic!("{e}"));
            let rays = convert::convert(&mesh.frame, &rays).unwrap_or_else(|e| panic!("{e}"));
            let rays: Vec<_> = rays.iter().map(|ray| ray.core().copied()).collect();
            let what = format!("{} {set}", mesh.name);
            let exact = trace(Method::default(), &exact, &rays, Query::Closest);
            let tests = compare(&what, &exact, &run, &rays);
            compare(&format!("{what}, streamed"), &exact, &streamed, &rays);
            let per_ray = |n: u64| n as f64 / rays.len() as f64;
            let row = |pick: fn(&Tests) -> u64| {
                let [exact, others @ ..] = tests.each_ref().map(pick);
                let more =
                    others.map(|n| format!("{:+.1} %", 100.0 * (n as f64 / exact as f64 - 1.0)));
                format!("{:.2} | {}", per_ray(exact), more.join(" | "))
            };
            let (boxes, triangles) = (row(|t| t.boxes), row(|t| t.triangles));
            writeln!(table, "| {what} | {} | {boxes} | {triangles} |", rays.len()).unwrap();
        }
    }
    println!("{table}");
    if places::full() {
        let body = format!(
            "Closest hits, `cbvh` with modulo coordinates; tests a ray with exact boxes, and how many more \
             there are with each method; run on {}. All hits are equal, for both queries.\n\n{table}\n\
             What a traversal unit multiplies to test the two boxes of a node and to move the traversal \
             point, with partial products, and bits of a stack entry, by width of a coordinate:\n\n{}",
            results::today(),
            costs()
        );
        results::report("Three ways to search quantized trees", &body);
    }
}
