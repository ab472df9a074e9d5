//! The accelerator: probe it, start a job, wait, read what came out.

use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::InputPin;
use glam::IVec3;
use xylem_core::geom::Aabb;
use xylem_core::node::{Subtree, Tree};
use xylem_regs::{
    CAP_FEATURES, CAP_GEOMETRY, CAP_MERGE, CAP_SORT, CAP_TRACE, CTRL, CapFeatures, CapGeometry,
    CapMerge, CapSort, CapTrace, Coordinate, Ctrl, INT_ENABLE, INT_STATUS, IntEnable, IntStatus,
    JOB_ENTRIES, JOB_FORMAT, JOB_LIMITS, JOB_NODES, JOB_PRIMITIVES, JOB_RAYS, JobEntries, JobNodes,
    JobPrimitives, JobRays, MAGIC, Magic, REGION_PRIMITIVES_BASE, RESULT_HITS, RESULT_LEAVES,
    RESULT_NODES, RESULT_QUANTIZED, ROOT_HI_X, ROOT_LEAF_SIZE, ROOT_LO_X, ROOT_POINTER, Reg,
    RegionBase, RegionSize, Register, RootLeafSize, RootPointer, STATUS, VERSION, Version,
};

use crate::access::{RegisterAccess, TypedAccess};
use crate::counters::{Counters, CountersError};
use crate::error::{ProbeError, ResultError, StartError};
use crate::job::{BuildJob, CompressJob, Setup, TraceJob, pointer, pointer_words};
use crate::wait::Micros;

/// A Xylem accelerator, reached through registers `R`, a delay `D` and an interrupt line `I`.
///
/// The interrupt line is active high. Without one, [`NoInterrupt`](crate::NoInterrupt) makes the
/// driver poll the status register instead.
#[derive(Debug)]
pub struct Xylem<R, D, I> {
    pub(crate) regs: R,
    pub(crate) delay: D,
    pub(crate) interrupt: I,
    pub(crate) poll_interval: Micros,
    capabilities: Capabilities,
}

/// What the accelerator was synthesized with, as its capability registers tell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capabilities {
    /// The sorter's memories.
    pub sort: CapSort,
    /// The merge and the leaves.
    pub merge: CapMerge,
    /// The number system.
    pub geometry: CapGeometry,
    /// Jobs, formats and counters that are there.
    pub features: CapFeatures,
    /// The traversal unit.
    pub trace: CapTrace,
}

/// A version of the register map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MapVersion {
    /// Changes when software must change.
    pub major: u8,
    /// Changes when something is added.
    pub minor: u8,
    /// Changes when only behaviour is repaired.
    pub patch: u16,
}

impl MapVersion {
    /// The version that this driver was written for.
    pub const SUPPORTED: Self = Self::of(Version::RESET);

    const fn of(version: Version) -> Self {
        Self { major: version.major(), minor: version.minor(), patch: version.patch() }
    }

    /// Whether an accelerator of this version does all that the driver of `wanted` relies on.
    const fn serves(self, wanted: Self) -> bool {
        let same_minor = self.minor == wanted.minor;
        self.major == wanted.major && (same_minor || self.major > 0 && self.minor > wanted.minor)
    }
}

impl fmt::Display for MapVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

impl<R: RegisterAccess, D: DelayNs, I: InputPin> Xylem<R, D, I> {
    /// Finds the accelerator and reads what it can do. Nothing is written.
    ///
    /// # Errors
    /// [`ProbeError`]: no accelerator there, one of another version, or a failed access.
    pub fn probe(mut regs: R, delay: D, interrupt: I) -> Result<Self, ProbeError<R::Error>> {
        let magic = regs.get(MAGIC)?;
        if magic != Magic::RESET {
            return Err(ProbeError::NotFound { found: magic.value() });
        }
        let (found, supported) = (MapVersion::of(regs.get(VERSION)?), MapVersion::SUPPORTED);
        if !found.serves(supported) {
            return Err(ProbeError::VersionMismatch { found, supported });
        }
        let capabilities = Capabilities {
            sort: regs.get(CAP_SORT)?,
            merge: regs.get(CAP_MERGE)?,
            geometry: regs.get(CAP_GEOMETRY)?,
            features: regs.get(CAP_FEATURES)?,
            trace: regs.get(CAP_TRACE)?,
        };
        Ok(Self { regs, delay, interrupt, poll_interval: Micros(10), capabilities })
    }

    /// What the accelerator can do, as found by [`probe`](Self::probe).
    pub const fn capabilities(&self) -> &Capabilities {
        &self.capabilities
    }

    /// Sets how long to pause between two looks at the interrupt line or the status register; at
    /// least 1 µs, 10 µs from the start.
    pub fn set_poll_interval(&mut self, interval: Micros) {
        self.poll_interval = interval.max(Micros(1));
    }

    /// Starts a build, and compresses the tree on the way if the job says so.
    ///
    /// # Errors
    /// [`StartError`]. Where the job is refused or the accelerator is busy, no register was
    /// written; after a failed access some were, but nothing runs.
    pub fn start_build(&mut self, job: &BuildJob) -> Result<(), StartError<R::Error>> {
        let setup = job.setup(&self.capabilities).map_err(StartError::Config)?;
        self.start(&setup)
    }

    /// Starts a top-down compression.
    ///
    /// # Errors
    /// As [`start_build`](Self::start_build).
    pub fn start_compress(&mut self, job: &CompressJob) -> Result<(), StartError<R::Error>> {
        let setup = job.setup(&self.capabilities).map_err(StartError::Config)?;
        self.start(&setup)
    }

    /// Starts tracing a region of rays.
    ///
    /// # Errors
    /// As [`start_build`](Self::start_build).
    pub fn start_trace(&mut self, job: &TraceJob) -> Result<(), StartError<R::Error>> {
        let setup = job.setup(&self.capabilities).map_err(StartError::Config)?;
        self.start(&setup)
    }

    fn start(&mut self, setup: &Setup) -> Result<(), StartError<R::Error>> {
        if self.regs.get(STATUS)?.busy() {
            return Err(StartError::Busy);
        }
        self.configure(setup)?;
        self.regs.set(CTRL, Ctrl::RESET.with_job(setup.kind).with_start(true))?;
        Ok(())
    }

    fn configure(&mut self, setup: &Setup) -> Result<(), R::Error> {
        let regs = &mut self.regs;
        regs.set(INT_STATUS, IntStatus::RESET.with_done(true).with_failed(true))?;
        regs.set(INT_ENABLE, IntEnable::RESET.with_done(true).with_failed(true))?;
        for (offset, region) in (REGION_PRIMITIVES_BASE.offset()..).step_by(8).zip(&setup.regions) {
            regs.write(offset, RegionBase::from_bits(region.base.0).bits())?;
            regs.write(offset + 4, RegionSize::from_bits(region.size).bits())?;
        }
        regs.set(JOB_PRIMITIVES, JobPrimitives::RESET.with_value(setup.primitives))?;
        regs.set(JOB_RAYS, JobRays::RESET.with_value(setup.rays))?;
        regs.set(JOB_NODES, JobNodes::RESET.with_value(setup.nodes))?;
        regs.set(JOB_ENTRIES, JobEntries::RESET.with_value(setup.entries))?;
        regs.set(JOB_FORMAT, setup.format)?;
        regs.set(JOB_LIMITS, setup.limits)?;
        match &setup.root {
            Some(root) => self.write_root(root),
            None => Ok(()),
        }
    }

    fn write_root(&mut self, root: &Subtree) -> Result<(), R::Error> {
        let corners = [(ROOT_LO_X, root.bounds.min), (ROOT_HI_X, root.bounds.max)];
        for (x, corner) in corners {
            for (offset, value) in (x.offset()..).step_by(4).zip(corner.to_array()) {
                self.regs.write(offset, Coordinate::RESET.with_value(value).bits())?;
            }
        }
        let (index, leaf_size) = pointer_words(root.child);
        self.regs.set(ROOT_POINTER, RootPointer::RESET.with_index(index))?;
        self.regs.set(ROOT_LEAF_SIZE, RootLeafSize::RESET.with_count(leaf_size))
    }

    /// Describes the tree that `job`, the last one, has built.
    ///
    /// # Errors
    /// [`ResultError`]: no job is done, it failed, or a failed access.
    pub fn built_tree(&mut self, job: &BuildJob) -> Result<Tree, ResultError<R::Error>> {
        self.require_result()?;
        let regs = &mut self.regs;
        let min = read_corner(regs, ROOT_LO_X)?;
        let bounds = Aabb::new(min, read_corner(regs, ROOT_HI_X)?);
        let child = pointer(regs.get(ROOT_POINTER)?.index(), regs.get(ROOT_LEAF_SIZE)?.count());
        let nodes = if job.compressed.is_some() { RESULT_QUANTIZED } else { RESULT_NODES };
        let node_count = regs.get(nodes)?.value();
        let leaf_count = regs.get(RESULT_LEAVES)?.value();
        Ok(job.tree(Subtree { bounds, child }, node_count, leaf_count))
    }

    /// How many rays of the last trace hit something.
    ///
    /// # Errors
    /// As [`built_tree`](Self::built_tree).
    pub fn hit_count(&mut self) -> Result<u32, ResultError<R::Error>> {
        self.require_result()?;
        Ok(self.regs.get(RESULT_HITS)?.value())
    }

    fn require_result(&mut self) -> Result<(), ResultError<R::Error>> {
        let status = self.regs.get(STATUS)?;
        if status.busy() || !status.done() {
            return Err(ResultError::NotDone);
        }
        if status.failed() { Err(ResultError::Failed) } else { Ok(()) }
    }

    /// Takes a snapshot of the event counters.
    ///
    /// # Errors
    /// [`CountersError`]: this accelerator has none, a failed access, or a bus that garbles.
    pub fn counters(&mut self) -> Result<Counters, CountersError<R::Error>> {
        if !self.capabilities.features.counters() {
            return Err(CountersError::Absent);
        }
        Counters::read(&mut self.regs)
    }

    /// Gives back the register access, the delay and the interrupt line. A running job runs on.
    pub fn release(self) -> (R, D, I) {
        (self.regs, self.delay, self.interrupt)
    }
}

/// The corner whose coordinates are in three consecutive registers from `x` on.
fn read_corner<R: RegisterAccess>(regs: &mut R, x: Reg<Coordinate>) -> Result<IVec3, R::Error> {
    let mut words = [0; 3];
    regs.read_burst(x.offset(), &mut words)?;
    Ok(IVec3::from_array(words.map(|word| Coordinate::from_bits(word).value())))
}
