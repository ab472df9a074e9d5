//! Cycle model of the primitive reader, RTL unit `xy_reader`: the input as one stream of lines (P1 §4.1,
//! P2 §5.1).
//!
//! | Property | Value |
//! |---|---|
//! | Room | a number of lines, asked for ahead of their use; that of a line is free a cycle after it |
//! | Latency | 2 cycles from a line's arrival to its records |
//! | Boxes | a line a cycle, which is a pair of records |
//! | Triangles | a line a cycle: the first of five is held, each of the others ends a pair |
//! | Output | a pair of records, in order, each checked and with its code |

use std::collections::VecDeque;

use xylem_core::mem::Region;
use xylem_core::sort::{InputFormat, Item, PrimitiveDecoder};

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
    /// Position of the first record that has not been taken from its lines. Those between are the pair that
    /// is offered.
    taken: u32,
    /// Whether the line before the first one below is held.
    held: bool,
    /// Number of the first line that is asked for or here.
    first_line: u32,
    /// Which lines from `first_line` on are here.
    here: VecDeque<bool>,
    /// Lines that come in this cycle.
    coming: Vec<u32>,
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
            taken: 0,
            held: false,
            first_line: 0,
            here: VecDeque::new(),
            coming: Vec::new(),
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
        let line = self.first_line + self.here.len() as u32;
        let offset = u64::from(line) * u64::from(LINE_BYTES);
        let wanted = self.here.len() < self.room && offset < self.bytes();
        wanted.then(|| self.region.base.0 + line * LINE_BYTES)
    }

    /// The line offered was taken.
    pub fn taken(&mut self) {
        self.here.push_back(false);
    }

    /// The line at `addr` has come.
    pub fn arrive(&mut self, addr: u32) {
        self.coming.push((addr - self.region.base.0) / LINE_BYTES);
    }

    /// Ends the cycle: the next pair is taken from its lines, if they were here and the last pair has left.
    pub fn tick(&mut self) {
        let head_here = self.here.front() == Some(&true);
        let room = self.next == self.taken;
        if self.taken < self.count {
            match self.decoder.format {
                InputFormat::Box32 if room && head_here => {
                    self.take_pair();
                    self.take_line();
                }
                InputFormat::Box32 => {}
                InputFormat::Triangle40 if self.held => {
                    // The last one may end in the line held.
                    let needs_head = self.pair_end().div_ceil(LINE_BYTES) > self.first_line;
                    if room && (head_here || !needs_head) {
                        self.take_pair();
                        if needs_head {
                            self.take_line();
                        }
                        self.held = !(self.taken * Self::TRIANGLE).is_multiple_of(LINE_BYTES);
                    }
                }
                InputFormat::Triangle40 if head_here => {
                    self.take_line();
                    self.held = true;
                }
                InputFormat::Triangle40 => {}
            }
        }
        for line in std::mem::take(&mut self.coming) {
            if let Some(here) = self.here.get_mut((line - self.first_line) as usize) {
                *here = true;
            }
        }
    }

    const TRIANGLE: u32 = InputFormat::Triangle40.bytes();

    /// Where in the input the next pair ends.
    fn pair_end(&self) -> u32 {
        (self.taken + 2).min(self.count) * self.decoder.format.bytes()
    }

    fn take_pair(&mut self) {
        self.taken = (self.taken + 2).min(self.count);
    }

    fn take_line(&mut self) {
        self.here.pop_front();
        self.first_line += 1;
    }

    /// Delivers the next record of the pair that is offered; `None` if there is none.
    ///
    /// # Errors
    /// The position of a record that [`PrimitiveDecoder::decode`] refuses.
    pub fn next(&mut self, image: &[u8]) -> Option<Result<Item, xylem_core::geom::PrimIndex>> {
        if self.next == self.taken {
            return None;
        }
        let stride = self.decoder.format.bytes();
        let at = (self.region.base.0 + self.next * stride) as usize;
        let item = self.decoder.decode(&image[at..at + stride as usize], self.next);
        self.next += 1;
        Some(item)
    }
}
