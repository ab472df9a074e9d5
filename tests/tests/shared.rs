//! Shared-plane nodes of streamed builds, against the exact tree.

use proptest::prelude::*;
use xylem::baseline::shared_top_down;
use xylem::run::{self, BuildOptions, BuildRun, RunError};
use xylem::scene::{self, LoadOptions, Random};
use xylem_core::compress::Compression;
use xylem_core::emit::{EmitterKind, PlocConfig};
use xylem_core::geom::Triangle;
use xylem_core::node::{Grids, NodeFormat, Sharing};
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::quality::Malformed;
use xylem_core::sort::{InputFormat, RecordFormat, SortConfig};
use xylem_core::toplevel::{Binned, TopLevel};
use xylem_core::traverse::{Query, Scene};
use xylem_tests::cases::for_all;
use xylem_tests::job::trace;
use xylem_tests::places::procedural;
use xylem_tests::rays::hard_ray;
use xylem_tests::streams::{assert_same_hits, tree};
use xylem_tests::trees::soup;

const SEED: u64 = 0x5a_4ed0;

fn try_build(triangles: &[Triangle], config: BuildConfig) -> Result<BuildRun, RunError> {
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    run::build(triangles, &options)
}

/// Builds, and checks that every box is inside its parent's and around its primitives.
fn build(triangles: &[Triangle], config: BuildConfig) -> BuildRun {
    let run = try_build(triangles, config).unwrap_or_else(|e| panic!("{e}"));
    run.check().unwrap_or_else(|e| panic!("{e}"));
    run
}

fn shared(sharing: Sharing) -> BuildConfig {
    BuildConfig { sharing: Some(sharing), ..BuildConfig::default() }
}

#[test]
fn every_way_of_sharing_keeps_every_hit() {
    let sharings = (0..=5u8, prop_oneof![Just(31u8), 0..6u8]);
    for_all(
        SEED,
        120,
        (sharings, 0..400usize, any::<u64>()),
        |((margin, flatness), count, seed)| {
            let mut random = Random::new(seed);
            let triangles = soup(&mut random, count);
            let sort = SortConfig { capacity: 64, burst: 8, ..SortConfig::PAPER };
            let max_leaf_size = 1 + (seed % 3) as u32;
            let plain = BuildConfig { sort, max_leaf_size, ..BuildConfig::default() };
            let exact = build(&triangles, plain);
            let sharing = Sharing { grids: Grids::Stored, margin, flatness };
            let run = build(&triangles, BuildConfig { sharing: Some(sharing), ..plain });
            prop_assert_eq!(run.scene.tree.leaf_count, exact.scene.tree.leaf_count);
            prop_assert!(run.scene.tree.node_count >= exact.scene.tree.node_count);
            if !triangles.is_empty() {
                assert_same_hits(&triangles, tree(&exact), tree(&run), &mut random);
            }
            Ok(())
        },
    );
}

#[test]
fn from_the_root_down_every_hit_is_kept_too() {
    for_all(SEED, 60, (0..32u8, 1..400usize, any::<u64>()), |(flatness, count, seed)| {
        let mut random = Random::new(seed);
        let triangles = soup(&mut random, count);
        let exact = build(&triangles, BuildConfig::default());
        let mut memory = exact.memory.clone();
        let sharing = Sharing { flatness, ..Sharing::TOP_DOWN };
        let target = exact.layout.quantized_nodes;
        let done = shared_top_down(&mut memory, &exact.scene.tree, target, &sharing).unwrap();
        let scene = Scene { tree: done.tree, ..exact.scene };
        run::check(&memory, &scene).unwrap();
        assert_same_hits(&triangles, tree(&exact), (&memory, &scene), &mut random);
        Ok(())
    });
}

#[test]
fn a_stream_writes_its_words_once_and_repairs_nothing() {
    for name in ["sphereflake:1", "terrain:6"] {
        let triangles = procedural(name).triangles;
        let run = build(&triangles, shared(Sharing::STREAMED));
        let traffic = |stage| run.traffic.stage(stage);
        assert_eq!(traffic(Stage::Compress).bytes(), 0, "{name}");
        let leaf_table = 4 * triangles.len() as u64;
        let words = 8 * u64::from(run.scene.tree.node_count);
        assert_eq!(traffic(Stage::Emit).write_bytes, words + leaf_table, "{name}");
        assert_eq!(traffic(Stage::Emit).read_bytes, 0, "{name}");
        let compression = Some(Compression::DEFAULT);
        let pairs = build(&triangles, BuildConfig { compression, ..BuildConfig::default() });
        let pairs = 16 * u64::from(pairs.scene.tree.node_count);
        assert!(100 * words <= 56 * pairs, "{name}: {words} of {pairs}");
    }
}

#[test]
fn what_cannot_stream_in_depth_first_order_is_refused() {
    let config = shared(Sharing::STREAMED);
    let ploc = EmitterKind::Ploc(PlocConfig::DEFAULT);
    for config in [
        BuildConfig { emitter: ploc, ..config },
        BuildConfig { top_level: TopLevel::Binned(Binned::default()), ..config },
        BuildConfig { compression: Some(Compression::DEFAULT), ..config },
        shared(Sharing::TOP_DOWN),
        shared(Sharing { margin: 6, ..Sharing::STREAMED }),
        shared(Sharing { flatness: 32, ..Sharing::STREAMED }),
    ] {
        let error =
            try_build(&procedural("sphereflake:0").triangles, config).unwrap_err().to_string();
        assert!(error.contains("shared-plane"), "{error}");
    }
}

#[test]
fn corrupt_words_give_an_answer_or_an_error_and_never_a_hang() {
    let (mut unreadable, mut fine) = (0, 0);
    for seed in 0..2000 {
        let mut random = Random::new(SEED + seed / 100);
        let triangles = soup(&mut random, 60);
        let mut run = build(&triangles, shared(Sharing::STREAMED));
        let bounds = triangles.iter().map(Triangle::bounds).reduce(|a, b| a.union(&b)).unwrap();
        let mut random = Random::stream(SEED, seed);
        let tree = &run.scene.tree;
        let (from, len) = (tree.nodes.base.0 as usize, 8 * tree.node_count as usize);
        for _ in 0..1 + random.below(6) {
            let at = from + random.below(len);
            match random.below(3) {
                0 => run.memory.bytes_mut()[at] = 0xff,
                1 => run.memory.bytes_mut()[at] = random.bits() as u8,
                _ => run.memory.bytes_mut()[at] ^= 1 << random.below(8),
            }
        }
        let NodeFormat::Shared(_) = tree.format else { panic!("not shared") };
        match run.check() {
            Ok(_) => fine += 1,
            Err(RunError::Malformed(Malformed::Unreadable(_))) => unreadable += 1,
            Err(_) => {}
        }
        for _ in 0..4 {
            let (_, ray) = hard_ray(&mut random, &triangles, &bounds);
            for query in [Query::Closest, Query::Any] {
                if let Ok(Some(hit)) = trace(&mut run.memory.snapshot(), &run.scene, &ray, query) {
                    assert!((hit.primitive.0 as usize) < triangles.len());
                }
            }
        }
    }
    assert!(unreadable > 100 && fine > 10, "{unreadable} unreadable, {fine} fine");
}

#[test]
fn a_build_of_the_bunny_moves_less_than_100_bytes_a_primitive() {
    let Ok(bunny) = scene::load("bunny", &LoadOptions::default()) else {
        println!(
            "skipped: a_build_of_the_bunny_moves_less_than_100_bytes_a_primitive: no bunny; set XYLEM_SCENES"
        );
        return;
    };
    let sort = SortConfig { record: RecordFormat::Packed22, ..SortConfig::PAPER };
    let input = InputFormat::Triangle40;
    let run = build(&bunny.triangles, BuildConfig { sort, input, ..shared(Sharing::STREAMED) });
    let bytes = run.traffic.total().bytes();
    assert!(bytes < 100 * bunny.triangles.len() as u64, "{bytes}");
}
