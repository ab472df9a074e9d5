//! Why rays meet more boxes once those are rounded to grids.
//!
//! A tree of 64-byte nodes is given the planes that its quantized tree decodes to, so that it is searched
//! as that one is by decompression, node for node. Where it visits a node that the exact tree does not,
//! the ray has met what rounding added to the node's box.

use rayon::prelude::*;
use xylem_core::compress::Placement;
use xylem_core::geom::{Aabb, Ray};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Bvh2Node, Bvh2View, Child, LeafEntry, NodeIndex, Quantization};
use xylem_core::num::{Grid, SubGrid, Time};
use xylem_core::traverse::{Query, Scene, TraceError, trace};

use super::{Column, ExperimentError, Table, Value};
use crate::bus::{FlatMemory, MemoryError, Snapshot};
use crate::report::html::Source;
use crate::run::TraceCounts;
use crate::scene::Mesh;

/// What is measured of a set of rays, of boxes or of triangles.
pub const COLUMNS: [Column; 7] = [
    Column::new("exact", "tests/ray, exact", Source::Counted),
    Column::new("extra_percent", "rounded, %", Source::Counted).places(1),
    Column::new("flat_percent", "flat ones alone, %", Source::Counted).places(1),
    Column::new("starts_percent", "ray starts within, %", Source::Counted).places(0),
    Column::new("ends_percent", "ends within, %", Source::Counted).places(0),
    Column::new("passes_percent", "passes, %", Source::Counted).places(0),
    Column::new("half", "half of them in", Source::Counted).places(0),
];

/// Of boxes and of triangles.
pub type Values = [[Value; COLUMNS.len()]; 2];

/// Tables with [`COLUMNS`] and no rows, of boxes and of triangles.
pub fn tables() -> [Table; 2] {
    [("Box", "of nodes"), ("Triangle", "that leaves have of triangles")].map(|(tests, of)| {
        let caption = format!(
            "{tests} tests with rounded boxes above those with exact ones, and how rays meet the rounded boxes {of} \
             that they visit only then"
        );
        Table::new(caption, "scene", COLUMNS)
    })
}

/// A row of each table: the closest hits of rays in a tree of 64-byte nodes, and in the same with rounded
/// boxes.
///
/// # Errors
/// [`ExperimentError::Trace`].
pub fn measure(
    mesh: &Mesh,
    (memory, scene): (&FlatMemory, &Scene),
    quantization: &Quantization,
    rays: &[Option<Ray>],
) -> Result<Values, ExperimentError> {
    let search = |memory: &FlatMemory| {
        let failed = |source| ExperimentError::Trace { scene: mesh.name.clone(), source };
        let visit = |ray: &Option<Ray>| Visits::of(memory, scene, ray.as_ref());
        rays.par_iter().map(visit).collect::<Result<Vec<_>, _>>().map_err(failed)
    };
    let exact = search(memory)?;
    let rounded = round(memory, scene, quantization, |_| true);
    let found = search(&rounded.memory)?;
    let flat = search(&round(memory, scene, quantization, |side| side == 0).memory)?;

    let count = rays.iter().flatten().count().max(1) as f64;
    let row = |what: usize| {
        let tests = |visits: &[Visits]| visits.iter().map(|v| v.tests[what]).sum::<u64>() as f64;
        let base = tests(&exact);
        let above = |ours: f64| Value::ours(100.0 * (ours / base.max(1.0) - 1.0));
        let mut met = [0u64; 3];
        let mut of_box = vec![0u64; rounded.boxes[what].len()];
        for ((exact, found), ray) in exact.iter().zip(&found).zip(rays) {
            let Some(ray) = ray else { continue };
            let known = &exact.visited[what];
            for &visited in found.visited[what].iter().filter(|visited| !known.contains(visited)) {
                let Some(bounds) = rounded.boxes[what].get(visited as usize) else { continue };
                met[meeting(ray, exact.end, bounds) as usize] += 1;
                of_box[visited as usize] += 1;
            }
        }
        of_box.sort_unstable_by_key(|&count| std::cmp::Reverse(count));
        let all: u64 = met.iter().sum();
        let before = of_box.iter().scan(0, |sum, count| Some(std::mem::replace(sum, *sum + count)));
        let half = before.take_while(|before| 2 * before < all).count();
        let [starts, ends, passes] =
            met.map(|count| Value::ours(100.0 * count as f64 / all.max(1) as f64));
        [
            Value::ours(base / count),
            above(tests(&found)),
            above(tests(&flat)),
            starts,
            ends,
            passes,
            Value::ours(half as f64),
        ]
    };
    Ok([0, 1].map(row))
}

/// A tree with rounded boxes.
struct Rounded {
    memory: FlatMemory,
    /// The decoded box of each node, and that of the leaf of each entry of the leaf table.
    boxes: [Vec<Aabb>; 2],
}

/// Gives boxes in 64-byte nodes the planes of the decoded boxes, on the axes on which they are as thick as
/// `is_rounded` says. What is not a tree stays as it is.
fn round(
    memory: &FlatMemory,
    scene: &Scene,
    quantization: &Quantization,
    is_rounded: impl Fn(i32) -> bool,
) -> Rounded {
    let tree = &scene.tree;
    let boxes = [tree.node_count, tree.entry_count].map(|n| vec![Aabb::EMPTY; n as usize]);
    let mut rounded = Rounded { memory: memory.clone(), boxes };
    let mut places = vec![None; tree.node_count as usize];
    if let (Some(root), Some(place)) = (tree.root, places.last_mut()) {
        *place = Placement::root(&root.bounds, quantization);
    }
    // Parents come after their children.
    for index in (0..tree.node_count).rev() {
        let node = (|| {
            let placement: Placement = places[index as usize]?;
            rounded.boxes[0][index as usize] = placement.decoded();
            let at = tree.nodes.record(index, Bvh2Node::BYTES as u32)?;
            let bytes = memory.region(Region { base: at, size: Bvh2Node::BYTES as u32 });
            let mut node = Bvh2View::new(bytes.try_into().ok()?).to_repr()?;
            for subtree in &mut node.children {
                let (_, cells) = placement.encode(&subtree.bounds, subtree.child, quantization)?;
                let below = placement.child(&cells, quantization);
                let (bounds, decoded) = (&mut subtree.bounds, below.decoded());
                match subtree.child {
                    Child::Inner(NodeIndex(child)) => {
                        *places.get_mut(child as usize)? = Some(below);
                    }
                    Child::Leaf { first, count } => {
                        let entries = first as usize..(first + count) as usize;
                        rounded.boxes[1].get_mut(entries)?.fill(decoded);
                    }
                }
                for axis in 0..3 {
                    if is_rounded(bounds.max[axis] - bounds.min[axis]) {
                        bounds.min[axis] = decoded.min[axis];
                        // A cell at the upper end of the grid ends a unit above it, where a 64-byte
                        // node has no coordinate.
                        bounds.max[axis] = decoded.max[axis].min(Grid::DEFAULT.max());
                    }
                }
            }
            Some((at, node))
        })();
        if let Some((ByteAddr(at), node)) = node {
            let at = at as usize;
            rounded.memory.bytes_mut()[at..at + Bvh2Node::BYTES].copy_from_slice(&node.to_bytes());
        }
    }
    rounded
}

/// What a search did.
struct Visits {
    /// The nodes and the leaf table entries that it read.
    visited: [Vec<u32>; 2],
    /// How many boxes and triangles it tested.
    tests: [u64; 2],
    /// When the ray hit something.
    end: Option<Time>,
}

impl Visits {
    fn of(
        memory: &FlatMemory,
        scene: &Scene,
        ray: Option<&Ray>,
    ) -> Result<Self, TraceError<MemoryError>> {
        let mut bus = Watched { memory: memory.snapshot(), scene, visited: [vec![], vec![]] };
        let mut counts = TraceCounts::default();
        let hit = match ray {
            Some(ray) => trace(&mut bus, scene, ray, Query::Closest, &mut counts)?,
            None => None,
        };
        let tests = [counts.box_tests, counts.triangle_tests];
        Ok(Self { visited: bus.visited, tests, end: hit.map(|hit| hit.t) })
    }
}

/// Memory that notes which nodes and leaf table entries are read.
struct Watched<'a> {
    memory: Snapshot<'a>,
    scene: &'a Scene,
    visited: [Vec<u32>; 2],
}

impl Bus for Watched<'_> {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        let tree = &self.scene.tree;
        let regions = [(tree.nodes, Bvh2Node::BYTES), (tree.leaf_table, LeafEntry::BYTES)];
        for (visited, (region, stride)) in self.visited.iter_mut().zip(regions) {
            let at = addr.0.wrapping_sub(region.base.0);
            if at < region.size {
                visited.push(at / stride as u32);
            }
        }
        self.memory.read(addr, buf)
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        self.memory.write(addr, bytes)
    }
}

/// How a ray meets a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meeting {
    /// It starts in it.
    Starts,
    /// It hits what it hits in it, or before it.
    Ends,
    /// It goes in and out.
    Passes,
}

fn meeting(ray: &Ray, end: Option<Time>, bounds: &Aabb) -> Meeting {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
    for (axis, origin) in ray.origin().map(SubGrid::to_num::<f64>).into_iter().enumerate() {
        let speed = f64::from(ray.direction()[axis]) / f64::from(1 << 30);
        if speed != 0.0 {
            let time = |plane: i32| (f64::from(plane) - origin) / speed;
            let (low, high) = (time(bounds.min[axis]), time(bounds.max[axis]));
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
    }
    if enter <= ray.t_min().to_num::<f64>() {
        Meeting::Starts
    } else if end.is_some_and(|end| leave >= end.to_num::<f64>()) {
        Meeting::Ends
    } else {
        Meeting::Passes
    }
}

#[cfg(test)]
mod tests {
    use xylem_core::node::NodeFormat;
    use xylem_core::traverse::Method;

    use super::*;
    use crate::report::close_up;
    use crate::run::{self, BuildOptions};
    use crate::scene::{GridRay, LoadOptions, UpAxis, procedural};

    #[test]
    fn rounded_boxes_are_searched_as_the_quantized_tree_is() {
        let soup = procedural::soup("sphereflake:2").unwrap().unwrap();
        let mesh = soup.into_mesh("sphereflake", &LoadOptions::default()).unwrap();
        let quantization = Quantization::MODULO;
        let format = NodeFormat::Quantized(quantization);
        let options = BuildOptions { format, ..BuildOptions::default() };
        let run = run::build(&mesh.triangles, &options).unwrap();
        let exact = run.exact.unwrap();
        let camera = close_up(&mesh, UpAxis::Y, 32, 24);
        let rays = camera.rays();
        let rays: Vec<_> =
            rays.iter().map(|ray| GridRay::new(&mesh.frame, ray).core().copied()).collect();
        let by = |memory, scene| {
            run::trace_by(Method::Decompress, memory, scene, &rays, Query::Closest).unwrap()
        };
        let quantized = by(&run.memory, &run.scene);
        let all = round(&run.memory, &exact, &quantization, |_| true);
        let rounded = by(&all.memory, &exact);
        assert_eq!(rounded.hits, quantized.hits);
        let tests =
            |run: &run::TraceRun| run.per_ray.iter().map(|c| c.box_tests).collect::<Vec<_>>();
        assert_eq!(tests(&rounded), tests(&quantized));
        assert!(rounded.sums.box_tests > by(&run.memory, &exact).sums.box_tests);
        let none = round(&run.memory, &exact, &quantization, |_| false);
        assert_eq!(none.memory.bytes(), run.memory.bytes());
    }

    #[test]
    fn a_ray_starts_in_a_box_or_ends_in_it_or_passes() {
        let ray = |x: i32| {
            let origin = [x, 0, 0].map(SubGrid::from_num);
            Ray::new(origin, [1 << 30, 0, 0].into(), Time::ZERO, Ray::TIME_LIMIT).unwrap()
        };
        let bounds = Aabb::new([10, -1, -1].into(), [20, 1, 1].into());
        let end = |t: i32| Some(Time::from_num(t));
        assert_eq!(meeting(&ray(10), end(5), &bounds), Meeting::Starts);
        assert_eq!(meeting(&ray(0), end(20), &bounds), Meeting::Ends);
        assert_eq!(meeting(&ray(0), end(21), &bounds), Meeting::Passes);
        assert_eq!(meeting(&ray(0), None, &bounds), Meeting::Passes);
    }
}
