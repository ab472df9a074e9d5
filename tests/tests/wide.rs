//! Wide trees, streamed: against the exact tree and against a collapse from the root down.

use proptest::prelude::*;
use xylem::bus::FlatMemory;
use xylem::run::{self, BuildOptions, BuildRun};
use xylem::scene::Random;
use xylem_core::compress::{Compression, Placement};
use xylem_core::error::ConfigError;
use xylem_core::geom::Triangle;
use xylem_core::mem::{Bus, ByteAddr};
use xylem_core::node::{
    Bvh2Node, Bvh2View, Child, NodeIndex, Quantization, Subtree, WideNode, WideView,
};
use xylem_core::pipeline::BuildConfig;
use xylem_core::toplevel::{Binned, TopLevel};
use xylem_core::traverse::{Method, Query, Scene, trace_by};
use xylem_tests::cases::for_all;
use xylem_tests::places::procedural;
use xylem_tests::rays::hard_ray;
use xylem_tests::streams::{assert_same_hits, compressions, tree};
use xylem_tests::trees::soup;

const SEED: u64 = 0x41de;

fn build(triangles: &[Triangle], config: BuildConfig) -> BuildRun {
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{config:?}: {e}"))
}

fn wide(compression: Compression) -> BuildConfig {
    let compression = Some(compression);
    BuildConfig { compression, collapse: true, max_leaf_size: 4, ..BuildConfig::default() }
}

fn exact(triangles: &[Triangle]) -> BuildRun {
    build(triangles, BuildConfig { max_leaf_size: 4, ..BuildConfig::default() })
}

#[test]
fn every_way_of_streaming_wide_nodes_keeps_every_hit() {
    for_all(
        SEED,
        120,
        (compressions(1..=2), 0..400usize, any::<u64>()),
        |(compression, count, seed)| {
            let mut random = Random::new(seed);
            let triangles = soup(&mut random, count);
            let run = build(&triangles, wide(compression));
            run.check().unwrap_or_else(|e| panic!("{compression:?}: {e}"));
            assert_same_hits(&triangles, tree(&exact(&triangles)), tree(&run), &mut random);
            Ok(())
        },
    );
}

#[test]
fn procedural_scenes_keep_every_hit() {
    for name in ["cornell", "sphereflake:3", "cloth:64"] {
        let triangles = procedural(name).triangles;
        let run = build(&triangles, wide(Compression::DEFAULT));
        let quality = run.check().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(quality.depth > 1, "{name}");
        assert_same_hits(&triangles, tree(&exact(&triangles)), tree(&run), &mut Random::new(SEED));
    }
}

/// A node of the reference: the parts that a binary node opens, and which of them are nodes.
struct Opened {
    parts: Vec<(Subtree, Option<Box<Opened>>)>,
}

/// The collapse by its definition, on the finished tree.
fn open(memory: &mut FlatMemory, tree: &xylem_core::node::Tree, child: &Subtree) -> Opened {
    let Child::Inner(NodeIndex(index)) = child.child else {
        return Opened { parts: vec![(*child, None)] };
    };
    let mut bytes = [0; Bvh2Node::BYTES];
    let addr = tree.nodes.record(index, Bvh2Node::BYTES as u32).unwrap();
    memory.read(addr, &mut bytes).unwrap();
    let children = Bvh2View::new(&bytes).to_repr().unwrap().children;
    let mut lists = children.each_ref().map(|child| open(memory, tree, child));
    let mut order = [0, 1];
    order.sort_by_key(|&i| std::cmp::Reverse(children[i].bounds.half_area()));
    // The larger one opens first if the other still has a place, then the smaller one.
    let mut places = [1, 1];
    for i in order {
        if lists[i].parts.len() + places[1 - i] <= WideNode::CHILDREN {
            places[i] = lists[i].parts.len();
        }
    }
    let mut parts = Vec::new();
    for i in 0..2 {
        let list = std::mem::replace(&mut lists[i], Opened { parts: Vec::new() });
        if places[i] == list.parts.len() {
            parts.extend(list.parts);
        } else {
            parts.push((children[i], Some(Box::new(list))));
        }
    }
    Opened { parts }
}

/// Compares a wide node in memory with what a pass from the root down writes for the reference.
fn compare(run: &BuildRun, index: u32, node: &Opened, place: Placement, q: &Quantization) -> u32 {
    let len = q.wide_bytes();
    let mut bytes = [0; WideNode::MAX_BYTES];
    let at = ByteAddr(run.scene.tree.nodes.base.0 + index * len);
    bytes[..len as usize].copy_from_slice(run.bytes_at(at, len.into()));
    let found = WideView::new(&bytes, q.bits).to_repr();
    assert_eq!(found.children.iter().flatten().count(), node.parts.len());
    let mut count = 1;
    for (found, (part, below)) in found.children.iter().flatten().zip(&node.parts) {
        let (wanted, cells) = place.encode(&part.bounds, part.child, q).unwrap();
        assert_eq!((found.low, found.high), (wanted.low, wanted.high), "node {index}");
        match (found.child, below) {
            (Child::Inner(NodeIndex(index)), Some(below)) => {
                count += compare(run, index, below, place.child(&cells, q), q);
            }
            (Child::Leaf { first, .. }, None) => {
                assert!(matches!(part.child, Child::Leaf { first: f, .. } if f == first));
            }
            other => panic!("{:?} in place of {:?}", other.0, part),
        }
    }
    count
}

#[test]
fn streamed_nodes_are_those_of_a_collapse_from_the_root_down() {
    for_all(SEED ^ 1, 60, (compressions(1..=2), 2..500usize, any::<u64>()), |(c, count, seed)| {
        // With P3's guess a repair loses nothing.
        let compression = Compression { margin: 0, ..c };
        let triangles = soup(&mut Random::new(seed), count);
        let (exact, run) = (exact(&triangles), build(&triangles, wide(compression)));
        let (Some(root), Some(found)) = (exact.scene.tree.root, run.scene.tree.root) else {
            panic!("no root")
        };
        assert_eq!(root.bounds, found.bounds);
        let Child::Inner(NodeIndex(index)) = found.child else {
            assert_eq!(run.scene.tree.node_count, 0);
            return Ok(());
        };
        let mut memory = exact.memory.clone();
        let reference = open(&mut memory, &exact.scene.tree, &root);
        let q = &compression.quantization;
        let place = Placement::root(&root.bounds, q).unwrap();
        assert_eq!(compare(&run, index, &reference, place, q), run.scene.tree.node_count);
        Ok(())
    });
}

#[test]
fn wide_trees_have_fewer_nodes_and_no_more_bytes_than_pairs() {
    let triangles = procedural("sphereflake:3").triangles;
    let run = build(&triangles, wide(Compression::DEFAULT));
    let pairs = exact(&triangles).scene.tree.node_count;
    let nodes = run.scene.tree.node_count;
    assert!(2 * nodes <= pairs + 1, "{nodes} of {pairs}");
}

#[test]
fn builds_that_cannot_stream_wide_nodes_are_refused() {
    let top_level = TopLevel::Binned(Binned::default());
    let config = wide(Compression::DEFAULT);
    for config in [BuildConfig { compression: None, ..config }, BuildConfig { top_level, ..config }]
    {
        assert_eq!(config.check(), Err(ConfigError::Collapse));
    }
    assert_eq!(config.check(), Ok(()));
}

/// Damages single bytes of nodes; each search and check must end, with an answer or a typed error.
#[test]
fn damaged_wide_nodes_give_an_answer_or_a_typed_error() {
    let mut random = Random::new(SEED);
    let triangles = soup(&mut random, 300);
    let bounds =
        triangles.iter().map(Triangle::bounds).reduce(|a, b| a.union(&b)).expect("there are some");
    let run = build(&triangles, wide(Compression::DEFAULT));
    let Scene { tree, .. } = run.scene;
    let (base, size) = (tree.nodes.base.0 as usize, tree.node_count as usize * 32);
    let (mut corrupt, mut sound) = (0, 0);
    for _ in 0..20_000 {
        let mut memory = run.memory.clone();
        for _ in 0..=random.below(3) {
            memory.bytes_mut()[base + random.below(size)] ^= 1 << random.below(8);
        }
        let (_, ray) = hard_ray(&mut random, &triangles, &bounds);
        for method in Method::ALL {
            match trace_by(method, &mut memory, &run.scene, &ray, Query::Closest, &mut ()) {
                Ok(_) => sound += 1,
                Err(_) => corrupt += 1,
            }
        }
        if run::check(&memory, &run.scene).is_err() {
            corrupt += 1;
        }
    }
    assert!(corrupt > 1000 && sound > 1000, "{corrupt} {sound}");
}
