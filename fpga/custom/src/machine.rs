//! VexRiscv: reset, memory, clock, UART, power switch and the custom instructions.
//!
//! This is the only module with unsafe code. It stands on three facts: one core without interrupts;
//! [`map::EXTERNAL`] is plain memory where no Rust object lives; the assembly below calls Rust once, with a valid
//! stack and zeroed `.bss`.
#![allow(unsafe_code, reason = "the one place where the program meets the machine")]

use core::arch::{asm, global_asm};
use core::cell::UnsafeCell;
use core::fmt;
use core::ptr;

use xylem_core::mem::{Bus, ByteAddr};
use xylem_custom::measure::Storage;
use xylem_custom::{Cfu, map};
use xylem_firmware::job::{Buffers, Clock};

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
    la      t0, _trap
    csrw    mtvec, t0
    li      t0, 0x80000000      # VexRiscv refuses custom instructions until bit 31 is set.
    csrw    0xbc0, t0
    la      t0, __bss_start
    la      t1, __bss_end
1:  bgeu    t0, t1, 2f
    sw      zero, 0(t0)
    addi    t0, t0, 4
    j       1b
2:  tail    {reset}

    .balign 4
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

/// The job's storage and what is measured on; too large for the stack. Handed out once, at reset.
static BUFFERS: Static<Buffers> = Static(UnsafeCell::new(Buffers::new()));
static STORAGE: Static<Storage> = Static(UnsafeCell::new(Storage::new()));

extern "C" fn reset() -> ! {
    // SAFETY: the only references, as this runs once.
    let (buffers, storage) = unsafe { (&mut *BUFFERS.0.get(), &mut *STORAGE.0.get()) };
    program::main(ExternalMemory(()), buffers, storage)
}

extern "C" fn trap(cause: u32, pc: u32, value: u32) -> ! {
    program::trap(cause, pc, value)
}

/// The custom function unit. The program has one thread, and the unit's state is written before it is read.
#[derive(Clone, Copy, Debug)]
pub struct CustomInstructions;

impl Cfu for CustomInstructions {
    #[inline(always)]
    fn call<const UNIT: u32, const OP: u32>(&self, a: u32, b: u32) -> u32 {
        let answer;
        // SAFETY: changes one register, and the state of the unit; not memory. As the assembly is not pure,
        // instructions stay in order.
        unsafe {
            asm!(
                ".insn r 0x0b, {unit}, {op}, {answer}, {a}, {b}",
                unit = const UNIT,
                op = const OP,
                answer = lateout(reg) answer,
                a = in(reg) a,
                b = in(reg) b,
                options(nomem, nostack, preserves_flags),
            );
        }
        answer
    }
}

/// The core's cycle counter.
#[derive(Clone, Copy, Debug)]
pub struct CycleCounter;

impl Clock for CycleCounter {
    fn cycles(&mut self) -> u64 {
        loop {
            let (high, low, again): (u32, u32, u32);
            // SAFETY: reads counters.
            unsafe {
                asm!(
                    ".option push",
                    ".option arch, +zicsr",
                    "csrr {0}, mcycleh",
                    "csrr {1}, mcycle",
                    "csrr {2}, mcycleh",
                    ".option pop",
                    out(reg) high,
                    out(reg) low,
                    out(reg) again,
                    // No `nomem`: what is timed stays between two readings.
                    options(nostack),
                );
            }
            if high == again {
                return u64::from(high) << 32 | u64::from(low);
            }
        }
    }
}

/// Writes `code` to the power switch, which ends the run.
pub fn power_off(code: u32) -> ! {
    // SAFETY: a device register.
    unsafe {
        ptr::with_exposed_provenance_mut::<u32>(map::POWER_OFF as usize).write_volatile(code)
    };
    loop {}
}

/// The UART: it takes a byte at any time.
#[derive(Clone, Copy, Debug)]
pub struct Uart;

impl fmt::Write for Uart {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let data = ptr::with_exposed_provenance_mut::<u32>(map::UART as usize);
        for byte in text.bytes() {
            // SAFETY: a device register.
            unsafe { data.write_volatile(byte.into()) };
        }
        Ok(())
    }
}

/// External memory. There is one of it, made at reset.
#[derive(Debug)]
pub struct ExternalMemory(());

/// The address of an access that is not wholly inside external memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OutsideMemory(pub ByteAddr);

impl ExternalMemory {
    /// The pointer to `len` bytes at `addr`, if all of them are external memory.
    fn at(&self, addr: ByteAddr, len: usize) -> Result<*mut u8, OutsideMemory> {
        let offset = addr.0.wrapping_sub(map::EXTERNAL.base.0);
        match map::EXTERNAL.at(offset, len as u32) {
            Some(addr) => Ok(ptr::with_exposed_provenance_mut(addr.0 as usize)),
            None => Err(OutsideMemory(addr)),
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
