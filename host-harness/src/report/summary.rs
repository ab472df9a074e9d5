//! The whole road on one scene: numbers as JSON and text, and the page with pictures.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

use super::chart::{self, Bar};
use super::html::{Figure, Page, Source};
use super::{BuildReport, Table, TraceReport, units};

/// The numbers of the bare `xylem`.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// The version of this program.
    pub version: &'static str,
    /// The build with its compression.
    pub build: BuildReport,
    /// The tree in each format.
    pub trees: Vec<TreeReport>,
    /// Each set of rays through each format.
    pub rays: Vec<RaySetReport>,
    /// Rays whose closest hits were compared between the formats, bit by bit.
    pub compared: u64,
    /// How many of them differed.
    pub differences: u64,
    /// Rays whose closest hits were compared with trying every triangle.
    pub checked: u64,
    /// How many of them differed.
    pub mismatches: u64,
    /// Where the page is.
    pub report: PathBuf,
    /// How long all of it took, in seconds: measured.
    pub host_s: f64,
}

/// A tree in one format.
#[derive(Debug, Clone, Serialize)]
pub struct TreeReport {
    /// The format, as `--format` names it.
    pub format: &'static str,
    /// Bytes of a node.
    pub bytes_per_node: u32,
    /// Bytes that all nodes take.
    pub node_bytes: u64,
    /// The SAH cost of the boxes as they are stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sah_cost: Option<f64>,
}

/// A set of rays through one format.
#[derive(Debug, Clone, Serialize)]
pub struct RaySetReport {
    /// How the rays were made.
    pub set: &'static str,
    /// What they took.
    #[serde(flatten)]
    pub trace: TraceReport,
}

/// The pictures of a page, as PNG files.
#[derive(Debug, Clone)]
pub struct Pictures {
    /// The scene in light and shade.
    pub shaded: Vec<u8>,
    /// Node visits of the camera rays through each of [`Summary::trees`].
    pub nodes: Vec<Vec<u8>>,
}

impl Summary {
    /// Whether all answers agree.
    pub fn agrees(&self) -> bool {
        self.differences == 0 && self.mismatches == 0
    }

    /// The page.
    pub fn page(&self, pictures: &Pictures) -> String {
        let build = &self.build;
        let mut page = Page::new(
            &format!("{} through Xylem", build.scene),
            &format!(
                "Xylem {}: {} triangles sorted by Morton code, turned into a tree, compressed and \
                 traced in fixed point.",
                self.version,
                units::count(build.primitives)
            ),
        );
        let caption = "Every ray of this picture (camera, light and sky) was traced through the \
                       compressed tree in fixed point.";
        let shaded = Figure::picture(&pictures.shaded, caption, Source::Traced);
        page.row([shaded, Figure::table(&self.tree_table(), "The tree.", Source::Counted)]);

        page.section("Memory traffic of the build");
        let bars: Vec<Bar> = build
            .stages
            .iter()
            .map(|stage| Bar {
                name: stage.stage.replace('_', " "),
                parts: vec![stage.read_bytes as f64, stage.write_bytes as f64],
                label: units::bytes(stage.bytes),
            })
            .collect();
        let chart = chart::bars(&["read", "written"], &bars);
        page.row([
            Figure::drawing(&chart, "Bytes on the memory bus by stage.", Source::Counted),
            Figure::table(&build.region_table(), "Bytes by region of memory.", Source::Counted),
        ]);
        let footnote = build.footnote();
        let footnote = footnote.trim_start_matches([' ', '*']);
        page.row([Figure::table(
            &build.stage_table(),
            &format!("Bytes are counted. Cycles (*) are {footnote}."),
            Source::Modelled,
        )]);

        page.section("Rays");
        page.paragraph(&self.verdict().join(" "));
        page.row([Figure::table(
            &self.ray_table(),
            "Closest hits. Work per ray is counted; rays/s is measured on this machine, with the \
             counters on.",
            Source::Measured,
        )]);
        let maps = self.trees.iter().zip(&pictures.nodes).map(|(tree, png)| {
            let caption = format!(
                "Nodes that each camera ray visits in the {}-byte format ({}); both maps have the \
                 same scale.",
                tree.bytes_per_node, tree.format
            );
            Figure::picture(png, &caption, Source::Counted)
        });
        page.row(maps);

        page.section("Configuration");
        page.row([Figure::table(&self.configuration(), "How to repeat this.", Source::Measured)]);
        page.finish()
    }

    fn tree_table(&self) -> Table {
        let build = &self.build;
        let mut table = Table::new(["tree"].into_iter().chain(self.trees.iter().map(|t| t.format)));
        let mut row = |name: &str, cell: &dyn Fn(&TreeReport) -> String| {
            table.row([name.to_owned()].into_iter().chain(self.trees.iter().map(cell)));
        };
        row("bytes per node", &|t| t.bytes_per_node.to_string());
        row("inner nodes", &|_| units::count(build.nodes));
        row("leaves", &|_| units::count(build.leaves));
        row("primitives per leaf, mean", &|_| optional(build.leaf_size_mean));
        row("depth", &|_| build.depth.to_string());
        row("all nodes", &|t| units::bytes(t.node_bytes));
        row("leaf table", &|_| units::bytes(build.leaf_table_bytes));
        row("SAH cost", &|t| optional(t.sah_cost));
        table
    }

    fn ray_table(&self) -> Table {
        let mut table = Table::new([
            "set",
            "tree",
            "rays",
            "hits",
            "boxes/ray",
            "tris/ray",
            "nodes/ray",
            "bytes/ray",
            "rays/s",
        ]);
        for RaySetReport { set, trace } in &self.rays {
            table.row([
                (*set).to_owned(),
                trace.format.to_owned(),
                units::count(trace.rays),
                units::count(trace.hits),
                optional(trace.box_tests_per_ray),
                optional(trace.triangle_tests_per_ray),
                optional(trace.nodes_per_ray),
                optional(trace.node_bytes_per_ray),
                trace.host_rays_per_s.map_or("n/a".into(), |r| units::rate(r).trim_end().into()),
            ]);
        }
        table
    }

    /// What was compared, and the outcome; one line each.
    fn verdict(&self) -> [String; 2] {
        let line = |n: u64, with: &str, differ: u64| {
            format!("{} closest hits compared {with}: {differ} differ.", units::count(n))
        };
        [
            line(self.compared, "between the formats", self.differences),
            line(self.checked, "with trying every triangle", self.mismatches),
        ]
    }

    fn configuration(&self) -> Table {
        let build = &self.build;
        let mut table = Table::new(["setting", "value"]);
        table
            .row(["command".to_owned(), format!("xylem --scene {}", build.scene)])
            .row(["version".to_owned(), self.version.to_owned()])
            .row(["builder".to_owned(), build.configuration()])
            .row([
                "memory model".to_owned(),
                format!("{} at {} MHz", build.memory, build.clock_mhz),
            ])
            .row(["host build and compression".to_owned(), format!("{:.1} ms", build.host_ms)])
            .row(["host, everything".to_owned(), format!("{:.1} s", self.host_s)])
            .row(["host threads".to_owned(), rayon::current_num_threads().to_string()]);
        table
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let build = &self.build;
        writeln!(
            f,
            "Xylem {}: {}, {} triangles",
            self.version,
            build.scene,
            units::count(build.primitives)
        )?;
        writeln!(f, "\n{}", self.tree_table())?;
        writeln!(f, "{}\n{}{}", build.stage_table(), build.region_table(), build.footnote())?;
        writeln!(f, "\n{}", self.ray_table())?;
        let [formats, reference] = self.verdict();
        writeln!(f, "  {formats}\n  {reference}")?;
        writeln!(
            f,
            "  Host: build and compression {:.2} ms on one thread; everything {:.1} s (measured)",
            build.host_ms, self.host_s
        )?;
        write!(f, "\nReport with pictures: {}", self.report.display())
    }
}

fn optional(n: Option<f64>) -> String {
    n.map_or("n/a".into(), |n| format!("{n:.2}"))
}
