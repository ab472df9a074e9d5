//! Cycle model of the road from a machine's line port to memory behind AXI4, RTL unit `xy_port`, with a bus as
//! wide as a line.
//!
//! | Property | Value |
//! |---|---|
//! | Latency | 1 cycle out, in which a request is held on its channel, 0 back |
//! | Throughput | a line a cycle in each direction, while memory takes what is held |
//! | Reads | 16 may be under way; their rows in its table are given out in turn |
//! | Writes | 16 may wait for their responses, which memory gives in the cycle after it took the line |

use std::collections::VecDeque;

use super::port::{Access, Port, Response};
use crate::dram;

/// Lines that may be under way in each direction: 2 to the width of an AXI ID.
pub const LINES: usize = 16;

/// A port of the machine in front of memory, which is a port in turn.
#[derive(Debug)]
pub struct AxiPort<P> {
    memory: P,
    read: Channel,
    write: Channel,
    /// Reads under way, in the rows that they were given.
    rows: [Option<Access>; LINES],
    /// The row whose turn is next.
    next_row: usize,
    /// The row that is free from the next cycle on.
    leaving: Option<usize>,
    /// What memory has given and the machine has not had, one a cycle.
    answers: VecDeque<Response>,
    /// Lines written that have no response. They must not be read, as AXI does not order reads after writes.
    unanswered: VecDeque<u32>,
    /// Whether memory gives the response to the first of them in this cycle.
    responds: bool,
    /// Cycles in a row in which something was under way and nothing moved.
    waited: u64,
    cycles: u64,
    lines_read: u64,
}

/// A request on its way out.
#[derive(Debug, Default)]
struct Channel {
    /// What memory is offered in this cycle.
    held: Option<Access>,
    /// Whether memory takes it.
    taken: bool,
    /// What is held from the next cycle on.
    next: Option<Access>,
}

impl Channel {
    fn is_free(&self) -> bool {
        self.held.is_none() || self.taken
    }

    /// Ends the cycle.
    fn tick(&mut self) {
        if self.is_free() {
            self.held = self.next.take();
        }
        self.taken = false;
    }

    /// Offers memory what is held.
    fn offer<P: Port>(&mut self, memory: &mut P) {
        self.taken = self.held.is_some_and(|access| memory.offer(access));
    }
}

impl<P: Port> AxiPort<P> {
    /// An idle port in front of `memory`.
    pub fn new(memory: P) -> Self {
        Self {
            memory,
            read: Channel::default(),
            write: Channel::default(),
            rows: [None; LINES],
            next_row: 0,
            leaving: None,
            answers: VecDeque::new(),
            unanswered: VecDeque::new(),
            responds: false,
            waited: 0,
            cycles: 0,
            lines_read: 0,
        }
    }

    /// Whether nothing is under way in either direction.
    pub fn is_idle(&self) -> bool {
        self.unanswered.is_empty() && self.rows.iter().all(Option::is_none)
    }

    /// A line that is under way: of those that are read, if there is one.
    pub fn waits_for(&self) -> Option<u32> {
        let read = self.rows.iter().flatten().next().map(|access| access.addr);
        read.or_else(|| self.unanswered.front().copied())
    }

    /// Counts what [`Port::waited`] tells from 0 on, as the control does where its state changes.
    pub fn forget_time(&mut self) {
        self.waited = 0;
    }

    /// Cycles that it has run.
    pub fn cycles(&self) -> u64 {
        self.cycles
    }

    /// Lines that it was asked to read.
    pub fn lines_read(&self) -> u64 {
        self.lines_read
    }

    fn offer_read(&mut self, access: Access) -> bool {
        let pending = self.unanswered.contains(&access.addr);
        let taken = !pending && self.rows[self.next_row].is_none() && self.read.is_free();
        if taken {
            self.rows[self.next_row] = Some(access);
            self.read.next = Some(Access { tag: self.next_row as u32, ..access });
            self.next_row = (self.next_row + 1) % LINES;
            self.lines_read += 1;
        }
        taken
    }

    fn offer_write(&mut self, access: Access) -> bool {
        let taken = self.write.is_free() && self.unanswered.len() < LINES;
        if taken {
            self.write.next = Some(access);
        }
        taken
    }
}

impl<P: Port> Port for AxiPort<P> {
    fn offer(&mut self, access: Access) -> bool {
        if access.write { self.offer_write(access) } else { self.offer_read(access) }
    }

    fn take(&mut self) -> Option<Response> {
        let Response { access, failed } = self.answers.pop_front()?;
        if access.write {
            return Some(Response { access, failed });
        }
        let row = access.tag as usize;
        self.leaving = Some(row);
        Some(Response { access: self.rows.get(row).copied().flatten()?, failed })
    }

    fn tick(&mut self) {
        let taken = self.read.next.is_some() || self.write.next.is_some();
        let sent = self.read.taken || self.write.taken;
        let moved = taken || sent || self.leaving.is_some() || self.responds;
        self.waited = if moved || self.is_idle() { 0 } else { self.waited + 1 };
        if let Some(row) = self.leaving.take() {
            self.rows[row] = None;
        }
        self.unanswered.extend(self.write.next.map(|access| access.addr));
        if self.responds {
            self.unanswered.pop_front();
        }
        self.responds = self.write.taken;
        self.read.tick();
        self.write.tick();
        self.memory.tick();
        self.cycles += 1;
        // What memory does in the next cycle depends on nothing that the machine does in it.
        while let Some(response) = self.memory.take() {
            self.answers.push_back(response);
        }
        self.read.offer(&mut self.memory);
        self.write.offer(&mut self.memory);
    }

    fn is_quiet(&self) -> bool {
        self.unanswered.is_empty()
    }

    fn waited(&self) -> Option<u64> {
        Some(self.waited)
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        self.memory.peak_bytes_per_cycle()
    }

    fn dram(&self) -> Option<(&dram::Memory, u64)> {
        self.memory.dram()
    }
}

#[cfg(test)]
mod tests {
    use super::super::port::IdealPort;
    use super::*;

    fn read(addr: u32) -> Access {
        Access { addr, write: false, tag: 7 }
    }

    fn write(addr: u32) -> Access {
        Access { addr, write: true, tag: 0 }
    }

    #[test]
    fn a_read_takes_a_cycle_more_than_memory_and_keeps_its_tag() {
        let mut port = AxiPort::new(IdealPort::new(5));
        assert!(port.offer(read(64)));
        for _ in 0..6 {
            assert_eq!(port.take(), None);
            assert!(!port.is_idle() || port.cycles() == 0);
            port.tick();
        }
        assert_eq!(port.take(), Some(Response { access: read(64), failed: false }));
        port.tick();
        assert!(port.is_idle());
    }

    #[test]
    fn no_more_than_sixteen_lines_are_under_way() {
        let mut port = AxiPort::new(IdealPort::new(40));
        let mut taken = Vec::new();
        for cycle in 0..100 {
            port.take();
            if port.offer(read(64 * cycle)) {
                taken.push(cycle);
            }
            port.tick();
        }
        // A row is free again 42 cycles after it was given out: out, there and back, freed.
        let expected: Vec<u32> = (0..100).filter(|cycle| cycle % 42 < 16).collect();
        assert_eq!(taken, expected);
    }

    #[test]
    fn time_is_counted_while_memory_owes_something_and_nothing_moves() {
        let mut port = AxiPort::new(IdealPort::new(5));
        let mut waited = |offered: Option<Access>| {
            let waited = port.waited();
            assert!(offered.is_none_or(|access| port.offer(access)));
            port.take();
            port.tick();
            waited.unwrap()
        };
        assert!((0..9).all(|_| waited(None) == 0), "nothing is under way");
        // Out in a cycle, taken in the next, there in five more.
        assert_eq!(waited(Some(read(64))), 0);
        let times: Vec<u64> = (0..9).map(|_| waited(None)).collect();
        assert_eq!(times, [0, 0, 1, 2, 3, 4, 0, 0, 0]);
    }

    #[test]
    fn what_was_written_can_be_read_back_three_cycles_later() {
        let mut port = AxiPort::new(IdealPort::new(1));
        for addr in [0, 64] {
            assert!(port.offer(write(addr)));
            port.tick();
        }
        for _ in 0..2 {
            assert!(!port.is_quiet() && !port.offer(read(64)));
            port.tick();
        }
        assert!(port.is_quiet() && port.is_idle() && port.offer(read(64)));
    }
}
