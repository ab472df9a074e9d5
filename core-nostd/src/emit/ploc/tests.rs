//! Lists through the chain, compared with sweeps written from the definition.

use glam::IVec3;
use heapless::Vec;

use super::gate::list_bound;
use super::*;
use crate::emit::MAX_DEPTH;
use crate::geom::Aabb;
use crate::node::{Bvh2Node, Child, NodeIndex, Subtree};
use crate::num::Grid;
use crate::probe::Probe;
use crate::sort::Item;
use crate::testing::{Random, cases};

const ROOM: usize = 300;

/// Keeps everything in order.
#[derive(Debug, Default)]
struct Log {
    entries: Vec<u32, ROOM>,
    nodes: Vec<Bvh2Node, ROOM>,
    list: Vec<Cluster, ROOM>,
}

impl Port for Log {
    type Error = ();
    fn leaf(&mut self, references: &[u32]) -> Result<u32, ()> {
        let first = self.entries.len() as u32;
        self.entries.extend_from_slice(references).map_err(|_| ())?;
        Ok(first)
    }
    fn node<P: Probe>(&mut self, node: &Bvh2Node, _: &mut P) -> Result<NodeIndex, ()> {
        self.nodes.push(*node).map_err(|_| ())?;
        Ok(NodeIndex(self.nodes.len() as u32 - 1))
    }
    fn cluster(&mut self, cluster: &Cluster) -> Result<(), ()> {
        self.list.push(*cluster).map_err(|_| ())
    }
}

/// One pass; the list goes through its records.
fn pass(chain: &mut Chain, list: &[Cluster], log: &mut Log) {
    chain.start(list.len() as u32, &mut ());
    for &cluster in list {
        assert_eq!(chain.beat(Token::Cluster(cluster), log, &mut ()), Ok(false));
    }
    let mut token = Token::End;
    let mut beats = 0;
    while !chain.beat(token, log, &mut ()).unwrap() {
        token = Token::Bubble;
        beats += 1;
        assert!(beats < 1000, "the chain never ends");
    }
}

/// All passes; gives their number, the log and the root.
fn build(config: PlocConfig, max_leaf: u32, list: &[Cluster]) -> (u32, Log, Option<Subtree>) {
    let mut chain = Chain::new(&config, max_leaf);
    let (mut log, mut passes) = (Log::default(), 0);
    let mut list: Vec<Cluster, ROOM> = Vec::from_slice(list).unwrap();
    while list.len() > 1 || passes == 0 {
        pass(&mut chain, &list, &mut log);
        let next = core::mem::take(&mut log.list);
        assert!(next.len() < list.len() || list.len() < 2, "{} after {}", next.len(), list.len());
        assert!(next.len() as u32 <= list_bound(list.len() as u32));
        let reread = |c: &Cluster| Cluster::from_record(&c.to_record().unwrap(), &Grid::DEFAULT);
        list = next.iter().map(|c| reread(c).unwrap()).collect();
        passes += 1;
    }
    let root = list.first().map(|root| root.close(&mut log, &mut ()).unwrap());
    (passes, log, root)
}

fn primitive(reference: u32, min: [i32; 3], max: [i32; 3]) -> Cluster {
    let bounds = Aabb::new(IVec3::from(min), IVec3::from(max));
    Cluster::of_primitive(&Item { code: 0, bounds, reference })
}

/// Boxes of side `side` at places on the x axis.
fn row<const N: usize>(side: i32, places: [i32; N]) -> [Cluster; N] {
    let mut reference = 0;
    places.map(|x| {
        reference += 1;
        primitive(reference - 1, [x, 0, 0], [x + side, side, side])
    })
}

/// Checks that all primitives are there once, boxes fit, and children come first; gives the depth.
fn check(log: &Log, root: &Subtree, count: usize) -> usize {
    fn walk(log: &Log, subtree: &Subtree, seen: &mut [u32; ROOM]) -> usize {
        match subtree.child {
            Child::Leaf { first, count } => {
                (first..first + count).for_each(|i| seen[log.entries[i as usize] as usize] += 1);
                0
            }
            Child::Inner(NodeIndex(index)) => {
                let node = log.nodes[index as usize];
                let [a, b] = &node.children;
                assert_eq!(a.bounds.union(&b.bounds), subtree.bounds);
                for child in &node.children {
                    assert!(!matches!(child.child, Child::Inner(NodeIndex(i)) if i >= index));
                }
                1 + walk(log, a, seen).max(walk(log, b, seen))
            }
        }
    }
    let mut seen = [0; ROOM];
    let depth = walk(log, root, &mut seen);
    assert!(seen[..count].iter().all(|&times| times == 1), "{:?}", &seen[..count]);
    assert_eq!(log.entries.len(), count);
    depth
}

#[test]
fn nearest_neighbours_merge_and_keep_the_place_of_the_earlier_one() {
    // b and d are close, so are a and e; c is far from all.
    let boxes = [
        primitive(0, [0, 0, 0], [1, 1, 1]),
        primitive(1, [1000, 0, 0], [1001, 1, 1]),
        primitive(2, [0, 90_000, 0], [1, 90_001, 1]),
        primitive(3, [1002, 0, 0], [1003, 1, 1]),
        primitive(4, [2, 0, 0], [3, 1, 1]),
    ];
    let mut log = Log::default();
    pass(&mut Chain::new(&PlocConfig { radius: 4, chain: 1 }, 1), &boxes, &mut log);
    let pairs: Vec<[u32; 2], 8> = log
        .nodes
        .iter()
        .map(|node| {
            node.children.map(|c| match c.child {
                Child::Leaf { first, .. } => log.entries[first as usize],
                Child::Inner(_) => u32::MAX,
            })
        })
        .collect();
    assert_eq!(pairs.as_slice(), [[0, 4], [1, 3]]);
    let lower: Vec<IVec3, 8> = log.list.iter().map(|c| c.bounds().min).collect();
    assert_eq!(lower.as_slice(), [IVec3::ZERO, IVec3::new(1000, 0, 0), IVec3::new(0, 90_000, 0)]);
    // With a radius of 2, a and e do not meet, nor does anything else than b and d choose each other.
    let mut log = Log::default();
    pass(&mut Chain::new(&PlocConfig { radius: 2, chain: 1 }, 1), &boxes, &mut log);
    assert_eq!(log.list.len(), 4);
}

#[test]
fn nothing_is_no_tree_and_one_primitive_is_a_leaf() {
    let (_, log, root) = build(PlocConfig::DEFAULT, 4, &[]);
    assert!(root.is_none() && log.nodes.is_empty() && log.entries.is_empty());
    let (passes, log, root) = build(PlocConfig::DEFAULT, 4, &row(5, [7]));
    assert_eq!((passes, log.nodes.len(), log.entries.as_slice()), (1, 0, &[0][..]));
    assert_eq!(root.unwrap().child, Child::Leaf { first: 0, count: 1 });
}

#[test]
fn two_primitives_share_a_leaf_if_their_boxes_overlap_enough_and_it_may_hold_them() {
    let root = |max_leaf, list: &[Cluster]| {
        let (_, log, root) = build(PlocConfig::DEFAULT, max_leaf, list);
        check(&log, &root.unwrap(), 2);
        root.unwrap().child
    };
    let leaf = Child::Leaf { first: 0, count: 2 };
    let node = Child::Inner(NodeIndex(0));
    assert_eq!(root(4, &row(5, [0, 0])), leaf);
    assert_eq!(root(1, &row(5, [0, 0])), node);
    assert_eq!(root(4, &row(5, [0, 900])), node);
    // One leaf costs 2 · A, a node 1.2 · A + A1 + A2: equal if 0.8 · A = A1 + A2. Squares of 10 by 10
    // in a plane have A1 = A2 = 100, so that is at a box of 25 by 10.
    let square = |i: u32, x: i32, side: i32| primitive(i, [x, 0, 0], [x + side, 10, 0]);
    assert_eq!(root(4, &[square(0, 0, 10), square(1, 15, 10)]), leaf);
    assert_eq!(root(4, &[square(0, 0, 10), square(1, 16, 10)]), node);
}

#[test]
fn equal_boxes_pair_off_into_a_balanced_tree() {
    for config in [PlocConfig::DEFAULT, PlocConfig { radius: 1, chain: 1 }] {
        let (_, log, root) = build(config, 1, &row(3, [50; 256]));
        assert_eq!(check(&log, &root.unwrap(), 256), 8);
        let (_, log, root) = build(config, 4, &row(3, [50; 256]));
        assert_eq!(check(&log, &root.unwrap(), 256), 6);
        assert!(log.nodes.len() == 63);
    }
}

#[test]
fn every_pass_is_a_run_of_the_sweeps_of_the_definition() {
    let mut random = Random(1);
    for round in 0..cases(60) as usize {
        let len = 1 + random.below(ROOM as i32) as usize;
        let spread = [4, 300, 1 << 20][round % 3];
        let list: Vec<Cluster, ROOM> = (0..len)
            .map(|i| {
                let min = [(); 3].map(|()| random.below(spread));
                let max = min.map(|m| m + random.below(50));
                primitive(i as u32, min, max)
            })
            .collect();
        let radius = 1 + random.below(MAX_RADIUS as i32) as u32;
        let chain = 1 + random.below(MAX_CHAIN as i32) as u32;
        let mut expect: Vec<Aabb, ROOM> = list.iter().map(|c| *c.bounds()).collect();
        for _ in 0..chain {
            expect = sweep(&expect, radius);
        }
        let mut log = Log::default();
        pass(&mut Chain::new(&PlocConfig { radius, chain }, 4), &list, &mut log);
        let came: Vec<Aabb, ROOM> = log.list.iter().map(|c| *c.bounds()).collect();
        if expect.len() as u32 <= list_bound(len as u32) * 2 / 3 {
            assert_eq!(came, expect, "round {round}: {len} boxes, radius {radius}, chain {chain}");
        }
        assert!(came.len() <= expect.len(), "the gate only takes away");
    }
}

/// One sweep, all nearest neighbours first.
fn sweep(list: &[Aabb], radius: u32) -> Vec<Aabb, ROOM> {
    let nearest = |i: usize| {
        let others = i.saturating_sub(radius as usize)..(i + radius as usize + 1).min(list.len());
        let key = |j: &usize| (list[i].union(&list[*j]).half_area(), i ^ *j);
        others.filter(|&j| j != i).min_by_key(key)
    };
    let merged = |i: usize| nearest(i).filter(|&j| nearest(j) == Some(i));
    let one = |i: usize| match merged(i) {
        None => Some(list[i]),
        Some(j) if i < j => Some(list[i].union(&list[j])),
        Some(_) => None,
    };
    (0..list.len()).filter_map(one).collect()
}

#[test]
fn a_list_in_which_sweeps_find_one_pair_shrinks_by_the_gates_share() {
    // Each box holds all before it: everyone's nearest is an earlier one.
    let nested = || -> Vec<Cluster, ROOM> {
        (0..ROOM as u32).map(|i| primitive(i, [0; 3], [1 + 9 * i as i32; 3])).collect()
    };
    for chain in [1, 4] {
        let (passes, log, root) = build(PlocConfig { radius: 16, chain }, 1, &nested());
        let depth = check(&log, &root.unwrap(), ROOM);
        assert!(passes <= 30 && depth <= MAX_DEPTH, "{passes} passes, depth {depth}");
    }
}

#[test]
fn trees_that_are_deep_already_get_no_deeper_than_the_stack() {
    let deep = |i: u32, depth: u64| {
        let x = 100 * i as i32;
        let bounds = Aabb::new(IVec3::new(x, 0, 0), IVec3::new(x + 1, 1, 1));
        let record = Item { code: depth << 8, bounds, reference: i };
        Cluster::from_record(&record, &Grid::DEFAULT).unwrap()
    };
    for depth in [1, SWEEP_DEPTH - 1, SWEEP_DEPTH] {
        let list: Vec<Cluster, ROOM> = (0..ROOM as u32).map(|i| deep(i, depth.into())).collect();
        let mut chain = Chain::new(&PlocConfig::DEFAULT, 4);
        let (mut log, mut list, mut passes) = (Log::default(), list, 0);
        while list.len() > 1 {
            pass(&mut chain, &list, &mut log);
            list = core::mem::take(&mut log.list);
            passes += 1;
        }
        let top = list[0].depth();
        // 300 clusters: nine halvings, and one pass in which the limit was met.
        assert!(top <= SWEEP_DEPTH + 1 + 9, "{top} after {passes} passes");
    }
    assert_eq!(usize::from(SWEEP_DEPTH) + 1 + 31, MAX_DEPTH);
}

#[test]
fn records_give_clusters_back_and_others_are_refused() {
    let bounds = Aabb::new(IVec3::new(-5, 6, 7), IVec3::new(8, 9, 10));
    let item = |reference: u32, code: u64| Item { code, bounds, reference };
    let top = 1 << 31;
    let sound = [
        item(7, 3 << 8),
        item(u32::MAX, 95 << 8),
        item(7, 4),
        item(0x7fff_ffff, top),
        item(5 | top as u32, 5 | top),
        item(top as u32, top),
    ];
    for record in sound {
        let cluster = Cluster::from_record(&record, &Grid::DEFAULT).unwrap();
        assert_eq!(cluster.to_record(), Some(record));
    }
    let off = Aabb::new(bounds.min, IVec3::splat(1 << 24));
    let inverted = Aabb::new(bounds.max, bounds.min);
    let corrupt = [
        item(7, 0),           // a node of no depth
        item(7, 96 << 8),     // deeper than any tree
        item(7, 1 << 8 | 1),  // a leaf with a depth
        item(7, 1 << 16 | 1), // spare bits
        item(7, 1 << 32 | 1), // not a word
        item(7, 9 | top),     // a second primitive without its mark
        Item { bounds: off, ..item(7, 1) },
        Item { bounds: inverted, ..item(7, 1) },
    ];
    for record in corrupt {
        assert_eq!(Cluster::from_record(&record, &Grid::DEFAULT), None, "{record:?}");
    }
}

#[test]
fn a_failing_port_ends_the_beat_with_its_error() {
    struct Full;
    impl Port for Full {
        type Error = &'static str;
        fn leaf(&mut self, _: &[u32]) -> Result<u32, Self::Error> {
            Ok(0)
        }
        fn node<P: Probe>(&mut self, _: &Bvh2Node, _: &mut P) -> Result<NodeIndex, Self::Error> {
            Err("full")
        }
        fn cluster(&mut self, _: &Cluster) -> Result<(), Self::Error> {
            Ok(())
        }
    }
    let mut chain = Chain::new(&PlocConfig { radius: 1, chain: 1 }, 1);
    chain.start(8, &mut ());
    let mut beats = row(1, [0; 8]).into_iter().map(Token::Cluster);
    let error = beats.find_map(|token| chain.beat(token, &mut Full, &mut ()).err());
    assert_eq!(error, Some("full"));
}
