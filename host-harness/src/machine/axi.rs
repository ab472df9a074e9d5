//! Cycle model of the road from a machine's line port to memory behind AXI4, RTL unit `xy_port`, with a bus as
//! wide as a line.
//!
//! | Property | Value |
//! |---|---|
//! | Latency | 1 cycle out, through a queue of 2 requests in each direction, 0 back |
//! | Throughput | a line a cycle in each direction, while memory takes what is offered |
//! | Reads | 16 may be under way; their rows in its table are given out in turn, as memory takes them |
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

/// Requests on their way out.
#[derive(Debug, Default)]
struct Channel {
    /// The first one is the one that memory may be offered.
    queue: VecDeque<Access>,
    /// Whether memory was offered it and has not taken it.
    offered: bool,
    /// Whether memory takes it in this cycle.
    taken: bool,
    /// What is queued from the next cycle on.
    next: Option<Access>,
}

impl Channel {
    /// Requests that have room.
    const ROOM: usize = 2;

    fn has_room(&self) -> bool {
        self.queue.len() < Self::ROOM
    }

    /// Ends the cycle.
    fn tick(&mut self) {
        if self.taken {
            self.queue.pop_front();
        }
        self.taken = false;
        self.queue.extend(self.next.take());
    }

    /// Offers memory an access, which is the first one.
    fn offer<P: Port>(&mut self, memory: &mut P, access: Access) {
        self.taken = memory.offer(access);
        self.offered = !self.taken;
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
        let reads = self.rows.iter().any(Option::is_some) || !self.read.queue.is_empty();
        self.unanswered.is_empty() && !reads
    }

    /// A line that is under way: of those that are read, if there is one.
    pub fn waits_for(&self) -> Option<u32> {
        let read = self.rows.iter().flatten().next().or(self.read.queue.front());
        read.map(|access| access.addr).or_else(|| self.unanswered.front().copied())
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
        let taken = self.read.has_room();
        if taken {
            self.read.next = Some(access);
            self.lines_read += 1;
        }
        taken
    }

    fn offer_write(&mut self, access: Access) -> bool {
        let taken = self.write.has_room() && self.unanswered.len() < LINES;
        if taken {
            self.write.next = Some(access);
        }
        taken
    }

    /// Offers memory the first read, if a row is free for it and its line is not being written; what was
    /// offered stays.
    fn send_read(&mut self) {
        let Some(&access) = self.read.queue.front() else { return };
        let pending = self.unanswered.contains(&access.addr) && !self.read.offered;
        if pending || self.rows[self.next_row].is_some() {
            return;
        }
        self.read.offer(&mut self.memory, Access { tag: self.next_row as u32, ..access });
        if self.read.taken {
            self.rows[self.next_row] = Some(access);
            self.next_row = (self.next_row + 1) % LINES;
        }
    }

    /// Offers memory the first write.
    fn send_write(&mut self) {
        if let Some(&access) = self.write.queue.front() {
            self.write.offer(&mut self.memory, access);
        }
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
        let sent = self.read.taken || self.write.taken;
        let moved = sent || self.leaving.is_some() || self.responds;
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
        self.send_read();
        self.send_write();
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
        // Sixteen have rows, two are queued. A row is free again 41 cycles after memory took its read, and the
        // cycle after that there is room in the queue.
        let expected: Vec<u32> = (0..18).chain(43..59).chain(84..100).collect();
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
    fn a_read_waits_for_the_writes_of_its_line_alone() {
        for (line, answered) in [(64, 5), (128, 4)] {
            let mut port = AxiPort::new(IdealPort::new(1));
            for addr in [0, 64] {
                assert!(port.offer(write(addr)));
                port.tick();
            }
            assert!(port.offer(read(line)));
            while port.take().is_none_or(|response| response.access.write) {
                port.tick();
            }
            assert_eq!(port.cycles(), answered, "line {line}");
        }
    }

    #[test]
    fn what_was_written_can_be_read_back_three_cycles_later() {
        let mut port = AxiPort::new(IdealPort::new(1));
        assert!(port.offer(write(64)));
        for _ in 0..3 {
            port.tick();
            assert!(port.cycles() == 3 || !port.is_quiet());
        }
        assert!(port.is_quiet() && port.is_idle());
    }
}
