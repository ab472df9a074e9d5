//! What the accelerator beside the soft core did, next to the software's cycles.

use std::fmt;

use serde::Serialize;
use xylem_core::probe::Stage;

use super::{Table, units};
use crate::soc::{
    Accelerated, Beside, Engine, OUTPUTS, Outcome, Output, PARTS, Part, STAGES, SceneBlob,
};

/// The comparison of software and accelerator on the same core, as `xylem soc --json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocAccelerated {
    /// The configuration's name in `fpga/rtl/configs.toml`.
    pub config: &'static str,
    /// What the accelerator is here: `cycle model` or `RTL`.
    pub engine: &'static str,
    /// Cycles from a read at its memory port to the answer.
    pub latency_cycles: u32,
    /// Whether everything that it made is what the software made.
    pub equal: bool,
    /// What it did, in order.
    pub parts: Vec<SocPart>,
    /// What it has no unit for, and what therefore stays software.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub in_software: Vec<&'static str>,
    /// How much faster a build is with the core's part of it, which makes the input.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub build_speedup_with_prepare: Option<f64>,
}

/// A part of the job.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocPart {
    /// What is done.
    pub part: &'static str,
    /// Cycles that the software takes for it, if it does it at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub software_cycles: Option<u64>,
    /// Cycles with the accelerator, from the first register access to the result.
    pub cycles: u64,
    /// Cycles in which the accelerator was busy, by its own counter.
    pub busy_cycles: u64,
    /// Bytes that it read from memory.
    pub read_bytes: u64,
    /// Bytes that it wrote to memory.
    pub write_bytes: u64,
    /// How many times as fast it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speedup: Option<f64>,
    /// Whether it made what the software made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal: Option<bool>,
}

impl SocAccelerated {
    /// The comparison of a run, if an accelerator took part.
    pub fn new(outcome: &Outcome, blob: &SceneBlob, beside: Option<&Beside>) -> Option<Self> {
        let (report, beside) = (outcome.accelerated.as_ref()?, beside?);
        let parts: Vec<SocPart> =
            PARTS.iter().filter_map(|&part| SocPart::new(part, report, outcome)).collect();
        let cycles = |name: Part| {
            let part = parts.iter().find(|part| part.part == name.as_str());
            part.map_or(0, |part| part.cycles)
        };
        let with_prepare = cycles(Part::Prepare) + cycles(Part::Build);
        let build = software(Part::Build, outcome).unwrap_or_default();
        Some(Self {
            config: beside.config.name,
            engine: if outcome.engine == Engine::PicoRv32 { "RTL" } else { "cycle model" },
            latency_cycles: beside.latency,
            equal: report.is_equal(),
            in_software: report.missing(blob.treelet_depth).map(Part::as_str).collect(),
            build_speedup_with_prepare: units::ratio(build, with_prepare),
            parts,
        })
    }
}

/// The software's cycles of a part.
fn software(part: Part, outcome: &Outcome) -> Option<u64> {
    let stages: &[Stage] = match part {
        Part::Prepare => return None,
        Part::Build => &[Stage::PartialSort, Stage::Merge, Stage::Emit],
        Part::Compress => &[Stage::Compress],
        Part::BuildCompressed => &[Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::Compress],
        Part::Trace => &[Stage::Trace],
    };
    let cycles = STAGES.iter().zip(outcome.report.cycles);
    Some(cycles.filter(|(stage, _)| stages.contains(stage)).map(|(_, cycles)| cycles).sum())
}

impl SocPart {
    fn new(part: Part, report: &Accelerated, outcome: &Outcome) -> Option<Self> {
        let done = report.parts[part as usize]?;
        let outputs: &[Output] = match part {
            Part::Prepare => &[],
            Part::Build => &[Output::LeafTable, Output::Nodes],
            Part::Compress => &[Output::QuantizedNodes],
            Part::BuildCompressed => &[Output::LeafTable, Output::QuantizedNodes],
            Part::Trace => &[Output::Hits],
        };
        let made = OUTPUTS.iter().zip(report.outputs).filter(|(o, _)| outputs.contains(o));
        let equal = made.filter_map(|(_, equal)| equal).reduce(|a, b| a && b);
        let software_cycles = software(part, outcome);
        Some(Self {
            part: part.as_str(),
            software_cycles,
            cycles: done.cycles,
            busy_cycles: done.counters.cycles,
            read_bytes: done.counters.bytes_read,
            write_bytes: done.counters.bytes_written,
            speedup: software_cycles.and_then(|software| units::ratio(software, done.cycles)),
            equal: equal.map(|equal| equal && report.same_counts),
        })
    }
}

impl fmt::Display for SocAccelerated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = units::count;
        let Self { config, engine, latency_cycles, .. } = self;
        let cycles = if *latency_cycles == 1 { "cycle" } else { "cycles" };
        writeln!(
            f,
            "  accelerator `{config}` ({engine}), its memory answers after {latency_cycles} {cycles}:\n"
        )?;
        let mut table =
            Table::new(["part", "software", "accelerated", "busy", "speed-up", "bytes"]);
        for part in &self.parts {
            table.row([
                part.part.to_owned(),
                part.software_cycles.map_or(String::new(), n),
                n(part.cycles),
                if part.busy_cycles > 0 { n(part.busy_cycles) } else { String::new() },
                part.speedup.map_or(String::new(), |times| format!("{times:.1}x")),
                match part.equal {
                    None => String::new(),
                    Some(true) => "equal".to_owned(),
                    Some(false) => "DIFFERENT".to_owned(),
                },
            ]);
        }
        write!(f, "{table}")?;
        if !self.in_software.is_empty() {
            writeln!(
                f,
                "  no unit for, and therefore in software: {}",
                self.in_software.join(", ")
            )?;
        }
        let prepares = self.parts.iter().any(|part| part.software_cycles.is_none());
        if let Some(times) = self.build_speedup_with_prepare.filter(|_| prepares) {
            writeln!(f, "  with the boxes that the core prepares, a build is {times:.1}x as fast")?;
        }
        Ok(())
    }
}
