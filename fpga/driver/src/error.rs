//! One error for each operation of the driver.
//!
//! `E` is the register access's own error, `P` the interrupt line's.

use core::fmt;

use xylem_core::mem::ByteAddr;
use xylem_regs::{ErrorCode, RegionId, Stage, UnknownValue};

use crate::config::ConfigError;
use crate::device::MapVersion;
use crate::wait::Micros;

/// Why [`probe`](crate::Xylem::probe) found no accelerator to work with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ProbeError<E> {
    /// A register access failed.
    Access(E),
    /// The first register does not hold the magic number.
    NotFound {
        /// What it holds.
        found: u32,
    },
    /// The accelerator's register map is not one that this driver knows.
    VersionMismatch {
        /// The accelerator's version.
        found: MapVersion,
        /// The version that this driver was written for.
        supported: MapVersion,
    },
}

impl<E: fmt::Display> fmt::Display for ProbeError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "accelerator could not be probed: {error}"),
            Self::NotFound { found: found @ (0 | u32::MAX) } => write!(
                f,
                "no accelerator: the magic register reads {found:#010x}, as an undriven bus does; \
                 check power, reset, wiring and chip select"
            ),
            Self::NotFound { found } => write!(
                f,
                "no accelerator: the magic register reads {found:#010x}; check the base address \
                 and the byte order"
            ),
            Self::VersionMismatch { found, supported } => write!(
                f,
                "accelerator has register map {found}, this driver knows {supported}; load a \
                 matching bitstream or use a matching driver"
            ),
        }
    }
}

/// Why a job was not started.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StartError<E> {
    /// A register access failed; some parameters may be written, but nothing runs unless the last
    /// access, the start itself, was the one that failed.
    Access(E),
    /// The job is wrong. No register was written.
    Config(ConfigError),
    /// A job is running. No register was written.
    Busy,
}

impl<E: fmt::Display> fmt::Display for StartError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "job could not be started: {error}"),
            Self::Config(error) => write!(f, "job refused: {error}"),
            Self::Busy => f.write_str("a job is running; wait for it or abort it first"),
        }
    }
}

/// Why [`wait`](crate::Xylem::wait) did not see a job succeed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum WaitError<E, P> {
    /// A register access failed; the job may still run.
    Access(E),
    /// The interrupt line could not be read; the job may still run.
    Interrupt(P),
    /// The job ended in an error.
    Job(JobError),
    /// The job still runs.
    TimedOut {
        /// What it is doing.
        stage: Stage,
        /// How long it was waited for.
        waited: Micros,
    },
    /// No job was started since the last reset.
    NotStarted,
    /// A register holds a value that this version of the map does not have.
    Unknown {
        /// The register.
        register: &'static str,
        /// The field's bits.
        value: UnknownValue,
    },
}

impl<E, P> WaitError<E, P> {
    pub(crate) fn unknown(register: &'static str, value: UnknownValue) -> Self {
        Self::Unknown { register, value }
    }
}

impl<E: fmt::Display, P: fmt::Debug> fmt::Display for WaitError<E, P> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "job could not be watched: {error}"),
            Self::Interrupt(error) => write!(f, "interrupt line could not be read: {error:?}"),
            Self::Job(error) => error.fmt(f),
            Self::TimedOut { stage, waited } => write!(
                f,
                "job is still in stage {stage} after {waited}; wait longer, abort it or reset"
            ),
            Self::NotStarted => f.write_str("no job was started; there is nothing to wait for"),
            Self::Unknown { register, value } => {
                write!(f, "register {register}: {value}; check the bus")
            }
        }
    }
}

/// How a job failed, as the accelerator reports it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobError {
    /// What went wrong.
    pub code: ErrorCode,
    /// In which stage.
    pub stage: Stage,
    /// The region concerned, where there is one.
    pub region: Option<RegionId>,
    /// Where in external memory, for errors of the bus, of a region or of a node.
    pub addr: ByteAddr,
}

impl fmt::Display for JobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { code, stage, region, addr } = self;
        write!(f, "job failed in stage {stage}: ")?;
        match code {
            ErrorCode::None => f.write_str("no error code was given; check the bitstream")?,
            ErrorCode::BadConfig => f.write_str("its parameters were refused")?,
            ErrorCode::RegionFull => f.write_str("a region ran full; make it larger")?,
            ErrorCode::OutOfRegion => write!(f, "an access to {addr} was outside its region")?,
            ErrorCode::BusRead => write!(f, "memory refused a read at {addr}")?,
            ErrorCode::BusWrite => write!(f, "memory refused a write at {addr}")?,
            ErrorCode::BusTimeout => write!(f, "memory did not answer at {addr}")?,
            ErrorCode::BadPrimitive => write!(f, "the primitive at {addr} is not on the grid")?,
            ErrorCode::CorruptNode => {
                write!(f, "{} at {addr} is corrupt; build it anew", entry(*region))?
            }
            ErrorCode::BadRay => write!(f, "the record at {addr} is not a ray")?,
            ErrorCode::StackOverflow => f.write_str("the tree is too deep for the stack")?,
            ErrorCode::Aborted => f.write_str("it was aborted")?,
        }
        match region {
            Some(region) => write!(f, " (region {region})"),
            None => Ok(()),
        }
    }
}

/// What a region of a tree consists of.
const fn entry(region: Option<RegionId>) -> &'static str {
    match region {
        Some(RegionId::LeafTable) => "the leaf table entry",
        _ => "the node",
    }
}

impl core::error::Error for JobError {}

/// Why there is no result to read.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ResultError<E> {
    /// A register access failed.
    Access(E),
    /// The job still runs, or none was started.
    NotDone,
    /// The last job failed; [`wait`](crate::Xylem::wait) tells how.
    Failed,
}

impl<E: fmt::Display> fmt::Display for ResultError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "result could not be read: {error}"),
            Self::NotDone => f.write_str("no job is done yet; wait for one first"),
            Self::Failed => f.write_str("the last job failed and has no result"),
        }
    }
}

/// Why [`abort`](crate::Xylem::abort) or [`reset`](crate::Xylem::reset) did not work.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StopError<E> {
    /// A register access failed.
    Access(E),
    /// Outstanding bursts did not return.
    TimedOut {
        /// How long they were waited for.
        waited: Micros,
    },
}

impl<E: fmt::Display> fmt::Display for StopError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Access(error) => write!(f, "job could not be stopped: {error}"),
            Self::TimedOut { waited } => write!(
                f,
                "still busy {waited} after the command: memory does not answer; reset the board"
            ),
        }
    }
}

impl<E: core::error::Error> core::error::Error for ProbeError<E> {}
impl<E: core::error::Error> core::error::Error for StartError<E> {}
impl<E: core::error::Error, P: fmt::Debug> core::error::Error for WaitError<E, P> {}
impl<E: core::error::Error> core::error::Error for ResultError<E> {}
impl<E: core::error::Error> core::error::Error for StopError<E> {}

/// Lets `?` pass a failed register access on, whatever the operation.
macro_rules! from_access {
    ($($error:ident $(<$other:ident>)?),*) => {$(
        impl<E $(, $other)?> From<E> for $error<E $(, $other)?> {
            fn from(error: E) -> Self {
                Self::Access(error)
            }
        }
    )*};
}

from_access!(ProbeError, StartError, WaitError<P>, ResultError, StopError);
