//! A machine's memory port: one line of 64 bytes a cycle in each direction.

use crate::dram;

/// Bytes of a line.
pub const LINE_BYTES: u32 = 64;

/// One access to a line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Access {
    /// First byte, a multiple of [`LINE_BYTES`].
    pub addr: u32,
    /// Whether it writes.
    pub write: bool,
    /// What a read's response carries back.
    pub tag: u32,
}

/// What came back from memory. Writes are posted: only those that fail are heard of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Response {
    /// The access.
    pub access: Access,
    /// Whether it failed.
    pub failed: bool,
}

/// What a memory port reports.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum PortError {
    /// A read was answered with an error.
    #[error("memory answered a read with an error")]
    Read,
    /// A write was answered with an error.
    #[error("memory answered a write with an error")]
    Write,
    /// Nothing moved for the machine's time-out.
    #[error("memory did not answer in time")]
    TimeOut,
}

/// The memory at the other end of a port, clocked by the machine.
pub trait Port {
    /// Offers an access; `false` if it is not taken in this cycle. At most one read and one write a
    /// cycle are offered and taken.
    fn offer(&mut self, access: Access) -> bool;
    /// The next response that has arrived; at most one a cycle is asked for.
    fn take(&mut self) -> Option<Response>;
    /// Runs one cycle of the machine's clock.
    fn tick(&mut self);
    /// Whether every line written so far can be read back. Memory that is there when it takes a line always
    /// says so.
    fn is_quiet(&self) -> bool {
        true
    }
    /// The cycles up to this one in which something was under way and nothing moved, where the port counts them.
    fn waited(&self) -> Option<u64> {
        None
    }
    /// The most bytes that the memory moves in a machine cycle, or `None` without a bound.
    fn peak_bytes_per_cycle(&self) -> Option<f64>;
    /// The device behind the port, where there is one to ask for its statistics.
    fn dram(&self) -> Option<(&dram::Memory, u64)> {
        None
    }
}

impl<P: Port + ?Sized> Port for Box<P> {
    fn offer(&mut self, access: Access) -> bool {
        (**self).offer(access)
    }

    fn take(&mut self) -> Option<Response> {
        (**self).take()
    }

    fn tick(&mut self) {
        (**self).tick();
    }

    fn is_quiet(&self) -> bool {
        (**self).is_quiet()
    }

    fn waited(&self) -> Option<u64> {
        (**self).waited()
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        (**self).peak_bytes_per_cycle()
    }

    fn dram(&self) -> Option<(&dram::Memory, u64)> {
        (**self).dram()
    }
}

/// Memory that takes every access and answers reads a fixed number of cycles later.
#[derive(Clone, Debug)]
pub struct IdealPort {
    latency: u64,
    now: u64,
    flying: std::collections::VecDeque<(u64, Access)>,
}

impl IdealPort {
    /// A memory that answers after `latency` cycles, at least 1.
    pub fn new(latency: u32) -> Self {
        Self { latency: u64::from(latency.max(1)), now: 0, flying: Default::default() }
    }
}

impl Port for IdealPort {
    fn offer(&mut self, access: Access) -> bool {
        if !access.write {
            self.flying.push_back((self.now + self.latency, access));
        }
        true
    }

    fn take(&mut self) -> Option<Response> {
        let &(at, access) = self.flying.front()?;
        (at <= self.now).then(|| {
            self.flying.pop_front();
            Response { access, failed: false }
        })
    }

    fn tick(&mut self) {
        self.now += 1;
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        None
    }
}

/// The DRAM model behind a clock crossing: memory clocks that fall into a machine cycle are run at
/// its end. The crossing itself is taken to cost nothing.
#[derive(Debug)]
pub struct DramPort {
    memory: dram::Memory,
    machine_khz: u64,
    memory_khz: u64,
    phase: u64,
    now: u64,
}

impl DramPort {
    /// A port of a machine clocked at `machine_mhz`.
    pub fn new(config: &dram::Config, machine_mhz: u32) -> Self {
        Self {
            memory: dram::Memory::new(config),
            machine_khz: 1000 * u64::from(machine_mhz.max(1)),
            memory_khz: (1000.0 * config.clock_mhz()).round() as u64,
            phase: 0,
            now: 0,
        }
    }
}

impl Port for DramPort {
    fn offer(&mut self, access: Access) -> bool {
        // The tag brings the whole access back.
        let tag = u64::from(access.tag) << 32 | u64::from(access.addr);
        let request = dram::Request { addr: u64::from(access.addr), write: access.write, tag };
        self.memory.offer(request, self.now)
    }

    fn take(&mut self) -> Option<Response> {
        let tag = self.memory.take_done()?;
        let access = Access { addr: tag as u32, write: false, tag: (tag >> 32) as u32 };
        Some(Response { access, failed: false })
    }

    fn tick(&mut self) {
        self.phase += self.memory_khz;
        while self.phase >= self.machine_khz {
            self.phase -= self.machine_khz;
            self.memory.tick(self.now);
            self.now += 1;
        }
    }

    fn peak_bytes_per_cycle(&self) -> Option<f64> {
        let config = self.memory.config();
        Some(config.peak_gb_per_s() * 1e6 / self.machine_khz as f64)
    }

    fn dram(&self) -> Option<(&dram::Memory, u64)> {
        Some((&self.memory, self.now))
    }
}
