//! A memory port that goes wrong on purpose.

use std::collections::VecDeque;

use super::port::{Access, Port, Response};
use crate::dram;

/// What goes wrong. Accesses are counted from 0, reads and writes apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// This read is answered with an error.
    FailRead(u64),
    /// This write is answered with an error.
    FailWrite(u64),
    /// This read is never answered.
    LoseRead(u64),
    /// From this read on, no access is taken any more.
    Refuse(u64),
    /// Every answer comes this many cycles late.
    Delay(u64),
}

/// A port with one fault in front of it.
#[derive(Debug)]
pub struct FaultyPort<P> {
    port: P,
    fault: Fault,
    reads: u64,
    writes: u64,
    now: u64,
    victim: Option<Access>,
    failures: VecDeque<Access>,
    late: VecDeque<(u64, Response)>,
}

impl<P: Port> FaultyPort<P> {
    /// Puts `fault` in front of `port`.
    pub fn new(port: P, fault: Fault) -> Self {
        Self {
            port,
            fault,
            reads: 0,
            writes: 0,
            now: 0,
            victim: None,
            failures: VecDeque::new(),
            late: VecDeque::new(),
        }
    }
}

impl<P: Port> Port for FaultyPort<P> {
    fn offer(&mut self, access: Access) -> bool {
        if let Fault::Refuse(from) = self.fault
            && self.reads >= from
        {
            return false;
        }
        if !self.port.offer(access) {
            return false;
        }
        let count = if access.write { &mut self.writes } else { &mut self.reads };
        let number = std::mem::replace(count, *count + 1);
        match self.fault {
            Fault::FailWrite(at) if access.write && number == at => self.failures.push_back(access),
            Fault::FailRead(at) | Fault::LoseRead(at) if !access.write && number == at => {
                self.victim = Some(access);
            }
            _ => {}
        }
        true
    }

    fn take(&mut self) -> Option<Response> {
        if let Some(access) = self.failures.pop_front() {
            return Some(Response { access, failed: true });
        }
        if let Fault::Delay(by) = self.fault {
            let due = self.now + by;
            self.late.extend(self.port.take().map(|response| (due, response)));
            let &(due, response) = self.late.front()?;
            return (due <= self.now).then(|| {
                self.late.pop_front();
                response
            });
        }
        let response = self.port.take()?;
        if self.victim != Some(response.access) {
            return Some(response);
        }
        self.victim = None;
        match self.fault {
            Fault::FailRead(_) => Some(Response { failed: true, ..response }),
            _ => None,
        }
    }

    fn tick(&mut self) {
        self.now += 1;
        self.port.tick();
    }

    fn is_quiet(&self) -> bool {
        self.port.is_quiet()
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        self.port.peak_bytes_per_cycle()
    }

    fn dram(&self) -> Option<(&dram::Memory, u64)> {
        self.port.dram()
    }
}
