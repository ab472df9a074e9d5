//! An accelerator of registers and a clock, stricter than hardware: what the register map does not
//! allow ends the test.
//!
//! It does no work: a job takes a scripted time and ends in a scripted way.
#![allow(dead_code)] // Each test binary uses its own part.

pub mod fixtures;

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin};
use xylem_driver::RegisterAccess;
use xylem_regs::{
    Access, CAP_FEATURES, CAP_GEOMETRY, CAP_MERGE, CAP_SORT, CAP_TRACE, CTRL, CapFeatures,
    CapGeometry, CapMerge, CapSort, CapTrace, Ctrl, ERROR_ADDR, ERROR_INFO, ErrorCode, ErrorInfo,
    INT_ENABLE, INT_STATUS, JobKind, REGISTERS, Reg, RegionId, Register, RegisterInfo, STATUS,
    Stage, Status,
};

/// How the next job ends.
#[derive(Clone, Copy, Debug)]
pub enum Outcome {
    Done,
    Failed(ErrorCode, Option<RegionId>, u32),
    /// It does not, and does not answer an abort either.
    Hangs,
}

#[derive(Debug)]
pub struct Device {
    words: BTreeMap<u32, u32>,
    now_ns: u64,
    ends_at_ns: Option<u64>,
    pub job_us: u64,
    pub outcome: Outcome,
    /// Jobs started, in order.
    pub started: Vec<JobKind>,
    /// Every register write, in order.
    pub writes: Vec<(&'static str, u32)>,
    /// How often the status register was read.
    pub status_reads: usize,
}

/// A handle to the device: one goes to the driver as its registers, one as its delay, one as its
/// interrupt line, and one stays with the test.
#[derive(Clone, Debug)]
pub struct Fake(pub Rc<RefCell<Device>>);

impl Fake {
    /// A device of the papers' configuration that can do everything, with jobs of 100 µs.
    pub fn new() -> Self {
        let mut device = Device {
            words: REGISTERS.iter().map(|r| (r.offset, r.reset)).collect(),
            now_ns: 0,
            ends_at_ns: None,
            job_us: 100,
            outcome: Outcome::Done,
            started: Vec::new(),
            writes: Vec::new(),
            status_reads: 0,
        };
        device.drive(CAP_SORT, CapSort::from_bits(8192 | 16 << 24));
        device.drive(CAP_MERGE, CapMerge::from_bits(256 | 255 << 16));
        device.drive(CAP_GEOMETRY, CapGeometry::from_bits(24 | 63 << 8 | 6 << 16 | 2 << 24));
        device.drive(CAP_FEATURES, CapFeatures::from_bits(0x0013_373f));
        device.drive(CAP_TRACE, CapTrace::from_bits(40 | 24 << 8 | 64 << 16));
        Self(Rc::new(RefCell::new(device)))
    }

    /// Sets a register as the hardware side does.
    pub fn drive<T: Register>(&self, register: Reg<T>, value: T) {
        self.0.borrow_mut().drive(register, value);
    }

    /// What the hardware side sees in a register.
    pub fn value<T: Register>(&self, register: Reg<T>) -> T {
        T::from_bits(self.0.borrow().words[&register.offset()])
    }

    pub fn script(&self, job_us: u64, outcome: Outcome) {
        let mut device = self.0.borrow_mut();
        (device.job_us, device.outcome) = (job_us, outcome);
    }

    pub fn writes(&self) -> Vec<(&'static str, u32)> {
        self.0.borrow().writes.clone()
    }
}

impl Device {
    fn drive<T: Register>(&mut self, register: Reg<T>, value: T) {
        self.words.insert(register.offset(), value.bits());
    }

    fn word<T: Register>(&self, register: Reg<T>) -> T {
        T::from_bits(self.words[&register.offset()])
    }

    fn busy(&self) -> bool {
        self.word(STATUS).busy()
    }

    fn run_until(&mut self, now_ns: u64) {
        self.now_ns = now_ns;
        if self.ends_at_ns.is_some_and(|end| end <= now_ns) {
            match self.outcome {
                Outcome::Done => self.end(ErrorCode::None, None, 0),
                Outcome::Failed(code, region, addr) => self.end(code, region, addr),
                Outcome::Hangs => {}
            }
        }
    }

    fn end(&mut self, code: ErrorCode, region: Option<RegionId>, addr: u32) {
        let failed = code != ErrorCode::None;
        let stage = if failed { self.word(STATUS).bits() & 0xf00 } else { 0 };
        let region = region.map_or(0, |id| (id as u32) << 16 | 1 << 15);
        self.drive(ERROR_INFO, ErrorInfo::from_bits(code as u32 | stage | region));
        self.words.insert(ERROR_ADDR.offset(), addr);
        self.drive(STATUS, Status::from_bits(0b010 | u32::from(failed) << 2));
        *self.words.entry(INT_STATUS.offset()).or_default() |= if failed { 0b10 } else { 0b01 };
        self.ends_at_ns = None;
    }

    fn command(&mut self, ctrl: Ctrl) {
        let bits = ctrl.bits() & 0b111;
        assert!(bits.count_ones() <= 1, "ctrl: {bits:#b} gives more than one command");
        match bits {
            0b001 => {
                assert!(!self.busy(), "ctrl: start while busy");
                let kind = ctrl.job().expect("a job that the map has");
                self.started.push(kind);
                self.drive(ERROR_INFO, ErrorInfo::RESET);
                self.drive(STATUS, Status::from_bits(1 | (stage_of(kind) as u32) << 8));
                self.ends_at_ns = Some(self.now_ns + 1000 * self.job_us);
            }
            0b010 if !matches!(self.outcome, Outcome::Hangs) => {
                self.end(ErrorCode::Aborted, None, 0);
            }
            0b100 => {
                self.drive(STATUS, Status::RESET);
                self.drive(ERROR_INFO, ErrorInfo::RESET);
                self.ends_at_ns = None;
            }
            _ => {}
        }
    }
}

fn stage_of(kind: JobKind) -> Stage {
    match kind {
        JobKind::None => Stage::Idle,
        JobKind::Build | JobKind::BuildCompressed => Stage::Emit,
        JobKind::Compress => Stage::Compress,
        JobKind::Trace => Stage::Trace,
    }
}

impl RegisterAccess for Fake {
    type Error = Infallible;

    fn read(&mut self, offset: u32) -> Result<u32, Infallible> {
        let info = RegisterInfo::at(offset).unwrap_or_else(|| panic!("read of {offset:#x}"));
        assert_ne!(info.readable(), 0, "{} cannot be read", info.path);
        let mut device = self.0.borrow_mut();
        device.status_reads += usize::from(offset == STATUS.offset());
        Ok(device.words[&offset] & info.readable())
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), Infallible> {
        let info = RegisterInfo::at(offset).unwrap_or_else(|| panic!("write of {offset:#x}"));
        assert_ne!(info.writable(), 0, "{} cannot be written", info.path);
        let reserved = value & !info.writable();
        assert_eq!(reserved, 0, "{}: {value:#x} sets reserved bits", info.path);

        let mut device = self.0.borrow_mut();
        device.writes.push((info.path, value));
        let kept = info.mask(|access| access == Access::ReadWrite);
        let locked = if device.busy() { info.locked() } else { 0 };
        assert_eq!(value & locked, 0, "{}: {value:#x} while busy has no effect", info.path);
        let cleared = value & info.mask(|access| access == Access::WriteOneToClear);
        let word = device.words[&offset];
        let change = kept & !locked;
        device.words.insert(offset, ((word & !change) | (value & change)) & !cleared);
        if offset == CTRL.offset() {
            device.command(Ctrl::from_bits(value));
        }
        Ok(())
    }
}

impl DelayNs for Fake {
    fn delay_ns(&mut self, ns: u32) {
        let mut device = self.0.borrow_mut();
        let now = device.now_ns + u64::from(ns);
        device.run_until(now);
    }
}

/// The interrupt line: high while an enabled event is pending.
impl ErrorType for Fake {
    type Error = Infallible;
}

impl InputPin for Fake {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let device = self.0.borrow();
        Ok(device.words[&INT_STATUS.offset()] & device.words[&INT_ENABLE.offset()] != 0)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}
