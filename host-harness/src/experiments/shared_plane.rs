//! Shared-plane nodes as they stream, which P3 §4.5 leaves open.

use std::sync::Arc;

use xylem_core::compress::Compression;
use xylem_core::error::BuildError;
use xylem_core::geom::Ray;
use xylem_core::node::{Grids, NodeFormat, Plane, SharedNode, Sharing};
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::sort::{InputFormat, RecordFormat, SortConfig};
use xylem_core::traverse::{Hit, Scene};

use super::beyond::{self, MESHES, SIZE, build};
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value};
use crate::baseline::{SharedTopDown, shared_top_down};
use crate::bus::FlatMemory;
use crate::report::html::Source;
use crate::run::{self, BuildRun, RunError};
use crate::scene::{Camera, Mesh, UpAxis};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "shared-plane",
    place: "P3 §4.5",
    title: "Shared-plane nodes, streamed",
    needs_scenes: true,
    run,
};

const TREES: [Column; 9] = [
    Column::new("node_bytes_per_primitive", "node B/prim", Source::Counted),
    Column::new("extended_percent", "extensions %", Source::Counted),
    Column::new("primary_box_tests", "primary boxes", Source::Counted),
    Column::new("primary_triangle_tests", "triangles", Source::Counted),
    Column::new("diffuse_box_tests", "diffuse boxes", Source::Counted),
    Column::new("diffuse_triangle_tests", "triangles", Source::Counted),
    Column::new("build_bytes_per_primitive", "build B/prim", Source::Counted),
    Column::new("repair_percent", "repairs %", Source::Counted),
    Column::new("other_hits", "other hits", Source::Counted).places(0),
];

const VARIANTS: [Column; 5] = [
    Column::new("node_bytes_per_primitive", "node B/prim", Source::Counted),
    Column::new("extended_percent", "extensions %", Source::Counted),
    Column::new("box_tests_percent", "box tests, % of 64 B", Source::Counted).places(1),
    Column::new("triangle_tests_percent", "triangle tests, %", Source::Counted).places(1),
    Column::new("other_hits", "other hits", Source::Counted).places(0),
];

const MISMATCHES: [Column; 4] = [
    Column::new("treelet_1_percent", "no treelets", Source::Counted).places(1),
    Column::new("treelet_2_percent", "2 deep", Source::Counted).places(1),
    Column::new("treelet_3_percent", "3 deep", Source::Counted).places(1),
    Column::new("treelet_4_percent", "4 deep", Source::Counted).places(1),
];

const EXTENSIONS: [Column; 3] = [
    Column::new("planes_percent", "exact planes", Source::Counted),
    Column::new("link_or_grid_percent", "links and grids", Source::Counted),
    Column::new("all_percent", "all", Source::Counted),
];

const LEAST: [Column; 3] = [
    Column::new("build_bytes_per_primitive", "build B/prim", Source::Counted).places(1),
    Column::new("node_bytes_per_primitive", "nodes", Source::Counted).places(1),
    Column::new("repair_bytes_per_primitive", "repairs", Source::Counted).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let mut mismatches = Table::new(
        "Nodes with another grid than they were written with, if grids followed from decoded boxes: \
         each is repaired at least once. Per cent of the nodes",
        "scene",
        MISMATCHES,
    );
    let mut extensions =
        Table::new("What extensions hold, in per cent of the nodes", "scene", EXTENSIONS);
    let mut here = Vec::new();
    for name in MESHES {
        let Some(mesh) = lab.mesh(name)? else {
            outcome.notes.push(format!("No mesh '{name}' is at hand."));
            continue;
        };
        let subject = Subject::new(mesh)?;
        let (table, mismatched) = subject.trees()?;
        outcome.tables.push(table);
        let nodes = f64::from(subject.exact.scene.tree.node_count.max(1));
        let shares = mismatched.map(|n| Value::ours(100.0 * f64::from(n) / nodes));
        mismatches.row(name, shares);
        extensions.row(name, subject.extensions()?);
        here.push(subject);
    }
    outcome.nothing_at_hand = here.is_empty();
    outcome.tables.extend([extensions, mismatches]);
    for subject in here.iter().filter(|s| ["bunny", "sponza_crytek"].contains(&s.name())) {
        outcome.tables.push(subject.variants()?);
    }
    if let Some(bunny) = here.iter().find(|subject| subject.name() == "bunny") {
        outcome.tables.push(bunny.least()?);
    }
    outcome.configuration.extend(CONFIGURATION.map(str::to_owned));
    outcome.notes.extend(NOTES.map(str::to_owned));
    Ok(())
}

const NOTES: [&str; 4] = [
    "Streamed nodes take their grid from the exact box, with room for coarser inherited planes, and their \
     parent stores it; what a descendant cannot bear rounded is written exactly, in an extension. So no node \
     depends on its ancestors and none is ever repaired.",
    "Repairing instead, with grids from decoded boxes, cannot be cheap: the table of grids is a lower bound of \
     one repair a node, and a repair is a read and a write of 64 bytes, sixteen times what the node takes.",
    "Without repairs the price is extensions. They are most where leaves differ in size, as where codes of 30 \
     bits are equal in buildings: then a node has to tell how many entries its right subtree has.",
    "The pass from the root down is a prototype on the host, whose nodes are the core's. Its traffic is that of \
     the 64-byte build, a read of each 64-byte node, and a write of each word.",
];

const CONFIGURATION: [&str; 2] = [
    "LBVH of 30-bit codes, equal codes in one leaf, 40-byte triangles in, 32-byte records, M = 8192, \
     B = 16; 16-byte nodes in modulo coordinates with treelets of two layers, repairs in memory.",
    "Rays: 256 x 192 from a camera that has the model in view, and a diffuse bounce of each. Tests are \
     per ray; primary and diffuse ones are added where one number is given.",
];

/// A tree with the memory that it is in, and the traffic that made it.
struct Made {
    memory: FlatMemory,
    scene: Scene,
    bytes: u64,
    repair_bytes: u64,
}

/// What the rays found in a tree and what it cost.
struct Traced {
    hits: Vec<Option<Hit>>,
    /// Box and triangle tests a ray, primary and diffuse.
    tests: [f64; 4],
}

/// A model with its rays and its tree of 64-byte nodes.
struct Subject {
    mesh: Arc<Mesh>,
    exact: BuildRun,
    rays: [Vec<Option<Ray>>; 2],
    reference: Traced,
}

fn config() -> BuildConfig {
    BuildConfig { input: InputFormat::Triangle40, ..BuildConfig::default() }
}

impl Subject {
    fn new(mesh: Arc<Mesh>) -> Result<Self, ExperimentError> {
        let exact = build(&mesh, config())?;
        let bounds = mesh.bounds().unwrap_or_default();
        let camera = Camera::framing(bounds, UpAxis::Y, SIZE.0, SIZE.1);
        let rays = beyond::rays(&mesh, &camera, &exact.memory, &exact.scene)?;
        let reference = trace(&mesh, &exact.memory, &exact.scene, &rays)?;
        Ok(Self { mesh, exact, rays, reference })
    }

    fn name(&self) -> &str {
        &self.mesh.name
    }

    fn primitives(&self) -> f64 {
        self.mesh.triangles.len().max(1) as f64
    }

    /// All formats beside one another, and how many nodes a stream would repair by the treelet's depth.
    fn trees(&self) -> Result<(Table, [u32; 4]), ExperimentError> {
        let caption = format!("{}, {} triangles", self.name(), self.mesh.triangles.len());
        let mut table = Table::new(caption, "nodes", TREES);
        let compression = Some(Compression::DEFAULT);
        let modulo = build(&self.mesh, BuildConfig { compression, ..config() })?;
        let (top_down, mismatched) = self.top_down(&Sharing::TOP_DOWN)?;
        let streamed = self.streamed(Sharing::STREAMED)?;
        let exact = Made {
            memory: self.exact.memory.clone(),
            scene: self.exact.scene,
            bytes: self.exact.traffic.total().bytes(),
            repair_bytes: 0,
        };
        for (name, made) in [
            ("64 bytes", exact),
            ("16 bytes, modulo, streamed", Made::from(modulo)),
            ("8 bytes, shared planes, from the root down", top_down),
            ("8 bytes, shared planes, streamed", streamed),
        ] {
            let traced = trace(&self.mesh, &made.memory, &made.scene, &self.rays)?;
            let mut values = vec![Value::ours(self.node_bytes(&made)), self.extended(&made)];
            values.extend(traced.tests.map(Value::ours));
            values.push(Value::ours(made.bytes as f64 / self.primitives()));
            values.push(Value::ours(100.0 * made.repair_bytes as f64 / made.bytes.max(1) as f64));
            values.push(Value::ours(self.other_hits(&traced)));
            table.row(name, values);
        }
        Ok((table, mismatched))
    }

    /// Shared planes with other parameters.
    fn variants(&self) -> Result<Table, ExperimentError> {
        let caption = format!("{}: parameters of shared planes", self.name());
        let mut table = Table::new(caption, "parameters", VARIANTS);
        let mut add = |name: String, made: &Made| {
            let traced = trace(&self.mesh, &made.memory, &made.scene, &self.rays)?;
            let ratio = |i: usize| {
                let sum = |tests: &[f64; 4]| tests[i] + tests[i + 2];
                Value::ours(100.0 * sum(&traced.tests) / sum(&self.reference.tests))
            };
            let bytes = Value::ours(self.node_bytes(made));
            let other = Value::ours(self.other_hits(&traced));
            table.row(name, [bytes, self.extended(made), ratio(0), ratio(1), other]);
            Ok::<(), ExperimentError>(())
        };
        for flatness in [31, 6, 4, 2] {
            let sharing = Sharing { flatness, ..Sharing::TOP_DOWN };
            add(format!("from the root down, flatness {flatness}"), &self.top_down(&sharing)?.0)?;
        }
        for (margin, flatness) in
            [(0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (3, 31), (3, 6), (3, 2)]
        {
            let sharing = Sharing { margin, flatness, ..Sharing::STREAMED };
            let name = format!("streamed, margin {margin}, flatness {flatness}");
            add(name, &self.streamed(sharing)?)?;
        }
        Ok(table)
    }

    /// Extensions with exact planes, others, and all, in per cent of the nodes.
    fn extensions(&self) -> Result<[Value; 3], ExperimentError> {
        let Made { memory, scene, .. } = self.streamed(Sharing::STREAMED)?;
        let bytes = memory.region(scene.tree.nodes);
        let words = bytes.as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word));
        let words: Vec<_> = words.take(scene.tree.node_count as usize).collect();
        let (mut nodes, mut planes) = (0u32, 0);
        let mut end = words.len();
        while end > 0 {
            // The node comes first and its extensions then, which are in front of it.
            let mut node = vec![words[end - 1]];
            while SharedNode::is_extended(&node) && node.len() < end {
                node.push(words[end - 1 - node.len()]);
            }
            end -= node.len();
            nodes += 1;
            let node = SharedNode::from_words(&node, Grids::Stored);
            let node = node.ok_or_else(|| self.malformed())?;
            let exact = node.planes.iter().filter(|plane| matches!(plane, Plane::Exact(_))).count();
            planes += exact.div_ceil(2);
        }
        let all = words.len() - nodes as usize;
        let share = |count: usize| Value::ours(100.0 * count as f64 / f64::from(nodes.max(1)));
        Ok([share(planes), share(all - planes), share(all)])
    }

    /// The least that a build moves.
    fn least(&self) -> Result<Table, ExperimentError> {
        let caption = format!("{}: the least build traffic", self.name());
        let mut table = Table::new(caption, "build", LEAST);
        let packed = SortConfig { record: RecordFormat::Packed22, ..SortConfig::PAPER };
        let sharing = Some(Sharing::STREAMED);
        let compression = Some(Compression::DEFAULT);
        for (name, config) in [
            ("32-byte records, 64-byte nodes", config()),
            ("32-byte records, 16-byte nodes", BuildConfig { compression, ..config() }),
            ("32-byte records, 8-byte nodes", BuildConfig { sharing, ..config() }),
            (
                "22-byte records, 16-byte nodes",
                BuildConfig { compression, sort: packed, ..config() },
            ),
            ("22-byte records, 8-byte nodes", BuildConfig { sharing, sort: packed, ..config() }),
        ] {
            let made = Made::from(build(&self.mesh, config)?);
            let bytes = [made.bytes as f64, self.node_bytes(&made) * self.primitives()];
            let values = [bytes[0], bytes[1], made.repair_bytes as f64];
            table.row(name, values.map(|bytes| Value::ours(bytes / self.primitives())));
        }
        Ok(table)
    }

    fn streamed(&self, sharing: Sharing) -> Result<Made, ExperimentError> {
        Ok(build(&self.mesh, BuildConfig { sharing: Some(sharing), ..config() })?.into())
    }

    fn top_down(&self, sharing: &Sharing) -> Result<(Made, [u32; 4]), ExperimentError> {
        let mut memory = self.exact.memory.clone();
        let (tree, target) = (&self.exact.scene.tree, self.exact.layout.quantized_nodes);
        let SharedTopDown { tree: compressed, mismatched } =
            shared_top_down(&mut memory, tree, target, sharing).ok_or_else(|| self.malformed())?;
        let scene = Scene { tree: compressed, ..self.exact.scene };
        run::check(&memory, &scene).map_err(|source| self.failed(source))?;
        // Each 64-byte node is read once and its words are written.
        let bytes = self.exact.traffic.total().bytes()
            + 64 * u64::from(tree.node_count)
            + 8 * u64::from(compressed.node_count);
        Ok((Made { memory, scene, bytes, repair_bytes: 0 }, mismatched))
    }

    fn malformed(&self) -> ExperimentError {
        self.failed(RunError::Build(BuildError::Unsorted))
    }

    fn failed(&self, source: RunError) -> ExperimentError {
        ExperimentError::Build { scene: self.mesh.name.clone(), source }
    }

    fn node_bytes(&self, made: &Made) -> f64 {
        let tree = &made.scene.tree;
        f64::from(tree.node_count) * f64::from(tree.format.bytes()) / self.primitives()
    }

    /// Extensions in per cent of the nodes.
    fn extended(&self, made: &Made) -> Value {
        let NodeFormat::Shared(_) = made.scene.tree.format else { return Value::NONE };
        let nodes = f64::from(self.exact.scene.tree.node_count.max(1));
        Value::ours(100.0 * (f64::from(made.scene.tree.node_count) / nodes - 1.0))
    }

    fn other_hits(&self, traced: &Traced) -> f64 {
        let pairs = traced.hits.iter().zip(&self.reference.hits);
        pairs.filter(|(a, b)| a != b).count() as f64
    }
}

impl From<BuildRun> for Made {
    fn from(run: BuildRun) -> Self {
        let repair_bytes = run.traffic.stage(Stage::Compress).bytes();
        let bytes = run.traffic.total().bytes();
        Self { memory: run.memory, scene: run.scene, bytes, repair_bytes }
    }
}

fn trace(
    mesh: &Mesh,
    memory: &FlatMemory,
    scene: &Scene,
    rays: &[Vec<Option<Ray>>; 2],
) -> Result<Traced, ExperimentError> {
    let mut traced = Traced { hits: Vec::new(), tests: [0.0; 4] };
    for (set, rays) in rays.iter().enumerate() {
        let run = beyond::trace(mesh, memory, scene, rays)?;
        let per_ray = |tests: u64| tests as f64 / rays.len().max(1) as f64;
        traced.tests[2 * set] = per_ray(run.sums.box_tests);
        traced.tests[2 * set + 1] = per_ray(run.sums.triangle_tests);
        traced.hits.extend(run.hits);
    }
    Ok(traced)
}
