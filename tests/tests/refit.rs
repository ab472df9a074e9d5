//! Refitting over memory: what has not moved keeps its bytes, what has moved gets exact boxes and the
//! hits of a fresh build, at the traffic promised; faults and corrupt memory are named.

use std::collections::BTreeMap;

use xylem::bus::{Fault, Faulty, FaultyError, FlatMemory, MEMORIES};
use xylem::run::{self, BuildOptions, BuildRun, RefitError, RefitMethod, RefitRun};
use xylem::scene::Random;
use xylem_core::compress::{Compression, Repairs};
use xylem_core::emit::{EmitterKind, PlocConfig};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::geom::{Aabb, Triangle};
use xylem_core::mem::Region;
use xylem_core::node::{
    Bvh2Node, Bvh2View, Child, Coordinates, LeafEntry, NodeFormat, NodeIndex, Quantization,
    Subtree, Tree,
};
use xylem_core::num::Grid;
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::refit::{InPlace, refit};
use xylem_core::sort::RecordFormat;
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};
use xylem_core::traverse::Query;
use xylem_tests::job::Job;
use xylem_tests::places;
use xylem_tests::rays::hard_ray;
use xylem_tests::trees::soup;

const SEED: u64 = 0x5eed_0ef1;

const FORMATS: [NodeFormat; 4] = [
    NodeFormat::Bvh2,
    NodeFormat::Quantized(Quantization::RELATIVE),
    NodeFormat::Quantized(Quantization::MODULO),
    NodeFormat::Quantized(Quantization { bits: 8, ..Quantization::MODULO }),
];

/// Ways to refit a quantized tree in place, of which the format is replaced.
fn streams() -> Vec<Compression> {
    let with = |treelet_depth, margin, repairs| Compression {
        treelet_depth,
        margin,
        repairs,
        ..Compression::DEFAULT
    };
    let lines = Repairs::InLines(8);
    vec![
        with(1, 0, Repairs::InMemory),
        with(2, 1, Repairs::InMemory),
        with(3, 0, lines),
        with(4, 1, lines),
    ]
}

/// Whether a method gives the tree that is compressed from the root down, byte by byte: estimates with
/// a margin may leave grids coarser.
fn is_canonical(method: &RefitMethod) -> bool {
    !matches!(method, RefitMethod::InPlace(compression) if compression.margin > 0)
}

/// Ways to refit a tree of a format.
fn methods(format: NodeFormat) -> Vec<RefitMethod> {
    match format {
        NodeFormat::Bvh2 => vec![RefitMethod::InPlace(Compression::DEFAULT)],
        NodeFormat::Wide(_) | NodeFormat::Shared(_) => Vec::new(),
        NodeFormat::Quantized(_) => [RefitMethod::TopDown]
            .into_iter()
            .chain(streams().into_iter().map(RefitMethod::InPlace))
            .collect(),
    }
}

fn refit_run(
    what: &str,
    run: &mut BuildRun,
    triangles: &[Triangle],
    method: &RefitMethod,
) -> RefitRun {
    let done = run::refit(run, triangles, method, MEMORIES[0]);
    done.unwrap_or_else(|e| panic!("{what}, {method:?}: {e}"))
}

/// Builders whose nodes come in different orders.
fn builders() -> Vec<(&'static str, BuildConfig)> {
    let plain = BuildConfig::default();
    let binned = TopLevel::Binned(Binned { bins: Bins::Sixteen });
    let treelets = TopLevel::Atrbvh(Atrbvh { treelet: 8, iterations: 2, start: None });
    vec![
        ("lbvh", plain),
        ("one primitive a leaf", BuildConfig { max_leaf_size: 1, ..plain }),
        ("joined leaves", BuildConfig { join_leaves: 8, ..plain }),
        ("ploc", BuildConfig { emitter: EmitterKind::Ploc(PlocConfig::DEFAULT), ..plain }),
        ("binned top", BuildConfig { top_level: binned, ..plain }),
        ("atrbvh top", BuildConfig { top_level: treelets, ..plain }),
    ]
}

fn inputs() -> Vec<(String, Vec<Triangle>)> {
    let random = soup(&mut Random::new(SEED), 1500);
    let mut inputs =
        vec![("all equal".to_owned(), vec![random[0]; 700]), ("random".into(), random)];
    for count in [0, 1, 2, 3, 17] {
        inputs.push((format!("random {count}"), soup(&mut Random::new(SEED), count)));
    }
    let small = places::small_scenes().into_iter();
    inputs.extend(small.map(|name| (name.clone(), places::procedural(&name).triangles)));
    inputs
}

fn build(triangles: &[Triangle], config: BuildConfig, format: NodeFormat) -> BuildRun {
    let options = BuildOptions { config, format, ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{config:?}: {e}"))
}

/// Moves every vertex by itself, by up to 2^`bits` units, and some triangles far away.
fn deform(random: &mut Random, triangles: &[Triangle], bits: u32) -> Vec<Triangle> {
    let grid = Grid::DEFAULT;
    let mut moved = triangles.to_vec();
    for triangle in &mut moved {
        let far = if random.below(50) == 0 { 22 } else { bits };
        for c in triangle.vertices.iter_mut().flat_map(|v| v.as_mut()) {
            let step = (random.bits() >> (64 - far)) as i32 - (1 << (far - 1));
            *c = (*c + step).clamp(grid.min(), grid.max());
        }
    }
    moved
}

/// The bytes of a tree's nodes.
fn nodes_of(run: &BuildRun, tree: &Tree) -> Vec<u8> {
    let bytes = u64::from(tree.node_count) * u64::from(tree.format.bytes());
    run.bytes_at(tree.nodes.base, bytes).to_vec()
}

/// Checks every box of the exact tree against the triangles below it, from scratch.
fn assert_exact(what: &str, run: &BuildRun, triangles: &[Triangle]) {
    let tree = &run.exact.expect("a tree of exact boxes").tree;
    let nodes = nodes_of(run, tree);
    let nodes: Vec<_> = nodes
        .chunks_exact(Bvh2Node::BYTES)
        .map(|bytes| Bvh2View::new(bytes.try_into().unwrap()).to_repr())
        .map(|node| node.unwrap_or_else(|| panic!("{what}: a broken node")))
        .collect();
    let table = run.bytes_at(tree.leaf_table.base, u64::from(tree.entry_count) * 4);
    let primitive = |entry: u32| {
        let bytes = table[4 * entry as usize..][..LeafEntry::BYTES].try_into().unwrap();
        LeafEntry::from_bytes(bytes).primitive.0 as usize
    };
    let of_leaf = |first: u32, count: u32| {
        (first..first + count)
            .map(|entry| triangles[primitive(entry)].bounds())
            .reduce(|a, b| a.union(&b))
            .unwrap()
    };
    // Children come before their parents.
    let mut boxes: Vec<Aabb> = Vec::new();
    let check = |boxes: &[Aabb], subtree: &Subtree| {
        let exact = match subtree.child {
            Child::Leaf { first, count } => of_leaf(first, count),
            Child::Inner(NodeIndex(index)) => boxes[index as usize],
        };
        assert_eq!(subtree.bounds, exact, "{what}: {:?}", subtree.child);
        exact
    };
    for node in &nodes {
        let [a, b] = node.children.each_ref().map(|child| check(&boxes, child));
        boxes.push(a.union(&b));
    }
    if let Some(root) = &tree.root {
        check(&boxes, root);
    }
}

#[test]
fn a_tree_whose_triangles_have_not_moved_keeps_every_byte() {
    for (name, triangles) in inputs() {
        for (builder, config) in builders() {
            for format in FORMATS {
                let built = build(&triangles, config, format);
                let cost = built.exact.map(|exact| run::check(&built.memory, &exact).unwrap());
                let cost = cost.expect("a tree of exact boxes").sah_cost();
                for method in methods(format) {
                    let what = format!("{name}, {builder}, {format:?}");
                    let mut run = build(&triangles, config, format);
                    let done = refit_run(&what, &mut run, &triangles, &method);
                    assert_eq!(run.scene, built.scene, "{what}, {method:?}");
                    let exact = format == NodeFormat::Bvh2 || is_canonical(&method);
                    let same = |a: &BuildRun, b: &BuildRun| a.memory.bytes() == b.memory.bytes();
                    assert!(same(&run, &built) || !exact, "{what}, {method:?}");
                    let before = run.memory.clone();
                    refit_run(&what, &mut run, &triangles, &method);
                    assert!(run.memory.bytes() == before.bytes(), "{what}, {method:?}: twice");
                    assert_eq!(done.cost, cost, "{what}, {method:?}: the cost of the walk");
                }
            }
        }
    }
}

#[test]
fn moved_triangles_get_exact_boxes_and_the_hits_of_a_fresh_build() {
    let (mut rays_traced, mut hits) = (0, 0);
    for (i, (name, triangles)) in (0..).zip(inputs()) {
        let mut random = Random::stream(SEED, i);
        let moved = deform(&mut random, &triangles, 4 + (i as u32 * 5) % 20);
        let bounds = moved.iter().map(Triangle::bounds).reduce(|a, b| a.union(&b));
        let rays: Vec<_> = bounds.map_or(Vec::new(), |bounds| {
            (0..100).map(|_| Some(hard_ray(&mut random, &moved, &bounds).1)).collect()
        });
        let fresh = build(&moved, BuildConfig::default(), NodeFormat::Bvh2);
        let expect = [Query::Closest, Query::Any]
            .map(|query| run::trace(&fresh.memory, &fresh.scene, &rays, query).unwrap().hits);
        for (builder, config) in builders() {
            for format in FORMATS {
                let what = format!("{name}, {builder}, {format:?}");
                let built = build(&triangles, config, format);
                let mut nodes: Option<Vec<u8>> = None;
                for method in methods(format) {
                    let mut run = build(&triangles, config, format);
                    refit_run(&what, &mut run, &moved, &method);
                    let what = format!("{what}, {method:?}");
                    assert_eq!(
                        run.scene.tree.root.map(|r| r.child),
                        built.scene.tree.root.map(|r| r.child)
                    );
                    if run.exact.is_some() {
                        assert_exact(&what, &run, &moved);
                    }
                    run.check().unwrap_or_else(|e| panic!("{what}: {e}"));
                    if is_canonical(&method) {
                        let bytes = nodes_of(&run, &run.scene.tree);
                        let first = nodes.get_or_insert_with(|| bytes.clone());
                        assert!(*first == bytes, "{what}: other bytes");
                    }
                    let trace =
                        |query| run::trace(&run.memory, &run.scene, &rays, query).unwrap().hits;
                    assert_eq!(trace(Query::Closest), expect[0], "{what}");
                    let any: Vec<_> = trace(Query::Any).iter().map(Option::is_some).collect();
                    let expect_any: Vec<_> = expect[1].iter().map(Option::is_some).collect();
                    assert_eq!(any, expect_any, "{what}");
                    rays_traced += rays.len();
                }
            }
        }
        hits += expect[0].iter().flatten().count();
    }
    println!("{rays_traced} rays through refitted trees, {hits} different hits");
    assert!(hits > 500, "{hits}");
}

/// Trees that were compressed as they were built have an order of their own.
#[test]
fn trees_that_were_built_compressed_refit_in_place_through_many_frames() {
    for (i, (name, triangles)) in (0..).zip(inputs()) {
        for (builder, config) in builders() {
            let mut random = Random::stream(SEED, i);
            let ploc = config.emitter != EmitterKind::Lbvh;
            for mut compression in streams() {
                compression.quantization.coordinates = match i % 2 {
                    0 => Coordinates::Relative,
                    _ => Coordinates::Modulo,
                };
                let built = Compression {
                    treelet_depth: if ploc { 1 } else { compression.treelet_depth },
                    ..compression
                };
                let config = BuildConfig { compression: Some(built), ..config };
                let mut run = build(&triangles, config, config.format());
                let mut moved = triangles.clone();
                for frame in 0..3 {
                    let what = format!("{name}, {builder}, {compression:?}, frame {frame}");
                    moved = deform(&mut random, &moved, 10 + 4 * frame);
                    let method = RefitMethod::InPlace(compression);
                    let done = refit_run(&what, &mut run, &moved, &method);
                    assert!(run.exact.is_none());
                    run.check().unwrap_or_else(|e| panic!("{what}: {e}"));
                    // The cost is that of exact boxes: the tree of 64-byte nodes has it.
                    let root = run.scene.tree.root.map(|root| root.bounds);
                    let bounds = moved.iter().map(Triangle::bounds).reduce(|a, b| a.union(&b));
                    assert_eq!(root, bounds, "{what}");
                    assert_eq!(done.cost == 0, moved.is_empty(), "{what}");
                }
            }
        }
    }
    let compressed =
        BuildConfig { compression: Some(Compression::DEFAULT), ..BuildConfig::default() };
    let triangles = soup(&mut Random::new(SEED), 9);
    let mut run = build(&triangles, compressed, compressed.format());
    let error = run::refit(&mut run, &triangles, &RefitMethod::TopDown, MEMORIES[0]).unwrap_err();
    assert_eq!(error, RefitError::NoRoom);
    let error = run::refit(&mut run, &triangles[1..], &RefitMethod::TopDown, MEMORIES[0]);
    assert_eq!(error.unwrap_err(), RefitError::Triangles { before: 9, after: 8 });
}

/// P3 §5.2, in bytes: nodes twice, entries and triangles once, a line of 64 bytes read and written for
/// each repair; and the baseline.
#[test]
fn a_refit_reads_a_tree_and_its_triangles_once_and_writes_its_nodes_once() {
    let sequential = ["lbvh", "one primitive a leaf", "joined leaves"];
    for (name, triangles) in inputs() {
        for (builder, config) in builders() {
            for format in FORMATS {
                for method in methods(format) {
                    let what = format!("{name}, {builder}, {format:?}, {method:?}");
                    let mut run = build(&triangles, config, format);
                    let Tree { node_count, entry_count, .. } = run.scene.tree;
                    let done = refit_run(&what, &mut run, &triangles, &method);
                    let of = |region: RegionName| {
                        let key = (Stage::Refit, Some(region.as_str()));
                        done.traffic.tallies.get(&key).copied().unwrap_or_default()
                    };
                    let own = match format {
                        NodeFormat::Bvh2 => RegionName::Nodes,
                        _ => RegionName::QuantizedNodes,
                    };
                    let stride = u64::from(format.bytes());
                    let (nodes, entries) = (u64::from(node_count), u64::from(entry_count));
                    assert_eq!(of(RegionName::Triangles).read_bytes, 40 * entries, "{what}");
                    let table = of(RegionName::LeafTable).read_bytes;
                    // Orders other than that of the walk use lines in parts.
                    let exact = sequential.contains(&builder);
                    assert!(
                        table == 4 * entries || !exact && table <= 64 * entries,
                        "{what}: {table}"
                    );
                    let read = of(own).read_bytes;
                    let least = stride * nodes;
                    // A node of 20 bytes may lie in two lines.
                    let most = if exact { least } else { 128 * nodes };
                    assert!((least..=most).contains(&read), "{what}: {read} of {least}");
                    let compress = done.traffic.stage(Stage::Compress);
                    match method {
                        RefitMethod::TopDown => {
                            assert_eq!(of(RegionName::Nodes).write_bytes, 64 * nodes, "{what}");
                            let both = (compress.read_bytes, compress.write_bytes);
                            assert_eq!(both, (64 * nodes, stride * nodes), "{what}");
                        }
                        RefitMethod::InPlace(Compression {
                            repairs: Repairs::InMemory, ..
                        }) => {
                            assert_eq!(of(own).write_bytes, stride * nodes, "{what}");
                            // A line may be cut off by the end of the region.
                            let repairs = done.compressor.backtracks();
                            let two = if stride == 20 { 2 } else { 1 };
                            assert!(compress.bytes() <= two * 128 * repairs, "{what}");
                            assert_eq!(compress.bytes() > 0, repairs > 0, "{what}");
                        }
                        RefitMethod::InPlace(_) => {}
                    }
                }
            }
        }
    }
}

#[test]
fn whichever_access_fails_the_error_names_it() {
    let job = Job::new(&mut Random::new(SEED), 200, RecordFormat::Box32);
    let mut memory = job.memory.clone();
    let exact = job.build(&mut memory, &mut ()).unwrap();
    let triangles = (job.layout.triangles, job.triangles.len() as u32);
    let mut tried = BTreeMap::new();
    for format in &FORMATS[..3] {
        let tree = match format {
            NodeFormat::Bvh2 => exact,
            NodeFormat::Wide(_) | NodeFormat::Shared(_) => continue,
            NodeFormat::Quantized(q) => job.compress(&mut memory, &exact, q, &mut ()).unwrap(),
        };
        let run = |bus: &mut Faulty<FlatMemory>| {
            refit(bus, &tree, triangles, &mut InPlace { nodes: exact.nodes }, &mut ())
        };
        let mut good = Faulty::new(memory.clone(), Fault::Access(u64::MAX));
        run(&mut good).unwrap();
        for access in 0..good.accesses() {
            let failure = run(&mut Faulty::new(memory.clone(), Fault::Access(access)));
            let injected = FaultyError::Injected { access };
            let Err(BuildError::Bus { stage: Stage::Refit, addr, error }) = failure else {
                panic!("access {access}: {failure:?}");
            };
            assert_eq!(error, injected);
            let hit = |(_, region): &(RegionName, Region)| {
                addr >= region.base && addr.0 < region.base.0 + region.size
            };
            let name = job.layout.named().into_iter().find(hit).expect("a region").0;
            *tried.entry(name.as_str()).or_insert(0) += 1;
        }
    }
    println!("every access of three refits failed once: {tried:?}");
    assert_eq!(tried.len(), 4, "{tried:?}");
}
