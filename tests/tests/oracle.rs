//! Every mesh and ray set with known answers, in every node format.
//!
//! `$XYLEM_ORACLE` holds meshes and ray sets with the exact answers of the float mesh, see its
//! README. Two questions are asked of each set:
//!
//! 1. Is every answer, in every format and for both queries, the exact answer on the grid? The
//!    exact answer is that of a brute-force search written without the core's triangle test.
//! 2. Where does the answer on the grid differ from that of the float mesh, and is each difference
//!    the grid's doing? The rule is the README's: rays whose answer depends on rounding are counted,
//!    not compared; of the others each difference must be shown to follow from moving vertices by at
//!    most half a grid unit, in exact arithmetic.
//!
//! Brute force takes every 40th ray, and every ray with `XYLEM_FULL=1`. Everything else always takes
//! all rays.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use num_traits::{Signed as _, ToPrimitive as _, Zero as _};
use rayon::prelude::*;
use xylem::run::{self, Reference, TraceRun};
use xylem::scene::rays::{read_hits, read_rays};
use xylem::scene::{GridRay, Hit as SceneHit, LoadOptions, Mesh, SceneRay, convert, obj};
use xylem_core::geom::Ray;
use xylem_core::traverse::{Hit, Query};
use xylem_tests::rational::{
    ExactRay, Fraction, Vector, fraction, grid_corners, largest, minus, ratio, scene_point,
};
use xylem_tests::trees::Forest;
use xylem_tests::{places, results};

const MESHES: [&str; 6] = ["armadillo", "bunny", "cow", "fandisk", "sponza", "teapot"];
const SETS: [&str; 3] = ["primary", "diffuse", "random"];

const TIE: u8 = 1;
const UNSTABLE: u8 = 2 | 4 | 8;

#[test]
fn every_answer_is_the_exact_one_and_every_difference_to_the_float_mesh_is_the_grids() {
    let test = "every_answer_is_the_exact_one_and_every_difference_to_the_float_mesh_is_the_grids";
    let Some(folder) = places::folder("XYLEM_ORACLE", test) else { return };
    let step = if places::full() { 1 } else { 40 };
    let mut table = String::from(
        "| rays | number | brute force | hits | unstable | compared | equal | of a tie | other \
         triangle | extra hit | lost hit | time only | by snapping | by ray | by time step | \
         unexplained | largest time error |\n\
         |---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    let mut list = String::new();
    let mut wrong = Vec::new();
    for name in MESHES {
        let path = folder.join(format!("{name}.obj.gz"));
        let mesh = obj::load(&path, &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let forest = Forest::grow(&mesh.triangles);
        let reference = Reference::new(&mesh.triangles);
        for set in SETS {
            let set = RaySet::read(&folder, name, set, &mesh);
            let answers = set.trace(&forest);
            let brute = set.check_against_brute_force(&reference, &answers, step);
            let tally = set.compare(&mesh, &reference, &answers);
            let line = tally.row(&set.name, set.rays.len(), brute, &answers);
            println!("{line}");
            writeln!(table, "{line}").unwrap();
            for Difference { ray, cause, text, .. } in &tally.differences {
                let text = format!("{} ray {ray}: {text}; {}", set.name, cause.about());
                writeln!(list, "{text}").unwrap();
                if *cause == Cause::Unexplained {
                    wrong.push(text);
                }
            }
        }
    }
    println!("{list}");
    if places::full() {
        let body = format!(
            "Every mesh and ray set with known answers, formats `bvh2`, `relative` and `modulo`, \
             closest and any hit; run on {}.\n\n{table}\n{NOTES}\nEvery difference:\n\n```\n{list}```\n",
            results::today()
        );
        results::report("Rays with known answers", &body);
    } else {
        println!("{table}");
    }
    assert!(wrong.is_empty(), "unexplained:\n{}", wrong.join("\n"));
}

const NOTES: &str = "\
- *brute force*: rays whose answers in all formats and for both queries were compared with those of an
  exact search through all triangles on the grid. All are equal.
- *unstable*: rays whose answer depends on rounding (fragile, grazing or coplanar), not compared.
- *of a tie*: answers that are another of several triangles hit at exactly the same time; no difference.
- *other triangle*, *extra hit*, *lost hit*, *time only* (more than 4 grid units along the ray and 1e-6
  relative): the differences, each with its cause.
- *by snapping*: the exact answer to the float ray on the snapped mesh is ours.
- *by ray*: it is not yet, but is once the snapped mesh is moved by the rounding of the ray, less than a
  32nd of a grid unit.
- *by time step*: two hits lie within one step of time, a 64th of a unit, and the lower index wins.
- *largest time error*: of equal answers, in grid units along the ray, beyond 1e-6 relative.
";

/// A ray set with its answers.
struct RaySet {
    name: String,
    rays: Vec<SceneRay>,
    truth: Vec<SceneHit>,
    flags: Vec<u8>,
    grid: Vec<GridRay>,
    core: Vec<Option<Ray>>,
}

impl RaySet {
    fn read(folder: &Path, mesh_name: &str, set: &str, mesh: &Mesh) -> Self {
        let path = |kind: &str| folder.join(format!("{mesh_name}.{set}.{kind}.gz"));
        let rays = read_rays(&path("rays")).unwrap_or_else(|e| panic!("{e}"));
        let truth = read_hits(&path("truth")).unwrap_or_else(|e| panic!("{e}"));
        let packed = std::fs::read(path("flags")).expect("the flags are readable");
        let mut flags = Vec::new();
        flate2::read::GzDecoder::new(packed.as_slice()).read_to_end(&mut flags).expect("gzip");
        assert!(rays.len() == truth.len() && rays.len() == flags.len() && !rays.is_empty());
        let grid = convert::convert(&mesh.frame, &rays).unwrap_or_else(|e| panic!("{e}"));
        let core = grid.iter().map(|ray| ray.core().copied()).collect();
        Self { name: format!("{mesh_name} {set}"), rays, truth, flags, grid, core }
    }

    /// The answers to the closest-hit query, after comparing those of all formats and both queries.
    fn trace(&self, forest: &Forest) -> Vec<Option<Hit>> {
        let trace = |scene, query| -> TraceRun {
            run::trace(&forest.memory, scene, &self.core, query).unwrap_or_else(|e| panic!("{e}"))
        };
        let closest = trace(&forest.exact, Query::Closest).hits;
        for (format, scene) in forest.scenes() {
            let again = trace(scene, Query::Closest).hits;
            let any = trace(scene, Query::Any).hits;
            for (i, hit) in closest.iter().enumerate() {
                assert_eq!(*hit, again[i], "{} ray {i}, {format}", self.name);
                assert_eq!(hit.is_some(), any[i].is_some(), "{} ray {i}, {format}, any", self.name);
            }
        }
        closest
    }

    /// Compares every `step`-th answer with an exhaustive search; returns how many. The answers of
    /// the other query and formats have been compared with these.
    fn check_against_brute_force(
        &self,
        reference: &Reference,
        answers: &[Option<Hit>],
        step: usize,
    ) -> usize {
        let chosen: Vec<usize> = (0..self.rays.len()).step_by(step).collect();
        chosen.par_iter().for_each(|&i| self.check_one(reference, answers, i));
        chosen.len()
    }

    fn check_one(&self, reference: &Reference, answers: &[Option<Hit>], i: usize) {
        let exact = self.core[i].as_ref().and_then(|ray| reference.closest(ray));
        let ours = answers[i].map(|hit| (hit.primitive.0, hit.t.to_bits()));
        assert_eq!(ours, exact.map(|a| (a.primitive, a.t)), "{} ray {i}", self.name);
    }

    /// Compares the answers with those of the float mesh.
    fn compare(&self, mesh: &Mesh, reference: &Reference, answers: &[Option<Hit>]) -> Tally {
        let mut tally = Tally::default();
        let mut open = Vec::new();
        for (i, ours) in answers.iter().enumerate() {
            if self.flags[i] & UNSTABLE != 0 {
                tally.unstable += 1;
                continue;
            }
            tally.compared += 1;
            let truth = self.truth[i];
            let same = ours.map(|hit| hit.primitive.0) == truth.is_hit().then_some(truth.prim);
            match ours {
                Some(hit) if same => match self.time_error(mesh, i, hit) {
                    error if error <= 4.0 => {
                        tally.equal += 1;
                        tally.time_error = tally.time_error.max(error);
                    }
                    _ => open.push(i),
                },
                None if same => tally.equal += 1,
                _ => open.push(i),
            }
        }
        let explained: Vec<_> = open
            .par_iter()
            .map(|&i| {
                self.check_one(reference, answers, i);
                (i, Judge::new(self, mesh, i).cause(answers[i].as_ref()))
            })
            .collect();
        for (ray, cause) in explained {
            match cause {
                Cause::OtherOfTie => tally.other_of_tie += 1,
                _ => tally.differences.push(self.difference(mesh, ray, cause, &answers[ray])),
            }
        }
        tally
    }

    fn difference(&self, mesh: &Mesh, ray: usize, cause: Cause, ours: &Option<Hit>) -> Difference {
        let truth = self.truth[ray];
        let (what, text) = match ours {
            None => (What::Lost, format!("miss, float mesh: triangle {}", truth.prim)),
            Some(hit) if !truth.is_hit() => {
                (What::Extra, format!("triangle {}, float mesh: miss", hit.primitive.0))
            }
            Some(hit) if hit.primitive.0 != truth.prim => {
                let text = format!("triangle {}, float mesh: {}", hit.primitive.0, truth.prim);
                (What::Other, text)
            }
            Some(hit) => {
                let error = self.time_error(mesh, ray, hit);
                (What::Time, format!("triangle {}, {error:.1} grid units off", truth.prim))
            }
        };
        Difference { ray, what, cause, text }
    }

    /// How far our time is from the true one, in grid units along the ray, beyond 1e-6 relative.
    fn time_error(&self, mesh: &Mesh, ray: usize, hit: &Hit) -> f64 {
        self.time_distance(mesh, ray, hit, self.truth[ray].t.into())
    }

    fn time_distance(&self, mesh: &Mesh, ray: usize, hit: &Hit, exact: f64) -> f64 {
        let GridRay::Core { times, .. } = &self.grid[ray] else { return f64::INFINITY };
        let difference = (times.to_scene(hit.t) - exact).abs() - 1e-6 * exact.abs();
        let length = self.rays[ray].direction.iter().map(|d| f64::from(*d).powi(2)).sum::<f64>();
        (difference * length.sqrt() / mesh.frame.cell()).max(0.0)
    }
}

/// Why an answer is not that of the float mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Cause {
    /// It is another of several triangles that are exactly tied: no difference.
    OtherOfTie,
    /// The exact answer to the float ray on the snapped mesh is ours.
    SnappedVertices,
    /// The exact answer to the float ray is ours on a mesh that is moved by the ray's rounding.
    RoundedRay,
    /// Two hits are within one step of time and the lower index won.
    RoundedTime,
    /// None of these.
    Unexplained,
}

impl Cause {
    const fn about(self) -> &'static str {
        match self {
            Self::OtherOfTie => "the other of a tie",
            Self::SnappedVertices => "the exact answer on the snapped mesh is ours",
            Self::RoundedRay => {
                "the exact answer on the snapped mesh, moved by the ray's rounding, is ours"
            }
            Self::RoundedTime => "two hits within one step of time",
            Self::Unexplained => "UNEXPLAINED",
        }
    }
}

/// What the comparison of one set found.
#[derive(Default)]
struct Tally {
    unstable: usize,
    compared: usize,
    equal: usize,
    other_of_tie: usize,
    time_error: f64,
    differences: Vec<Difference>,
}

/// An answer that is not that of the float mesh.
struct Difference {
    ray: usize,
    what: What,
    cause: Cause,
    text: String,
}

/// How an answer differs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum What {
    Other,
    Extra,
    Lost,
    Time,
}

impl Tally {
    fn row(&self, name: &str, rays: usize, brute: usize, answers: &[Option<Hit>]) -> String {
        let count = |pick: &dyn Fn(&Difference) -> bool| {
            self.differences.iter().filter(|d| pick(d)).count().to_string()
        };
        let what = |what| count(&|d: &Difference| d.what == what);
        let cause = |cause| count(&|d: &Difference| d.cause == cause);
        let cells = [
            name.to_owned(),
            rays.to_string(),
            brute.to_string(),
            answers.iter().flatten().count().to_string(),
            self.unstable.to_string(),
            self.compared.to_string(),
            self.equal.to_string(),
            self.other_of_tie.to_string(),
            what(What::Other),
            what(What::Extra),
            what(What::Lost),
            what(What::Time),
            cause(Cause::SnappedVertices),
            cause(Cause::RoundedRay),
            cause(Cause::RoundedTime),
            cause(Cause::Unexplained),
            format!("{:.3}", self.time_error),
        ];
        format!("| {} |", cells.join(" | "))
    }
}

/// One ray in exact arithmetic, against the triangles that it may hit.
struct Judge<'a> {
    set: &'a RaySet,
    ray: usize,
    mesh: &'a Mesh,
    float_ray: ExactRay,
    grid_ray: Option<Ray>,
    flags: u8,
    candidates: Vec<u32>,
}

impl<'a> Judge<'a> {
    fn new(set: &'a RaySet, mesh: &'a Mesh, i: usize) -> Self {
        let candidates = (0..mesh.triangles.len())
            .filter(|&triangle| may_hit(mesh, &set.rays[i], triangle))
            .map(|triangle| triangle as u32)
            .collect();
        Self {
            set,
            ray: i,
            mesh,
            float_ray: ExactRay::of_scene(&set.rays[i]),
            grid_ray: set.core[i],
            flags: set.flags[i],
            candidates,
        }
    }

    fn cause(&self, ours: Option<&Hit>) -> Cause {
        let prim = ours.map(|hit| hit.primitive.0);
        if self.flags & TIE != 0 {
            let float = self.closest(&self.float_ray, false);
            if self.names_one_of(&float, prim) && self.same_time(&float, ours) {
                return Cause::OtherOfTie;
            }
        }
        self.assert_snapping_moves_by_half_a_cell();
        let snapped = self.closest(&self.float_ray, true);
        if self.names_one_of(&snapped, prim) && self.same_time(&snapped, ours) {
            return Cause::SnappedVertices;
        }
        let Some(grid_ray) = &self.grid_ray else { return Cause::Unexplained };
        let rounded = ExactRay::of_grid_in(&self.mesh.frame, grid_ray);
        if self.rounding_moves_by(&rounded) >= ratio(1, 32) {
            return Cause::Unexplained;
        }
        // Our answer must be exact for the rounded ray. Seen from the float ray, that is the mesh
        // moved by the distance between the two rays.
        let first = self.closest(&rounded, true);
        let our_time = ours.map(|hit| ratio(hit.t.to_bits(), 64));
        match (&first, prim, our_time) {
            (None, None, None) => Cause::RoundedRay,
            (Some((t, tied)), Some(prim), Some(ours)) => {
                // The reported time is the exact one rounded up by less than a step.
                let step = ratio(1, 64);
                let is_first = *t <= ours && ours < t + &step;
                let hit = rounded.hit(&self.corners(prim, true));
                let is_hit = hit.is_some_and(|t| t <= ours && ours < t + step);
                match (is_first && is_hit, tied.contains(&prim)) {
                    (true, true) => Cause::RoundedRay,
                    (true, false) => Cause::RoundedTime,
                    (false, _) => Cause::Unexplained,
                }
            }
            _ => Cause::Unexplained,
        }
    }

    fn closest(&self, ray: &ExactRay, snapped: bool) -> Option<(Fraction, Vec<u32>)> {
        ray.closest(self.candidates.iter().map(|&i| (i, self.corners(i, snapped))))
    }

    fn names_one_of(&self, closest: &Option<(Fraction, Vec<u32>)>, prim: Option<u32>) -> bool {
        match (closest, prim) {
            (None, None) => true,
            (Some((_, tied)), Some(prim)) => tied.contains(&prim),
            _ => false,
        }
    }

    /// Whether our time is that of the exact hit, by the rule's bound.
    fn same_time(&self, closest: &Option<(Fraction, Vec<u32>)>, ours: Option<&Hit>) -> bool {
        let (Some((exact, _)), Some(ours)) = (closest, ours) else { return true };
        let exact = exact.to_f64().unwrap_or(f64::INFINITY);
        self.set.time_distance(self.mesh, self.ray, ours, exact) <= 4.0
    }

    /// The corners of a triangle of the snapped or the float mesh, in scene units.
    fn corners(&self, triangle: u32, snapped: bool) -> [Vector; 3] {
        if snapped {
            let corners = grid_corners(&self.mesh.triangles[triangle as usize]);
            return corners.map(|point| scene_point(&self.mesh.frame, &point));
        }
        let corners = self.mesh.corners(triangle as usize).expect("the triangle exists");
        corners.map(|p| p.map(|c| fraction(c.into())))
    }

    /// Half a cell, plus the 2⁻²⁷ that the frame's arithmetic may err by.
    fn assert_snapping_moves_by_half_a_cell(&self) {
        let bound = fraction(self.mesh.frame.cell()) * (ratio(1, 2) + ratio(1, 1 << 27));
        for &i in &self.candidates {
            let (float, snapped) = (self.corners(i, false), self.corners(i, true));
            for (a, b) in float.iter().zip(&snapped) {
                assert!(largest(&minus(a, b)) <= bound, "triangle {i}");
            }
        }
    }

    /// How far the rounded ray is from the float ray, at most, while it is within reach of the
    /// grid, in cells. Both ends of the way are enough, as the distance is convex.
    fn rounding_moves_by(&self, rounded: &ExactRay) -> Fraction {
        let cell = fraction(self.mesh.frame.cell());
        // The float ray's time at a point is found by its largest component.
        let axis = (0..3).max_by_key(|&i| self.float_ray.direction[i].abs()).unwrap_or(0);
        let reach = [ratio(0, 1), ratio(1 << 26, 1)];
        let moved = reach.map(|t| {
            let point = rounded.at(&t);
            let time =
                (&point[axis] - &self.float_ray.origin[axis]) / &self.float_ray.direction[axis];
            largest(&minus(&point, &self.float_ray.at(&time))) / &cell
        });
        moved.into_iter().fold(Fraction::zero(), |a, b| a.max(b))
    }
}

/// Whether the ray's line may hit the triangle, however its corners and the ray are moved by less
/// than two grid cells. Errs only towards yes.
fn may_hit(mesh: &Mesh, ray: &SceneRay, triangle: usize) -> bool {
    let corners = mesh.corners(triangle).expect("the triangle exists");
    let (o, d) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
    let slack = 2.0 * mesh.frame.cell() + 1e-14 * o.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let [a, b, c] = corners.map(|p| [0, 1, 2].map(|i| f64::from(p[i]) - o[i]));
    let sum = |v: &[f64; 3]| v[0].abs() + v[1].abs() + v[2].abs();
    let volume = |p: &[f64; 3], q: &[f64; 3]| {
        let n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let value = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
        let error = sum(&d) * (4.0 * slack * (sum(p) + sum(q) + slack) + 1e-12 * sum(p) * sum(q));
        if value.abs() <= error { 0.0 } else { value }
    };
    let volumes = [volume(&a, &b), volume(&b, &c), volume(&c, &a)];
    !(volumes.iter().any(|v| *v > 0.0) && volumes.iter().any(|v| *v < 0.0))
}
