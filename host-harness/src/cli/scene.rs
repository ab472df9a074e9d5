//! `xylem scene`.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Subcommand;
use flate2::Compression;
use serde::Serialize;
use xylem_core::num::Grid;

use super::{CliError, Console, options, output};
use crate::report::{Table, units, wrap};
use crate::scene::find::Library;
use crate::scene::procedural::{GENERATORS, degenerate};
use crate::scene::{SceneError, procedural};

/// List, compute and describe scenes
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem scene list\n  \
    xylem scene generate terrain:levels=10,seed=7 --out terrain.obj.gz\n  \
    xylem scene info bunny.obj.gz --json")]
pub(super) struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the scenes that a name stands for: computed ones and files that were found
    List,
    /// Compute a scene and write it as Wavefront OBJ
    Generate {
        /// The scene's name and parameters, as `terrain`, `terrain:9` or `hair:hairs=50,seed=2`
        name: String,
        /// Where to put it; gzipped if the name ends in .gz
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Print a scene's size, its box and the grid that is laid over it
    Info {
        /// OBJ file, a name in scenes/ or $XYLEM_SCENES, or a computed scene
        scene: String,
        /// Bits of a grid coordinate, 4 to 24
        #[arg(long, value_name = "BITS", default_value_t = 24,
              value_parser = clap::value_parser!(u8).range(4..=24))]
        grid: u8,
    },
}

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    match &args.action {
        Action::List => list(console),
        Action::Generate { name, out } => generate(name, out, console),
        Action::Info { scene, grid } => info(scene, *grid, console),
    }
}

#[derive(Serialize)]
struct Listing {
    computed: Vec<Computed>,
    degenerate: Vec<Degenerate>,
    folders: Vec<PathBuf>,
    files: Vec<String>,
}

#[derive(Serialize)]
struct Computed {
    name: &'static str,
    about: &'static str,
    parameters: Vec<Parameter>,
}

#[derive(Serialize)]
struct Parameter {
    name: &'static str,
    default: u32,
    min: u32,
    max: u32,
    about: &'static str,
}

#[derive(Serialize)]
struct Degenerate {
    name: String,
    about: &'static str,
}

fn list(console: Console) -> Result<(), CliError> {
    let library = Library::default();
    let computed_names: Vec<String> = procedural::names().collect();
    let listing = Listing {
        computed: GENERATORS
            .iter()
            .map(|g| Computed {
                name: g.name,
                about: g.about,
                parameters: g
                    .parameters
                    .iter()
                    .map(|&procedural::Parameter { name, default, min, max, about }| Parameter {
                        name,
                        default,
                        min,
                        max,
                        about,
                    })
                    .collect(),
            })
            .collect(),
        degenerate: degenerate::CASES
            .iter()
            .map(|c| Degenerate { name: format!("degenerate/{}", c.name), about: c.about })
            .collect(),
        folders: library.folders.iter().filter(|f| !f.as_os_str().is_empty()).cloned().collect(),
        files: library.names().into_iter().filter(|n| !computed_names.contains(n)).collect(),
    };
    console.result(&listing, || listing.to_text())
}

impl Listing {
    fn to_text(&self) -> String {
        let mut text = String::from("Computed scenes, with their parameters and defaults:\n");
        for scene in &self.computed {
            text += &item(15, format!("  {:<12} {}", scene.name, scene.about));
            for p in &scene.parameters {
                let range = format!("{} to {}", p.min, p.max);
                let line = format!("    {:<8} {:>5}  {range:<15} {}", p.name, p.default, p.about);
                text += &item(36, line);
            }
        }
        text += "\nScenes that break tracers:\n";
        for scene in &self.degenerate {
            text += &item(29, format!("  {:<26} {}", scene.name, scene.about));
        }
        text += "\nFiles in\n";
        for folder in &self.folders {
            text += &format!("  {}\n", folder.display());
        }
        match self.files.as_slice() {
            [] => text += "  none; set XYLEM_SCENES to folders with .obj or .obj.gz files\n",
            files => {
                for name in files {
                    text += &format!("  {name}\n");
                }
            }
        }
        text
    }
}

/// A line of the listing, wrapped with what follows indented by `hanging`.
fn item(hanging: usize, line: String) -> String {
    wrap(&line, hanging) + "\n"
}

#[derive(Serialize)]
struct Generated<'a> {
    scene: &'a str,
    file: &'a Path,
    vertices: usize,
    triangles: usize,
    file_bytes: usize,
}

fn generate(name: &str, out: &Path, console: Console) -> Result<(), CliError> {
    output::check_writable(out)?;
    let soup = procedural::soup(name)
        .ok_or_else(|| CliError::NoGenerator { name: name.to_owned() })?
        .map_err(|source| SceneError::Parameter { name: name.to_owned(), source })?;
    let mut bytes = soup.to_obj(&format!("xylem scene generate {name}")).into_bytes();
    if out.extension().is_some_and(|e| e == "gz") {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&bytes)?;
        bytes = encoder.finish()?;
    }
    output::write(out, &bytes)?;
    let generated = Generated {
        scene: name,
        file: out,
        vertices: soup.positions.len(),
        triangles: soup.indices.len(),
        file_bytes: bytes.len(),
    };
    console.result(&generated, || {
        format!(
            "{name}: {} vertices, {} triangles, {} in {}",
            units::count(generated.vertices as u64),
            units::count(generated.triangles as u64),
            units::bytes(generated.file_bytes as u64),
            out.display()
        )
    })
}

#[derive(Serialize)]
struct Info<'a> {
    scene: &'a str,
    vertices: usize,
    triangles: usize,
    faces_fanned: usize,
    faces_skipped: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    bounds: Option<[[f32; 3]; 2]>,
    grid_bits: u8,
    grid_cell: f64,
    grid_origin: [f64; 3],
}

fn info(scene: &str, bits: u8, console: Console) -> Result<(), CliError> {
    // The parser lets no other widths through.
    let mesh = options::load(scene, Grid::new(bits).unwrap_or_default())?;
    let info = Info {
        scene: &mesh.name,
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        faces_fanned: mesh.fanned,
        faces_skipped: mesh.skipped,
        bounds: mesh.bounds(),
        grid_bits: mesh.frame.grid().bits(),
        grid_cell: mesh.frame.cell(),
        grid_origin: mesh.frame.origin(),
    };
    console.result(&info, || {
        let mut table = Table::new([info.scene.to_owned(), String::new()]);
        let mut row = |name: &str, value: String| {
            table.row([name.to_owned(), value]);
        };
        row("vertices", units::count(info.vertices as u64));
        row("triangles", units::count(info.triangles as u64));
        row("faces fanned into triangles", units::count(info.faces_fanned as u64));
        row("faces left out (points, lines)", units::count(info.faces_skipped as u64));
        if let Some([low, high]) = info.bounds {
            row("lowest corner", format!("{low:?}"));
            row("highest corner", format!("{high:?}"));
        }
        row("grid", format!("{} bits", info.grid_bits));
        row("one grid unit", format!("{:e} scene units", info.grid_cell));
        table.to_string()
    })
}
