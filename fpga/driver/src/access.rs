//! The seam between the driver and the bus that the registers are on.

use core::fmt;

use xylem_regs::{MAP_SIZE, Readable, Reg, Writable};

/// Reads and writes 32-bit registers by their byte offset in the map.
///
/// Two implementations come with the driver, [`Mmio`](crate::Mmio) and [`Spi`](crate::Spi); a
/// simulated accelerator is a third. An implementation needs [`read`](Self::read) and
/// [`write`](Self::write); one whose bus has bursts overrides [`read_burst`](Self::read_burst).
pub trait RegisterAccess {
    /// Why an access failed.
    type Error: core::error::Error;

    /// Reads the register at `offset` bytes.
    ///
    /// # Errors
    /// The bus's own, and an offset outside the map.
    fn read(&mut self, offset: u32) -> Result<u32, Self::Error>;

    /// Writes the register at `offset` bytes.
    ///
    /// # Errors
    /// The bus's own, and an offset outside the map; the register is then unchanged.
    fn write(&mut self, offset: u32, value: u32) -> Result<(), Self::Error>;

    /// Reads consecutive registers from `offset` on, in ascending order.
    ///
    /// # Errors
    /// As [`read`](Self::read); `values` are then unspecified.
    fn read_burst(&mut self, offset: u32, values: &mut [u32]) -> Result<(), Self::Error> {
        let mut at = offset;
        for value in values {
            *value = self.read(at)?;
            at = at.saturating_add(4);
        }
        Ok(())
    }
}

impl<R: RegisterAccess + ?Sized> RegisterAccess for &mut R {
    type Error = R::Error;

    fn read(&mut self, offset: u32) -> Result<u32, Self::Error> {
        (**self).read(offset)
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), Self::Error> {
        (**self).write(offset, value)
    }

    fn read_burst(&mut self, offset: u32, values: &mut [u32]) -> Result<(), Self::Error> {
        (**self).read_burst(offset, values)
    }
}

/// An access outside the register map, or not to a whole register. Nothing was accessed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OffsetError {
    /// The first byte of the access.
    pub offset: u32,
    /// Its length in bytes.
    pub bytes: usize,
}

impl OffsetError {
    /// Accepts `words` registers from `offset` on, if all of them are in the map.
    pub(crate) fn check(offset: u32, words: usize) -> Result<(), Self> {
        let bytes = words.saturating_mul(4);
        let inside =
            (offset as usize).checked_add(bytes).is_some_and(|end| end <= MAP_SIZE as usize);
        if inside && offset.is_multiple_of(4) { Ok(()) } else { Err(Self { offset, bytes }) }
    }
}

impl fmt::Display for OffsetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { offset, bytes } = self;
        write!(
            f,
            "{bytes} bytes at offset {offset:#x} are not registers of the {MAP_SIZE:#x}-byte map"
        )
    }
}

impl core::error::Error for OffsetError {}

/// Accesses by typed register: what can only be read cannot be written, and the reverse.
pub(crate) trait TypedAccess: RegisterAccess {
    fn get<T: Readable>(&mut self, register: Reg<T>) -> Result<T, Self::Error> {
        self.read(register.offset()).map(T::from_bits)
    }

    fn set<T: Writable>(&mut self, register: Reg<T>, value: T) -> Result<(), Self::Error> {
        self.write(register.offset(), value.bits())
    }
}

impl<R: RegisterAccess> TypedAccess for R {}
