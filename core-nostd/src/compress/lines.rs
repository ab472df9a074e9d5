//! The lines of nodes that a compressor holds on chip.

use heapless::Vec;

use crate::error::{BuildError, RegionName};
use crate::mem::{Bus, Region};
use crate::probe::{Probe, Stage};

/// Bytes of a line: the least that memory is read or written by (P3 §5.2).
pub(super) const LINE: u32 = 64;

/// The most lines that can be held.
pub const MAX_LINES: usize = 64;

/// A few lines of a region of nodes, written back when their place is needed; the one that was not used
/// for longest goes first.
///
/// New nodes fill lines without reading them. A node that is read back brings its whole line, which
/// is then written whole.
#[derive(Debug)]
pub(super) struct LineBuffer {
    region: Region,
    capacity: usize,
    /// New nodes are written in this stage; what was read back, in the compressor's.
    pub stage: Stage,
    /// The most recently used one is the last.
    lines: Vec<Line, MAX_LINES>,
}

#[derive(Debug)]
struct Line {
    number: u32,
    bytes: [u8; LINE as usize],
    /// Which bytes are known.
    known: [u32; 2],
    /// The line came from memory, so that all of it that is in the region is known.
    fetched: bool,
}

impl LineBuffer {
    /// Holds `capacity` lines of `region`, at least 2 (a node may lie in two).
    pub fn new(region: Region, capacity: usize) -> Self {
        Self {
            region,
            capacity: capacity.clamp(2, MAX_LINES),
            stage: Stage::Emit,
            lines: Vec::new(),
        }
    }

    /// Writes a new record at `offset`.
    ///
    /// # Errors
    /// [`BuildError::RegionFull`], or the bus's for a line that made room.
    #[inline]
    pub fn put<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        offset: u32,
        record: &[u8],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        if self.region.at(offset, record.len() as u32).is_none() {
            self.flush(bus, probe)?;
            return Err(BuildError::RegionFull {
                region: RegionName::QuantizedNodes,
                needed: u64::from(offset) + record.len() as u64,
                available: self.region.size,
            });
        }
        for (number, [from, to], part) in parts(offset, record.len()) {
            let adjoins = |line: &Line| from <= line.known[1] && to >= line.known[0];
            if let Some(at) = self.find(number)
                && !adjoins(&self.lines[at])
            {
                self.evict(bus, at, probe)?;
            }
            let line = match self.find(number) {
                Some(at) => self.touch(at),
                None => {
                    self.make_room(bus, probe)?;
                    let bytes = [0; LINE as usize];
                    self.add(Line { number, bytes, known: [from, to], fetched: false })
                }
            };
            let line = line.ok_or(BuildError::Internal)?;
            line.bytes[from as usize..to as usize].copy_from_slice(&record[part]);
            line.known = [line.known[0].min(from), line.known[1].max(to)];
        }
        Ok(())
    }

    /// Reads a record, from memory where it is not held.
    ///
    /// # Errors
    /// [`BuildError::Bus`], or [`BuildError::Internal`] for a record outside the region.
    pub fn get<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        offset: u32,
        record: &mut [u8],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.region.at(offset, record.len() as u32).ok_or(BuildError::Internal)?;
        for (number, [from, to], part) in parts(offset, record.len()) {
            let knows = |line: &Line| line.known[0] <= from && to <= line.known[1];
            if let Some(at) = self.find(number)
                && !knows(&self.lines[at])
            {
                self.evict(bus, at, probe)?;
            }
            let line = match self.find(number) {
                Some(at) => self.touch(at),
                None => {
                    self.make_room(bus, probe)?;
                    let line = self.fetch(bus, number, probe)?;
                    self.add(line)
                }
            };
            let line = line.ok_or(BuildError::Internal)?;
            record[part].copy_from_slice(&line.bytes[from as usize..to as usize]);
        }
        Ok(())
    }

    /// Writes back the lines of a record, so that the next access reads them from memory.
    ///
    /// # Errors
    /// [`BuildError::Bus`].
    pub fn release<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        offset: u32,
        len: usize,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        for (number, ..) in parts(offset, len) {
            if let Some(at) = self.find(number) {
                self.evict(bus, at, probe)?;
            }
        }
        Ok(())
    }

    /// Writes back all lines.
    ///
    /// # Errors
    /// [`BuildError::Bus`].
    pub fn flush<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        while !self.lines.is_empty() {
            self.evict(bus, 0, probe)?;
        }
        Ok(())
    }

    #[inline]
    fn find(&self, number: u32) -> Option<usize> {
        self.lines.iter().rposition(|line| line.number == number)
    }

    /// Makes a line the most recently used one.
    #[inline]
    fn touch(&mut self, at: usize) -> Option<&mut Line> {
        if at + 1 < self.lines.len() {
            self.lines[at..].rotate_left(1);
        }
        self.lines.last_mut()
    }

    fn add(&mut self, line: Line) -> Option<&mut Line> {
        self.lines.push(line).ok()?;
        self.lines.last_mut()
    }

    fn make_room<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        if self.lines.len() < self.capacity { Ok(()) } else { self.evict(bus, 0, probe) }
    }

    fn fetch<B: Bus, P: Probe>(
        &self,
        bus: &mut B,
        number: u32,
        probe: &mut P,
    ) -> Result<Line, BuildError<B::Error>> {
        probe.stage(Stage::Compress);
        let start = number * LINE;
        let len = LINE.min(self.region.size.saturating_sub(start));
        let addr = self.region.at(start, len).ok_or(BuildError::Internal)?;
        let mut bytes = [0; LINE as usize];
        let failed = |error| BuildError::Bus { stage: Stage::Compress, addr, error };
        bus.read(addr, &mut bytes[..len as usize]).map_err(failed)?;
        Ok(Line { number, bytes, known: [0, len], fetched: true })
    }

    /// Writes a line back and drops it.
    fn evict<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        at: usize,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let Some(line) = self.lines.get(at) else { return Ok(()) };
        let [from, to] = line.known;
        let addr = self.region.at(line.number * LINE + from, to - from);
        let addr = addr.ok_or(BuildError::Internal)?;
        let stage = if line.fetched { Stage::Compress } else { self.stage };
        probe.stage(stage);
        let failed = |error| BuildError::Bus { stage, addr, error };
        bus.write(addr, &line.bytes[from as usize..to as usize]).map_err(failed)?;
        self.lines.remove(at);
        Ok(())
    }
}

/// The parts of a record by line: the line, which bytes of it, which bytes of the record.
#[inline]
fn parts(
    offset: u32,
    len: usize,
) -> impl Iterator<Item = (u32, [u32; 2], core::ops::Range<usize>)> {
    let end = offset.saturating_add(len as u32);
    let first = offset / LINE;
    let last = if len == 0 { first } else { (end - 1) / LINE + 1 };
    (first..last).map(move |number| {
        let start = number * LINE;
        let (from, to) = (offset.max(start), end.min(start + LINE));
        let part = (from - offset) as usize..(to - offset) as usize;
        (number, [from - start, to - start], part)
    })
}
