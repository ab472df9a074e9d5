//! Playing a [tape](super::tape) on the clock.

use std::collections::VecDeque;

use xylem_core::probe::Stage;

use super::port::{Access, LINE_BYTES};
use super::tape::Event;

/// Plays a tape on the clock.
#[derive(Debug)]
pub struct Player {
    /// What is left of the tape.
    pub events: VecDeque<Event>,
    busy: u64,
    /// Bursts on their way out, first byte to send next and end.
    writes: VecDeque<(u32, u32)>,
    /// Lines that reads ahead may ask for.
    room: u32,
    /// Lines asked for that have not come, and whether they have: from the front read on.
    asked: VecDeque<(u32, bool)>,
}

/// Bursts that wait in the write ports: one of nodes, one of leaf table entries, one of a list.
const WRITE_BURSTS: usize = 3;

impl Player {
    /// A player that reads `room` lines ahead.
    pub fn new(room: u32) -> Self {
        let (events, writes, asked) = Default::default();
        Self { events, busy: 0, writes, room, asked }
    }

    /// Whether everything has been played and sent.
    pub fn is_done(&self) -> bool {
        self.is_idle() && self.writes.is_empty()
    }

    /// Whether everything has been played.
    pub fn is_idle(&self) -> bool {
        self.events.is_empty() && self.busy == 0
    }

    /// Runs one cycle; tells whether a unit worked, and which stage began.
    pub fn tick(&mut self) -> (bool, Option<Stage>) {
        let mut stage = None;
        while self.busy == 0 {
            match self.events.front().copied() {
                Some(Event::Work(cycles)) => self.busy = cycles,
                Some(Event::Write { addr, bytes }) if self.writes.len() < WRITE_BURSTS => {
                    self.writes.push_back((addr / LINE_BYTES * LINE_BYTES, addr + bytes));
                }
                Some(Event::Read { addr, bytes }) if self.has(addr, bytes) => {}
                Some(Event::Barrier) if self.writes.is_empty() => {}
                Some(Event::Stage(next)) => stage = Some(next),
                _ => return (false, stage),
            }
            self.events.pop_front();
        }
        self.busy -= 1;
        (true, stage)
    }

    /// Takes the lines of a burst, if all have come.
    fn has(&mut self, addr: u32, bytes: u32) -> bool {
        let lines = lines(addr, bytes).len();
        let here = self.asked.len() >= lines && self.asked.iter().take(lines).all(|line| line.1);
        if here {
            self.asked.drain(..lines);
        }
        here
    }

    /// The line to read next.
    pub fn read(&self) -> Option<u32> {
        if self.asked.len() >= self.room as usize {
            return None;
        }
        let ahead = self.events.iter().take_while(|event| **event != Event::Barrier);
        let reads = ahead.filter_map(|event| match *event {
            Event::Read { addr, bytes } => Some(lines(addr, bytes)),
            _ => None,
        });
        reads.flatten().nth(self.asked.len()).map(|line| line * LINE_BYTES)
    }

    /// The line offered to read was taken.
    pub fn read_taken(&mut self, addr: u32) {
        self.asked.push_back((addr, false));
    }

    /// A line has come.
    pub fn arrive(&mut self, addr: u32) {
        if let Some(line) = self.asked.iter_mut().find(|line| **line == (addr, false)) {
            line.1 = true;
        }
    }

    /// The line to write next.
    pub fn write(&self) -> Option<Access> {
        self.writes.front().map(|&(addr, _)| Access { addr, write: true, tag: 0 })
    }

    /// The line offered to write was taken.
    pub fn write_taken(&mut self) {
        if let Some((addr, end)) = self.writes.front_mut() {
            *addr += LINE_BYTES;
            if *addr >= *end {
                self.writes.pop_front();
            }
        }
    }
}

/// The lines that a burst touches.
fn lines(addr: u32, bytes: u32) -> std::ops::Range<u32> {
    addr / LINE_BYTES..(addr + bytes).div_ceil(LINE_BYTES)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays until done, with a memory that answers after `latency` cycles; gives the cycles.
    fn play(events: &[Event], room: u32, latency: u64) -> u64 {
        let mut player = Player::new(room);
        player.events = events.iter().copied().collect();
        let mut flying = VecDeque::new();
        for now in 0..10_000 {
            if player.is_done() {
                return now;
            }
            while flying.front().is_some_and(|&(at, _)| at <= now) {
                player.arrive(flying.pop_front().unwrap().1);
            }
            player.tick();
            if let Some(addr) = player.read() {
                player.read_taken(addr);
                flying.push_back((now + latency, addr));
            }
            if player.write().is_some() {
                player.write_taken();
            }
        }
        panic!("the tape does not end");
    }

    #[test]
    fn work_takes_its_cycles_and_writes_go_beside_it() {
        assert_eq!(play(&[Event::Work(10)], 4, 5), 10);
        let write = Event::Write { addr: 0, bytes: 512 };
        assert_eq!(play(&[Event::Work(3), write, Event::Work(9)], 4, 5), 12);
        // Eight lines a burst; the fourth burst waits until the first has left.
        assert_eq!(play(&[write; 5], 4, 5), 5 * 8);
    }

    #[test]
    fn a_read_takes_the_latency_unless_it_was_asked_for_ahead() {
        let read = |addr| Event::Read { addr, bytes: 64 };
        let ahead = [Event::Work(20), read(0), Event::Work(1)];
        assert_eq!(play(&ahead, 4, 10), 21);
        assert_eq!(play(&ahead[1..], 4, 10), 11);
        let in_turn = [read(0), Event::Barrier, read(64), Event::Work(1)];
        assert_eq!(play(&in_turn, 4, 10), 21);
        assert_eq!(play(&[read(0), read(64), Event::Work(1)], 1, 10), 21);
    }
}
