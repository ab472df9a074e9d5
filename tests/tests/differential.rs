//! Every way to build gives the same tree, and it is the tree of the definition.

use std::collections::BTreeSet;

use rayon::prelude::*;
use xylem::run::{self, BuildOptions, BuildRun};
use xylem::scene::Random;
use xylem_core::compress::Placement;
use xylem_core::geom::Triangle;
use xylem_core::node::{Bvh2Node, Child, LeafEntry, Quantization};
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::{InputFormat, ReadSchedule, RecordFormat, SortConfig};
use xylem_tests::lbvh::{Lbvh, morton_code};
use xylem_tests::places;
use xylem_tests::trees::{Forest, soup};

const SEED: u64 = 0x5eed_0d1f;

const RECORDS: [RecordFormat; 3] =
    [RecordFormat::Box32, RecordFormat::Packed22, RecordFormat::Pair8];
const INPUTS: [InputFormat; 2] = [InputFormat::Box32, InputFormat::Triangle40];

/// Named inputs: all procedural scenes in small, random ones, and orders that are special.
fn inputs() -> Vec<(String, Vec<Triangle>)> {
    let random = soup(&mut Random::new(SEED), 2500);
    let mut sorted = random.clone();
    sorted.sort_by_key(|t| morton_code(&t.bounds(), MortonWidth::Bits30));
    let reversed = sorted.iter().rev().copied().collect();
    let equal = vec![random[0]; 1500];
    let mut inputs = vec![
        ("random".to_owned(), random),
        ("sorted".to_owned(), sorted),
        ("reversed".to_owned(), reversed),
        ("all equal".to_owned(), equal),
    ];
    for count in [1, 2, 3, 63, 64, 65, 129] {
        inputs.push((
            format!("random {count}"),
            soup(&mut Random::new(SEED + count), count as usize),
        ));
    }
    inputs.extend(places::small_scenes().into_iter().map(|name| {
        let mesh = places::procedural(&name);
        (name, mesh.triangles)
    }));
    inputs
}

fn build(triangles: &[Triangle], config: BuildConfig) -> BuildRun {
    let options = BuildOptions { config, ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{config:?}: {e}"))
}

/// The bytes of nodes and leaf table, and the root.
fn tree_of(run: &BuildRun) -> Lbvh {
    let tree = &run.exact.expect("the nodes are exact").tree;
    let part = |base, count: u32, bytes: usize| {
        run.bytes_at(base, u64::from(count) * bytes as u64).to_vec()
    };
    Lbvh {
        nodes: part(tree.nodes.base, tree.node_count, Bvh2Node::BYTES),
        leaf_table: part(tree.leaf_table.base, tree.entry_count, LeafEntry::BYTES),
        root: tree.root,
    }
}

fn assert_same(what: &str, run: &BuildRun, expect: &Lbvh) {
    let tree = tree_of(run);
    assert_eq!(tree.root, expect.root, "{what}: root");
    let differs = |a: &[u8], b: &[u8]| a.iter().zip(b).position(|(a, b)| a != b);
    let nodes = differs(&tree.nodes, &expect.nodes).map(|at| at / Bvh2Node::BYTES);
    assert_eq!(nodes, None, "{what}: first node that differs");
    assert_eq!(tree.nodes.len(), expect.nodes.len(), "{what}: nodes");
    assert_eq!(tree.leaf_table, expect.leaf_table, "{what}: leaf table");
}

/// How many merge passes write runs back, from the definition: runs are merged `width` at a time.
fn passes(count: usize, sort: &SortConfig) -> u64 {
    let mut runs = count.div_ceil(sort.capacity as usize);
    let mut passes = 0;
    while runs > sort.width() as usize {
        runs = runs.div_ceil(sort.width() as usize);
        passes += 1;
    }
    passes
}

/// Bytes moved by a build: the input is read once (again for pairs, which hold no box), runs are
/// written and read once a pass, and nodes and leaf table are written once.
fn traffic(count: u64, nodes: u64, config: &BuildConfig, passes: u64) -> u64 {
    let input = u64::from(config.input.bytes());
    let record = u64::from(config.sort.record.bytes());
    let fetched = if config.sort.record == RecordFormat::Pair8 { 2 } else { 1 };
    count * (fetched * input + 2 * record * (1 + passes) + 4) + 64 * nodes
}

#[test]
fn every_configuration_gives_the_tree_of_the_definition_and_the_traffic_of_the_formula() {
    let inputs = inputs();
    let mut configs = Vec::new();
    for record in RECORDS {
        for input in INPUTS {
            for capacity in (6..=13).map(|bits| 1 << bits) {
                for burst in [1, 2, 4, 8, 16, 32].into_iter().filter(|b| 4 * b <= capacity) {
                    for schedule in [ReadSchedule::DoubleBuffer, ReadSchedule::Forecast] {
                        let sort = SortConfig { capacity, burst, record, schedule };
                        configs.push(BuildConfig { input, sort, ..BuildConfig::default() });
                    }
                }
            }
        }
    }
    let mut seen = BTreeSet::new();
    for (name, triangles) in &inputs {
        let expect = Lbvh::new(triangles, MortonWidth::Bits30, 255);
        let count = triangles.len() as u64;
        let found: Vec<_> = configs
            .par_iter()
            .map(|config| {
                let run = build(triangles, *config);
                let what = format!("{name}, {config:?}");
                assert_same(&what, &run, &expect);
                let passes = passes(triangles.len(), &config.sort);
                let nodes = u64::from(run.exact.expect("the nodes are exact").tree.node_count);
                let bytes = traffic(count, nodes, config, passes);
                assert_eq!(run.traffic.total().bytes(), bytes, "{what}: traffic, {passes} passes");
                passes
            })
            .collect();
        seen.extend(found);
    }
    println!(
        "{} configurations of {} scenes; further merge passes {seen:?}; seed {SEED:#x}",
        configs.len(),
        inputs.len()
    );
    assert!(seen.is_superset(&BTreeSet::from([0, 1, 2, 3])), "{seen:?}");
}

#[test]
fn every_code_width_and_leaf_size_gives_the_tree_of_the_definition() {
    let inputs = inputs();
    let mut leaves = 0;
    for (name, triangles) in &inputs {
        for morton in [MortonWidth::Bits30, MortonWidth::Bits63] {
            for max_leaf_size in [1, 2, 3, 8, 255] {
                let expect = Lbvh::new(triangles, morton, max_leaf_size);
                for record in RECORDS {
                    if record == RecordFormat::Pair8 && morton == MortonWidth::Bits63 {
                        continue;
                    }
                    let sort = SortConfig { capacity: 256, burst: 8, record, ..SortConfig::PAPER };
                    let config =
                        BuildConfig { morton, max_leaf_size, sort, ..BuildConfig::default() };
                    let run = build(triangles, config);
                    assert_same(&format!("{name}, {config:?}"), &run, &expect);
                    let quality = run.check().unwrap_or_else(|e| panic!("{name}, {config:?}: {e}"));
                    assert!(quality.largest_leaf <= max_leaf_size);
                    leaves += u64::from(run.exact.expect("the nodes are exact").tree.leaf_count);
                }
            }
        }
    }
    println!(
        "{} scenes, 30- and 63-bit codes, leaves of 1, 2, 3, 8 and 255: {leaves} leaves",
        inputs.len()
    );
}

#[test]
fn every_format_is_well_formed_and_encloses_the_exact_tree() {
    let mut nodes = 0;
    for (name, triangles) in inputs() {
        let forest = Forest::grow(&triangles);
        for (format, scene) in forest.scenes() {
            let quality = forest.check(scene).unwrap_or_else(|e| panic!("{name}, {format}: {e:?}"));
            assert!(quality.depth <= 64, "{name}, {format}: {quality:?}");
        }
        nodes += decode_both(&name, &forest);
    }
    println!("{nodes} nodes decode to the same boxes in both coordinates");
}

/// Walks the quantized trees; returns how many nodes there were.
fn decode_both(name: &str, forest: &Forest) -> u32 {
    let Some(root) = forest.exact.tree.root else { return 0 };
    let mut stack = vec![(
        root.child,
        Placement::root(&root.bounds, &Quantization::RELATIVE).expect("the root is on the grid"),
    )];
    let mut nodes = 0;
    while let Some((child, placement)) = stack.pop() {
        let Child::Inner(index) = child else { continue };
        nodes += 1;
        let (relative, modulo) =
            (forest.pair(&forest.relative, index), forest.pair(&forest.modulo, index));
        for (relative, modulo) in relative.children.iter().zip(&modulo.children) {
            assert_eq!(relative.child, modulo.child, "{name}: node {index:?}");
            let cells = placement.context.decode(relative, &Quantization::RELATIVE);
            assert_eq!(cells, placement.context.decode(modulo, &Quantization::MODULO), "{name}");
            let cells = cells.unwrap_or_else(|| panic!("{name}: node {index:?} leaves its parent"));
            stack.push((relative.child, placement.child(&cells, &Quantization::RELATIVE)));
        }
    }
    assert_eq!(nodes, forest.exact.tree.node_count, "{name}");
    nodes
}
