use core::convert::Infallible;

use glam::IVec3;

use super::*;
use crate::error::{BuildError, ConfigError, RegionName};
use crate::geom::{Aabb, PrimIndex, Triangle};
use crate::mem::{Bus, ByteAddr, Region};
use crate::node::{
    Bvh2Node, Child, LeafEntry, NodeFormat, NodeIndex, Quantization, QuantizedChild, QuantizedPair,
    Sharing, Subtree, Tree,
};

/// Memory of 4 KiB that counts what crosses the bus.
struct Memory {
    bytes: [u8; 4096],
    read: usize,
    written: usize,
}

impl Bus for Memory {
    type Error = Infallible;
    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Infallible> {
        let at = addr.0 as usize;
        buf.copy_from_slice(&self.bytes[at..at + buf.len()]);
        self.read += buf.len();
        Ok(())
    }
    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), Infallible> {
        let at = addr.0 as usize;
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
        self.written += bytes.len();
        Ok(())
    }
}

const NODES: Region = Region::new(0, 1024);
const TABLE: Region = Region::new(1024, 256);
const TRIANGLES: Region = Region::new(2048, 2048);

const FORMATS: [NodeFormat; 4] = [
    NodeFormat::Bvh2,
    NodeFormat::Quantized(Quantization::RELATIVE),
    NodeFormat::Quantized(Quantization::MODULO),
    NodeFormat::Quantized(Quantization { bits: 8, ..Quantization::MODULO }),
];

const fn inner(index: u32) -> Child {
    Child::Inner(NodeIndex(index))
}

const fn leaf(first: u32, count: u32) -> Child {
    Child::Leaf { first, count }
}

/// The tree of P2 Fig. 5: six primitives a to f, with d and e in one leaf.
const FIGURE_5: [[Child; 2]; 4] = [
    [leaf(1, 1), leaf(2, 1)],
    [leaf(0, 1), inner(0)],
    [leaf(3, 2), leaf(5, 1)],
    [inner(1), inner(2)],
];

fn triangle(i: u32) -> Triangle {
    let x = 10 * i as i32;
    let vertices = [[x, 0, 0], [x + 4, 1, 0], [x, 3, 2]].map(IVec3::from);
    Triangle { vertices, id: i }
}

/// The tree with no boxes in its nodes, over the first triangles, which are referred to backwards.
fn plant(nodes: &[[Child; 2]], marks: &[bool], format: NodeFormat) -> (Memory, Tree) {
    let mut memory = Memory { bytes: [0; 4096], read: 0, written: 0 };
    for (i, children) in nodes.iter().enumerate() {
        let bounds = Aabb::new(IVec3::ZERO, IVec3::ZERO);
        let node = Bvh2Node { children: children.map(|child| Subtree { bounds, child }) };
        let pair = children.map(|child| QuantizedChild { low: [0; 3], high: [0; 3], child });
        let stride = format.bytes() as usize;
        let place = &mut memory.bytes[i * stride..][..stride];
        match format {
            NodeFormat::Bvh2 => place.copy_from_slice(&node.to_bytes()),
            NodeFormat::Wide(_) | NodeFormat::Shared(_) => {
                unreachable!("these trees are not refitted")
            }
            NodeFormat::Quantized(Quantization { bits, .. }) => {
                place.copy_from_slice(&QuantizedPair { children: pair }.to_bytes(bits)[..stride]);
            }
        }
    }
    let count = marks.len() as u32;
    for (i, &last) in (0..).zip(marks) {
        let entry = LeafEntry { primitive: PrimIndex(count - 1 - i), last };
        memory.bytes[1024 + 4 * i as usize..][..4].copy_from_slice(&entry.to_bytes());
        let at = 2048 + 40 * i as usize;
        memory.bytes[at..at + 40].copy_from_slice(&triangle(i).to_bytes());
    }
    let node_count = nodes.len() as u32;
    let child = if node_count == 0 { leaf(0, count) } else { inner(node_count - 1) };
    let root = Some(Subtree { bounds: Aabb::EMPTY, child });
    let leaf_count = node_count + 1;
    let tree = Tree {
        root,
        node_count,
        leaf_count,
        entry_count: count,
        ..Tree::empty(format, NODES, TABLE)
    };
    (memory, tree)
}

fn figure_5(format: NodeFormat) -> (Memory, Tree) {
    plant(&FIGURE_5, &[true, true, true, false, true, true], format)
}

/// Takes the nodes down.
#[derive(Default)]
struct Record(heapless::Vec<(u32, Bvh2Node), 16>);

impl RefitSink for Record {
    fn node<B: Bus, P: crate::probe::Probe>(
        &mut self,
        _: &mut B,
        node: &Bvh2Node,
        index: NodeIndex,
        _: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.0.push((index.0, *node)).map_err(|_| BuildError::Internal)
    }
}

fn run(memory: &mut Memory, tree: &Tree) -> Result<(Refitted, Record), BuildError<Infallible>> {
    let mut record = Record::default();
    let count = tree.entry_count;
    let done = refit(memory, tree, (TRIANGLES, count), &mut record, &mut ())?;
    Ok((done, record))
}

#[test]
fn nodes_come_children_first_and_second_subtree_first_with_exact_boxes() {
    for format in FORMATS {
        let (mut memory, tree) = figure_5(format);
        let (done, record) = run(&mut memory, &tree).unwrap();
        let order: heapless::Vec<u32, 16> = record.0.iter().map(|(index, _)| *index).collect();
        assert_eq!(order.as_slice(), [2, 0, 1, 3]);
        // Entry i refers to triangle 5 - i.
        let around = |entries: core::ops::Range<u32>| {
            entries.fold(Aabb::EMPTY, |b, e| b.union(&triangle(5 - e).bounds()))
        };
        let expect = [
            (2, [(around(3..5), leaf(3, 2)), (around(5..6), leaf(5, 1))]),
            (0, [(around(1..2), leaf(1, 1)), (around(2..3), leaf(2, 1))]),
            (1, [(around(0..1), leaf(0, 1)), (around(1..3), inner(0))]),
            (3, [(around(0..3), inner(1)), (around(3..6), inner(2))]),
        ];
        for ((index, node), (at, children)) in record.0.iter().zip(expect) {
            let children = children.map(|(bounds, child)| Subtree { bounds, child });
            assert_eq!((*index, node.children), (at, children), "{format:?}");
        }
        assert_eq!(done.root, Some(Subtree { bounds: around(0..6), child: inner(3) }));
        // 6/5 of the areas of the nodes and the leaves' by their sizes, over the root's.
        let area = |entries| u128::from(around(entries).half_area());
        let inner_area = area(0..6) + area(0..3) + area(3..6) + area(1..3);
        let single = [0..1, 1..2, 2..3, 5..6].into_iter().map(area).sum::<u128>();
        let sum = 6 * inner_area + 5 * (single + 2 * area(3..5));
        let cost = crate::quality::SahCost::from_bits(((sum << 32) / (5 * area(0..6))) as u64);
        assert_eq!(done.cost, cost);
    }
}

#[test]
fn nodes_entries_and_triangles_are_read_once_and_nodes_written_once() {
    let (mut memory, tree) = figure_5(NodeFormat::Bvh2);
    refit(&mut memory, &tree, (TRIANGLES, 6), &mut InPlace { nodes: NODES }, &mut ()).unwrap();
    assert_eq!((memory.read, memory.written), (4 * 64 + 6 * 44, 4 * 64));
    for (format, bytes) in FORMATS.into_iter().zip([64, 16, 16, 20]) {
        let (mut memory, tree) = figure_5(format);
        run(&mut memory, &tree).unwrap();
        assert_eq!((memory.read, memory.written), (4 * bytes + 6 * 44, 0));
    }
}

#[test]
fn no_tree_stays_none_and_a_leaf_gets_its_box() {
    let empty = Tree::empty(NodeFormat::Bvh2, NODES, TABLE);
    let (mut memory, leaf_tree) = plant(&[], &[false, false, true], NodeFormat::Bvh2);
    assert_eq!(run(&mut memory, &empty).unwrap().0, Refitted::default());
    let (done, record) = run(&mut memory, &leaf_tree).unwrap();
    let bounds = (0..3).fold(Aabb::EMPTY, |b, i| b.union(&triangle(i).bounds()));
    assert_eq!(done.root, Some(Subtree { bounds, child: leaf(0, 3) }));
    assert_eq!(done.cost, 3);
    assert!(record.0.is_empty());
}

#[test]
fn pointers_that_lead_astray_are_named() {
    let marks = [true, true, true, false, true, true];
    let with = |node: usize, child: usize, to: Child| {
        let mut nodes = FIGURE_5;
        nodes[node][child] = to;
        let (mut memory, tree) = plant(&nodes, &marks, NodeFormat::Bvh2);
        run(&mut memory, &tree).map(|_| ()).unwrap_err()
    };
    let node = |index| BuildError::CorruptNode { index };
    let entry = |entry| BuildError::CorruptLeaf { entry };
    assert_eq!(with(3, 1, inner(3)), node(3), "a cycle");
    assert_eq!(with(3, 1, inner(u32::MAX)), node(3), "a wild pointer");
    assert_eq!(with(0, 1, inner(2)), node(0), "a child after its parent");
    assert_eq!(with(3, 0, inner(2)), node(3), "one node twice, others never");
    assert_eq!(with(3, 0, leaf(0, 1)), node(3), "a node never");
    assert_eq!(with(2, 1, leaf(6, 1)), entry(6), "no such entry");
    assert_eq!(with(2, 1, leaf(u32::MAX, 1)), entry(u32::MAX));
    assert_eq!(with(2, 0, leaf(3, 1)), entry(3), "a leaf without a mark");
    assert_eq!(with(2, 0, leaf(4, 2)), entry(4), "a mark within a leaf");
}

#[test]
fn leaves_and_triangles_that_are_none_are_named() {
    let strike = |at: usize, word: u32| {
        let (mut memory, tree) = figure_5(FORMATS[1]);
        memory.bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        run(&mut memory, &tree).map(|_| ()).unwrap_err()
    };
    assert_eq!(strike(1024 + 4 * 5, 6 | 1 << 31), BuildError::CorruptLeaf { entry: 5 });
    // The last leaf goes on without a mark, past the table.
    assert_eq!(strike(1024 + 4 * 5, 0), BuildError::CorruptLeaf { entry: 6 });
    let off_grid = strike(2048 + 40 * 2 + 8, 1 << 24);
    assert_eq!(off_grid, BuildError::InvalidPrimitive { index: PrimIndex(2) });
}

#[test]
fn regions_smaller_than_the_tree_says_are_named_before_anything_is_read() {
    let (mut memory, tree) = figure_5(NodeFormat::Bvh2);
    let full = |region, needed, available| BuildError::RegionFull { region, needed, available };
    let short = Tree { nodes: Region { size: 255, ..NODES }, ..tree };
    assert_eq!(run(&mut memory, &short).err(), Some(full(RegionName::Nodes, 256, 255)));
    let short = Tree { leaf_table: Region { size: 23, ..TABLE }, ..tree };
    assert_eq!(run(&mut memory, &short).err(), Some(full(RegionName::LeafTable, 24, 23)));
    let few = Region { size: 239, ..TRIANGLES };
    let error = refit(&mut memory, &tree, (few, 6), &mut Record::default(), &mut ());
    assert_eq!(error, Err(full(RegionName::Triangles, 240, 239)));
    let wide = NodeFormat::Quantized(Quantization { bits: 9, ..Quantization::MODULO });
    let error = BuildError::Config(ConfigError::Quantization);
    assert_eq!(run(&mut memory, &Tree { format: wide, ..tree }).err(), Some(error));
    let shared = NodeFormat::Shared(Sharing::STREAMED);
    let error = BuildError::Config(ConfigError::RefitFormat);
    assert_eq!(run(&mut memory, &Tree { format: shared, ..tree }).err(), Some(error));
    assert_eq!(memory.read, 0);
    let small = InPlace { nodes: Region { size: 128, ..NODES } };
    let error = refit(&mut memory, &tree, (TRIANGLES, 6), &mut { small }, &mut ());
    assert_eq!(error, Err(full(RegionName::Nodes, 192, 128)));
}
