//! Cycle model of a burst writer, RTL unit `xy_burst_writer`: a record buffer in front of a write port.
//!
//! | Property | Value |
//! |---|---|
//! | Room | one burst that is being filled and one that is being sent |
//! | Input | one record a cycle, while the open burst has room |
//! | Latency | 1 cycle from the record that fills a burst to its first line |
//! | Output | one line of 64 bytes a cycle |

use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::Region;
use xylem_core::probe::Stage;

use super::port::{Access, LINE_BYTES, PortError};
use crate::bus::{Tally, Traffic};

/// Collects consecutive records and sends them in bursts, as `xylem_core::mem::BurstWriter` does.
#[derive(Debug)]
pub struct Writer {
    region: Region,
    name: RegionName,
    stage: Stage,
    burst: u32,
    /// Bytes of the region that belong to bursts sent or being sent.
    written: u32,
    pending: Vec<u8>,
    /// Whether what is pending leaves in this cycle though it does not fill a burst.
    flushing: bool,
    /// Lines still to be sent, as byte offsets into the region.
    sending: std::ops::Range<u32>,
    /// Bursts sent, and their bytes.
    sent: Sent,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Sent {
    bursts: u64,
    bytes: u64,
}

impl Writer {
    /// A writer at the start of `region` that sends `burst` bytes at a time, a multiple of a line.
    pub fn new(region: Region, name: RegionName, stage: Stage, burst: u32) -> Self {
        Self {
            region,
            name,
            stage,
            burst,
            written: 0,
            pending: Vec::with_capacity(burst as usize),
            flushing: false,
            sending: 0..0,
            sent: Sent::default(),
        }
    }

    /// Adds what it has sent so far to `traffic`, the burst being sent included.
    pub fn count(&self, traffic: &mut Traffic) {
        let tally =
            Tally { write_bytes: self.sent.bytes, writes: self.sent.bursts, ..Tally::default() };
        let key = (self.stage, Some(self.name.as_str()));
        *traffic.tallies.entry(key).or_default() += tally;
    }

    /// Whether a record of `len` bytes can be taken in this cycle.
    pub fn is_ready(&self, len: usize) -> bool {
        self.pending.len() + len <= self.burst as usize
    }

    /// Takes a record; call at most once a cycle, when [`Writer::is_ready`].
    ///
    /// # Errors
    /// [`BuildError::RegionFull`] if the record would leave the region; what came before it is put
    /// into `image`.
    pub fn push(&mut self, image: &mut [u8], record: &[u8]) -> Result<(), BuildError<PortError>> {
        let len = self.written + self.pending.len() as u32;
        if self.region.at(len, record.len() as u32).is_none() {
            // The machine stops here; what came before is not lost.
            self.commit(image);
            return Err(BuildError::RegionFull {
                region: self.name,
                needed: u64::from(len) + record.len() as u64,
                available: self.region.size,
            });
        }
        self.pending.extend_from_slice(record);
        Ok(())
    }

    /// Asks that what is pending be sent; a level, to be held until [`Writer::is_empty`].
    pub fn flush(&mut self) {
        self.flushing = true;
    }

    /// Ends the cycle: a burst that is full, or to be flushed, is handed to the port if the port is
    /// free, and its bytes are put into `image`.
    pub fn tick(&mut self, image: &mut [u8]) {
        let full = self.pending.len() == self.burst as usize;
        let flushed = std::mem::take(&mut self.flushing) && !self.pending.is_empty();
        if !self.sending.is_empty() || !(full || flushed) {
            return;
        }
        let len = self.pending.len() as u32;
        self.commit(image);
        self.sending = self.written..self.written + len;
        self.written += len;
        self.sent.bursts += 1;
        self.sent.bytes += u64::from(len);
        self.pending.clear();
    }

    fn commit(&self, image: &mut [u8]) {
        // Inside the region: checked for each record.
        let start = (self.region.base.0 + self.written) as usize;
        if let Some(target) = image.get_mut(start..start + self.pending.len()) {
            target.copy_from_slice(&self.pending);
        }
    }

    /// The line that it offers in this cycle.
    pub fn offer(&self) -> Option<Access> {
        let addr = self.region.base.0 + self.sending.start;
        (!self.sending.is_empty()).then_some(Access { addr, write: true, tag: 0 })
    }

    /// How many bytes of the line offered are written, from its first on, and whether it is the last
    /// of its burst.
    pub fn line(&self) -> (u32, bool) {
        let len = self.sending.end - self.sending.start;
        (len.min(LINE_BYTES), len <= LINE_BYTES)
    }

    /// The line offered was taken.
    pub fn taken(&mut self) {
        self.sending.start = (self.sending.start + LINE_BYTES).min(self.sending.end);
    }

    /// Whether a burst is under way: its lines follow each other on the port.
    pub fn in_burst(&self) -> bool {
        !self.sending.is_empty() && !self.sending.start.is_multiple_of(self.burst)
    }

    /// Whether all that was pushed has been sent.
    pub fn is_empty(&self) -> bool {
        self.pending.is_empty() && self.sending.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn writer(size: u32) -> Writer {
        Writer::new(Region::new(64, size), RegionName::Nodes, Stage::Emit, 128)
    }

    #[test]
    fn a_full_burst_leaves_a_cycle_later_line_by_line_and_the_rest_at_flush() {
        let mut image = vec![0; 512];
        let mut writer = writer(448);
        let mut lines = Vec::new();
        for i in 0..7u8 {
            lines.push(writer.offer().map(|line| line.addr));
            writer.taken();
            if i < 5 {
                assert!(writer.is_ready(32));
                writer.push(&mut image, &[i; 32]).unwrap();
            }
            writer.tick(&mut image);
        }
        let expected = [None, None, None, None, Some(64), Some(128), None];
        assert_eq!(lines, expected, "the fourth record fills a burst of two lines");
        writer.flush();
        assert!(writer.offer().is_none());
        writer.tick(&mut image);
        assert_eq!((writer.offer().unwrap().addr, writer.line()), (192, (32, true)));
        writer.taken();
        writer.tick(&mut image);
        assert!(writer.is_empty());
        assert_eq!((image[63], image[64 + 96], image[64 + 128]), (0, 3, 4));
        assert_eq!(writer.sent, Sent { bursts: 2, bytes: 160 });
    }

    #[test]
    fn a_burst_that_is_not_sent_holds_up_the_one_after_the_next() {
        let mut image = vec![0; 512];
        let mut writer = writer(448);
        for _ in 0..4 {
            assert!(writer.is_ready(64));
            writer.push(&mut image, &[1; 64]).unwrap();
            writer.tick(&mut image);
        }
        assert!(!writer.is_ready(64), "one burst is sent, one is full");
        writer.taken();
        writer.tick(&mut image);
        assert!(!writer.is_ready(64));
        writer.taken();
        writer.tick(&mut image);
        assert!(writer.is_ready(64));
        assert_eq!(writer.offer().unwrap().addr, 64 + 128, "the next burst follows at once");
    }

    #[test]
    fn a_full_region_refuses_the_record() {
        let mut image = vec![0; 512];
        let mut writer = writer(96);
        writer.push(&mut image, &[1; 64]).unwrap();
        let full = BuildError::RegionFull { region: RegionName::Nodes, needed: 128, available: 96 };
        assert_eq!(writer.push(&mut image, &[1; 64]), Err(full));
        assert_eq!((image[64], image[127], image[128]), (1, 1, 0));
    }
}
