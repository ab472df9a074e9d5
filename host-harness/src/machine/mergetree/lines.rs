//! The machine's side of its memory port: who asks for which line, and what comes back.

use std::collections::VecDeque;

use xylem_core::error::BuildError;
use xylem_core::mem::ByteAddr;

use super::super::activity::Unit;
use super::super::port::{Access, LINE_BYTES, Port, PortError, Response};
use super::super::tail;
use super::super::writer::Writer;
use super::control::Machine;

/// What the port's read tags say: where a line goes.
const FOR_READER: u32 = u32::MAX;
const FOR_TAIL: u32 = u32::MAX - 1;

/// Who reads in a cycle.
#[derive(Clone, Copy)]
pub(super) enum Reads {
    /// The primitive reader.
    Input,
    /// The multi-merge, and what comes after it where nodes are repaired.
    Runs,
    /// What comes after it.
    Tail,
}

/// The lines under way.
#[derive(Debug, Default)]
pub(super) struct Lines {
    /// Bytes asked for of the burst that the merge wants first.
    asked: u32,
    /// Lines asked for that have not come, oldest first.
    outstanding: VecDeque<Access>,
    /// Which of the write ports is served.
    turn: usize,
    /// Whether its turn is not over: the line that it offered, or the last of its burst, is not taken.
    kept: bool,
}

impl<P: Port> Machine<'_, P> {
    /// The rest of a cycle: the memory port, and time.
    pub(super) fn cycle(&mut self, reads: Reads) -> Result<(), BuildError<PortError>> {
        if let Some(Response { access, failed }) = self.port.take() {
            self.respond(access, failed)?;
        }
        match reads {
            Reads::Input => self.read_input(),
            // A repair holds the emitter up, so it goes first, even between the lines of a burst.
            Reads::Runs if self.tail.read().is_some() => self.read_for_tail(),
            Reads::Runs => self.read_bursts(),
            Reads::Tail => self.read_for_tail(),
        }
        self.write();
        self.reader.tick();
        self.merge.tick_requests();
        self.tail.end_cycle(self.image)?;
        if let Some(writer) = &mut self.runs {
            writer.tick(self.image);
        }
        self.port.tick();
        self.activity.tick();
        self.now += 1;
        let limit = self.config.time_out;
        let moved_at = self.moved_at;
        // A port that keeps the time itself says so in the cycle that is the last.
        if self.port.waited().map_or(self.now - moved_at > limit, |waited| waited >= limit) {
            let waiting = self.lines.outstanding.front().copied().or_else(|| self.wanted());
            let addr = ByteAddr(waiting.map_or(0, |access| access.addr));
            let (stage, error) = (self.stage, PortError::TimeOut);
            return Err(BuildError::Bus { stage, addr, error });
        }
        Ok(())
    }

    /// The access that the port has not taken, if there is one.
    fn wanted(&self) -> Option<Access> {
        let read = |addr| Access { addr, write: false, tag: 0 };
        let write = (0..=tail::PORTS).find_map(|port| self.write_offer(port));
        let burst = self.merge.request().map(|request| read(request.addr + self.lines.asked));
        let tail = || self.tail.read().map(read);
        burst.or(write).or_else(|| self.reader.offer().map(read)).or_else(tail)
    }

    fn respond(&mut self, access: Access, failed: bool) -> Result<(), BuildError<PortError>> {
        self.moved_at = self.now;
        if failed {
            let error = if access.write { PortError::Write } else { PortError::Read };
            return Err(BuildError::Bus { stage: self.stage, addr: ByteAddr(access.addr), error });
        }
        // Nearly always the oldest.
        if let Some(at) = self.lines.outstanding.iter().position(|other| *other == access) {
            self.lines.outstanding.remove(at);
        }
        match access.tag {
            FOR_READER => self.reader.arrive(access.addr),
            FOR_TAIL => self.tail.arrive(access.addr),
            buffer => self.merge.arrive(buffer, self.image),
        }
        Ok(())
    }

    fn read_input(&mut self) {
        if let Some(addr) = self.reader.offer()
            && self.ask(Access { addr, write: false, tag: FOR_READER })
        {
            self.reader.taken();
        }
    }

    fn read_bursts(&mut self) {
        let Some(request) = self.merge.request() else { return };
        let access =
            Access { addr: request.addr + self.lines.asked, write: false, tag: request.buffer };
        if self.ask(access) {
            self.lines.asked += LINE_BYTES;
        }
        if self.lines.asked >= request.bytes {
            self.merge.requested();
            self.lines.asked = 0;
        }
    }

    fn read_for_tail(&mut self) {
        if let Some(addr) = self.tail.read()
            && self.ask(Access { addr, write: false, tag: FOR_TAIL })
        {
            self.tail.read_taken(addr);
        }
    }

    fn ask(&mut self, access: Access) -> bool {
        let taken = self.port.offer(access);
        if taken {
            self.lines.outstanding.push_back(access);
            self.activity.add(Unit::ReadPort, 1000);
            self.moved_at = self.now;
        }
        taken
    }

    /// The line that a write port offers: first that of runs, then those of the tail.
    fn write_offer(&self, port: usize) -> Option<Access> {
        match port.checked_sub(1) {
            None => self.runs.as_ref()?.offer(),
            Some(port) => self.tail.offer(port),
        }
    }

    fn in_burst(&self, port: usize) -> bool {
        match port.checked_sub(1) {
            None => self.runs.as_ref().is_some_and(Writer::in_burst),
            Some(port) => self.tail.in_burst(port),
        }
    }

    /// Offers a line of one write port, as the RTL unit `xy_write_arbiter` does. A burst keeps its turn until
    /// its last line is taken.
    fn write(&mut self) {
        const PORTS: usize = tail::PORTS + 1;
        if !self.lines.kept {
            let wants = |port: &usize| self.write_offer(*port).is_some();
            let Some(next) = (1..=PORTS).map(|i| (self.lines.turn + i) % PORTS).find(wants) else {
                return;
            };
            self.lines.turn = next;
        }
        let Some(access) = self.write_offer(self.lines.turn) else { return };
        self.lines.kept = true;
        if self.port.offer(access) {
            match self.lines.turn.checked_sub(1) {
                None => self.runs.iter_mut().for_each(Writer::taken),
                Some(port) => self.tail.taken(port),
            }
            self.lines.kept = self.in_burst(self.lines.turn);
            self.activity.add(Unit::WritePort, 1000);
            self.moved_at = self.now;
        }
    }
}
