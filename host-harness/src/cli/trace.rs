//! `xylem trace`.

use std::path::PathBuf;

use xylem_core::node::NodeFormat;
use xylem_core::traverse::Method;

use super::options::{self, QueryArg, TraversalArg, TreeArgs};
use super::{CliError, Console, output, rays};
use crate::report::{BuildReport, MethodReport, TraceReport};
use crate::run::Reference;
use crate::scene::rays::{RayFileError, read_rays, write_hits};
use crate::scene::{ConversionCounts, Hit, convert};

/// Trace a file of rays through the tree of a scene
///
/// A ray file is little-endian f32 `ox oy oz dx dy dz tmin tmax` per ray, a hit file little-endian
/// `u32 prim, f32 t u v` per ray with prim 4294967295 for a miss; both may be gzipped. A ray is the
/// interval tmin < t <= tmax of origin + t * direction; directions need not have unit length.
///
/// The closest hit is exact on the grid: of several triangles at the same time, the lowest index.
/// Rays without a direction or with an empty interval are misses, and counted.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem trace bunny.obj.gz --rays primary.rays --hits primary.hits\n  \
    xylem trace bunny.obj.gz --rays shadow.rays.gz --query any --format cbvh --json\n  \
    xylem trace bunny.obj.gz --rays primary.rays --format cbvh --traversal point\n  \
    xylem trace teapot.obj --rays hard.rays --check")]
pub(super) struct Args {
    #[command(flatten)]
    tree: TreeArgs,
    /// The rays
    #[arg(long, value_name = "FILE")]
    rays: PathBuf,
    /// Where to put the hits; gzipped if the name ends in .gz
    #[arg(long, value_name = "FILE")]
    hits: Option<PathBuf>,
    /// What the rays are asked
    #[arg(long, value_enum, default_value_t = QueryArg::Closest)]
    query: QueryArg,
    /// How the boxes of cbvh nodes are tested; the closest hits are the same [default: incremental]
    #[arg(long, value_enum)]
    traversal: Option<TraversalArg>,
    /// Compare every answer with trying every triangle exactly, which takes time; exit code 1 if
    /// any differs
    #[arg(long)]
    check: bool,
}

/// How many mismatches are listed.
const LISTED: usize = 10;

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let options = args.tree.build_options()?;
    if args.traversal.is_some() && options.format == NodeFormat::Bvh2 {
        let message = "--traversal is about quantized nodes, but --format is bvh2; use --format cbvh \
                       or leave it out";
        return Err(CliError::Usage(message.into()));
    }
    if let Some(path) = &args.hits {
        output::check_writable(path)?;
    }
    let scene_rays = read_rays(&args.rays)?;
    let mesh = args.tree.load()?;
    let grid_rays = convert::convert(&mesh.frame, &scene_rays)
        .map_err(|source| RayFileError::BadRay { path: args.rays.clone(), source })?;
    let run = options::build(&mesh, &options)?;
    let method = args.traversal.map_or(Method::default(), Method::from);
    let traced = rays::trace(method, &mesh, &run, &run.scene, &grid_rays, args.query.into())?;
    if let Some(path) = &args.hits {
        let answers = grid_rays.iter().zip(&traced.hits);
        let hits: Vec<Hit> = answers.map(|(ray, hit)| ray.hit(hit.as_ref())).collect();
        write_hits(path, &hits)?;
    }

    let words = BuildReport::format_words(options.format);
    let conversion = ConversionCounts::of(&grid_rays);
    let mut report = TraceReport::new(&mesh.name, words, args.query, &conversion, &traced);
    if let NodeFormat::Quantized(quantization) = &options.format {
        report.method = Some(MethodReport::new(method, quantization));
    }
    let mut mismatches = Vec::new();
    if args.check {
        let reference = Reference::new(&mesh.triangles);
        mismatches = rays::check(&reference, &grid_rays, &traced.hits, args.query.into());
        report.checked = Some(report.rays);
        report.mismatches = Some(mismatches.len() as u64);
    }
    console.result(&report, || report.to_string())?;
    if mismatches.is_empty() {
        return Ok(());
    }
    let mut message = format!(
        "{}: {} of {} answers are wrong (a defect; please report it):",
        args.rays.display(),
        mismatches.len(),
        report.rays
    );
    for mismatch in mismatches.iter().take(LISTED) {
        message += &format!("\n  ray {}: {}", mismatch.ray, mismatch.difference);
    }
    if mismatches.len() > LISTED {
        message += &format!("\n  and {} more", mismatches.len() - LISTED);
    }
    Err(CliError::Mismatch(message))
}
