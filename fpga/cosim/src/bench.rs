//! A unit on the bench: clocked cycle by cycle, its outputs held against what a model says.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use crate::rtl::{Pin, Rtl};
use crate::verilate::CosimError;

/// Cycles before a mismatch that its waveform shows.
const RECORDED: u64 = 600;

/// Declares a struct of a unit's pins with a field for each port, of the port's name: inputs first,
/// then outputs.
#[macro_export]
macro_rules! pins {
    ($(#[$meta:meta])* $name:ident { $($input:ident),* ; $($output:ident),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Debug)]
        struct $name {
            $($input: $crate::rtl::Pin,)*
            $($output: $crate::rtl::Pin,)*
        }

        impl $name {
            fn new(rtl: &$crate::rtl::Rtl) -> Self {
                Self {
                    $($input: rtl.input(stringify!($input)),)*
                    $($output: rtl.output(stringify!($output)),)*
                }
            }
        }
    };
}

/// A unit in gates and the number of the cycle that it is in.
#[derive(Debug)]
pub struct Bench {
    /// The unit.
    pub rtl: Rtl,
    cycle: u64,
    waves: Waves,
}

/// From which cycle on a waveform is to be written, and to which file; `None` for never.
pub type Waves = Option<(u64, PathBuf)>;

/// Why a run stopped.
#[derive(Debug)]
pub enum Stop {
    /// An output is not what the model says.
    Mismatch {
        /// Counted from 0 after reset.
        cycle: u64,
        /// The output port.
        port: String,
        /// The model's value, in hexadecimal.
        model: String,
        /// The RTL's value, in hexadecimal.
        rtl: String,
    },
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
            Self::Mismatch { cycle, .. } | Self::Rtl { cycle, .. } => *cycle,
        }
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mismatch { cycle, port, model, rtl } => write!(
                f,
                "RTL and model differ, first in cycle {cycle}, in {port}\n    model {model}\n    RTL   {rtl}"
            ),
            Self::Rtl { cycle, error } => write!(f, "cycle {cycle}: {error}"),
        }
    }
}

impl Bench {
    /// Puts the unit of a library on the bench; what has no reset starts with random values from `seed`.
    ///
    /// # Errors
    /// As [`Rtl::load`].
    pub fn load(library: &Path, seed: u64, waves: Waves) -> Result<Self, Stop> {
        let rtl = Rtl::load(library, seed as u32).map_err(|error| Stop::Rtl { cycle: 0, error })?;
        Ok(Self { rtl, cycle: 0, waves })
    }

    /// Cycles that have ended.
    pub fn cycle(&self) -> u64 {
        self.cycle
    }

    /// Compares an output of up to 64 bits, as it was last settled.
    ///
    /// # Errors
    /// [`Stop::Mismatch`].
    pub fn expect(&self, pin: Pin, model: impl Into<u64>) -> Result<(), Stop> {
        self.expect_bytes(pin, &model.into().to_le_bytes()[..pin.bits().div_ceil(8) as usize])
    }

    /// Compares an output as bytes, lowest first.
    ///
    /// # Errors
    /// [`Stop::Mismatch`].
    pub fn expect_bytes(&self, pin: Pin, model: &[u8]) -> Result<(), Stop> {
        let rtl = self.rtl.bytes(pin);
        if rtl == model {
            return Ok(());
        }
        let hex = |bytes: &[u8]| bytes.iter().rev().map(|byte| format!("{byte:02x}")).collect();
        let port = self.rtl.name(pin).to_owned();
        Err(Stop::Mismatch { cycle: self.cycle, port, model: hex(model), rtl: hex(&rtl) })
    }

    /// Ends the cycle with a clock edge.
    ///
    /// # Errors
    /// [`Stop::Rtl`] for an assertion that failed.
    pub fn edge(&mut self) -> Result<(), Stop> {
        let cycle = self.cycle;
        let failed = |error| Stop::Rtl { cycle, error };
        if let Some((_, file)) = self.waves.take_if(|(from, _)| *from <= cycle) {
            self.rtl.record(&file).map_err(failed)?;
        }
        self.rtl.edge().map_err(failed)?;
        self.cycle += 1;
        Ok(())
    }
}

/// Runs a unit with a fault in it, which must be seen: as a difference, or in a panic of what checks what
/// came of it. Says where.
///
/// # Panics
/// If the unit cannot be built, or nothing sees the fault.
pub fn must_see<T: fmt::Debug>(
    what: &str,
    faulty: Result<PathBuf, CosimError>,
    run: impl FnOnce(&Path) -> Result<T, Stop>,
) {
    let faulty = faulty.unwrap_or_else(|error| panic!("{what}: {error}"));
    match catch_unwind(AssertUnwindSafe(|| run(&faulty))) {
        Ok(Ok(summary)) => panic!("not seen: {what}: {summary:?}"),
        Ok(Err(stop)) => println!("{what}: seen in cycle {}", stop.cycle()),
        Err(_) => println!("{what}: seen in what came of it"),
    }
}

/// Runs `run` once; when it stops, again with a waveform of the last cycles before that, written to
/// `NAME.vcd` in the folder that the environment names in `XYLEM_WAVES`, if it does.
///
/// # Errors
/// Those of the first run.
pub fn with_waves<T>(name: &str, run: impl Fn(Waves) -> Result<T, Stop>) -> Result<T, Stop> {
    let result = run(None);
    if let (Err(stop), Some(folder)) = (&result, std::env::var_os("XYLEM_WAVES")) {
        let file = Path::new(&folder).join(format!("{name}.vcd"));
        let from = stop.cycle().saturating_sub(RECORDED);
        match run(Some((from, file.clone()))) {
            Err(Stop::Rtl { error: error @ CosimError::Io { .. }, .. }) => {
                eprintln!("no waveform: {error}");
            }
            _ => eprintln!("waveform from cycle {from} on: {}", file.display()),
        }
    }
    result
}
