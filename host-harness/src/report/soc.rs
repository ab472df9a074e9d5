//! The numbers of a run on the soft core.

use std::fmt;

use serde::Serialize;
use xylem_core::probe::Stage;
use xylem_core::refit::Update;
use xylem_core::toplevel::TopLevel;

use super::build::{bins_of, top_name};
use super::{BuildReport, SocAccelerated, Table, stage_name, units};
use crate::soc::{Beside, FrameReport, OUTPUTS, Outcome, Report, STAGES, SceneBlob};

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
    /// Depth of the treelets, where quantized nodes were compressed bottom-up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub treelet_depth: Option<u8>,
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
    /// What was done in each frame of an animation.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<SocFrame>,
    /// What the accelerator did of the same job, if there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accelerator: Option<SocAccelerated>,
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
    /// Cycles for each primitive of each frame, in all stages but the last.
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

/// A frame of an animation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocFrame {
    /// Its number, from 0.
    pub frame: u32,
    /// What was done: `refit` or `rebuild`.
    pub update: &'static str,
    /// The SAH cost of the tree that was there, refitted; none in the first frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sah_refitted: Option<f64>,
    /// The SAH cost of the tree that rays were traced through.
    pub sah: f64,
    /// Rays that hit a triangle.
    pub hits: u32,
    /// The CRC-32 of all hits, in hexadecimal.
    pub hits_crc32: String,
    /// Whether the same rays hit the same in a tree that was built for this frame.
    pub fresh_hits_equal: bool,
    /// Cycles of the refit.
    pub refit_cycles: u64,
    /// Cycles of the build, if there was one.
    pub build_cycles: u64,
    /// Cycles of the compression.
    pub compress_cycles: u64,
    /// Cycles of tracing.
    pub trace_cycles: u64,
}

impl SocFrame {
    /// A frame; `fresh` is the digest of the hits of a tree that was built for it.
    fn new(report: &FrameReport, fresh: u32) -> Self {
        let cycles = |pick: &dyn Fn(Stage) -> bool| {
            STAGES.iter().zip(report.cycles).filter(|(s, _)| pick(**s)).map(|(_, c)| c).sum()
        };
        let build = [Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::TopLevel];
        Self {
            frame: report.frame,
            update: match report.update {
                Update::Refit => "refit",
                Update::Rebuild => "rebuild",
            },
            sah_refitted: (report.frame > 0).then(|| report.refitted.to_num()),
            sah: report.cost.to_num(),
            hits: report.hits,
            hits_crc32: format!("{:08x}", report.hits_crc),
            fresh_hits_equal: report.hits_crc == fresh,
            refit_cycles: cycles(&|s| s == Stage::Refit),
            build_cycles: cycles(&|s| build.contains(&s)),
            compress_cycles: cycles(&|s| s == Stage::Compress),
            trace_cycles: cycles(&|s| s == Stage::Trace),
        }
    }
}

impl SocReport {
    /// Collects the numbers of a run on `blob`; `host` is the report of the same job on the host, and `fresh`
    /// has for each frame of an animation the digest of the hits of a tree that was built for it; `beside`
    /// is the accelerator that took part, if one did.
    pub fn new(
        scene: &str,
        blob: &SceneBlob,
        outcome: &Outcome,
        host: &Report,
        fresh: &[u32],
        beside: Option<&Beside>,
    ) -> Self {
        let report = &outcome.report;
        let (format, coords) = BuildReport::format_words(blob.format);
        let top_level = blob.top_level != TopLevel::None;
        let counted = |stage: &Stage| match stage {
            Stage::TopLevel => top_level,
            Stage::Refit => blob.animation.is_some(),
            _ => true,
        };
        let stage = |(stage, &cycles): (&Stage, &u64)| {
            let per = |of: u32, yes: bool| if yes { units::ratio(cycles, of.into()) } else { None };
            let frames = outcome.frames.len().max(1) as u32;
            SocStage {
                stage: stage_name(*stage),
                cycles,
                cycles_per_primitive: per(
                    report.primitives.saturating_mul(frames),
                    *stage != Stage::Trace,
                ),
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
            treelet_depth: Some(blob.treelet_depth).filter(|depth| *depth > 0),
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
            frames: outcome.frames.iter().zip(fresh).map(|(f, &c)| SocFrame::new(f, c)).collect(),
            accelerator: SocAccelerated::new(outcome, blob, beside),
            host_ms: units::milliseconds(outcome.time),
            log: outcome.log.iter().map(ToString::to_string).collect(),
        }
    }
}

impl SocReport {
    /// The table of the frames and what they sum up to.
    fn write_frames(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = |n: u64| if n == 0 { String::new() } else { units::count(n) };
        let mut header = vec!["frame", "update", "SAH refitted", "SAH", "refit", "build"];
        let compressed = self.frames.iter().any(|s| s.compress_cycles > 0);
        header.extend(compressed.then_some("compress"));
        header.extend(["trace", "hits"]);
        let mut table = Table::new(header);
        for s in &self.frames {
            let mut row = vec![
                s.frame.to_string(),
                s.update.to_owned(),
                s.sah_refitted.map_or(String::new(), |cost| format!("{cost:.2}")),
                format!("{:.2}", s.sah),
                n(s.refit_cycles),
                n(s.build_cycles),
            ];
            row.extend(compressed.then(|| n(s.compress_cycles)));
            let equal = if s.fresh_hits_equal { "=" } else { "DIFFERENT" };
            row.extend([n(s.trace_cycles), format!("{} {equal}", s.hits)]);
            table.row(row);
        }
        writeln!(f, "{table}  = the hits are those of a tree built for the frame\n")?;
        let mean = |pick: fn(&SocFrame) -> u64| {
            let some: Vec<u64> = self.frames.iter().map(pick).filter(|&c| c > 0).collect();
            units::ratio(some.iter().sum(), some.len() as u64).map_or(0, |mean| mean as u64)
        };
        let (refit, build) = (mean(|s| s.refit_cycles), mean(|s| s.build_cycles));
        let rebuilt = self.frames.iter().filter(|s| s.build_cycles > 0).count();
        writeln!(
            f,
            "  built in {rebuilt} of {} frames; a refit takes {} {}, a build {}",
            self.frames.len(),
            units::count(refit),
            self.cycles_are,
            units::count(build)
        )
    }
}

impl fmt::Display for SocReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = |n: u64| units::count(n);
        let coords = self.coords.map_or(String::new(), |c| format!(", {c} coordinates"));
        let treelets = self.treelet_depth.map_or(String::new(), |depth| {
            format!(", compressed bottom-up with treelets of depth {depth}")
        });
        writeln!(f, "{} on {}: {}{coords}{treelets}", self.scene, self.engine, self.format)?;
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
        if !self.frames.is_empty() {
            self.write_frames(f)?;
        }
        if let Some(accelerator) = &self.accelerator {
            writeln!(f, "{accelerator}")?;
        }
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
