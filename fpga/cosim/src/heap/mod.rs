//! The heap unit: its pins, what it is fed, and the lockstep with its model.

pub mod lockstep;
pub mod traffic;

use std::path::{Path, PathBuf};

use xylem::machine::heap::{HeapConfig, HeapEntry, HeapOp, HeapOutputs};

use crate::rtl::{Pin, Rtl};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// Builds the heap in `config`, with a fault if `mutation` says so, and returns the library's path.
///
/// # Errors
/// As [`verilate::unit`].
pub fn build(config: HeapConfig, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
    let unit = Unit {
        top: "xy_heap",
        files: "heap.f",
        config: config.name,
        parameters: &[
            ("Levels", config.levels.into()),
            ("KeyWidth", config.key_bits.into()),
            ("SlotWidth", config.slot_bits.into()),
            ("BlockLevel", config.block_level.into()),
        ],
    };
    verilate::unit(&unit, mutation)
}

/// `xy_heap` in gates.
#[derive(Debug)]
pub struct HeapRtl {
    rtl: Rtl,
    pins: Pins,
}

#[derive(Debug)]
struct Pins {
    op_valid: Pin,
    op: Pin,
    op_key: Pin,
    op_slot: Pin,
    op_ready: Pin,
    op_error: Pin,
    top_valid: Pin,
    top_key: Pin,
    top_slot: Pin,
    full: Pin,
}

impl HeapRtl {
    /// Loads a library that [`build`] built and resets the unit, as [`Rtl::load`] does.
    ///
    /// # Errors
    /// As [`Rtl::load`].
    pub fn load(library: &Path, seed: u32) -> Result<Self, CosimError> {
        let rtl = Rtl::load(library, seed)?;
        let pins = Pins {
            op_valid: rtl.input("op_valid_i"),
            op: rtl.input("op_i"),
            op_key: rtl.input("op_key_i"),
            op_slot: rtl.input("op_slot_i"),
            op_ready: rtl.output("op_ready_o"),
            op_error: rtl.output("op_error_o"),
            top_valid: rtl.output("top_valid_o"),
            top_key: rtl.output("top_key_o"),
            top_slot: rtl.output("top_slot_o"),
            full: rtl.output("full_o"),
        };
        Ok(Self { rtl, pins })
    }

    /// Runs one clock cycle in which `op` is offered, and returns the outputs during it.
    ///
    /// # Errors
    /// As [`Rtl::edge`].
    pub fn tick(&mut self, op: Option<HeapOp>) -> Result<HeapOutputs, CosimError> {
        let (valid, op, entry) = match op {
            None => (0, 0, HeapEntry::default()),
            Some(HeapOp::Insert(entry)) => (1, 0, entry),
            Some(HeapOp::Replace(entry)) => (1, 1, entry),
            Some(HeapOp::Remove) => (1, 2, HeapEntry::default()),
            Some(HeapOp::Clear) => (1, 3, HeapEntry::default()),
        };
        let Self { rtl, pins } = self;
        rtl.set(pins.op_valid, valid as u64);
        rtl.set(pins.op, op as u64);
        rtl.set(pins.op_key, entry.key);
        rtl.set(pins.op_slot, entry.slot);
        rtl.tick()?;
        let top = HeapEntry { key: rtl.get(pins.top_key), slot: rtl.get(pins.top_slot) as u32 };
        Ok(HeapOutputs {
            ready: rtl.is_set(pins.op_ready),
            error: rtl.is_set(pins.op_error),
            top: rtl.is_set(pins.top_valid).then_some(top),
            full: rtl.is_set(pins.full),
        })
    }

    /// Writes a waveform, as [`Rtl::record`] does.
    ///
    /// # Errors
    /// As [`Rtl::record`].
    pub fn record(&mut self, path: &Path) -> Result<(), CosimError> {
        self.rtl.record(path)
    }
}
