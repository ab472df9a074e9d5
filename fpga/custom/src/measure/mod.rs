//! Each step in software and with custom instructions, on a scene's own data.

mod bench;
mod steps;
mod whole;

use core::fmt;

use xylem_core::mem::Bus;
use xylem_firmware::job::{Clock, Finished};

use crate::Cfu;
use bench::Bench;

pub use steps::{RUNS, Storage};

/// What was measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step {
    /// Replacing the top of a heap of [`RUNS`] runs, and fetching the next code of its run.
    Heap,
    /// Testing an exact box.
    BoxTest,
    /// Encoding the two children of a node.
    Encode,
    /// All of `compress_top_down`, a node.
    Compress,
    /// All of tracing, a ray.
    Trace,
}

impl Step {
    /// All steps, in the order in which they are measured.
    pub const ALL: [Self; 5] =
        [Self::Heap, Self::BoxTest, Self::Encode, Self::Compress, Self::Trace];

    /// The step's name, a word.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Heap => "heap",
            Self::BoxTest => "box-test",
            Self::Encode => "encode",
            Self::Compress => "compress",
            Self::Trace => "trace",
        }
    }
}

/// A step in both ways, with equal results.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Measured {
    /// Which.
    pub step: Step,
    /// How often it was done.
    pub count: u32,
    /// Cycles of all in software.
    pub software: u64,
    /// Cycles of all with custom instructions.
    pub custom: u64,
}

impl fmt::Display for Measured {
    /// The step's name, its count, and the cycles of software and of custom instructions.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {} {}", self.step.as_str(), self.count, self.software, self.custom)
    }
}

impl Measured {
    /// What [`Display`](fmt::Display) wrote.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let name = words.next()?;
        let step = Step::ALL.into_iter().find(|step| step.as_str() == name)?;
        let mut number = || words.next()?.parse().ok();
        let (count, software, custom) = (number()?, number()?, number()?);
        Some(Self { step, count: u32::try_from(count).ok()?, software, custom })
    }
}

/// Why nothing was measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Failure {
    /// The results of a step differ.
    Differ(Step),
    /// A step could not be done: memory does not hold what the job left there, or lacks room.
    Impossible(Step),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Differ(step) => write!(f, "{}: the results differ", step.as_str()),
            Self::Impossible(step) => {
                write!(f, "{}: memory does not hold what the job leaves", step.as_str())
            }
        }
    }
}

impl core::error::Error for Failure {}

/// Measures every step on what a job left in memory and hands each to `observe`.
///
/// # Errors
/// [`Failure`], at the first step of which results differ.
pub fn all<B: Bus, K: Clock, C: Cfu>(
    bus: &mut B,
    finished: &Finished,
    storage: &mut Storage,
    clock: &mut K,
    cfu: &C,
    observe: &mut impl FnMut(&Measured),
) -> Result<(), Failure> {
    let mut bench = Bench { bus, finished, clock, cfu };
    observe(&bench.heap(storage)?);
    observe(&bench.box_test(storage)?);
    observe(&bench.encode(storage)?);
    observe(&bench.compress()?);
    observe(&bench.trace()?);
    Ok(())
}
