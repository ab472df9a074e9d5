//! The bare `xylem`: the whole road on one scene, and a report.

use std::path::PathBuf;
use std::time::Instant;

use xylem_core::node::{NodeFormat, Quantization};
use xylem_core::num::Grid;
use xylem_core::traverse::{Method, Query, Scene};

use super::options::{self, build_failed};
use super::render::{self, Heat, Size, Up};
use super::{CliError, Console, output, progress, rays};
use crate::report::{BuildReport, Pictures, RaySetReport, Summary, TraceReport, TreeReport, units};
use crate::run::{BuildOptions, BuildRun, Reference, TraceRun, check};
use crate::scene::procedural::DEFAULT_SCENE;
use crate::scene::{ConversionCounts, GridRay, Mesh, sampling};

/// Options of the bare command.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Folder for the report, made if it is not there [default: xylem-report]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Another scene than the bundled sphereflake of 101,392 triangles
    #[arg(long)]
    scene: Option<String>,
    /// Width and height of the pictures in pixels [default: 512x384]
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// The axis that points up in the scene [default: y]
    #[arg(long, value_enum)]
    up: Option<Up>,
}

impl Args {
    /// Whether any option is given.
    pub fn is_given(&self) -> bool {
        self.out.is_some() || self.scene.is_some() || self.size.is_some() || self.up.is_some()
    }
}

/// How many rays of each set are compared with trying every triangle.
const CHECKED: usize = 1000;

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let start = Instant::now();
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("xylem-report"));
    output::folder(&out)?;
    let size = args.size.unwrap_or(Size { width: 512, height: 384 });
    let up = args.up.unwrap_or(Up::Y);

    let mesh = options::load(args.scene.as_deref().unwrap_or(DEFAULT_SCENE), Grid::DEFAULT)?;
    let build = BuildOptions {
        format: NodeFormat::Quantized(Quantization::MODULO),
        ..BuildOptions::default()
    };
    let run = options::build(&mesh, &build)?;
    let quality = run.check().map_err(|e| build_failed(&mesh, e))?;
    let trees: Vec<_> = [("bvh2", run.exact), ("cbvh", Some(run.scene))]
        .into_iter()
        .filter_map(|(name, scene)| Some((name, scene?)))
        .collect();

    let camera = render::camera(&mesh, up, size);
    let primary = RaySet::trace("camera", &mesh, &run, &trees, &camera.rays())?;
    let bounces: Vec<_> = (0..camera.len())
        .filter_map(|i| {
            let hit = primary.rays[i].hit(primary.traced[0].hits[i].as_ref());
            sampling::bounce(&mesh, &camera.ray(i), &hit, 1, i)
        })
        .collect();
    let diffuse = RaySet::trace("diffuse", &mesh, &run, &trees, &bounces)?;
    let sets = [primary, diffuse];

    let spinner = progress::spinner("trying every triangle for some rays");
    let reference = Reference::new(&mesh.triangles);
    let checks = sets.iter().map(|set| set.check(&reference));
    let (checked, mismatches) = checks.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    spinner.finish_and_clear();

    let maps =
        [0, 1].map(|i| render::heat_map(Heat::Nodes, size.width, &sets[0].traced[i].per_ray));
    let top = maps.iter().map(|map| map.top()).max().unwrap_or(1);
    let shaded = render::shaded(&mesh, &run, run.scene, camera.with_strata(2, 1), up.into())?;
    let page = out.join("index.html");
    let pictures = Pictures {
        shaded: render::png(&shaded, &page)?,
        nodes: maps
            .iter()
            .map(|map| render::png(&map.picture(top), &page))
            .collect::<Result<_, _>>()?,
    };

    let mut tree_reports = Vec::new();
    for &(format, scene) in &trees {
        let quality = check(&run.memory, &scene).map_err(|e| build_failed(&mesh, e))?;
        let bytes_per_node = scene.tree.format.bytes();
        tree_reports.push(TreeReport {
            format,
            bytes_per_node,
            node_bytes: u64::from(scene.tree.node_count) * u64::from(bytes_per_node),
            sah_cost: (quality.root_area > 0).then(|| quality.sah_cost().to_num()),
        });
    }
    let summary = Summary {
        version: env!("CARGO_PKG_VERSION"),
        build: BuildReport::new(&mesh.name, &build, &run, &quality),
        trees: tree_reports,
        rays: sets.iter().flat_map(|set| set.reports(&mesh, &trees)).collect(),
        compared: sets.iter().map(|set| set.rays.len() as u64).sum(),
        differences: sets.iter().map(RaySet::differences).sum(),
        checked,
        mismatches,
        report: page.clone(),
        host_s: start.elapsed().as_secs_f64(),
    };
    output::write(&out.join("shaded.png"), &pictures.shaded)?;
    for (tree, png) in summary.trees.iter().zip(&pictures.nodes) {
        output::write(&out.join(format!("nodes-{}.png", tree.format)), png)?;
    }
    output::write(&page, summary.page(&pictures).as_bytes())?;
    console.result(&summary, || summary.to_string())?;
    if summary.agrees() {
        return Ok(());
    }
    let (differences, mismatches) = (summary.differences, summary.mismatches);
    Err(CliError::Mismatch(format!(
        "{}: {} hits differ between the formats and {} from the reference (a defect; please report \
         it)",
        mesh.name,
        units::count(differences),
        units::count(mismatches)
    )))
}

/// Rays and their answers in both formats.
struct RaySet {
    name: &'static str,
    rays: Vec<GridRay>,
    traced: [TraceRun; 2],
}

impl RaySet {
    fn trace(
        name: &'static str,
        mesh: &Mesh,
        run: &BuildRun,
        trees: &[(&'static str, Scene)],
        scene_rays: &[crate::scene::SceneRay],
    ) -> Result<Self, CliError> {
        let rays: Vec<GridRay> =
            scene_rays.iter().map(|ray| GridRay::new(&mesh.frame, ray)).collect();
        let trace =
            |scene: &Scene| rays::trace(Method::default(), mesh, run, scene, &rays, Query::Closest);
        let traced = [trace(&trees[0].1)?, trace(&trees[1].1)?];
        Ok(Self { name, rays, traced })
    }

    /// How many hits differ between the formats in any bit.
    fn differences(&self) -> u64 {
        let [a, b] = &self.traced;
        a.hits.iter().zip(&b.hits).filter(|(a, b)| a != b).count() as u64
    }

    /// Compares some rays, evenly chosen, with the reference; returns how many and how many differ.
    fn check(&self, reference: &Reference) -> (u64, u64) {
        let step = self.rays.len().div_ceil(CHECKED).max(1);
        let rays: Vec<GridRay> = self.rays.iter().step_by(step).copied().collect();
        let hits: Vec<_> = self.traced[1].hits.iter().step_by(step).copied().collect();
        let wrong = rays::check(reference, &rays, &hits, Query::Closest);
        (rays.len() as u64, wrong.len() as u64)
    }

    fn reports(&self, mesh: &Mesh, trees: &[(&'static str, Scene)]) -> Vec<RaySetReport> {
        let conversion = ConversionCounts::of(&self.rays);
        let report = |((_, scene), traced): (&(&'static str, Scene), &TraceRun)| {
            let words = BuildReport::format_words(scene.tree.format);
            let trace = TraceReport::new(&mesh.name, words, "closest", &conversion, traced);
            RaySetReport { set: self.name, trace }
        };
        trees.iter().zip(&self.traced).map(report).collect()
    }
}
