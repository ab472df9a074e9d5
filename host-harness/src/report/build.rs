//! The numbers of a build.

use std::fmt;

use serde::Serialize;
use xylem_core::emit::EmitterKind;
use xylem_core::error::RegionName;
use xylem_core::node::{Coordinates, LeafEntry, NodeFormat};
use xylem_core::pipeline::BuildConfig;
use xylem_core::probe::Stage;
use xylem_core::quality::Quality;
use xylem_core::sort::{InputFormat, RecordFormat};
use xylem_core::toplevel::TopLevel;

use super::clocked::ClockedReport;
use super::compression::CompressionReport;
use super::{Table, units};
use crate::bus::Traffic;
use crate::machine::toplevel::{SweepUnit, TopEvents};
use crate::run::{BuildOptions, BuildRun};

/// The numbers of a build, as `xylem build --json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BuildReport {
    /// The scene.
    pub scene: String,
    /// The node format, as `--format` names it.
    pub format: &'static str,
    /// The coordinates of quantized nodes, as `--coords` names them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coords: Option<&'static str>,
    /// How nodes were quantized, if they were.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub compression: Option<CompressionReport>,
    /// The input, as `--input` names it.
    pub input: &'static str,
    /// What runs consist of, as `--record` names it.
    pub record: &'static str,
    /// Which tree was made, as `--emitter` names it.
    pub emitter: &'static str,
    /// Clusters that were searched to each side; `ploc` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<u32>,
    /// Sweeps between two lists of clusters; `ploc` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain: Option<u32>,
    /// Records that the sorter's scratchpad holds.
    pub capacity: u32,
    /// Records in a burst.
    pub burst: u32,
    /// Bits of a Morton code.
    pub morton_bits: u32,
    /// Bits of a grid coordinate.
    pub grid_bits: u8,
    /// The largest leaf that was allowed, in primitives.
    pub max_leaf: u32,
    /// What computed the build, as `--engine` names it.
    pub engine: &'static str,
    /// The builder of the top of the tree, as `--top-level` names it.
    pub top_level: &'static str,
    /// Neighbouring leaves were joined up to this many primitives where that is cheaper.
    pub join_leaves: u32,
    /// What the top-level build was and took, if there was one.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub top: Option<TopReport>,
    /// The memory whose time is modelled, as `--memory` names it.
    pub memory: &'static str,
    /// The modelled clock in MHz.
    pub clock_mhz: u32,
    /// Primitives.
    pub primitives: u64,
    /// Leaves.
    pub leaves: u64,
    /// Inner nodes.
    pub nodes: u64,
    /// Primitives in a leaf, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaf_size_mean: Option<f64>,
    /// Primitives in the largest leaf.
    pub leaf_size_max: u64,
    /// Nodes on the longest way from the root to a leaf.
    pub depth: u64,
    /// The SAH cost (Ci 1.2, Cl 0, Ct 1) of the boxes as they are stored; none if the root's box has
    /// no area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sah_cost: Option<f64>,
    /// Bytes read from memory.
    pub read_bytes: u64,
    /// Bytes written to memory.
    pub write_bytes: u64,
    /// Bytes read and written.
    pub total_bytes: u64,
    /// Bytes that the nodes take.
    pub node_bytes: u64,
    /// Bytes that the leaf table takes.
    pub leaf_table_bytes: u64,
    /// Cycles of memory transfers, **modelled**; none where memory takes no time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub build_cycles: Option<u64>,
    /// `build_cycles` at `clock_mhz`, in milliseconds: **modelled**.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_ms: Option<f64>,
    /// How long the host took to build and compress, or to simulate, in milliseconds: measured.
    pub host_ms: f64,
    /// What the units on the clock did; `--engine cycle` only.
    #[serde(flatten)]
    pub clocked: Option<ClockedReport>,
    /// Traffic and cycles by stage; they add up to the totals.
    pub stages: Vec<StageReport>,
    /// Traffic by region; it adds up to the totals.
    pub regions: Vec<RegionReport>,
}

/// The traffic of a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StageReport {
    /// The stage.
    pub stage: &'static str,
    /// Bytes read.
    pub read_bytes: u64,
    /// Bytes written.
    pub write_bytes: u64,
    /// Bytes read and written.
    pub bytes: u64,
    /// Modelled cycles; none where memory takes no time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<u64>,
}

/// The traffic of a region.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RegionReport {
    /// The region.
    pub region: &'static str,
    /// Bytes read.
    pub read_bytes: u64,
    /// Bytes written.
    pub write_bytes: u64,
    /// Bytes read and written.
    pub bytes: u64,
}

const STAGES: [Stage; 5] =
    [Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::TopLevel, Stage::Compress];

const REGIONS: [RegionName; 7] = [
    RegionName::Primitives,
    RegionName::RunsA,
    RegionName::RunsB,
    RegionName::Nodes,
    RegionName::LeafTable,
    RegionName::QuantizedNodes,
    RegionName::Triangles,
];

/// The numbers of a top-level build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TopReport {
    /// The most cells that there may be.
    pub cells_max: u32,
    /// Bits of the Morton code that the threshold starts at.
    pub cell_bits: u32,
    /// Cells that the top was built over.
    pub cells: u64,
    /// How often the cells' buffer was full.
    pub cell_raises: u64,
    /// Bins on each axis, where cells were binned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bins: Option<u64>,
    /// Cycles of the unit of P1 §4.5 for the sweeps over the cells: modelled, and not in
    /// `build_cycles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweep_cycles: Option<u64>,
    /// Treelets that were rebuilt, where that was done.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub treelets_rebuilt: Option<u64>,
}

impl TopReport {
    fn new(config: &BuildConfig, events: &TopEvents) -> Option<Self> {
        let atrbvh = match config.top_level {
            TopLevel::None => return None,
            TopLevel::Binned(_) => false,
            TopLevel::Atrbvh(_) => true,
        };
        let bins = bins_of(config.top_level);
        Some(Self {
            cells_max: config.cells.capacity,
            cell_bits: config.cells.bits,
            cells: events.cells,
            cell_raises: events.raises,
            bins,
            sweep_cycles: bins.map(|_| SweepUnit::PAPER.cycles(events)),
            treelets_rebuilt: atrbvh.then_some(events.better_treelets),
        })
    }
}

/// The top-level builder as `--top-level` names it.
pub(super) const fn top_name(top: TopLevel) -> &'static str {
    match top {
        TopLevel::None => "none",
        TopLevel::Binned(_) => "binned",
        TopLevel::Atrbvh(_) => "atrbvh",
    }
}

/// Bins on each axis, where a top-level builder sorts cells into bins.
pub(super) fn bins_of(top: TopLevel) -> Option<u64> {
    let binned = match top {
        TopLevel::None => None,
        TopLevel::Binned(binned) => Some(binned),
        TopLevel::Atrbvh(atrbvh) => atrbvh.start,
    };
    binned.map(|binned| binned.bins.count() as u64)
}

/// What a stage is called in reports.
pub const fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::PartialSort => "partial_sort",
        Stage::Merge => "merge",
        Stage::Emit => "emit",
        Stage::TopLevel => "top_level",
        Stage::Compress => "compress",
        Stage::Refit => "refit",
        Stage::Trace => "trace",
    }
}

impl BuildReport {
    /// A format as `--format` and `--coords` name it.
    pub const fn format_words(format: NodeFormat) -> (&'static str, Option<&'static str>) {
        match format {
            NodeFormat::Bvh2 => ("bvh2", None),
            NodeFormat::Shared(_) => ("cbvh8", None),
            NodeFormat::Wide(quantization) => match quantization.coordinates {
                Coordinates::Relative => ("cbvh4", Some("relative")),
                Coordinates::Modulo => ("cbvh4", Some("modulo")),
            },
            NodeFormat::Quantized(quantization) => match quantization.coordinates {
                Coordinates::Relative => ("cbvh", Some("relative")),
                Coordinates::Modulo => ("cbvh", Some("modulo")),
            },
        }
    }

    /// Collects the numbers of a build whose tree has the given quality.
    pub fn new(scene: &str, options: &BuildOptions, run: &BuildRun, quality: &Quality) -> Self {
        let (tree, total) = (&run.scene.tree, run.traffic.total());
        let clocked = run.clocked.as_ref();
        let timed = clocked.is_some() || options.memory.deci_bytes_per_cycle > 0;
        let build_cycles = timed.then(|| run.cycles());
        let clock_mhz = clocked.map_or(options.memory.clock_mhz, |c| c.config.clock_mhz);
        let (format, coords) = Self::format_words(tree.format);
        let config = &options.config;
        let ploc = match config.emitter {
            EmitterKind::Lbvh => None,
            EmitterKind::Ploc(ploc) => Some(ploc),
        };
        Self {
            scene: scene.to_owned(),
            format,
            coords,
            compression: CompressionReport::new(
                tree.format,
                config.compression.as_ref(),
                &run.compressor,
            ),
            input: match config.input {
                InputFormat::Box32 => "aabb",
                InputFormat::Triangle40 => "triangle",
            },
            record: match config.sort.record {
                RecordFormat::Box32 => "box32",
                RecordFormat::Packed22 => "packed22",
                RecordFormat::Pair8 => "pair8",
            },
            emitter: if ploc.is_some() { "ploc" } else { "lbvh" },
            radius: ploc.map(|p| p.radius),
            chain: ploc.map(|p| p.chain),
            capacity: config.sort.capacity,
            burst: config.sort.burst,
            morton_bits: config.morton.bits(),
            grid_bits: config.grid.bits(),
            max_leaf: config.max_leaf_size,
            engine: if clocked.is_some() { "cycle" } else { "function" },
            top_level: top_name(config.top_level),
            join_leaves: config.join_leaves,
            top: TopReport::new(config, &run.top),
            memory: options.memory.name,
            clock_mhz,
            primitives: u64::from(tree.entry_count),
            leaves: u64::from(tree.leaf_count),
            nodes: u64::from(tree.node_count),
            leaf_size_mean: units::ratio(tree.entry_count.into(), tree.leaf_count.into()),
            leaf_size_max: u64::from(quality.largest_leaf),
            depth: u64::from(quality.depth),
            sah_cost: (quality.root_area > 0).then(|| quality.sah_cost().to_num()),
            read_bytes: total.read_bytes,
            write_bytes: total.write_bytes,
            total_bytes: total.bytes(),
            node_bytes: u64::from(tree.node_count) * u64::from(tree.format.bytes()),
            leaf_table_bytes: u64::from(tree.entry_count) * LeafEntry::BYTES as u64,
            build_cycles,
            time_ms: build_cycles.map(|cycles| cycles as f64 / (f64::from(clock_mhz) * 1e3)),
            host_ms: units::milliseconds(run.host_time),
            clocked: clocked.map(ClockedReport::new),
            stages: stages(&run.traffic, timed),
            regions: regions(&run.traffic),
        }
    }

    /// The builder's parameters in words.
    pub fn configuration(&self) -> String {
        format!(
            "input {}, runs of {}, M = {}, B = {}, {}-bit Morton codes, {}-bit grid, leaves to {}",
            self.input,
            self.record,
            self.capacity,
            self.burst,
            self.morton_bits,
            self.grid_bits,
            self.max_leaf
        )
    }

    /// The emitter and its parameters in words.
    pub fn emitter_words(&self) -> String {
        match (self.radius, self.chain) {
            (Some(radius), Some(chain)) => format!("{} (R = {radius}, K = {chain})", self.emitter),
            _ => self.emitter.to_owned(),
        }
    }

    /// Traffic by stage.
    pub fn stage_table(&self) -> Table {
        let mut table = Table::new(["traffic by stage", "read", "written", "total", "cycles*"]);
        let cycles = |cycles: Option<u64>| cycles.map_or("n/a".into(), units::count);
        for s in &self.stages {
            let bytes = [s.read_bytes, s.write_bytes, s.bytes].map(units::bytes);
            let name = s.stage.replace('_', " ");
            table.row([name].into_iter().chain(bytes).chain([cycles(s.cycles)]));
        }
        let total = [self.read_bytes, self.write_bytes, self.total_bytes].map(units::bytes);
        let ends = ["all".to_owned()].into_iter().chain(total).chain([cycles(self.build_cycles)]);
        table.row(ends);
        table
    }

    /// Traffic by region.
    pub fn region_table(&self) -> Table {
        let mut table = Table::new(["traffic by region", "read", "written", "total"]);
        for r in &self.regions {
            let bytes = [r.read_bytes, r.write_bytes, r.bytes].map(units::bytes);
            table.row([r.region.to_owned()].into_iter().chain(bytes));
        }
        table
    }

    /// What the starred columns are.
    pub fn footnote(&self) -> String {
        match self.time_ms {
            Some(ms) if self.clocked.is_some() => format!(
                "  * modelled: every unit at {} MHz, memory `{}`; {ms:.3} ms in all. Emission \
                 overlaps the merge",
                self.clock_mhz, self.memory
            ),
            Some(ms) => format!(
                "  * modelled: memory `{}` at {} MHz, transfers and shared latency only; {ms:.3} ms \
                 in all",
                self.memory, self.clock_mhz
            ),
            None => format!("  * not modelled: memory `{}` takes no time", self.memory),
        }
    }
}

impl fmt::Display for BuildReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let optional = |n: Option<f64>| n.map_or("n/a".into(), |n| format!("{n:.2}"));
        let coords = self.coords.map_or(String::new(), |c| format!(", {c} coordinates"));
        writeln!(f, "{}: {}{coords}, emitter {}", self.scene, self.format, self.emitter_words())?;
        if let Some(compression) = &self.compression {
            writeln!(f, "quantized: {}", compression.words())?;
        }
        writeln!(f, "  {}", self.configuration())?;
        writeln!(
            f,
            "  {} primitives in {} leaves ({} mean, {} largest), {} nodes, depth {}",
            units::count(self.primitives),
            units::count(self.leaves),
            optional(self.leaf_size_mean),
            self.leaf_size_max,
            units::count(self.nodes),
            self.depth
        )?;
        writeln!(
            f,
            "  SAH cost {}; nodes take {}, the leaf table {}",
            optional(self.sah_cost),
            units::bytes(self.node_bytes),
            units::bytes(self.leaf_table_bytes)
        )?;
        if let Some(top) = &self.top {
            let cells = units::count(top.cells);
            write!(f, "  top of the tree: {} over {cells} cells", self.top_level)?;
            let cycles = top.sweep_cycles.map(units::count);
            let cycles = cycles.map(|c| format!(", sweeps take {c} cycles (modelled)"));
            writeln!(f, "{}", cycles.unwrap_or_default())?;
        }
        writeln!(f, "\n{}\n{}", self.stage_table(), self.region_table())?;
        writeln!(f, "{}", self.footnote())?;
        if let Some(clocked) = &self.clocked {
            write!(f, "{clocked}")?;
        }
        let did = if self.clocked.is_some() { "simulated" } else { "built" };
        write!(f, "  host: {did} in {:.2} ms (measured, one thread)", self.host_ms)
    }
}

/// Traffic by stage, with whole cycles that add up to the rounded total.
fn stages(traffic: &Traffic, timed: bool) -> Vec<StageReport> {
    let mut stages = Vec::new();
    let mut millicycles = 0u64;
    for stage in STAGES {
        let tally = traffic.stage(stage);
        if tally.reads + tally.writes + tally.millicycles == 0 {
            continue;
        }
        // Rounding the running sum, not each part, keeps the sum of the parts the whole.
        let before = millicycles.div_ceil(1000);
        millicycles += tally.millicycles;
        stages.push(StageReport {
            stage: stage_name(stage),
            read_bytes: tally.read_bytes,
            write_bytes: tally.write_bytes,
            bytes: tally.bytes(),
            cycles: timed.then(|| millicycles.div_ceil(1000) - before),
        });
    }
    stages
}

fn regions(traffic: &Traffic) -> Vec<RegionReport> {
    let used = REGIONS.map(|region| (region, traffic.region(region)));
    used.into_iter()
        .filter(|(_, tally)| tally.reads + tally.writes > 0)
        .map(|(region, tally)| RegionReport {
            region: region.as_str(),
            read_bytes: tally.read_bytes,
            write_bytes: tally.write_bytes,
            bytes: tally.bytes(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::{MEMORIES, MemoryTiming};
    use crate::scene::{LoadOptions, procedural};
    use xylem_core::node::Quantization;

    fn report(scene: &str, options: &BuildOptions) -> BuildReport {
        let soup = procedural::soup(scene).unwrap().unwrap();
        let mesh = soup.into_mesh(scene, &LoadOptions::default()).unwrap();
        let run = crate::run::build(&mesh.triangles, options).unwrap();
        let quality = run.check().unwrap();
        BuildReport::new(scene, options, &run, &quality)
    }

    #[test]
    fn stages_and_regions_add_up_to_the_totals_on_every_memory() {
        for memory in MEMORIES {
            let format = NodeFormat::Quantized(Quantization::MODULO);
            let options = BuildOptions { memory, format, ..BuildOptions::default() };
            let report = report("terrain:6", &options);
            let sum = |bytes: fn(&StageReport) -> u64| report.stages.iter().map(bytes).sum::<u64>();
            assert_eq!(sum(|s| s.read_bytes), report.read_bytes);
            assert_eq!(sum(|s| s.write_bytes), report.write_bytes);
            assert_eq!(sum(|s| s.bytes), report.total_bytes);
            assert_eq!(report.regions.iter().map(|r| r.bytes).sum::<u64>(), report.total_bytes);
            let cycles: Option<u64> = report.stages.iter().map(|s| s.cycles).sum();
            assert_eq!(cycles, report.build_cycles, "{}", memory.name);
            assert_eq!(report.stages.len(), 4);
        }
    }

    #[test]
    fn what_was_not_measured_is_absent() {
        let ideal = *MemoryTiming::by_name("ideal").unwrap();
        let options = BuildOptions { memory: ideal, ..BuildOptions::default() };
        let json = serde_json::to_value(report("degenerate/empty", &options)).unwrap();
        let absent =
            ["build_cycles", "time_ms", "leaf_size_mean", "sah_cost", "coords", "backtracks"];
        for key in absent {
            assert!(json.get(key).is_none(), "{key}: {json}");
        }
        assert_eq!(json["primitives"], 0);
        assert_eq!(json["format"], "bvh2");
    }
}
