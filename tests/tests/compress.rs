//! Streaming compression against the pass from the root down and against the exact tree.

use glam::IVec3;
use proptest::prelude::*;
use xylem::bus::{Fault, Faulty, FaultyError, FlatMemory};
use xylem::run::{self, Buffers, BuildOptions, BuildRun};
use xylem::scene::Random;
use xylem_core::compress::{Compression, Compressor, HeldNode, Place, Repairs};
use xylem_core::emit::{CellConfig, EmitterKind, PlocConfig};
use xylem_core::error::{BuildError, RegionName};
use xylem_core::geom::{Aabb, Triangle};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{
    Bvh2Node, Child, Coordinates, NodeFormat, NodeIndex, Quantization, QuantizedPair,
    QuantizedView, Subtree,
};
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::sort::{RecordFormat, SortConfig};
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};
use xylem_tests::cases::for_all;
use xylem_tests::places::procedural;
use xylem_tests::streams::{assert_same_hits, compressions, tree};
use xylem_tests::trees::soup;

const SEED: u64 = 0xc0_4e55;

fn build(triangles: &[Triangle], config: BuildConfig) -> BuildRun {
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    let run = run::build(triangles, &options).unwrap_or_else(|e| panic!("{e}"));
    run.check().unwrap_or_else(|e| panic!("{config:?}: {e}"));
    run
}

fn top_down(triangles: &[Triangle], config: BuildConfig, quantization: Quantization) -> BuildRun {
    let config = BuildConfig { compression: None, ..config };
    let format = NodeFormat::Quantized(quantization);
    let options = BuildOptions { config, format, ..BuildOptions::default() };
    run::build(triangles, &options).unwrap_or_else(|e| panic!("{e}"))
}

/// The tree as nested boxes and leaves, which do not depend on where nodes are.
fn shape(run: &BuildRun) -> Vec<([[u8; 6]; 2], [bool; 2])> {
    let tree = &run.scene.tree;
    let NodeFormat::Quantized(quantization) = tree.format else { panic!("not quantized") };
    let len = quantization.node_bytes() as usize;
    let mut shape = Vec::new();
    let mut stack = Vec::from_iter(tree.root.map(|root| root.child));
    while let Some(child) = stack.pop() {
        let Child::Inner(NodeIndex(index)) = child else { continue };
        let mut bytes = [0; QuantizedPair::MAX_BYTES];
        let base = ByteAddr(tree.nodes.base.0 + index * len as u32);
        bytes[..len].copy_from_slice(run.bytes_at(base, len as u64));
        let pair = QuantizedView::new(&bytes, quantization.bits).to_repr();
        let corners = pair.children.map(|c| {
            let [a, b, d] = c.low;
            let [e, f, g] = c.high;
            [a, b, d, e, f, g]
        });
        let leaves = pair.children.map(|c| matches!(c.child, Child::Leaf { .. }));
        shape.push((corners, leaves));
        stack.extend(pair.children.map(|c| c.child));
    }
    shape
}

#[test]
fn every_way_of_compressing_keeps_every_hit() {
    for_all(
        SEED,
        120,
        (compressions(1..=4), 0..400usize, any::<u64>()),
        |(compression, count, seed)| {
            let mut random = Random::new(seed);
            let triangles = soup(&mut random, count);
            let sort = SortConfig { capacity: 64, burst: 8, ..SortConfig::PAPER };
            let plain = BuildConfig { sort, max_leaf_size: 3, ..BuildConfig::default() };
            let exact = build(&triangles, plain);
            let run = build(&triangles, BuildConfig { compression: Some(compression), ..plain });
            prop_assert_eq!(run.scene.tree.node_count, exact.scene.tree.node_count);
            if !triangles.is_empty() {
                assert_same_hits(&triangles, tree(&exact), tree(&run), &mut random);
            }
            Ok(())
        },
    );
}

#[test]
fn without_a_margin_the_streamed_tree_is_the_one_compressed_from_the_root_down() {
    for_all(
        SEED,
        100,
        (compressions(1..=4), 0..400usize, any::<u64>()),
        |(compression, count, seed)| {
            let compression = Compression { margin: 0, ..compression };
            let triangles = soup(&mut Random::new(seed), count);
            let config = BuildConfig { max_leaf_size: 3, ..BuildConfig::default() };
            let expect = top_down(&triangles, config, compression.quantization);
            let run = build(&triangles, BuildConfig { compression: Some(compression), ..config });
            prop_assert_eq!(shape(&run), shape(&expect));
            if compression.treelet_depth == 1 {
                let len = u64::from(run.scene.tree.node_count * run.scene.tree.format.bytes());
                let bytes = |run: &BuildRun| run.bytes_at(run.scene.tree.nodes.base, len).to_vec();
                prop_assert_eq!(bytes(&run), bytes(&expect));
            }
            Ok(())
        },
    );
}

#[test]
fn traffic_is_a_node_each_and_two_lines_a_repair() {
    for (name, depth, coordinates) in [
        ("sphereflake:1", 1, Coordinates::Relative),
        ("sphereflake:1", 2, Coordinates::Relative),
        ("terrain:6", 1, Coordinates::Modulo),
    ] {
        let quantization = Quantization { coordinates, ..Quantization::MODULO };
        let compression =
            Compression { quantization, treelet_depth: depth, ..Compression::DEFAULT };
        let compression = Some(compression);
        let run = build(
            &procedural(name).triangles,
            BuildConfig { compression, ..BuildConfig::default() },
        );
        let nodes = u64::from(run.scene.tree.node_count);
        let (repairs, mut emitted, mut repaired) = (run.compressor.backtracks(), 0, 0);
        for ((stage, region), tally) in &run.traffic.tallies {
            match stage {
                Stage::Emit if *region != Some(RegionName::LeafTable.as_str()) => {
                    emitted += tally.bytes()
                }
                Stage::Compress => repaired += tally.bytes(),
                _ => {}
            }
        }
        assert_eq!(run.compressor.nodes, nodes, "{name}");
        assert_eq!(emitted, 16 * nodes, "{name}");
        assert!(repairs > 0, "{name} repairs something");
        // The last line of the region may be short.
        assert!((128 * repairs - repaired) < 256, "{name}: {repaired} for {repairs} repairs");
    }
}

#[test]
fn treelets_and_modulo_coordinates_and_held_lines_each_save_traffic() {
    let triangles = procedural("terrain:6").triangles;
    let bytes = |quantization, treelet_depth, repairs| {
        let compression =
            Compression { quantization, treelet_depth, repairs, ..Compression::DEFAULT };
        let config = BuildConfig { compression: Some(compression), ..BuildConfig::default() };
        build(&triangles, config).traffic.total().bytes()
    };
    let (relative, modulo) = (Quantization::RELATIVE, Quantization::MODULO);
    let plain = bytes(relative, 1, Repairs::InMemory);
    assert!(bytes(relative, 2, Repairs::InMemory) < plain);
    assert!(bytes(modulo, 1, Repairs::InMemory) < plain);
    assert!(bytes(relative, 1, Repairs::InLines(16)) < plain);
    assert!(bytes(modulo, 2, Repairs::InMemory) <= bytes(modulo, 1, Repairs::InMemory));
}

#[test]
fn every_emitter_feeds_the_compressor() {
    let triangles = procedural("sphereflake:1").triangles;
    let binned = Binned { bins: Bins::Eight };
    let cells = CellConfig { capacity: 40, bits: 20 };
    let top = |top_level| BuildConfig { top_level, cells, ..BuildConfig::default() };
    let configs = [
        ("lbvh", BuildConfig::default()),
        ("joined leaves", BuildConfig { join_leaves: 4, ..BuildConfig::default() }),
        ("binned", top(TopLevel::Binned(binned))),
        ("atrbvh", top(TopLevel::Atrbvh(Atrbvh::default()))),
        (
            "ploc",
            BuildConfig {
                emitter: EmitterKind::Ploc(PlocConfig::DEFAULT),
                ..BuildConfig::default()
            },
        ),
    ];
    for (name, config) in configs {
        let exact = build(&triangles, config);
        for quantization in [Quantization::RELATIVE, Quantization::MODULO] {
            let deepest = if name == "ploc" { 1 } else { 4 };
            for treelet_depth in 1..=deepest {
                let compression =
                    Compression { quantization, treelet_depth, margin: 0, ..Compression::DEFAULT };
                let run =
                    build(&triangles, BuildConfig { compression: Some(compression), ..config });
                let expect = top_down(&triangles, config, quantization);
                assert_eq!(shape(&run), shape(&expect), "{name} {treelet_depth}");
                assert_same_hits(&triangles, tree(&exact), tree(&run), &mut Random::new(SEED));
            }
        }
    }
}

#[test]
fn deep_treelets_behind_the_clustering_emitter_are_refused() {
    let emitter = EmitterKind::Ploc(PlocConfig::DEFAULT);
    let compression = Some(Compression::DEFAULT);
    let config = BuildConfig { emitter, compression, ..BuildConfig::default() };
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    let error =
        run::build(&procedural("sphereflake:1").triangles, &options).unwrap_err().to_string();
    assert!(error.contains("treelets"), "{error}");
}

/// Builds on any bus.
fn on_bus<B: Bus>(
    bus: &mut B,
    triangles: &[Triangle],
    options: &BuildOptions,
) -> Result<(), BuildError<B::Error>> {
    let (_, layout) = run::load(triangles, &options.config).unwrap();
    let mut buffers = Buffers::new(&options.config);
    run::job(bus, &layout, options, triangles.len() as u32, &mut buffers, &mut ()).map(|_| ())
}

fn repairing() -> (Vec<Triangle>, BuildOptions, FlatMemory) {
    let triangles = soup(&mut Random::new(SEED), 300);
    let compression = Compression {
        quantization: Quantization::RELATIVE,
        treelet_depth: 1,
        ..Compression::DEFAULT
    };
    let sort = SortConfig { record: RecordFormat::Box32, ..SortConfig::PAPER };
    let config = BuildConfig { sort, compression: Some(compression), ..BuildConfig::default() };
    let options = BuildOptions { config, format: config.format(), ..BuildOptions::default() };
    let (memory, _) = run::load(&triangles, &config).unwrap();
    (triangles, options, memory)
}

#[test]
fn whichever_access_of_a_streamed_build_fails_the_error_names_it() {
    let (triangles, options, memory) = repairing();
    let mut good = Faulty::new(memory.clone(), Fault::Access(u64::MAX));
    on_bus(&mut good, &triangles, &options).unwrap();
    assert!(good.accesses() > 300, "there are repairs: {}", good.accesses());
    for access in 0..good.accesses() {
        let mut bus = Faulty::new(memory.clone(), Fault::Access(access));
        let failure = on_bus(&mut bus, &triangles, &options).unwrap_err();
        let injected = FaultyError::Injected { access };
        assert!(
            matches!(failure, BuildError::Bus { error, .. } if error == injected),
            "{access}: {failure:?}"
        );
        assert_eq!(bus.accesses(), access + 1, "it stops at once");
    }
}

/// A bus whose reads of nodes bring other bits than were written.
struct Rotten<'a> {
    memory: FlatMemory,
    from: u32,
    random: &'a mut Random,
}

impl Bus for Rotten<'_> {
    type Error = <FlatMemory as Bus>::Error;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Self::Error> {
        self.memory.read(addr, buf)?;
        if addr.0 >= self.from {
            for _ in 0..1 + self.random.below(8) {
                let at = self.random.below(buf.len());
                buf[at] ^= 1 << self.random.below(8);
            }
        }
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), Self::Error> {
        self.memory.write(addr, bytes)
    }
}

#[test]
fn nodes_that_come_back_damaged_end_in_an_error_or_a_tree_and_never_in_a_hang() {
    let (triangles, options, memory) = repairing();
    let (_, layout) = run::load(&triangles, &options.config).unwrap();
    let mut refused = 0;
    for seed in 0..300 {
        let mut random = Random::new(SEED + seed);
        let from = layout.build.nodes.base.0;
        let mut bus = Rotten { memory: memory.clone(), from, random: &mut random };
        match on_bus(&mut bus, &triangles, &options) {
            Ok(()) => {}
            Err(BuildError::CorruptNode { .. }) => refused += 1,
            Err(other) => panic!("seed {seed}: {other:?}"),
        }
    }
    assert!(refused > 100, "{refused} of 300 were noticed");
}

#[test]
fn a_node_whose_children_are_one_is_refused() {
    let bounds = Aabb::new(IVec3::splat(-5), IVec3::splat(5));
    let node = |child| Bvh2Node { children: [Subtree { bounds, child }; 2] };
    let leaf = node(Child::Leaf { first: 0, count: 1 });
    let twice = node(Child::Inner(NodeIndex(0)));
    let compression = Compression { treelet_depth: 3, ..Compression::DEFAULT };
    let mut held = vec![HeldNode::EMPTY; compression.held_nodes()];
    let region = Region::new(0, 64);
    let mut compressor = Compressor::new(compression, region, &mut held);
    let mut bus = FlatMemory::new(64);
    compressor.accept(&mut bus, &leaf, NodeIndex(0), Place::Next, &mut ()).unwrap();
    let refused = compressor.accept(&mut bus, &twice, NodeIndex(1), Place::Next, &mut ());
    assert_eq!(refused, Err(BuildError::CorruptNode { index: 1 }));
}
