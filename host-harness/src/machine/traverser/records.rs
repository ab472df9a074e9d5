//! The writer of hit records: three words of 8 bytes each, collected in lines (`xy_hit_writer`).

use xylem_core::traverse::Hit;

/// A line on its way to memory.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LineWrite {
    /// First byte.
    pub addr: u32,
    /// The bytes; those that are not written are 0.
    pub data: [u8; 64],
    /// Which words of 8 bytes are written, the lowest in bit 0.
    pub words: u8,
}

/// A line that is being filled.
#[derive(Clone, Debug)]
pub struct RecordWriter {
    line: LineWrite,
    /// The next word of the line.
    lane: usize,
    /// The next word of the record.
    word: usize,
    full: bool,
}

impl RecordWriter {
    /// A writer whose first record goes to `base`.
    pub fn new(base: u32) -> Self {
        let line = LineWrite { addr: base, data: [0; 64], words: 0 };
        Self { line, lane: 0, word: 0, full: false }
    }

    /// The line that is offered in this cycle.
    pub fn offered(&self) -> Option<LineWrite> {
        self.full.then_some(self.line)
    }

    /// Whether nothing is left to be written.
    pub fn is_empty(&self) -> bool {
        self.line.words == 0
    }

    /// Runs a cycle in which a record is given or what is left is to be written; returns whether the
    /// record's last word was taken.
    pub fn tick(&mut self, record: Option<&[u8; Hit::BYTES]>, flush: bool, ready: bool) -> bool {
        if self.full {
            if ready {
                self.line = LineWrite { addr: self.line.addr + 64, data: [0; 64], words: 0 };
                self.full = false;
            }
            return false;
        }
        let Some(record) = record else {
            self.full = flush && self.line.words != 0;
            return false;
        };
        let at = 8 * self.lane;
        self.line.data[at..at + 8].copy_from_slice(&record[8 * self.word..8 * self.word + 8]);
        self.line.words |= 1 << self.lane;
        self.lane = (self.lane + 1) % 8;
        self.full = self.lane == 0;
        self.word = (self.word + 1) % 3;
        self.word == 0
    }
}
