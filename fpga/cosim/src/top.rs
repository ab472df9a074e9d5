//! The whole accelerator in gates: its registers for `xylem-driver`, its memory behind AXI4.

use std::cell::RefCell;
use std::fmt;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use xylem::machine::port::Port;
use xylem_driver::{RegisterAccess, Xylem};

use crate::axi::Slave;
use crate::rtl::{Pin, Rtl};
use crate::verilate::{self, CosimError, Mutation, Unit};

/// The sizes of an accelerator, under the names of `fpga/rtl/configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TopConfig {
    /// Name of the configuration.
    pub name: &'static str,
    /// Records of the scratchpad, `M`.
    pub capacity: u32,
    /// Records of a burst, `B`.
    pub burst: u32,
    /// Insertion sorters.
    pub sorters: u32,
    /// Records between merge and emitter.
    pub fifo: u32,
    /// Lines of input that are read ahead.
    pub read_ahead: u32,
    /// Bits of a Morton code; 63 serves 30-bit codes too.
    pub code_bits: u32,
    /// Bits of a line of the memory bus.
    pub data_bits: u32,
    /// Cycles without movement after which memory is given up.
    pub time_out: u32,
    /// Of the compressor's treelets; 0 without compressor.
    pub depth: u32,
    /// Whether there is a traversal unit.
    pub tracer: bool,
    /// That unit's cache holds 2 to the power of this many lines.
    pub cache_width: u32,
    /// Whether those are in block memory.
    pub cache_block: bool,
}

impl TopConfig {
    /// For simulation: sorts of some hundred records take several passes.
    pub const SMALL: Self = Self {
        name: "small",
        capacity: 128,
        burst: 4,
        sorters: 2,
        fifo: 4,
        read_ahead: 8,
        code_bits: 63,
        data_bits: 512,
        time_out: 2000,
        depth: 1,
        tracer: true,
        cache_width: 4,
        cache_block: false,
    };
    /// P2 §6.2.
    pub const PAPER: Self = Self {
        name: "paper",
        capacity: 8192,
        burst: 16,
        sorters: 8,
        fifo: 16,
        read_ahead: 32,
        code_bits: 63,
        data_bits: 512,
        time_out: 1 << 20,
        depth: 2,
        tracer: true,
        cache_width: 9,
        cache_block: true,
    };
    /// What fits an LFE5U-85F.
    pub const ECP5: Self = Self {
        name: "ecp5",
        capacity: 2048,
        burst: 8,
        sorters: 2,
        fifo: 8,
        read_ahead: 16,
        code_bits: 30,
        data_bits: 128,
        time_out: 1 << 20,
        depth: 0,
        tracer: false,
        cache_width: 4,
        cache_block: false,
    };

    /// Every named configuration.
    pub const ALL: [Self; 3] = [Self::SMALL, Self::PAPER, Self::ECP5];

    /// Lines of a burst of nodes or leaf table entries.
    pub const WRITE_LINES: u32 = 8;

    /// Bytes of such a burst.
    pub const WRITE_BURST: u32 = 64 * Self::WRITE_LINES;

    /// Builds the accelerator, with a fault if `mutation` says so, and returns the library's path.
    ///
    /// # Errors
    /// As [`verilate::unit`].
    pub fn build(&self, mutation: Option<Mutation>) -> Result<PathBuf, CosimError> {
        let unit = Unit {
            top: "xy_top",
            files: "top.f",
            config: self.name,
            parameters: &[
                ("Capacity", self.capacity.into()),
                ("Burst", self.burst.into()),
                ("Sorters", self.sorters.into()),
                ("Fifo", self.fifo.into()),
                ("ReadAhead", self.read_ahead.into()),
                ("CodeWidth", self.code_bits.into()),
                ("DataWidth", self.data_bits.into()),
                ("WriteLines", Self::WRITE_LINES.into()),
                ("TimeOut", self.time_out.into()),
                ("Depth", self.depth.into()),
                ("Tracer", self.tracer.into()),
                ("CacheWidth", self.cache_width.into()),
                ("CacheBlock", self.cache_block.into()),
            ],
        };
        verilate::unit(&unit, mutation)
    }
}

/// `xy_top` in gates with its memory.
#[derive(Debug)]
pub struct Top<P> {
    rtl: Rtl,
    /// What is at its memory port.
    pub memory: Slave<P>,
    pins: Pins,
    /// Cycles since the reset.
    pub cycles: u64,
    /// What the RTL's assertions said, if one failed; nothing runs after that.
    pub failure: Option<String>,
}

#[derive(Debug)]
struct Pins {
    aw_valid: Pin,
    aw_ready: Pin,
    aw_addr: Pin,
    w_valid: Pin,
    w_ready: Pin,
    w_data: Pin,
    w_strb: Pin,
    b_valid: Pin,
    b_ready: Pin,
    b_resp: Pin,
    ar_valid: Pin,
    ar_ready: Pin,
    ar_addr: Pin,
    r_valid: Pin,
    r_ready: Pin,
    r_data: Pin,
    r_resp: Pin,
    irq: Pin,
}

impl<P: Port> Top<P> {
    /// Loads a library that [`TopConfig::build`] built, with `bytes` of memory that answers as `port`
    /// says; each channel is held up in one of `stall` cycles, or never if that is 0.
    ///
    /// # Errors
    /// As [`Rtl::load`].
    pub fn load(
        library: &Path,
        port: P,
        bytes: Vec<u8>,
        stall: u64,
        seed: u64,
    ) -> Result<Self, CosimError> {
        let mut rtl = Rtl::load(library, seed as u32)?;
        let memory = Slave::new(&rtl, "m_axi_", port, bytes, stall, seed);
        let pins = Pins {
            aw_valid: rtl.input("s_axil_awvalid_i"),
            aw_ready: rtl.output("s_axil_awready_o"),
            aw_addr: rtl.input("s_axil_awaddr_i"),
            w_valid: rtl.input("s_axil_wvalid_i"),
            w_ready: rtl.output("s_axil_wready_o"),
            w_data: rtl.input("s_axil_wdata_i"),
            w_strb: rtl.input("s_axil_wstrb_i"),
            b_valid: rtl.output("s_axil_bvalid_o"),
            b_ready: rtl.input("s_axil_bready_i"),
            b_resp: rtl.output("s_axil_bresp_o"),
            ar_valid: rtl.input("s_axil_arvalid_i"),
            ar_ready: rtl.output("s_axil_arready_o"),
            ar_addr: rtl.input("s_axil_araddr_i"),
            r_valid: rtl.output("s_axil_rvalid_o"),
            r_ready: rtl.input("s_axil_rready_i"),
            r_data: rtl.output("s_axil_rdata_o"),
            r_resp: rtl.output("s_axil_rresp_o"),
            irq: rtl.output("irq_o"),
        };
        rtl.set(pins.b_ready, 1u64);
        rtl.set(pins.r_ready, 1u64);
        rtl.set(pins.w_strb, 0xfu64);
        Ok(Self { rtl, memory, pins, cycles: 0, failure: None })
    }

    /// Writes a waveform, as [`Rtl::record`] does.
    ///
    /// # Errors
    /// As [`Rtl::record`].
    pub fn record(&mut self, path: &Path) -> Result<(), CosimError> {
        self.rtl.record(path)
    }

    /// Runs one cycle.
    pub fn tick(&mut self) {
        if self.failure.is_some() {
            return;
        }
        self.memory.drive(&mut self.rtl);
        self.rtl.settle();
        self.memory.respond(&mut self.rtl);
        if let Err(error) = self.rtl.edge() {
            self.failure = Some(error.to_string());
        }
        self.cycles += 1;
    }

    /// Pulls the reset of unit and memory.
    pub fn pull_reset(&mut self) {
        self.rtl.pull_reset();
        self.memory.reset();
    }

    /// Whether the interrupt line is high.
    pub fn irq(&self) -> bool {
        self.rtl.is_set(self.pins.irq)
    }

    fn access(&mut self, offset: u32, value: Option<u32>) -> Result<u32, AccessError> {
        let [valid, other] = match value {
            Some(_) => [self.pins.aw_valid, self.pins.w_valid],
            None => [self.pins.ar_valid; 2],
        };
        let addr = if value.is_some() { self.pins.aw_addr } else { self.pins.ar_addr };
        self.rtl.set(addr, offset);
        self.rtl.set(self.pins.w_data, value.unwrap_or(0));
        self.rtl.set(valid, 1u64);
        self.rtl.set(other, 1u64);
        for _ in 0..64 {
            self.tick();
            let Pins { aw_ready, w_ready, ar_ready, b_valid, b_resp, .. } = self.pins;
            let Pins { r_valid, r_resp, r_data, .. } = self.pins;
            let rtl = &mut self.rtl;
            let took = |rtl: &Rtl, ready| rtl.is_set(ready);
            if value.is_some() {
                if took(rtl, aw_ready) {
                    rtl.set(valid, 0u64);
                }
                if took(rtl, w_ready) {
                    rtl.set(other, 0u64);
                }
            } else if took(rtl, ar_ready) {
                rtl.set(valid, 0u64);
            }
            let (answered, response) =
                if value.is_some() { (b_valid, b_resp) } else { (r_valid, r_resp) };
            if rtl.is_set(answered) {
                return match rtl.get(response) {
                    0 => Ok(rtl.get(r_data) as u32),
                    _ => Err(AccessError { offset, what: "answered with an error" }),
                };
            }
        }
        let what =
            if self.failure.is_some() { "lost: an assertion failed" } else { "not answered" };
        Err(AccessError { offset, what })
    }
}

/// A register access that failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AccessError {
    offset: u32,
    what: &'static str,
}

impl fmt::Display for AccessError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the access to register {:#x} was {}", self.offset, self.what)
    }
}

impl std::error::Error for AccessError {}

/// An accelerator that the driver's three ends share: registers, time and interrupt line. The clock
/// runs while a register is accessed and while the driver waits, a cycle a nanosecond.
#[derive(Debug)]
pub struct Shared<P>(Rc<RefCell<Top<P>>>);

impl<P> Clone for Shared<P> {
    fn clone(&self) -> Self {
        Self(Rc::clone(&self.0))
    }
}

impl<P: Port> Shared<P> {
    /// Shares `top`.
    pub fn new(top: Top<P>) -> Self {
        Self(Rc::new(RefCell::new(top)))
    }

    /// Does something to it.
    pub fn with<T>(&self, f: impl FnOnce(&mut Top<P>) -> T) -> T {
        f(&mut self.0.borrow_mut())
    }

    /// The driver on it.
    ///
    /// # Errors
    /// As [`Xylem::probe`].
    pub fn driver(&self) -> Result<Xylem<Self, Self, Self>, xylem_driver::ProbeError<AccessError>> {
        Xylem::probe(self.clone(), self.clone(), self.clone())
    }
}

impl<P: Port> RegisterAccess for Shared<P> {
    type Error = AccessError;

    fn read(&mut self, offset: u32) -> Result<u32, AccessError> {
        self.with(|top| top.access(offset, None))
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), AccessError> {
        self.with(|top| top.access(offset, Some(value)).map(drop))
    }
}

impl<P: Port> embedded_hal::delay::DelayNs for Shared<P> {
    fn delay_ns(&mut self, ns: u32) {
        self.with(|top| (0..ns).for_each(|_| top.tick()));
    }
}

impl<P> embedded_hal::digital::ErrorType for Shared<P> {
    type Error = std::convert::Infallible;
}

impl<P: Port> embedded_hal::digital::InputPin for Shared<P> {
    fn is_high(&mut self) -> Result<bool, Self::Error> {
        Ok(self.with(|top| top.irq()))
    }

    fn is_low(&mut self) -> Result<bool, Self::Error> {
        self.is_high().map(|high| !high)
    }
}
