//! A small cache of whole lines in front of an array of records.

use crate::mem::{Bus, ByteAddr, Region};

/// Bytes of a line: the access granularity of the memory (P3 §5.2).
const LINE: usize = 64;

/// Reads records of an array in lines of 64 bytes, each at its own place among `N`.
///
/// An array that is read from one end to the other crosses the bus once, byte for byte: the last
/// line ends where the array does. `N` lines, at least 2, hold any `N` that follow one another.
#[derive(Debug)]
pub(super) struct Lines<const N: usize> {
    array: Region,
    held: [Option<u32>; N],
    data: [[u8; LINE]; N],
}

/// The burst that failed, and why.
pub(super) type Failed<E> = (ByteAddr, E);

impl<const N: usize> Lines<N> {
    /// Nothing yet of `array`, whose end can be addressed.
    pub fn new(array: Region) -> Self {
        Self { array, held: [None; N], data: [[0; LINE]; N] }
    }

    /// Copies record `index` of an array of records as long as `record`, which is at most a line. It
    /// may lie in two lines. Gives false if it is not in the array.
    #[inline]
    pub fn read<B: Bus>(
        &mut self,
        bus: &mut B,
        index: u32,
        record: &mut [u8],
    ) -> Result<bool, Failed<B::Error>> {
        let len = record.len() as u32;
        if self.array.record(index, len).is_none() {
            return Ok(false);
        }
        let start = index * len;
        let (line, at) = (start / LINE as u32, start as usize % LINE);
        let (first, second) = record.split_at_mut(record.len().min(LINE - at));
        first.copy_from_slice(&self.line(bus, line)?[at..at + first.len()]);
        if !second.is_empty() {
            second.copy_from_slice(&self.line(bus, line + 1)?[..second.len()]);
        }
        Ok(true)
    }

    /// A line that starts inside the array.
    #[inline]
    fn line<B: Bus>(&mut self, bus: &mut B, line: u32) -> Result<&[u8; LINE], Failed<B::Error>> {
        let slot = line as usize % N;
        if self.held[slot] != Some(line) {
            self.held[slot] = None;
            let start = line * LINE as u32;
            let len = (self.array.size - start).min(LINE as u32);
            let addr = ByteAddr(self.array.base.0 + start);
            bus.read(addr, &mut self.data[slot][..len as usize]).map_err(|error| (addr, error))?;
            self.held[slot] = Some(line);
        }
        Ok(&self.data[slot])
    }
}
