//! The soft core: reset, memory, clock, accelerator, log line and power switch.
//!
//! This is the only module with unsafe code: the reset and trap code in assembly, accesses to the
//! device registers of [`map`], and external memory behind [`Bus`]. It stands on four facts:
//!
//! - the program runs on one core without interrupts, so nothing is concurrent;
//! - [`map::EXTERNAL`] is plain memory where no Rust object lives, as link.x places them all in
//!   [`map::LOCAL`];
//! - the accelerator's registers are touched through the one value of [`Accelerator`], and its jobs write
//!   external memory only;
//! - the assembly below calls Rust with a valid stack, zeroed `.bss`, and never twice.
//!
//! PicoRV32 has hardly any control register and stops at instructions that touch others: only
//! `rdcycle` is used unless the blob says that the standard trap registers exist.
#![allow(unsafe_code, reason = "the one place where the program meets the machine")]

use core::arch::{asm, global_asm};
use core::cell::UnsafeCell;
use core::convert::Infallible;
use core::ptr::{self, NonNull};

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin};
use xylem_core::mem::{Bus, ByteAddr};
use xylem_driver::Mmio;
use xylem_firmware::job::{Buffers, Clock};
use xylem_firmware::map;

use crate::program;

global_asm!(
    r#"
    .option push
    .option arch, +zicsr
    .section .init, "ax"
    .globl _start
_start:
    .option push
    .option norelax
    la      gp, __global_pointer$
    .option pop
    la      sp, __stack_top
    la      t0, __bss_start
    la      t1, __bss_end
1:  bgeu    t0, t1, 2f
    sw      zero, 0(t0)
    addi    t0, t0, 4
    j       1b
2:  tail    {reset}

    .balign 4
    .globl _trap
_trap:
    csrr    a0, mcause
    csrr    a1, mepc
    csrr    a2, mtval
    la      sp, __stack_top
    tail    {trap}
    .option pop
    "#,
    reset = sym reset,
    trap = sym trap,
);

/// A variable of this module.
struct Static<T>(UnsafeCell<T>);

// SAFETY: one core, no interrupts.
unsafe impl<T> Sync for Static<T> {}

/// The job's storage; too large for the stack. Handed out once, at reset.
static BUFFERS: Static<Buffers> = Static(UnsafeCell::new(Buffers::new()));

extern "C" fn reset() -> ! {
    // SAFETY: the only reference to the buffers, as this runs once.
    let buffers = unsafe { &mut *BUFFERS.0.get() };
    program::main(ExternalMemory(()), Accelerator(()), buffers)
}

extern "C" fn trap(cause: u32, pc: u32, value: u32) -> ! {
    program::trap(Trap { cause, pc, value })
}

/// What the trap registers said.
#[derive(Clone, Copy, Debug)]
pub struct Trap {
    /// `mcause`.
    pub cause: u32,
    /// `mepc`: the instruction that trapped.
    pub pc: u32,
    /// `mtval`: the address or instruction at fault.
    pub value: u32,
}

/// Makes exceptions call [`program::trap`]. The core must have the standard trap registers.
pub fn catch_traps() {
    // SAFETY: installs the handler above; nothing else uses mtvec.
    unsafe {
        asm!(
            ".option push",
            ".option arch, +zicsr",
            "la {0}, _trap",
            "csrw mtvec, {0}",
            ".option pop",
            out(reg) _,
        );
    }
}

/// Cycles since reset.
pub fn cycles() -> u64 {
    loop {
        let (high, low, again): (u32, u32, u32);
        // SAFETY: reads counters.
        unsafe {
            asm!(
                ".option push",
                ".option arch, +zicsr",
                "rdcycleh {0}",
                "rdcycle {1}",
                "rdcycleh {2}",
                ".option pop",
                out(reg) high,
                out(reg) low,
                out(reg) again,
                options(nomem, nostack),
            );
        }
        if high == again {
            return u64::from(high) << 32 | u64::from(low);
        }
    }
}

/// The core's cycle counter.
#[derive(Clone, Copy, Debug)]
pub struct CycleCounter;

impl Clock for CycleCounter {
    fn cycles(&mut self) -> u64 {
        cycles()
    }
}

/// The place of the accelerator, if there is one. There is one place, made at reset.
#[derive(Debug)]
pub struct Accelerator(());

impl Accelerator {
    /// Its registers, a delay, and its interrupt line.
    pub fn into_parts(self) -> (Mmio, CoreDelay, InterruptLine) {
        let base = ptr::with_exposed_provenance_mut(map::ACCELERATOR.base.0 as usize);
        // SAFETY: not null; the whole map is device registers, which only this value reaches.
        let registers = unsafe { Mmio::new(NonNull::new_unchecked(base)) };
        (registers, CoreDelay, InterruptLine)
    }
}

/// Waits by the cycle counter, at [`map::CLOCK_MHZ`].
#[derive(Clone, Copy, Debug)]
pub struct CoreDelay;

impl DelayNs for CoreDelay {
    fn delay_ns(&mut self, ns: u32) {
        const NS_PER_CYCLE: u32 = 1000 / map::CLOCK_MHZ;
        let start = cycles();
        let wanted = u64::from(ns / NS_PER_CYCLE);
        while cycles().wrapping_sub(start) < wanted {}
    }
}

/// The accelerator's interrupt line as a word of memory: PicoRV32 has no standard interrupts.
#[derive(Clone, Copy, Debug)]
pub struct InterruptLine;

impl ErrorType for InterruptLine {
    type Error = Infallible;
}

impl InputPin for InterruptLine {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let line = ptr::with_exposed_provenance::<u32>(map::ACCELERATOR_INTERRUPT as usize);
        // SAFETY: a device register.
        Ok(unsafe { line.read_volatile() } & 1 == 1)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        self.is_high().map(|high| !high)
    }
}

/// Writes `word` to the power switch, which ends the run.
pub fn power_off(word: u32) -> ! {
    // SAFETY: a device register.
    unsafe {
        ptr::with_exposed_provenance_mut::<u32>(map::POWER_OFF as usize).write_volatile(word)
    };
    loop {}
}

/// External memory. There is one of it, made at reset.
#[derive(Debug)]
pub struct ExternalMemory(());

/// An access that is not wholly inside external memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug, defmt::Format)]
pub struct OutsideMemory {
    /// First byte of the access.
    pub addr: ByteAddr,
    /// Its length in bytes.
    pub len: u32,
}

impl ExternalMemory {
    /// The pointer to `len` bytes at `addr`, if all of them are external memory.
    fn at(&self, addr: ByteAddr, len: usize) -> Result<*mut u8, OutsideMemory> {
        let len = len as u32;
        let offset = addr.0.wrapping_sub(map::EXTERNAL.base.0);
        match map::EXTERNAL.at(offset, len) {
            Some(addr) => Ok(ptr::with_exposed_provenance_mut(addr.0 as usize)),
            None => Err(OutsideMemory { addr, len }),
        }
    }
}

impl Bus for ExternalMemory {
    type Error = OutsideMemory;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), OutsideMemory> {
        let from = self.at(addr, buf.len())?;
        // SAFETY: `from` is external memory; `buf`, a Rust object, is local memory.
        unsafe { ptr::copy_nonoverlapping(from.cast_const(), buf.as_mut_ptr(), buf.len()) };
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), OutsideMemory> {
        let to = self.at(addr, bytes.len())?;
        // SAFETY: as above.
        unsafe { ptr::copy_nonoverlapping(bytes.as_ptr(), to, bytes.len()) };
        Ok(())
    }
}

/// The log line: defmt frames over the UART.
#[defmt::global_logger]
struct UartLogger;

/// The frame encoder's state, reached only through the logger.
static ENCODER: Static<defmt::Encoder> = Static(UnsafeCell::new(defmt::Encoder::new()));

// SAFETY: one core, no interrupts. A frame that a panic or trap cuts off is never continued: the
// handlers end the run, and their own first frame ends the broken one.
unsafe impl defmt::Logger for UartLogger {
    fn acquire() {
        // SAFETY: no other reference to the encoder lives here; defmt calls one method at a time.
        unsafe { (*ENCODER.0.get()).start_frame(send) };
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: as in `acquire`.
        unsafe { (*ENCODER.0.get()).end_frame(send) };
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: as in `acquire`.
        unsafe { (*ENCODER.0.get()).write(bytes, send) };
    }
}

/// Sends bytes over the UART, each when the line is ready.
fn send(bytes: &[u8]) {
    let status = ptr::with_exposed_provenance::<u8>(map::UART_STATUS as usize);
    let data = ptr::with_exposed_provenance_mut::<u8>(map::UART as usize);
    for &byte in bytes {
        // SAFETY: device registers.
        unsafe {
            while status.read_volatile() & map::UART_READY != map::UART_READY {}
            data.write_volatile(byte);
        }
    }
}
