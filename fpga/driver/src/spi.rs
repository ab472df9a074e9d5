//! Registers behind an SPI bus.
//!
//! # Framing
//!
//! SPI mode 0, most significant bit first; chip select frames one transaction. The master sends a
//! command byte, then the byte offset of the first register, 24 bits, most significant byte first.
//! Words are 32 bits, most significant byte first.
//!
//! | Command | Master sends                                     | Master receives         |
//! |---------|--------------------------------------------------|-------------------------|
//! | Read    | `0x03`, offset (3 bytes), one byte of turnaround | words, as many as asked |
//! | Write   | `0x02`, offset (3 bytes), one word               | nothing                 |
//!
//! The turnaround byte gives the device time to fetch the first word. In a read the offset advances
//! by 4 with every word: the device fetches a word while it sends the one before, so the words of a
//! burst are read one after the other, not at one instant.

use core::fmt;

use embedded_hal::spi::{Operation, SpiDevice};

use crate::access::{OffsetError, RegisterAccess};

const WRITE: u8 = 0x02;
const READ: u8 = 0x03;

/// The longest read transaction, in words; longer bursts are split.
const BURST_WORDS: usize = 8;

/// Register access over an SPI device, framed as the [module](self) says.
#[derive(Debug)]
pub struct Spi<S> {
    device: S,
}

impl<S: SpiDevice> Spi<S> {
    /// The register map behind `device`, which selects the chip and runs in mode 0.
    pub const fn new(device: S) -> Self {
        Self { device }
    }

    /// Gives the device back.
    pub fn release(self) -> S {
        self.device
    }

    fn read_words(&mut self, offset: u32, words: &mut [u32]) -> Result<(), SpiError<S::Error>> {
        let [_, high, middle, low] = offset.to_be_bytes();
        let mut bytes = [[0; 4]; BURST_WORDS];
        let bytes = bytes.get_mut(..words.len()).unwrap_or_default();
        self.device
            .transaction(&mut [
                Operation::Write(&[READ, high, middle, low, 0]),
                Operation::Read(bytes.as_flattened_mut()),
            ])
            .map_err(SpiError::Bus)?;
        for (word, bytes) in words.iter_mut().zip(bytes) {
            *word = u32::from_be_bytes(*bytes);
        }
        Ok(())
    }
}

impl<S: SpiDevice> RegisterAccess for Spi<S> {
    type Error = SpiError<S::Error>;

    fn read(&mut self, offset: u32) -> Result<u32, Self::Error> {
        let mut word = [0];
        self.read_burst(offset, &mut word)?;
        Ok(word[0])
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), Self::Error> {
        OffsetError::check(offset, 1)?;
        let [_, high, middle, low] = offset.to_be_bytes();
        let [b3, b2, b1, b0] = value.to_be_bytes();
        self.device.write(&[WRITE, high, middle, low, b3, b2, b1, b0]).map_err(SpiError::Bus)
    }

    fn read_burst(&mut self, offset: u32, values: &mut [u32]) -> Result<(), Self::Error> {
        OffsetError::check(offset, values.len())?;
        let offsets = (offset..).step_by(4 * BURST_WORDS);
        for (at, words) in offsets.zip(values.chunks_mut(BURST_WORDS)) {
            self.read_words(at, words)?;
        }
        Ok(())
    }
}

/// Why a register behind SPI could not be accessed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SpiError<E> {
    /// The access is outside the map. The bus was not used.
    Offset(OffsetError),
    /// The SPI device failed.
    Bus(E),
}

impl<E> From<OffsetError> for SpiError<E> {
    fn from(error: OffsetError) -> Self {
        Self::Offset(error)
    }
}

impl<E: fmt::Debug> fmt::Display for SpiError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Offset(error) => error.fmt(f),
            Self::Bus(error) => write!(f, "SPI device failed: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for SpiError<E> {}
