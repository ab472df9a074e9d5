//! The verilated heap behind a safe interface.
//!
//! All of this crate's `unsafe` is here: calls through the C interface of `shim/heap.cpp`, which is
//! compiled from this repository's text into the very library that is loaded.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;

use libloading::Library;
use xylem::machine::heap::{HeapEntry, HeapOp, HeapOutputs};

use crate::verilate::CosimError;

/// Mirrors `HeapIn` of `shim/heap.cpp`.
#[repr(C)]
struct RawIn {
    key: u64,
    slot: u32,
    valid: u8,
    op: u8,
}

/// Mirrors `HeapOut` of `shim/heap.cpp`.
#[repr(C)]
#[derive(Default)]
struct RawOut {
    top_key: u64,
    top_slot: u32,
    ready: u8,
    error: u8,
    top_valid: u8,
    full: u8,
}

type New = unsafe extern "C" fn(u32) -> *mut c_void;
type Free = unsafe extern "C" fn(*mut c_void);
type Tick = unsafe extern "C" fn(*mut c_void, *const RawIn, *mut RawOut) -> c_int;
type Waves = unsafe extern "C" fn(*mut c_void, *const c_char);
type Failure = unsafe extern "C" fn() -> *const c_char;

/// `xy_heap` in gates: the RTL under Verilator, cycle by cycle.
#[derive(Debug)]
pub struct HeapRtl {
    handle: *mut c_void,
    free: Free,
    tick: Tick,
    waves: Waves,
    failure: Failure,
    /// Dropped last: the functions above lie in it.
    _library: Library,
}

impl HeapRtl {
    /// Loads a library that [`verilate::heap`](crate::verilate::heap) built and resets the unit.
    /// What has no reset starts with random values from `seed`.
    ///
    /// # Errors
    ///
    /// [`CosimError::Load`] if the library cannot be loaded or lacks the interface.
    pub fn load(library: &Path, seed: u32) -> Result<Self, CosimError> {
        let load = |error| CosimError::Load { path: library.to_owned(), error };
        // SAFETY: the library is our shim and Verilator's output; loading it runs only the
        // constructors of Verilator's runtime. The symbol types are those of `shim/heap.cpp`. The
        // functions are used only while `_library` lives, since they are private to this value.
        unsafe {
            let lib = Library::new(library).map_err(load)?;
            let new: New = *lib.get(b"xy_heap_new\0").map_err(load)?;
            let free: Free = *lib.get(b"xy_heap_free\0").map_err(load)?;
            let tick: Tick = *lib.get(b"xy_heap_tick\0").map_err(load)?;
            let waves: Waves = *lib.get(b"xy_heap_waves\0").map_err(load)?;
            let failure: Failure = *lib.get(b"xy_heap_failure\0").map_err(load)?;
            Ok(Self { handle: new(seed), free, tick, waves, failure, _library: lib })
        }
    }

    /// Runs one clock cycle in which `op` is offered, and returns the outputs during it.
    ///
    /// # Errors
    ///
    /// [`CosimError::Assertion`] if an assertion of the RTL fails in this cycle or failed before.
    pub fn tick(&mut self, op: Option<HeapOp>) -> Result<HeapOutputs, CosimError> {
        let (valid, op, entry) = match op {
            None => (0, 0, HeapEntry::default()),
            Some(HeapOp::Insert(entry)) => (1, 0, entry),
            Some(HeapOp::Replace(entry)) => (1, 1, entry),
            Some(HeapOp::Remove) => (1, 2, HeapEntry::default()),
            Some(HeapOp::Clear) => (1, 3, HeapEntry::default()),
        };
        let raw_in = RawIn { key: entry.key, slot: entry.slot, valid, op };
        let mut raw = RawOut::default();
        // SAFETY: `handle` came from `xy_heap_new` and is freed only on drop; both structs are laid
        // out as in the shim and live across the call; `&mut self` keeps other threads out.
        let failed = unsafe { (self.tick)(self.handle, &raw_in, &mut raw) } != 0;
        if failed {
            // SAFETY: the shim returns a NUL-terminated string that stays until the next call.
            let message = unsafe { CStr::from_ptr((self.failure)()) };
            return Err(CosimError::Assertion(message.to_string_lossy().into_owned()));
        }
        let top = HeapEntry { key: raw.top_key, slot: raw.top_slot };
        Ok(HeapOutputs {
            ready: raw.ready != 0,
            error: raw.error != 0,
            top: (raw.top_valid != 0).then_some(top),
            full: raw.full != 0,
        })
    }

    /// Writes a VCD waveform of the following cycles to `path`.
    ///
    /// # Errors
    ///
    /// [`CosimError::Io`] if the path cannot be handed to C or its folder does not exist.
    pub fn record(&mut self, path: &Path) -> Result<(), CosimError> {
        let io = |error| CosimError::Io { path: path.to_owned(), error };
        std::fs::File::create(path).map_err(io)?;
        let text = CString::new(path.as_os_str().as_encoded_bytes())
            .map_err(|error| io(std::io::Error::new(std::io::ErrorKind::InvalidInput, error)))?;
        // SAFETY: `handle` as in `tick`; the string outlives the call.
        unsafe { (self.waves)(self.handle, text.as_ptr()) };
        Ok(())
    }
}

impl Drop for HeapRtl {
    fn drop(&mut self) {
        // SAFETY: `handle` came from `xy_heap_new` and is not used afterwards.
        unsafe { (self.free)(self.handle) }
    }
}
