//! Feeds the RTL and the cycle model the same inputs and compares every output of every cycle.

use std::collections::VecDeque;
use std::fmt;
use std::path::{Path, PathBuf};

use xylem::machine::heap::{HeapConfig, HeapModel, HeapOp, HeapOutputs};

use super::HeapRtl;
use super::traffic::Traffic;
use crate::verilate::CosimError;

/// Cycles before a mismatch that its report and its waveform show.
const SHOWN: usize = 12;
const RECORDED: u64 = 600;

/// What a run without a mismatch amounts to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Summary {
    /// Operations that the model took.
    pub operations: u64,
    /// Of those, the ones that were errors.
    pub rejected: u64,
    /// Cycles until the model had taken the last of them.
    pub model_cycles: u64,
    /// Cycles until the RTL had taken as many.
    pub rtl_cycles: u64,
    /// Entries in the heap, summed over the operations.
    pub entries: u64,
}

impl Summary {
    /// A row of the table that [`Summary::HEADER`] heads.
    pub fn row(&self, test: &str, config: HeapConfig, seed: u64) -> String {
        let Self { operations, rejected, model_cycles, rtl_cycles, entries } = *self;
        let delta = rtl_cycles as i64 - model_cycles as i64;
        let mean = entries as f64 / operations as f64;
        format!(
            "| {test} | {} | {seed} | {operations} | {rejected} | {mean:.1} | {model_cycles} \
             | {rtl_cycles} | {delta} |",
            config.name
        )
    }

    /// Heads the rows.
    pub const HEADER: &str = "\
        | test | configuration | seed | operations | rejected | entries (mean) | model cycles \
        | RTL cycles | delta |\n|---|---|---:|---:|---:|---:|---:|---:|---:|";
}

/// One cycle on both sides.
#[derive(Clone, Copy, Debug)]
pub struct Compared {
    /// Counted from 0 after reset.
    pub cycle: u64,
    /// What was offered.
    pub op: Option<HeapOp>,
    /// The model's outputs.
    pub model: HeapOutputs,
    /// The RTL's outputs.
    pub rtl: HeapOutputs,
}

impl fmt::Display for Compared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cycle, op, model, rtl } = self;
        match op {
            None => write!(f, "cycle {cycle}: no operation")?,
            Some(op) => write!(f, "cycle {cycle}: {op:?}")?,
        }
        if model == rtl {
            write!(f, "\n    both  {model:?}")
        } else {
            write!(f, "\n    model {model:?}\n    RTL   {rtl:?}   <- differs")
        }
    }
}

/// Why a run stopped.
#[derive(Debug)]
pub enum Stop {
    /// The sides differ in the last of these cycles; those before it lead there.
    Mismatch(Vec<Compared>),
    /// The RTL could not be run, or an assertion in it failed.
    Rtl {
        /// The cycle in which it happened.
        cycle: u64,
        /// What happened.
        error: CosimError,
    },
}

impl Stop {
    /// The cycle in which the run stopped.
    pub fn cycle(&self) -> u64 {
        match self {
            Self::Mismatch(trail) => trail.last().map_or(0, |last| last.cycle),
            Self::Rtl { cycle, .. } => *cycle,
        }
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mismatch(trail) => {
                write!(f, "RTL and model differ, first in cycle {}", self.cycle())?;
                trail.iter().try_for_each(|compared| write!(f, "\n{compared}"))
            }
            Self::Rtl { cycle, error } => write!(f, "cycle {cycle}: {error}"),
        }
    }
}

/// The folder for waveforms that the environment names in `XYLEM_WAVES`, if it does.
pub fn waves_folder() -> Option<PathBuf> {
    std::env::var_os("XYLEM_WAVES").map(PathBuf::from)
}

/// Runs random traffic until `operations` have been taken.
///
/// On a stop, the run is repeated with a waveform of the last cycles before it, written to
/// `heap-CONFIGURATION-seedSEED.vcd` in `waves` if that names a folder.
///
/// # Errors
///
/// The first cycle in which the sides differ or the RTL fails.
pub fn run(
    library: &Path,
    config: HeapConfig,
    seed: u64,
    operations: u64,
    waves: Option<&Path>,
) -> Result<Summary, Stop> {
    let result = run_once(library, config, seed, operations, None);
    if let (Err(stop), Some(folder)) = (&result, waves) {
        let file = folder.join(format!("heap-{}-seed{seed}.vcd", config.name));
        let from = stop.cycle().saturating_sub(RECORDED);
        match run_once(library, config, seed, operations, Some((from, &file))) {
            Err(Stop::Rtl { error: error @ CosimError::Io { .. }, .. }) => {
                eprintln!("no waveform: {error}");
            }
            _ => eprintln!("waveform from cycle {from} on: {}", file.display()),
        }
    }
    result
}

fn run_once(
    library: &Path,
    config: HeapConfig,
    seed: u64,
    operations: u64,
    waves: Option<(u64, &Path)>,
) -> Result<Summary, Stop> {
    let at = |cycle| move |error| Stop::Rtl { cycle, error };
    let mut rtl = HeapRtl::load(library, seed as u32).map_err(at(0))?;
    let mut model = HeapModel::new(config);
    let mut traffic = Traffic::new(config, seed);
    let mut summary =
        Summary { operations: 0, rejected: 0, model_cycles: 0, rtl_cycles: 0, entries: 0 };
    let mut trail = VecDeque::with_capacity(SHOWN);

    // Some cycles more than the operations need, so that the last one's results are seen too.
    let mut after = 0;
    for cycle in 0.. {
        if let Some((from, file)) = waves.filter(|(from, _)| *from == cycle) {
            rtl.record(file).map_err(at(from))?;
        }
        let running = summary.operations < operations;
        let op = if running { traffic.offer(model.outputs()) } else { None };
        let compared =
            Compared { cycle, op, model: model.tick(op), rtl: rtl.tick(op).map_err(at(cycle))? };
        if trail.len() == SHOWN {
            trail.pop_front();
        }
        trail.push_back(compared);
        if compared.model != compared.rtl {
            return Err(Stop::Mismatch(trail.into()));
        }
        if op.is_some() && compared.model.ready {
            summary.operations += 1;
            summary.entries += model.len() as u64;
            summary.model_cycles = cycle + 1;
        }
        if op.is_some() && compared.rtl.ready {
            summary.rtl_cycles = cycle + 1;
        }
        summary.rejected += u64::from(compared.model.error);
        after += u64::from(!running);
        if after > 2 * u64::from(config.levels) {
            break;
        }
    }
    Ok(summary)
}
