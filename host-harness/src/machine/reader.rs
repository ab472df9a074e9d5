//! Cycle model of the primitive reader, RTL unit `xy_reader`: the input as one stream of lines (P1 §4.1,
//! P2 §5.1).
//!
//! | Property | Value |
//! |---|---|
//! | Room | a number of lines, asked for ahead of their use; that of a line is free a cycle after it |
//! | Latency | 1 cycle from a line's arrival to its records |
//! | Output | up to two records a cycle, in order, each checked and with its code |

use std::collections::VecDeque;

use xylem_core::mem::Region;
use xylem_core::sort::{Item, PrimitiveDecoder};

use super::port::LINE_BYTES;

/// Reads records from first to last.
#[derive(Clone, Debug)]
pub struct Reader {
    region: Region,
    decoder: PrimitiveDecoder,
    count: u32,
    /// Lines that there is room for.
    room: usize,
    /// Position of the next record to deliver.
    next: u32,
    /// Number of the first line that is asked for or here.
    first_line: u32,
    /// Which lines from `first_line` on have arrived.
    arrived: VecDeque<bool>,
    /// Lines whose last record was delivered in this cycle.
    freed: usize,
}

impl Reader {
    /// A reader of `count` records that asks for at most `room` lines ahead.
    pub fn new(region: Region, decoder: PrimitiveDecoder, count: u32, room: u32) -> Self {
        Self {
            region,
            decoder,
            count,
            room: room as usize,
            next: 0,
            first_line: 0,
            arrived: VecDeque::new(),
            freed: 0,
        }
    }

    /// Number of the next record.
    pub fn position(&self) -> u32 {
        self.next
    }

    /// Whether all records have been delivered.
    pub fn is_done(&self) -> bool {
        self.next == self.count
    }

    /// Bytes of all records.
    pub fn bytes(&self) -> u64 {
        u64::from(self.count) * u64::from(self.decoder.format.bytes())
    }

    /// The line to ask for next.
    pub fn offer(&self) -> Option<u32> {
        let line = self.first_line + self.arrived.len() as u32;
        let offset = u64::from(line) * u64::from(LINE_BYTES);
        let wanted = self.arrived.len() + self.freed < self.room && offset < self.bytes();
        wanted.then(|| self.region.base.0 + line * LINE_BYTES)
    }

    /// The line offered was taken.
    pub fn taken(&mut self) {
        self.arrived.push_back(false);
    }

    /// Ends the cycle.
    pub fn tick(&mut self) {
        self.freed = 0;
    }

    /// The line at `addr` has come; its records can be had from the next cycle on.
    pub fn arrive(&mut self, addr: u32) {
        let line = (addr - self.region.base.0) / LINE_BYTES - self.first_line;
        if let Some(arrived) = self.arrived.get_mut(line as usize) {
            *arrived = true;
        }
    }

    /// Delivers the next record if its lines have come; `None` if they have not or there is none.
    ///
    /// # Errors
    /// The position of a record that [`PrimitiveDecoder::decode`] refuses.
    pub fn next(&mut self, image: &[u8]) -> Option<Result<Item, xylem_core::geom::PrimIndex>> {
        let stride = self.decoder.format.bytes();
        if self.is_done() {
            return None;
        }
        let start = self.next * stride;
        let last_line = (start + stride - 1) / LINE_BYTES;
        let mut lines = self.arrived.iter().take((last_line - self.first_line + 1) as usize);
        if last_line >= self.first_line + self.arrived.len() as u32 || !lines.all(|&here| here) {
            return None;
        }
        let at = (self.region.base.0 + start) as usize;
        let item = self.decoder.decode(&image[at..at + stride as usize], self.next);
        self.next += 1;
        let needed_line =
            if self.is_done() { last_line + 1 } else { self.next * stride / LINE_BYTES };
        while self.first_line < needed_line && !self.arrived.is_empty() {
            self.arrived.pop_front();
            self.first_line += 1;
            self.freed += 1;
        }
        Some(item)
    }
}
