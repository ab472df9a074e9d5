//! Memory as a job meets it: with an end, and perhaps a fault.

use std::collections::VecDeque;

use super::Site;
use crate::machine::fault::{Fault, FaultyPort};
use crate::machine::port::{Access, IdealPort, Port, Response};

/// A port that answers what lies outside of memory with errors.
#[derive(Debug)]
pub struct MemoryPort {
    port: FaultyPort<IdealPort>,
    size: usize,
    refused: VecDeque<Access>,
}

impl MemoryPort {
    /// The port of a site.
    pub fn new(site: Site<'_>) -> Self {
        let fault = site.fault.unwrap_or(Fault::Delay(0));
        Self {
            port: FaultyPort::new(IdealPort::new(site.latency), fault),
            size: site.memory.bytes().len(),
            refused: VecDeque::new(),
        }
    }

    fn is_outside(&self, access: &Access) -> bool {
        access.addr as usize >= self.size
    }
}

impl Port for MemoryPort {
    fn offer(&mut self, access: Access) -> bool {
        let taken = self.port.offer(access);
        if taken && access.write && self.is_outside(&access) {
            self.refused.push_back(access);
        }
        taken
    }

    fn take(&mut self) -> Option<Response> {
        if let Some(access) = self.refused.pop_front() {
            return Some(Response { access, failed: true });
        }
        let Response { access, failed } = self.port.take()?;
        Some(Response { access, failed: failed || self.is_outside(&access) })
    }

    fn tick(&mut self) {
        self.port.tick();
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        self.port.peak_bytes_per_cycle()
    }
}
