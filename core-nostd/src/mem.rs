//! The one road to external memory.
//!
//! Every algorithm of this crate reads and writes external memory through [`Bus`], in the bursts
//! that the hardware would use; the traffic counted on a bus is therefore the traffic of the
//! design. Buses stack: a tracing, timing or fault-injecting bus wraps another one.

use core::fmt;

mod burst;

pub use burst::{BurstWriter, MAX_BURST_BYTES};

/// A byte address in external memory.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ByteAddr(pub u32);

impl ByteAddr {
    /// The address `bytes` further on, or `None` past the end of the address space.
    pub const fn checked_add(self, bytes: u32) -> Option<Self> {
        match self.0.checked_add(bytes) {
            Some(sum) => Some(Self(sum)),
            None => None,
        }
    }
}

impl fmt::Debug for ByteAddr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.0)
    }
}

impl fmt::Display for ByteAddr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

/// External memory, as a device that serves bursts.
///
/// A call is one burst: all of its bytes or none. An implementation returns an error for an
/// access that it cannot serve and leaves memory as it was.
pub trait Bus {
    /// Why an access failed.
    type Error: Copy + fmt::Debug;

    /// Reads `buf.len()` bytes from `addr` on.
    ///
    /// # Errors
    /// The device's own, when it cannot serve the whole burst; `buf` is then unspecified.
    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes `bytes` from `addr` on.
    ///
    /// # Errors
    /// The device's own, when it cannot serve the whole burst; memory is then unchanged.
    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), Self::Error>;
}

impl<B: Bus + ?Sized> Bus for &mut B {
    type Error = B::Error;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Self::Error> {
        (**self).read(addr, buf)
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), Self::Error> {
        (**self).write(addr, bytes)
    }
}

/// A contiguous piece of external memory that the caller sets aside for one purpose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Region {
    /// First byte.
    pub base: ByteAddr,
    /// Length in bytes.
    pub size: u32,
}

impl Region {
    /// A region of `size` bytes from `base` on.
    pub const fn new(base: u32, size: u32) -> Self {
        Self { base: ByteAddr(base), size }
    }

    /// The address of bytes `offset .. offset + len`, or `None` if they are not all inside.
    pub const fn at(&self, offset: u32, len: u32) -> Option<ByteAddr> {
        match offset.checked_add(len) {
            Some(end) if end <= self.size => self.base.checked_add(offset),
            _ => None,
        }
    }

    /// The address of record `index` of an array of `stride`-byte records, or `None` outside.
    pub const fn record(&self, index: u32, stride: u32) -> Option<ByteAddr> {
        match index.checked_mul(stride) {
            Some(offset) => self.at(offset, stride),
            None => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn region_addresses_its_last_byte_and_none_after() {
        let region = Region::new(0x100, 64);
        assert_eq!(region.at(63, 1), Some(ByteAddr(0x13f)));
        assert_eq!(region.at(64, 1), None);
        assert_eq!(region.at(u32::MAX, 2), None);
        assert_eq!(region.record(1, 32), Some(ByteAddr(0x120)));
        assert_eq!(region.record(2, 32), None);
        assert_eq!(region.record(u32::MAX, 32), None);
    }
}
