//! Options that several commands share, as the words of the command line.

use std::fmt;

use clap::{Args, ValueEnum};
use serde::Serialize;
use xylem_core::emit::{CellConfig, EmitterKind, MAX_CHAIN, MAX_RADIUS, PlocConfig};
use xylem_core::node::NodeFormat;
use xylem_core::num::{Grid, MortonWidth};
use xylem_core::pipeline::BuildConfig;
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};
use xylem_core::traverse::{Method, Query};

use super::format::FormatArgs;
use super::{CliError, progress};
use crate::run::{BuildOptions, BuildRun, RunError};
use crate::scene::{self, LoadOptions, Mesh};

/// A scene and the tree over it.
#[derive(Debug, Clone, Args)]
pub(super) struct TreeArgs {
    /// OBJ file (.obj, .obj.gz), a name in scenes/ or $XYLEM_SCENES, or a computed scene (see
    /// `xylem scene list`)
    pub scene: String,
    #[command(flatten)]
    nodes: FormatArgs,
    /// Bits of a Morton code
    #[arg(long, value_enum, default_value_t = Morton::Bits30)]
    morton: Morton,
    /// Largest leaf in primitives, 1 to 255; lbvh's leaves share a code, ploc's hold at most 4
    #[arg(long, value_name = "N", default_value_t = 255,
          value_parser = clap::value_parser!(u32).range(1..=255))]
    max_leaf: u32,
    /// Which tree is made of the sorted primitives: the hierarchy of the codes' bits, or clusters of
    /// nearest neighbours
    #[arg(long, value_enum, default_value_t = EmitterArg::Lbvh)]
    emitter: EmitterArg,
    /// With --emitter ploc: clusters that are searched for the nearest one, before and after each
    /// [default: 8]
    #[arg(long, value_name = "R", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_RADIUS)))]
    radius: Option<u32>,
    /// With --emitter ploc: sweeps between writing a list of clusters and reading it [default: 4]
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_CHAIN)))]
    chain: Option<u32>,
    /// Bits of a grid coordinate, 4 to 24; the longest side of the scene box spans the grid
    #[arg(long, value_name = "BITS", default_value_t = 24,
          value_parser = clap::value_parser!(u8).range(4..=24))]
    grid: u8,
    #[command(flatten)]
    top: TopArgs,
}

/// The top of the tree.
#[derive(Debug, Clone, Args)]
struct TopArgs {
    /// How the top of the tree is built: like the rest, by binned SAH over cells of the Morton order,
    /// or by that and agglomerative restructuring of treelets of eight, twice
    #[arg(long, value_enum, default_value_t = TopArg::None)]
    top_level: TopArg,
    /// Bins on each axis
    #[arg(long, value_name = "8|16", default_value_t = 16, value_parser = bins)]
    bins: u32,
    /// The most cells; when there would be more they become coarser [default: 8192, on the soft core
    /// 2048]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    cells: Option<u32>,
    /// Bits of the Morton code that cells differ in to begin with
    #[arg(long, value_name = "BITS", default_value_t = CellConfig::default().bits,
          value_parser = clap::value_parser!(u32).range(0..=63))]
    cell_bits: u32,
    /// Where atrbvh starts: from the binned tree over the cells, or from their Morton order (P2's)
    #[arg(long, value_enum, default_value_t = StartArg::Binned)]
    treelet_start: StartArg,
    /// Join neighbouring leaves up to N primitives, at most 16, where a leaf costs no more than a
    /// node over two; 0 for not at all [default: 4 with a top level, else 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=16))]
    join_leaves: Option<u32>,
}

/// `--top-level`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TopArg {
    /// By Morton codes
    None,
    /// By binned SAH
    Binned,
    /// By restructuring treelets
    Atrbvh,
}

/// `--treelet-start`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StartArg {
    /// The binned tree
    Binned,
    /// The tree of the Morton codes
    Morton,
}

impl TopArgs {
    fn set(&self, config: &mut BuildConfig) {
        let binned = Binned { bins: if self.bins == 8 { Bins::Eight } else { Bins::Sixteen } };
        let start = (self.treelet_start == StartArg::Binned).then_some(binned);
        config.top_level = match self.top_level {
            TopArg::None => TopLevel::None,
            TopArg::Binned => TopLevel::Binned(binned),
            TopArg::Atrbvh => TopLevel::Atrbvh(Atrbvh { start, ..Atrbvh::default() }),
        };
        let capacity = self.cells.unwrap_or(CellConfig::default().capacity);
        config.cells = CellConfig { capacity, bits: self.cell_bits };
        let join_leaves = if self.top_level == TopArg::None { 0 } else { 4 };
        config.join_leaves = self.join_leaves.unwrap_or(join_leaves);
    }
}

fn bins(text: &str) -> Result<u32, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("there can be 8 or 16 bins".into()),
    }
}

/// `--morton`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Morton {
    /// 10 bits an axis
    #[value(name = "30")]
    Bits30,
    /// 21 bits an axis
    #[value(name = "63")]
    Bits63,
}

/// `--emitter`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EmitterArg {
    /// Linear BVH: a node splits where the highest Morton bit changes
    Lbvh,
    /// Parallel locally-ordered clustering, streamed
    Ploc,
}

/// `--query`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum QueryArg {
    /// The first triangle along the ray
    Closest,
    /// Whether there is any
    Any,
}

impl From<QueryArg> for Query {
    fn from(query: QueryArg) -> Self {
        match query {
            QueryArg::Closest => Self::Closest,
            QueryArg::Any => Self::Any,
        }
    }
}

impl fmt::Display for QueryArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Closest => "closest",
            Self::Any => "any",
        })
    }
}

/// `--traversal`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum TraversalArg {
    /// Decode boxes to full coordinates and test those
    Decompress,
    /// Move the ray's origin to the node and test with short numbers (Keely)
    Point,
    /// Step from the parent's plane distances to the children's (Vaidyanathan et al.)
    Incremental,
}

impl From<TraversalArg> for Method {
    fn from(traversal: TraversalArg) -> Self {
        match traversal {
            TraversalArg::Decompress => Self::Decompress,
            TraversalArg::Point => Self::TraversalPoint,
            TraversalArg::Incremental => Self::Incremental,
        }
    }
}

impl TreeArgs {
    /// The tree that these options ask for, with the sorter and the memory of the default.
    ///
    /// # Errors
    /// [`CliError::Usage`] if they contradict each other.
    pub fn build_options(&self) -> Result<BuildOptions, CliError> {
        let (format, compression) = self.nodes.resolve()?;
        let mut config = BuildConfig {
            grid: self.grid(),
            morton: match self.morton {
                Morton::Bits30 => MortonWidth::Bits30,
                Morton::Bits63 => MortonWidth::Bits63,
            },
            max_leaf_size: self.max_leaf,
            emitter: self.emitter()?,
            compression,
            collapse: matches!(format, NodeFormat::Wide(_)),
            sharing: match format {
                NodeFormat::Shared(sharing) => Some(sharing),
                _ => None,
            },
            ..BuildConfig::default()
        };
        self.top.set(&mut config);
        Ok(BuildOptions { config, format, ..BuildOptions::default() })
    }

    fn emitter(&self) -> Result<EmitterKind, CliError> {
        match self.emitter {
            EmitterArg::Lbvh if self.radius.is_some() || self.chain.is_some() => {
                let message =
                    "--radius and --chain are about --emitter ploc; add it or leave them out";
                Err(CliError::Usage(message.into()))
            }
            EmitterArg::Lbvh => Ok(EmitterKind::Lbvh),
            EmitterArg::Ploc => Ok(EmitterKind::Ploc(PlocConfig {
                radius: self.radius.unwrap_or(PlocConfig::DEFAULT.radius),
                chain: self.chain.unwrap_or(PlocConfig::DEFAULT.chain),
            })),
        }
    }

    /// The most cells of a top level, where that was asked for.
    pub const fn cells(&self) -> Option<u32> {
        self.top.cells
    }

    /// Loads the scene.
    ///
    /// # Errors
    /// [`CliError::Scene`].
    pub fn load(&self) -> Result<Mesh, CliError> {
        load(&self.scene, self.grid())
    }

    fn grid(&self) -> Grid {
        // The parser lets no other widths through.
        Grid::new(self.grid).unwrap_or_default()
    }
}

/// Loads a scene.
///
/// # Errors
/// [`CliError::Scene`].
pub(super) fn load(scene: &str, grid: Grid) -> Result<Mesh, CliError> {
    let spinner = progress::spinner(format!("loading {scene}"));
    let mesh = scene::load(scene, &LoadOptions { grid, frame: None })?;
    spinner.finish_and_clear();
    Ok(mesh)
}

/// Builds the tree of a scene.
///
/// # Errors
/// [`CliError::Build`].
pub(super) fn build(mesh: &Mesh, options: &BuildOptions) -> Result<BuildRun, CliError> {
    let spinner =
        progress::spinner(format!("building {} ({} triangles)", mesh.name, mesh.triangles.len()));
    let run = crate::run::build(&mesh.triangles, options).map_err(|e| build_failed(mesh, e))?;
    spinner.finish_and_clear();
    Ok(run)
}

/// Names the scene whose build failed.
pub(super) fn build_failed(mesh: &Mesh, source: impl Into<RunError>) -> CliError {
    CliError::Build { scene: mesh.name.clone(), source: source.into() }
}
