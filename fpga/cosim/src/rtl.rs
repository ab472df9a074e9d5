//! A verilated unit behind a safe interface: named pins, settled and clocked.
//!
//! All of this crate's `unsafe` is here: calls through the C interface of `shim/unit.cpp`, which is
//! compiled from this repository's text into the very library that is loaded.
#![allow(unsafe_code)]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::Path;

use libloading::Library;

use crate::verilate::CosimError;

type Ports = unsafe extern "C" fn() -> *const c_char;
type New = unsafe extern "C" fn(u32) -> *mut c_void;
type Free = unsafe extern "C" fn(*mut c_void);
type Settle = unsafe extern "C" fn(*mut c_void, *const u32, *mut u32);
type Edge = unsafe extern "C" fn(*mut c_void) -> c_int;
type Reset = unsafe extern "C" fn(*mut c_void);
type Waves = unsafe extern "C" fn(*mut c_void, *const c_char);
type Failure = unsafe extern "C" fn() -> *const c_char;

/// A unit in gates: the RTL under Verilator, cycle by cycle.
///
/// In a cycle: set input pins, [`settle`](Rtl::settle), look at output pins (and perhaps set inputs
/// that depend on them and settle again), then [`edge`](Rtl::edge). [`tick`](Rtl::tick) does one of
/// each.
#[derive(Debug)]
pub struct Rtl {
    handle: *mut c_void,
    free: Free,
    settle: Settle,
    edge: Edge,
    reset: Reset,
    waves: Waves,
    failure: Failure,
    ports: Vec<Port>,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    /// Dropped last: the functions above lie in it.
    _library: Library,
}

/// A port of a unit.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Port {
    name: String,
    pin: Pin,
    input: bool,
}

/// Where a port's value lies; from [`Rtl::input`] or [`Rtl::output`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pin {
    first: u32,
    bits: u32,
}

impl Pin {
    /// Width of the port.
    pub const fn bits(self) -> u32 {
        self.bits
    }

    fn words(self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.bits.div_ceil(32)) as usize
    }
}

impl Rtl {
    /// Loads a library that [`verilate::unit`](crate::verilate::unit) built and resets the unit. All
    /// inputs are 0. What has no reset starts with random values from `seed`.
    ///
    /// # Errors
    /// [`CosimError::Load`] if the library cannot be loaded or lacks the interface.
    pub fn load(library: &Path, seed: u32) -> Result<Self, CosimError> {
        let load = |error| CosimError::Load { path: library.to_owned(), error };
        // SAFETY: the library is our shim and Verilator's output; loading it runs only the
        // constructors of Verilator's runtime. The symbol types are those of `shim/unit.cpp`. The
        // functions are used only while `_library` lives, since they are private to this value. The
        // shim's table of ports is a string that lives as long as the library.
        unsafe {
            let lib = Library::new(library).map_err(load)?;
            let table: Ports = *lib.get(b"xy_ports\0").map_err(load)?;
            let new: New = *lib.get(b"xy_new\0").map_err(load)?;
            let free: Free = *lib.get(b"xy_free\0").map_err(load)?;
            let settle: Settle = *lib.get(b"xy_settle\0").map_err(load)?;
            let edge: Edge = *lib.get(b"xy_edge\0").map_err(load)?;
            let reset: Reset = *lib.get(b"xy_reset\0").map_err(load)?;
            let waves: Waves = *lib.get(b"xy_waves\0").map_err(load)?;
            let failure: Failure = *lib.get(b"xy_failure\0").map_err(load)?;
            let ports = Port::table(&CStr::from_ptr(table()).to_string_lossy());
            let words = |input| {
                let of = ports.iter().filter(|port| port.input == input);
                of.map(|port| port.pin.words().end).max().unwrap_or(0)
            };
            let (inputs, outputs) = (vec![0; words(true)], vec![0; words(false)]);
            let handle = new(seed);
            let _library = lib;
            Ok(Self {
                handle,
                free,
                settle,
                edge,
                reset,
                waves,
                failure,
                ports,
                inputs,
                outputs,
                _library,
            })
        }
    }

    /// The input port `name`.
    ///
    /// # Panics
    /// If the unit has none of that name.
    pub fn input(&self, name: &str) -> Pin {
        self.pin(name, true)
    }

    /// The output port `name`.
    ///
    /// # Panics
    /// If the unit has none of that name.
    pub fn output(&self, name: &str) -> Pin {
        self.pin(name, false)
    }

    fn pin(&self, name: &str, input: bool) -> Pin {
        let port = self.ports.iter().find(|port| port.input == input && port.name == name);
        match port {
            Some(port) => port.pin,
            None => panic!("the unit has no port {name}; it has {:?}", self.ports),
        }
    }

    /// The name of an output port.
    pub fn name(&self, output: Pin) -> &str {
        let port = self.ports.iter().find(|port| !port.input && port.pin == output);
        port.map_or("", |port| &port.name)
    }

    /// Sets an input of up to 64 bits; higher bits are cut off.
    pub fn set(&mut self, pin: Pin, value: impl Into<u64>) {
        let value = value.into() & (u64::MAX >> 64u32.saturating_sub(pin.bits));
        let words = &mut self.inputs[pin.words()];
        words.fill(0);
        for (word, part) in words.iter_mut().zip([value as u32, (value >> 32) as u32]) {
            *word = part;
        }
    }

    /// Sets an input from bytes, lowest first; what is missing is 0.
    pub fn set_bytes(&mut self, pin: Pin, bytes: &[u8]) {
        let words = &mut self.inputs[pin.words()];
        words.fill(0);
        for (word, chunk) in words.iter_mut().zip(bytes.chunks(4)) {
            let mut four = [0; 4];
            four[..chunk.len()].copy_from_slice(chunk);
            *word = u32::from_le_bytes(four);
        }
        if !pin.bits.is_multiple_of(32)
            && let Some(last) = words.last_mut()
        {
            *last &= (1 << (pin.bits % 32)) - 1;
        }
    }

    /// An output as it was last settled; of one wider than 64 bits, the lowest ones.
    pub fn get(&self, pin: Pin) -> u64 {
        let mut words = self.outputs[pin.words()].iter().map(|&word| u64::from(word));
        words.next().unwrap_or(0) | words.next().unwrap_or(0) << 32
    }

    /// An input as it was last set; of one wider than 64 bits, the lowest ones.
    pub fn get_input(&self, pin: Pin) -> u64 {
        let mut words = self.inputs[pin.words()].iter().map(|&word| u64::from(word));
        words.next().unwrap_or(0) | words.next().unwrap_or(0) << 32
    }

    /// A one-bit output as it was last settled.
    pub fn is_set(&self, pin: Pin) -> bool {
        self.get(pin) != 0
    }

    /// An output's bytes, lowest first, as they were last settled.
    pub fn bytes(&self, pin: Pin) -> Vec<u8> {
        let words = &self.outputs[pin.words()];
        let mut bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        bytes.truncate(pin.bits.div_ceil(8) as usize);
        bytes
    }

    /// Lets the outputs follow the inputs, without an edge.
    pub fn settle(&mut self) {
        // SAFETY: `handle` came from `xy_new` and is freed only on drop; both arrays have the words
        // that the shim's table of ports asks for; `&mut self` keeps other threads out.
        unsafe { (self.settle)(self.handle, self.inputs.as_ptr(), self.outputs.as_mut_ptr()) }
    }

    /// Ends the cycle with a clock edge.
    ///
    /// # Errors
    /// [`CosimError::Assertion`] if an assertion of the RTL fails in this cycle or failed before.
    pub fn edge(&mut self) -> Result<(), CosimError> {
        // SAFETY: as in `settle`.
        if unsafe { (self.edge)(self.handle) } == 0 {
            return Ok(());
        }
        // SAFETY: the shim returns a NUL-terminated string that stays until the next call.
        let message = unsafe { CStr::from_ptr((self.failure)()) };
        Err(CosimError::Assertion(message.to_string_lossy().into_owned()))
    }

    /// Runs one clock cycle; outputs are those during it.
    ///
    /// # Errors
    /// As [`Rtl::edge`].
    pub fn tick(&mut self) -> Result<(), CosimError> {
        self.settle();
        self.edge()
    }

    /// Pulls the reset for two cycles, in the middle of whatever the unit does.
    pub fn pull_reset(&mut self) {
        // SAFETY: as in `settle`.
        unsafe { (self.reset)(self.handle) }
    }

    /// Writes a VCD waveform of the following cycles to `path`.
    ///
    /// # Errors
    /// [`CosimError::Io`] if the path cannot be handed to C or its folder does not exist.
    pub fn record(&mut self, path: &Path) -> Result<(), CosimError> {
        let io = |error| CosimError::Io { path: path.to_owned(), error };
        std::fs::File::create(path).map_err(io)?;
        let text = CString::new(path.as_os_str().as_encoded_bytes())
            .map_err(|error| io(std::io::Error::new(std::io::ErrorKind::InvalidInput, error)))?;
        // SAFETY: `handle` as in `settle`; the string outlives the call.
        unsafe { (self.waves)(self.handle, text.as_ptr()) };
        Ok(())
    }
}

impl Port {
    /// The ports of a shim's table, with their places in the words of inputs and outputs.
    fn table(text: &str) -> Vec<Self> {
        let mut next = [0; 2];
        let line = |line: &str| {
            let mut parts = line.split(' ');
            let input = parts.next()? == "in";
            let (name, bits) = (parts.next()?.to_owned(), parts.next()?.parse().ok()?);
            let next = &mut next[usize::from(input)];
            let pin = Pin { first: *next, bits };
            *next += bits.div_ceil(32);
            Some(Self { name, pin, input })
        };
        text.lines().filter_map(line).collect()
    }
}

impl Drop for Rtl {
    fn drop(&mut self) {
        // SAFETY: `handle` came from `xy_new` and is not used afterwards.
        unsafe { (self.free)(self.handle) }
    }
}
