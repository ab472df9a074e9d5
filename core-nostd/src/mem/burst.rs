//! A write buffer that turns a stream of records into bursts.

use super::{Bus, Region};
use crate::error::{BuildError, RegionName};
use crate::probe::Stage;

/// The longest burst that a [`BurstWriter`] writes, in bytes.
pub const MAX_BURST_BYTES: usize = 1024;

/// Collects consecutive records and writes them to a region in bursts.
///
/// This is the burst buffer in front of each write port of the builder. A record is placed whole:
/// it starts a new burst if it does not fit into the open one.
#[derive(Debug)]
pub struct BurstWriter {
    region: Region,
    name: RegionName,
    stage: Stage,
    burst: usize,
    written: u32,
    pending: usize,
    /// Bytes that the open burst may have inside the region; 0 before the first one.
    limit: usize,
    buffer: [u8; MAX_BURST_BYTES],
}

impl BurstWriter {
    /// A writer at the start of `region` that writes `burst` bytes at a time, at most
    /// [`MAX_BURST_BYTES`]. `name` and `stage` are for its errors.
    pub const fn new(region: Region, name: RegionName, stage: Stage, burst: usize) -> Self {
        let burst = if burst > MAX_BURST_BYTES { MAX_BURST_BYTES } else { burst };
        Self {
            region,
            name,
            stage,
            burst,
            written: 0,
            pending: 0,
            limit: 0,
            buffer: [0; MAX_BURST_BYTES],
        }
    }

    /// Makes `stage` the one that errors name from now on.
    pub fn set_stage(&mut self, stage: Stage) {
        self.stage = stage;
    }

    /// Accepts one record, which must not be longer than a burst.
    ///
    /// # Errors
    /// [`BuildError::RegionFull`] if the record would leave the region; those before it are written
    /// first. [`BuildError::Bus`] if a burst had to be written first and failed.
    #[inline]
    pub fn push<B: Bus, const N: usize>(
        &mut self,
        bus: &mut B,
        record: &[u8; N],
    ) -> Result<(), BuildError<B::Error>> {
        *self.reserve(bus)? = *record;
        Ok(())
    }

    /// Accepts one record that the caller writes in the place given, which spares a copy.
    ///
    /// # Errors
    /// As [`BurstWriter::push`].
    #[inline(always)]
    pub fn reserve<B: Bus, const N: usize>(
        &mut self,
        bus: &mut B,
    ) -> Result<&mut [u8; N], BuildError<B::Error>> {
        if self.pending + N > self.limit {
            self.next_burst(bus, N as u32)?;
        }
        let place = self.buffer.get_mut(self.pending..).and_then(|free| free.first_chunk_mut());
        let place = place.ok_or(BuildError::Internal)?;
        self.pending += N;
        Ok(place)
    }

    /// Makes room for a record of `len` bytes that does not fit into the open burst.
    #[cold]
    #[inline(never)]
    fn next_burst<B: Bus>(&mut self, bus: &mut B, len: u32) -> Result<(), BuildError<B::Error>> {
        let offset = self.written + self.pending as u32;
        let inside = self.region.at(offset, len).is_some();
        self.flush(bus)?;
        if !inside {
            return Err(BuildError::RegionFull {
                region: self.name,
                needed: u64::from(offset) + u64::from(len),
                available: self.region.size,
            });
        }
        // A region that leaves the address space is checked record by record.
        let whole = self.region.at(self.region.size.saturating_sub(1), 1).is_some();
        let rest = (self.region.size - self.written) as usize;
        self.limit = if whole { self.burst.min(rest) } else { 0 };
        Ok(())
    }

    /// Writes what is pending.
    ///
    /// # Errors
    /// [`BuildError::Bus`] if the burst failed; it stays pending.
    pub fn flush<B: Bus>(&mut self, bus: &mut B) -> Result<(), BuildError<B::Error>> {
        if self.pending == 0 {
            return Ok(());
        }
        let len = self.pending as u32;
        let pending = self.buffer.get(..self.pending).ok_or(BuildError::Internal)?;
        let addr = self.region.at(self.written, len).ok_or(BuildError::Internal)?;
        let stage = self.stage;
        bus.write(addr, pending).map_err(|error| BuildError::Bus { stage, addr, error })?;
        self.written += len;
        self.pending = 0;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::ByteAddr;
    use super::*;
    use heapless::Vec;

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

    fn writer(region: Region, burst: usize) -> BurstWriter {
        BurstWriter::new(region, RegionName::Nodes, Stage::Emit, burst)
    }

    #[test]
    fn records_leave_in_whole_bursts_and_the_rest_at_flush() {
        let mut log = Log::default();
        let mut writer = writer(Region::new(0x1000, 100), 32);
        for _ in 0..5 {
            writer.push(&mut log, &[0; 16]).unwrap();
        }
        assert_eq!(log.bursts.as_slice(), [(0x1000, 32), (0x1020, 32)]);
        writer.flush(&mut log).unwrap();
        writer.flush(&mut log).unwrap();
        assert_eq!(log.bursts.as_slice(), [(0x1000, 32), (0x1020, 32), (0x1040, 16)]);
    }

    #[test]
    fn a_full_region_refuses_the_record_and_holds_the_earlier_ones() {
        let mut log = Log::default();
        let mut writer = writer(Region::new(0, 40), 64);
        writer.push(&mut log, &[0; 16]).unwrap();
        writer.push(&mut log, &[0; 16]).unwrap();
        let full = BuildError::RegionFull { region: RegionName::Nodes, needed: 48, available: 40 };
        assert_eq!(writer.push(&mut log, &[0; 16]), Err(full));
        assert_eq!(log.bursts.as_slice(), [(0, 32)]);
    }

    #[test]
    fn a_failed_burst_stays_pending() {
        let mut log = Log::default();
        for i in 0..8 {
            log.bursts.push((i, 0)).unwrap();
        }
        let mut writer = writer(Region::new(0, 64), 32);
        writer.push(&mut log, &[0; 16]).unwrap();
        assert!(matches!(writer.flush(&mut log), Err(BuildError::Bus { error: (), .. })));
        log.bursts.clear();
        writer.flush(&mut log).unwrap();
        assert_eq!(log.bursts.as_slice(), [(0, 16)]);
    }
}
