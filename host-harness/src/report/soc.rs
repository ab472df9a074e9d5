//! The numbers of a run on the soft core.

use std::fmt;

use serde::Serialize;
use xylem_core::probe::Stage;
use xylem_core::toplevel::TopLevel;

use super::build::{bins_of, top_name};
use super::{BuildReport, Table, stage_name, units};
use crate::soc::{OUTPUTS, Outcome, Report, STAGES, SceneBlob};

/// The numbers of a run on the soft core, as `xylem soc --json` prints them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocReport {
    /// The scene.
    pub scene: String,
    /// What ran the program.
    pub engine: &'static str,
    /// What `cycles` are with this engine.
    pub cycles_are: &'static str,
    /// The node format that rays were traced through, as `--format` names it.
    pub format: &'static str,
    /// The coordinates of quantized nodes, as `--coords` names them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coords: Option<&'static str>,
    /// Primitives.
    pub primitives: u32,
    /// Leaves.
    pub leaves: u32,
    /// Inner nodes.
    pub nodes: u32,
    /// The builder of the top of the tree, as `--top-level` names it.
    pub top_level: &'static str,
    /// Bins on each axis, where that builder sorts cells into bins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bins: Option<u64>,
    /// Cells that the top was built over, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<u32>,
    /// Rays that the firmware traced.
    pub rays: u32,
    /// Rays that hit a triangle.
    pub hits: u32,
    /// Cycles by stage.
    pub stages: Vec<SocStage>,
    /// Cycles from reset to power-off, where the engine counts them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<u64>,
    /// Instructions from reset to power-off, where the engine counts them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instructions: Option<u64>,
    /// Bytes that the core read from external memory, where the engine counts them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read_bytes: Option<u64>,
    /// Bytes that the core wrote to external memory, where the engine counts them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub write_bytes: Option<u64>,
    /// Everything the firmware put into memory, and its digest (CRC-32).
    pub outputs: Vec<SocOutput>,
    /// One digest of all outputs and counts, in hexadecimal.
    pub digest: String,
    /// The same of the same job on the host.
    pub host_digest: String,
    /// How long the engine ran on this machine, in milliseconds: measured.
    pub host_ms: f64,
    /// The firmware's log.
    pub log: Vec<String>,
}

/// The cycles of a stage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocStage {
    /// The stage.
    pub stage: &'static str,
    /// Cycles.
    pub cycles: u64,
    /// Cycles for each primitive, in the stages of a build.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles_per_primitive: Option<f64>,
    /// Cycles for each ray, in the last stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles_per_ray: Option<f64>,
}

/// One output of the firmware.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SocOutput {
    /// What it is.
    pub output: &'static str,
    /// Its length.
    pub bytes: u32,
    /// Its CRC-32, in hexadecimal.
    pub crc32: String,
}

impl SocReport {
    /// Collects the numbers of a run on `blob`; `host` is the report of the same job on the host.
    pub fn new(scene: &str, blob: &SceneBlob, outcome: &Outcome, host: &Report) -> Self {
        let report = &outcome.report;
        let (format, coords) = BuildReport::format_words(blob.format);
        let top_level = blob.top_level != TopLevel::None;
        let counted = |stage: &Stage| top_level || *stage != Stage::TopLevel;
        let stage = |(stage, &cycles): (&Stage, &u64)| {
            let per = |of: u32, yes: bool| if yes { units::ratio(cycles, of.into()) } else { None };
            SocStage {
                stage: stage_name(*stage),
                cycles,
                cycles_per_primitive: per(report.primitives, *stage != Stage::Trace),
                cycles_per_ray: per(report.rays, *stage == Stage::Trace),
            }
        };
        let hex = |word: u32| format!("{word:08x}");
        Self {
            scene: scene.to_owned(),
            engine: outcome.engine.as_str(),
            cycles_are: outcome.engine.cycles_are(),
            format,
            coords,
            primitives: report.primitives,
            leaves: report.leaves,
            nodes: report.nodes,
            top_level: top_name(blob.top_level),
            bins: bins_of(blob.top_level),
            cells: top_level.then_some(report.cells),
            rays: report.rays,
            hits: report.hits,
            stages: STAGES
                .iter()
                .zip(&report.cycles)
                .filter(|(stage, _)| counted(stage))
                .map(stage)
                .collect(),
            cycles: outcome.cycles,
            instructions: outcome.instructions,
            read_bytes: outcome.external.map(|tally| tally.read_bytes),
            write_bytes: outcome.external.map(|tally| tally.write_bytes),
            outputs: OUTPUTS
                .iter()
                .zip(&report.outputs)
                .map(|(output, digest)| SocOutput {
                    output: output.as_str(),
                    bytes: digest.bytes,
                    crc32: hex(digest.crc),
                })
                .collect(),
            digest: hex(report.digest()),
            host_digest: hex(host.digest()),
            host_ms: units::milliseconds(outcome.time),
            log: outcome.log.iter().map(ToString::to_string).collect(),
        }
    }
}

impl fmt::Display for SocReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = |n: u64| units::count(n);
        let coords = self.coords.map_or(String::new(), |c| format!(", {c} coordinates"));
        writeln!(f, "{} on {}: {}{coords}", self.scene, self.engine, self.format)?;
        writeln!(
            f,
            "  {} primitives in {} leaves, {} nodes; {} of {} rays hit",
            n(self.primitives.into()),
            n(self.leaves.into()),
            n(self.nodes.into()),
            n(self.hits.into()),
            n(self.rays.into())
        )?;
        if let Some(cells) = self.cells {
            write!(f, "  top of the tree: {} over {} cells", self.top_level, n(cells.into()))?;
            match self.bins {
                Some(bins) => writeln!(f, ", {bins} bins")?,
                None => writeln!(f)?,
            }
        }
        writeln!(f)?;
        let mut table = Table::new(["stage", self.cycles_are, "per primitive", "per ray"]);
        let mean = |n: Option<f64>| n.map_or(String::new(), |n| format!("{n:.1}"));
        for s in &self.stages {
            table.row([
                s.stage.replace('_', " "),
                n(s.cycles),
                mean(s.cycles_per_primitive),
                mean(s.cycles_per_ray),
            ]);
        }
        writeln!(f, "{table}")?;
        let mut table = Table::new(["output", "bytes", "CRC-32"]);
        for o in &self.outputs {
            table.row([o.output.to_owned(), n(o.bytes.into()), o.crc32.clone()]);
        }
        writeln!(f, "{table}")?;
        if let (Some(cycles), Some(instructions)) = (self.cycles, self.instructions) {
            let (cycles, instructions) = (n(cycles), n(instructions));
            writeln!(f, "  from reset to power-off: {cycles} cycles, {instructions} instructions")?;
        }
        if let (Some(read), Some(written)) = (self.read_bytes, self.write_bytes) {
            let (read, written) = (units::bytes(read), units::bytes(written));
            writeln!(f, "  external memory: {read} read, {written} written")?;
        }
        let equal = if self.digest == self.host_digest { "equal" } else { "DIFFERENT" };
        writeln!(f, "  digest {}, on the host {}: {equal}", self.digest, self.host_digest)?;
        write!(f, "  the run took {:.0} ms here (measured)", self.host_ms)?;
        for line in &self.log {
            write!(f, "\n  | {line}")?;
        }
        Ok(())
    }
}
