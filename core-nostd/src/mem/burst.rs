//! A write buffer that turns a stream of records into bursts.

use heapless::Vec;

use super::{Bus, Region};

/// Why a [`BurstWriter`] could not take or flush bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BurstError<E> {
    /// The region has no room for the next record; what was written before stays.
    Full {
        /// Bytes that the stream needs at least, counted from the region's base.
        needed: u32,
    },
    /// The bus refused a burst.
    Bus(E),
}

/// Collects consecutive records and writes them to a region in bursts of at most `BYTES` bytes.
///
/// This is the burst buffer in front of each write port of the builder. A record is placed whole:
/// it starts a new burst if it does not fit into the open one.
#[derive(Debug)]
pub struct BurstWriter<const BYTES: usize> {
    region: Region,
    written: u32,
    pending: Vec<u8, BYTES>,
    burst: usize,
}

impl<const BYTES: usize> BurstWriter<BYTES> {
    /// A writer at the start of `region` that writes `burst` bytes at a time (at most `BYTES`).
    pub const fn new(region: Region, burst: usize) -> Self {
        let burst = if burst > BYTES { BYTES } else { burst };
        Self { region, written: 0, pending: Vec::new(), burst }
    }

    /// Bytes accepted so far, written or pending.
    pub fn len(&self) -> u32 {
        self.written + self.pending.len() as u32
    }

    /// Whether nothing was accepted yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Accepts one record.
    ///
    /// # Errors
    /// [`BurstError::Full`] if the record would leave the region; the writer is unchanged.
    /// [`BurstError::Bus`] if a burst had to be written first and failed.
    #[inline]
    pub fn push<B: Bus>(&mut self, bus: &mut B, record: &[u8]) -> Result<(), BurstError<B::Error>> {
        let len = self.len();
        if self.region.at(len, record.len() as u32).is_none() {
            return Err(BurstError::Full { needed: len.saturating_add(record.len() as u32) });
        }
        if self.pending.len() + record.len() > self.burst {
            self.flush(bus)?;
        }
        if self.pending.extend_from_slice(record).is_err() {
            // A record longer than the buffer goes straight through.
            let addr = self.region.at(self.written, record.len() as u32);
            let addr = addr.ok_or(BurstError::Full { needed: len })?;
            bus.write(addr, record).map_err(BurstError::Bus)?;
            self.written += record.len() as u32;
        }
        Ok(())
    }

    /// Writes what is pending.
    ///
    /// # Errors
    /// [`BurstError::Bus`] if the burst failed; it stays pending.
    pub fn flush<B: Bus>(&mut self, bus: &mut B) -> Result<(), BurstError<B::Error>> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let len = self.pending.len() as u32;
        let addr = self.region.at(self.written, len);
        let addr = addr.ok_or(BurstError::Full { needed: self.len() })?;
        bus.write(addr, &self.pending).map_err(BurstError::Bus)?;
        self.written += len;
        self.pending.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::ByteAddr;
    use super::*;

    #[derive(Default)]
    struct Log {
        bursts: Vec<(u32, usize), 8>,
    }

    impl Bus for Log {
        type Error = ();
        fn read(&mut self, _: ByteAddr, _: &mut [u8]) -> Result<(), ()> {
            Err(())
        }
        fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), ()> {
            self.bursts.push((addr.0, bytes.len())).map_err(|_| ())
        }
    }

    #[test]
    fn records_leave_in_whole_bursts_and_the_rest_at_flush() {
        let mut log = Log::default();
        let mut writer = BurstWriter::<64>::new(Region::new(0x1000, 100), 32);
        for _ in 0..5 {
            writer.push(&mut log, &[0; 16]).unwrap();
        }
        assert_eq!(log.bursts.as_slice(), [(0x1000, 32), (0x1020, 32)]);
        writer.flush(&mut log).unwrap();
        writer.flush(&mut log).unwrap();
        assert_eq!(log.bursts.as_slice(), [(0x1000, 32), (0x1020, 32), (0x1040, 16)]);
    }

    #[test]
    fn a_full_region_refuses_the_record_and_keeps_the_earlier_ones() {
        let mut log = Log::default();
        let mut writer = BurstWriter::<64>::new(Region::new(0, 40), 64);
        writer.push(&mut log, &[0; 16]).unwrap();
        writer.push(&mut log, &[0; 16]).unwrap();
        assert_eq!(writer.push(&mut log, &[0; 16]), Err(BurstError::Full { needed: 48 }));
        writer.flush(&mut log).unwrap();
        assert_eq!(log.bursts.as_slice(), [(0, 32)]);
    }
}
