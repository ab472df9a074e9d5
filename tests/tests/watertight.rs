//! No box test loses a ray: every verdict against exact arithmetic, in every node format.
//!
//! Rays descend real trees in every format and by every method at once. At each child the test is
//! done as the traversal does it and compared with exact arithmetic on fractions
//! ([`xylem_tests::planes`]). The tests are, in this order: planes from the origin, for 64-byte nodes;
//! for quantized pairs decoded planes from the origin; planes from the traversal point, as far down
//! as the ray hits by that method; and steps from the parent's planes, all the way down from the
//! root. Asserted of every single test:
//!
//! - if the exact ray is in the subtree's *exact* closed box at some time of its interval, the
//!   verdict is a hit; for quantized nodes also if it is in the decoded box;
//! - each near plane's time is at most the exact one, and each far plane's at least; from the
//!   traversal point, if they are ahead of it;
//! - the decoded box encloses the exact one, and both coordinates decode to the same.
//!
//! Some boxes are tested again with intervals that end or begin exactly where the ray enters or
//! leaves. The short run is about 10⁷ tests; `XYLEM_FULL=1` makes it 1.2 · 10⁹ over all scenes.

use std::fmt::Write as _;
use std::ops::AddAssign;
use std::path::PathBuf;

use rayon::prelude::*;
use xylem::scene::{LoadOptions, Mesh, Random, obj};
use xylem_core::compress::{CellBox, Placement};
use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::Region;
use xylem_core::node::{Bvh2View, Child, NodeIndex, Quantization, QuantizedPair};
use xylem_core::traverse::{Slabs, TraversalPoint};
use xylem_tests::planes::Planes;
use xylem_tests::rays::{KINDS, hard_ray};
use xylem_tests::trees::{Forest, soup};
use xylem_tests::{places, results};

const SEED: u64 = 0x5eed_0004;

/// Rays that walk together as one parallel task.
const BATCH: u64 = 64;

/// The most nodes that one ray visits; where a sheet lies in the ray's plane there are too many.
const MAX_NODES: u32 = 4000;

#[test]
fn no_box_test_in_any_format_loses_a_ray() {
    let scenes = scenes();
    let all = if places::full() { 1_200_000_000 } else { 10_000_000 };
    let share = all / scenes.len() as u64;
    let mut table = String::from(
        "| scene | triangles | rays | box tests | hit, bvh2 | decompress | point | incremental | exact \
         hits | lost |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    let mut total = Tally::default();
    let mut triangles = 0;
    for scene in &scenes {
        let (name, mesh) = scene.load();
        let tally = run(&mesh, share);
        triangles += mesh.len();
        writeln!(table, "{}", tally.row(&name, mesh.len())).unwrap();
        total += tally;
    }
    writeln!(table, "{}", total.row("all", triangles)).unwrap();
    let body = format!(
        "Box tests against exact arithmetic, seed {SEED:#x}, ray kinds {KINDS:?}; run on {}. A *hit* of \
         a format that is no exact hit costs a visit, a *lost* one would be a defect. From the *point*, only the children of nodes that were hit so \
         are tested.\n\n{table}",
        results::today()
    );
    if places::full() {
        results::report("Watertightness", &body);
    } else {
        println!("{body}");
    }
    // Each single test was asserted on the way; these say that there were some.
    assert!(total.tests * 10 >= all * 9, "only {} box tests of {all}", total.tests);
    assert!(total.exact_hits > total.tests / 20 && total.exact_hits < total.hits[0]);
    // Steps err more than planes from the origin; from the point, what is below a miss is not tested.
    assert!(total.hits[1] <= total.hits[3] && total.hits[2] > total.exact_hits / 2);
    assert_eq!(total.lost, 0);
}

/// Where the triangles of a scene come from.
enum Source {
    Named(String),
    File(PathBuf),
    Soup(usize),
}

impl Source {
    fn load(&self) -> (String, Vec<Triangle>) {
        let named = |mesh: Mesh| (mesh.name.clone(), mesh.triangles);
        match self {
            Self::Named(name) => named(places::procedural(name)),
            Self::File(path) => {
                named(obj::load(path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")))
            }
            Self::Soup(count) => {
                let triangles = soup(&mut Random::new(SEED + *count as u64), *count);
                (format!("soup of {count}"), triangles)
            }
        }
    }
}

/// The scenes to run: procedural and random ones; in the long run also all that there are.
fn scenes() -> Vec<Source> {
    let soups = [2, 40, 5000].map(Source::Soup);
    // Without triangles there is no tree to walk.
    let names = places::small_scenes().into_iter().filter(|name| name != "degenerate/empty");
    let mut scenes: Vec<_> = names.map(Source::Named).chain(soups).collect();
    if places::full() {
        for variable in ["XYLEM_SCENES", "XYLEM_ORACLE"] {
            if let Some(folder) = places::folder(variable, "the long run's meshes") {
                scenes.extend(places::meshes_in(&folder).into_iter().map(Source::File));
            }
        }
    }
    scenes
}

/// What the box tests of one scene found.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    rays: u64,
    tests: u64,
    /// Hits by format and method.
    hits: [u64; 4],
    /// Exact hits of exact boxes.
    exact_hits: u64,
    /// Tests that lost the ray.
    lost: u64,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.tests += other.tests;
        self.exact_hits += other.exact_hits;
        self.lost += other.lost;
        for (sum, hits) in self.hits.iter_mut().zip(other.hits) {
            *sum += hits;
        }
    }
}

impl Tally {
    fn row(&self, name: &str, triangles: usize) -> String {
        let Self { rays, tests, hits: [bvh2, full, point, step], exact_hits, lost } = self;
        format!(
            "| {name} | {triangles} | {rays} | {tests} | {bvh2} | {full} | {point} | {step} | \
             {exact_hits} | {lost} |"
        )
    }
}

/// Sends rays through a scene until there were `tests` box tests.
fn run(triangles: &[Triangle], tests: u64) -> Tally {
    let forest = Forest::grow(triangles);
    let bounds = forest.exact.tree.root.expect("the scene has triangles").bounds;
    let mut tally = Tally::default();
    let mut stream = 0;
    while tally.tests < tests {
        // As many batches as will do, judged by those before; the same on every machine.
        let batches = match tally.tests.checked_div(stream) {
            Some(per_batch) => ((tests - tally.tests) / per_batch).clamp(1, 4096),
            None => 4,
        };
        let walk = |batch| {
            let mut random = Random::stream(SEED, batch);
            let mut tally = Tally::default();
            for _ in 0..BATCH {
                let (_, ray) = hard_ray(&mut random, triangles, &bounds);
                Walk::new(&forest, &ray).run(&mut random, &mut tally);
            }
            tally
        };
        let found = (stream..stream + batches).into_par_iter().map(walk);
        let found = found.reduce(Tally::default, |mut a, b| {
            a += b;
            a
        });
        tally += found;
        stream += batches;
    }
    tally
}

/// A ray on its way down one tree in all formats.
struct Walk<'a> {
    forest: &'a Forest,
    ray: &'a Ray,
}

/// What the ray knows of a subtree.
#[derive(Clone, Copy, Debug)]
struct State {
    child: Child,
    /// The exact box.
    exact: Aabb,
    /// The decoded box and the local grid.
    placement: Placement,
    /// The planes of the exact and of the decoded box, from the origin, and the latter by steps.
    slabs: [Slabs; 3],
    /// The planes from the traversal point.
    near: Option<Nearby>,
    /// The traversal point of this subtree, if a test from the one above is a hit.
    point: Option<TraversalPoint>,
}

/// The planes of a box from a traversal point, and when that is.
#[derive(Clone, Copy, Debug)]
struct Nearby {
    time: i64,
    slabs: Slabs,
}

impl<'a> Walk<'a> {
    fn new(forest: &'a Forest, ray: &'a Ray) -> Self {
        Self { forest, ray }
    }

    fn run(&self, random: &mut Random, tally: &mut Tally) {
        tally.rays += 1;
        let root = self.forest.exact.tree.root.expect("the scene has triangles");
        let placement = Placement::root(&root.bounds, &Quantization::RELATIVE)
            .expect("the root is on the grid");
        let exact = Slabs::new(self.ray, &root.bounds);
        let decoded = Slabs::new(self.ray, &placement.decoded());
        let slabs = [exact, decoded, decoded];
        let entry = decoded.entry(self.ray, self.ray.t_min().to_bits(), self.ray.t_max().to_bits());
        let point = entry.map(|entry| TraversalPoint::root(self.ray, placement, entry));
        let root =
            State { child: root.child, exact: root.bounds, placement, slabs, near: None, point };
        self.judge(&root, random, tally);
        let mut stack = vec![root];
        for _ in 0..MAX_NODES {
            let Some(parent) = stack.pop() else { break };
            let Child::Inner(index) = parent.child else { continue };
            for state in self.children(index, &parent) {
                let hit = self.judge(&state, random, tally);
                // Now and then also where no traversal would go.
                if hit || random.below(16) == 0 {
                    stack.push(state);
                }
            }
        }
    }

    /// The children of a node, read in all formats.
    fn children(&self, index: NodeIndex, parent: &State) -> [State; 2] {
        let forest = self.forest;
        let node: &[u8; 64] = bytes(forest, forest.exact.tree.nodes, index);
        let node = Bvh2View::new(node).to_repr().expect("the node is valid");
        let (relative, modulo) =
            (forest.pair(&forest.relative, index), forest.pair(&forest.modulo, index));
        [0, 1].map(|i| {
            let exact = node.children[i];
            let context = &parent.placement.context;
            let decode = |pair: &QuantizedPair, quantization| -> CellBox {
                let child = pair.children[i];
                assert_eq!(pointer(child.child), pointer(exact.child), "node {index:?}");
                context.decode(&child, quantization).expect("the child is inside its parent")
            };
            let cells = decode(&relative, &Quantization::RELATIVE);
            let again = decode(&modulo, &Quantization::MODULO);
            assert_eq!(cells, again, "node {index:?}");
            let placement = parent.placement.child(&cells, &Quantization::RELATIVE);
            let slabs = [
                Slabs::new(self.ray, &exact.bounds),
                Slabs::new(self.ray, &placement.decoded()),
                parent.slabs[2].step(self.ray, context, &cells),
            ];
            let near = parent.point.map(|point| Nearby {
                time: point.time,
                slabs: point.slabs(self.ray, &point.position(self.ray), &cells, 6),
            });
            let all = (self.ray.t_min().to_bits(), self.ray.t_max().to_bits());
            let after = near.and_then(|near| near.entry(self.ray, all));
            let point = parent.point.zip(after);
            let point =
                point.map(|(point, after)| point.descend(&cells, after, &Quantization::RELATIVE));
            State { child: exact.child, exact: exact.bounds, placement, slabs, near, point }
        })
    }

    /// Judges the box test of each format; returns whether any traversal would go on.
    fn judge(&self, state: &State, random: &mut Random, tally: &mut Tally) -> bool {
        let decoded = state.placement.decoded();
        assert!(decoded.contains(&state.exact), "{state:?}");
        let exact = Planes::new(self.ray, &state.exact);
        let wide = Planes::new(self.ray, &decoded);
        for (planes, slabs) in [exact, wide, wide].iter().zip(&state.slabs) {
            assert!(planes.enclosed_by(self.ray, slabs), "{:?} {state:?}", self.ray);
        }
        if let Some(Nearby { time, slabs }) = &state.near {
            assert!(wide.enclosed_after(self.ray, *time, slabs), "{:?} {state:?}", self.ray);
        }
        let all = (self.ray.t_min().to_bits(), self.ray.t_max().to_bits());
        let hit = self.verdicts(state, [exact, wide], all, tally);
        if random.below(8) == 0
            && let Some((enter, leave)) = exact.crossing()
        {
            // Ends where the ray enters, begins where it leaves, and both.
            for interval in
                [(all.0, enter), (leave - 1, all.1), (leave - 1, enter), (enter - 1, enter)]
            {
                self.verdicts(state, [exact, wide], interval, tally);
            }
        }
        hit
    }

    fn verdicts(
        &self,
        state: &State,
        [exact, wide]: [Planes; 2],
        (t_min, t_max): (i64, i64),
        tally: &mut Tally,
    ) -> bool {
        // A point is only before times of the ray's own interval.
        let t_min = t_min.max(self.ray.t_min().to_bits());
        let entry = |slabs: &Slabs| Some(slabs.entry(self.ray, t_min, t_max).is_some());
        let [exact_box, decoded, stepped] = state.slabs.each_ref().map(entry);
        let near = state.near.map(|near| near.entry(self.ray, (t_min, t_max)).is_some());
        let verdicts = [exact_box, decoded, near, stepped];
        let (passes, passes_wide) = (exact.passes(t_min, t_max), wide.passes(t_min, t_max));
        for (i, verdict) in verdicts.into_iter().enumerate() {
            let Some(verdict) = verdict else { continue };
            let must = passes || (i > 0 && passes_wide);
            assert!(verdict || !must, "lost: {:?} {t_min} {t_max} {state:?}", self.ray);
            tally.lost += u64::from(must && !verdict);
            tally.hits[i] += u64::from(verdict);
            tally.tests += 1;
        }
        tally.exact_hits += u64::from(passes);
        verdicts.contains(&Some(true))
    }
}

impl Nearby {
    /// How long after its point the ray enters the box, if it does within the interval.
    fn entry(&self, ray: &Ray, (t_min, t_max): (i64, i64)) -> Option<i64> {
        self.slabs.entry(ray, t_min - self.time, t_max - self.time)
    }
}

/// The bytes of a node.
fn bytes<const LEN: usize>(forest: &Forest, region: Region, index: NodeIndex) -> &[u8; LEN] {
    let start =
        region.record(index.0, LEN as u32).expect("the node is inside its region").0 as usize;
    forest.memory.bytes()[start..].first_chunk().expect("the node is in memory")
}

/// What a pointer says in every format; the quantized leaf has no count.
fn pointer(child: Child) -> (bool, u32) {
    match child {
        Child::Inner(NodeIndex(index)) => (false, index),
        Child::Leaf { first, .. } => (true, first),
    }
}
