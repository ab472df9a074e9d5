//! Registers in the processor's own address space.
//!
//! The one module of this crate with unsafe code: volatile accesses through a pointer that the
//! caller vouches for once, at construction.
#![allow(unsafe_code)]

use core::ptr::NonNull;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::access::{OffsetError, RegisterAccess};

/// Register access by volatile 32-bit loads and stores.
///
/// Memory accesses before a register write stay before it, and those after a register read stay
/// after it, as far as the compiler goes; that is all an in-order core without a data cache needs.
/// On any other, clean and invalidate the regions around a job.
#[derive(Debug)]
pub struct Mmio {
    base: NonNull<u32>,
}

// SAFETY: the registers belong to this value alone (see `Mmio::new`), whichever thread holds it.
unsafe impl Send for Mmio {}

impl Mmio {
    /// The register map whose first register is at `base`.
    ///
    /// # Safety
    /// As long as the value lives, `base` must be aligned to 4 bytes and valid for volatile 32-bit
    /// reads and writes over [`xylem_regs::MAP_SIZE`] bytes, and nothing else may access them.
    pub const unsafe fn new(base: NonNull<u32>) -> Self {
        Self { base }
    }

    fn register(&self, offset: u32) -> Result<NonNull<u32>, OffsetError> {
        OffsetError::check(offset, 1)?;
        // SAFETY: the check leaves an offset inside the map, which `new`'s caller vouched for.
        Ok(unsafe { self.base.byte_add(offset as usize) })
    }
}

impl RegisterAccess for Mmio {
    type Error = OffsetError;

    fn read(&mut self, offset: u32) -> Result<u32, OffsetError> {
        let register = self.register(offset)?;
        // SAFETY: `register` is aligned and inside the map, valid as `new`'s caller vouched.
        let value = unsafe { register.read_volatile() };
        compiler_fence(Ordering::Acquire);
        Ok(value)
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), OffsetError> {
        let register = self.register(offset)?;
        compiler_fence(Ordering::Release);
        // SAFETY: `register` is aligned and inside the map, valid as `new`'s caller vouched.
        unsafe { register.write_volatile(value) };
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use xylem_regs::MAP_SIZE;

    const WORDS: usize = MAP_SIZE as usize / 4;

    #[test]
    fn accesses_reach_the_word_at_their_offset() {
        let mut memory = [0u32; WORDS];
        memory[WORDS - 1] = 7;
        // SAFETY: the array is as large as the map and untouched while `mmio` lives.
        let mut mmio = unsafe { Mmio::new(NonNull::from(&mut memory).cast()) };
        assert_eq!(mmio.read(MAP_SIZE - 4), Ok(7));
        assert_eq!(mmio.write(0x40, 0x0102_0304), Ok(()));
        let mut burst = [0; 2];
        assert_eq!(mmio.read_burst(0x3c, &mut burst), Ok(()));
        assert_eq!(burst, [0, 0x0102_0304]);
        assert_eq!(memory[16], 0x0102_0304);
    }

    #[test]
    fn accesses_outside_the_map_or_across_registers_are_refused() {
        let mut memory = [0u32; WORDS];
        // SAFETY: the array is as large as the map and untouched while `mmio` lives.
        let mut mmio = unsafe { Mmio::new(NonNull::from(&mut memory).cast()) };
        for offset in [MAP_SIZE, u32::MAX - 3, 2] {
            assert_eq!(mmio.read(offset), Err(OffsetError { offset, bytes: 4 }));
            assert_eq!(mmio.write(offset, 1), Err(OffsetError { offset, bytes: 4 }));
        }
        assert_eq!(memory, [0; WORDS]);
    }
}
