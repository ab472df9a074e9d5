//! `xylem render`.

use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;

use clap::ValueEnum;
use serde::Serialize;
use xylem_core::traverse::{Method, Query, Scene};

use super::options::{self, TreeArgs};
use super::{CliError, Console, output, progress, rays};
use crate::report::{BuildReport, HeatMap, Picture, Shading, close_up, units};
use crate::run::{BuildRun, TraceCounts, TraceRun};
use crate::scene::{Camera, GridRay, Mesh, UpAxis};

/// Draw a picture of a scene, every ray of it traced in fixed point
///
/// The camera stands in front of the scene, a little to the right and above, and has all of it in
/// view. Without --heatmap the picture is shaded: clay under a light with shadows and an open sky.
/// With it, each pixel shows what its camera ray cost, with a legend below.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem render sphereflake --out flake.png\n  \
    xylem render bunny.obj.gz --heatmap nodes --format cbvh --out nodes.png\n  \
    xylem render part.obj --up z --size 1280x720 --samples 3 --out part.png")]
pub(super) struct Args {
    #[command(flatten)]
    tree: TreeArgs,
    /// Where to put the picture, as PNG
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Width and height in pixels, each 1 to 8192
    #[arg(long, value_name = "WxH", default_value = "640x480")]
    size: Size,
    /// Show what each camera ray cost instead of light: nodes fetched, triangles or boxes tested
    #[arg(long, value_enum)]
    heatmap: Option<Heat>,
    /// The axis that points up in the scene
    #[arg(long, value_enum, default_value_t = Up::Y)]
    up: Up,
    /// N x N rays a pixel in a shaded picture, 1 to 16
    #[arg(long, value_name = "N", default_value_t = 2,
          value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
}

/// `--size`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Size {
    pub width: u32,
    pub height: u32,
}

/// `--heatmap`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Heat {
    /// Nodes fetched
    Nodes,
    /// Triangles tested
    Tris,
    /// Boxes tested
    Boxes,
}

/// `--up`.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Up {
    /// +x
    X,
    /// +y
    Y,
    /// +z
    Z,
}

impl From<Up> for UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::X => Self::X,
            Up::Y => Self::Y,
            Up::Z => Self::Z,
        }
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| (1..=8192).contains(side));
        let sides = text.split_once('x').and_then(|(w, h)| Some((side(w)?, side(h)?)));
        let (width, height) =
            sides.ok_or("write WIDTHxHEIGHT in pixels, each 1 to 8192, as 640x480")?;
        Ok(Self { width, height })
    }
}

#[derive(Serialize)]
struct Rendered<'a> {
    scene: &'a str,
    format: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    coords: Option<&'static str>,
    file: &'a Path,
    width: u32,
    height: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    heatmap: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mean_per_ray: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_per_ray: Option<u64>,
    host_ms: f64,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let options = args.tree.build_options()?;
    output::check_writable(&args.out)?;
    let mesh = args.tree.load()?;
    let run = options::build(&mesh, &options)?;
    let camera = camera(&mesh, args.up, args.size);
    let start = Instant::now();
    let (picture, map) = match args.heatmap {
        None => {
            let camera = camera.with_strata(args.samples, 1);
            (shaded(&mesh, &run, run.scene, camera, args.up.into())?, None)
        }
        Some(heat) => {
            let (_, traced) = camera_rays(&mesh, &run, &run.scene, &camera)?;
            let map = heat_map(heat, args.size.width, &traced.per_ray);
            (map.picture(map.top()), Some(map))
        }
    };
    let host_ms = units::milliseconds(start.elapsed());
    output::write(&args.out, &png(&picture, &args.out)?)?;
    let (format, coords) = BuildReport::format_words(options.format);
    let rendered = Rendered {
        scene: &mesh.name,
        format,
        coords,
        file: &args.out,
        width: picture.width(),
        height: picture.height(),
        heatmap: map.as_ref().map(|map| map.what.clone()),
        mean_per_ray: map.as_ref().and_then(HeatMap::mean),
        max_per_ray: map.as_ref().map(HeatMap::max),
        host_ms,
    };
    console.result(&rendered, || rendered.to_text())
}

impl Rendered<'_> {
    fn to_text(&self) -> String {
        let mut text = format!("{}: {}", self.scene, self.format);
        if let (Some(what), Some(max)) = (&self.heatmap, self.max_per_ray) {
            let mean = self.mean_per_ray.map_or("n/a".into(), |mean| format!("{mean:.2}"));
            text += &format!(", {what} per ray: mean {mean}, max {}", units::count(max));
        }
        let (file, ms) = (self.file.display(), self.host_ms);
        text + &format!("\n  {} x {} pixels in {file} ({ms:.0} ms)", self.width, self.height)
    }
}

/// The standard view of a scene.
pub(super) fn camera(mesh: &Mesh, up: Up, size: Size) -> Camera {
    close_up(mesh, up.into(), size.width, size.height)
}

/// Traces all rays of a camera.
///
/// # Errors
/// [`CliError::Trace`].
pub(super) fn camera_rays(
    mesh: &Mesh,
    run: &BuildRun,
    scene: &Scene,
    camera: &Camera,
) -> Result<(Vec<GridRay>, TraceRun), CliError> {
    let rays: Vec<GridRay> =
        (0..camera.len()).map(|i| GridRay::new(&mesh.frame, &camera.ray(i))).collect();
    let traced = rays::trace(Method::default(), mesh, run, scene, &rays, Query::Closest)?;
    Ok((rays, traced))
}

/// What rays cost, for a picture `width` pixels wide.
pub(super) fn heat_map(heat: Heat, width: u32, per_ray: &[TraceCounts]) -> HeatMap {
    let (what, pick): (_, fn(&TraceCounts) -> u64) = match heat {
        Heat::Nodes => ("node visits", |c| c.nodes),
        Heat::Tris => ("triangle tests", |c| c.triangle_tests),
        Heat::Boxes => ("box tests", |c| c.box_tests),
    };
    HeatMap { what: what.into(), width, counts: per_ray.iter().map(pick).collect() }
}

/// Draws a shaded picture.
///
/// # Errors
/// [`CliError::Trace`].
pub(super) fn shaded(
    mesh: &Mesh,
    run: &BuildRun,
    scene: Scene,
    camera: Camera,
    up: UpAxis,
) -> Result<Picture, CliError> {
    let bar = progress::bar(u64::from(camera.height()), "drawing");
    let shading = Shading { mesh, memory: &run.memory, scene, camera, up, sky_rays: 2 };
    let picture = shading
        .draw(|| bar.inc(1))
        .map_err(|source| CliError::Trace { scene: mesh.name.clone(), source })?;
    bar.finish_and_clear();
    Ok(picture)
}

/// Encodes a picture that will be at `path`.
///
/// # Errors
/// [`CliError::Image`].
pub(super) fn png(picture: &Picture, path: &Path) -> Result<Vec<u8>, CliError> {
    picture.to_png().map_err(|source| CliError::Image { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_parse_or_say_how() {
        assert_eq!("7x8192".parse(), Ok(Size { width: 7, height: 8192 }));
        for wrong in ["", "7", "0x4", "4x8193", "ax4", "4x4x4", "-1x2"] {
            let error = wrong.parse::<Size>().unwrap_err();
            assert!(error.contains("as 640x480"), "{wrong}: {error}");
        }
    }
}
