//! The controller of one channel: FR-FCFS with a row-hit cap, as Ramulator 1's.
//!
//! There are three queues of requests: reads, writes, and those for which a row was opened. Each clock
//! issues at most one command. In this order, a clock
//! 1. notes a refresh if one is due;
//! 2. begins to drain writes if more than `drain_above` wait or no read does, or stops if fewer than
//!    `drain_below` are left and a read waits;
//! 3. takes from the requests whose row was opened for them the oldest whose command is legal;
//! 4. failing that, goes on with a refresh that is due: closes all banks, refreshes;
//! 5. failing that, takes from the reads or, while draining, from the writes the oldest whose next
//!    command is legal and whose row has not used up its hits, or else the oldest: a precharge if
//!    another row is open, an activate if none is (which moves the request to the third queue), else
//!    the burst itself.
//!
//! A precharge that is legal while the data bus is busy may so close a row for which hits wait. This is
//! what Ramulator does, and it costs the second activates that its figures show. As there, writes that
//! keep coming faster than they drain hold up reads without end; whoever offers both must bound them.
//!
//! Clocks in which no command can become legal are skipped; the outcome is that of stepping each.

use std::collections::VecDeque;

use super::config::{Config, ControllerConfig};
use super::device::{Address, Device, MAX_BANKS};
use super::memory::Request;
use super::queue::{Queue, RowUses, Waiting};
use super::stats::ChannelStats;
use super::timing::Command;

/// A command on a channel's command bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Issued {
    /// When.
    pub clock: u64,
    /// What.
    pub command: Command,
    /// Where to.
    pub address: Address,
}

/// One channel: a device and the queues before it.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    device: Device,
    config: ControllerConfig,
    banks: u32,
    bursts: u32,
    burst_clocks: u64,
    read_latency: u64,
    refresh_interval: Option<u64>,
    reads: Queue,
    writes: Queue,
    /// Requests for which a row was opened.
    opened: Queue,
    draining: bool,
    /// Whether writes are drained however few they are.
    flushing: bool,
    refreshes_due: u32,
    next_refresh: u64,
    row_uses: RowUses,
    /// Reads on their way back, in order: when their last beat arrives, and their tag.
    returning: VecDeque<(u64, u64)>,
    arrivals: u64,
    /// The next clock at which anything can happen if nothing is offered.
    wake: u64,
    ran_to: u64,
    log: Option<Vec<Issued>>,
}

#[derive(Debug, Clone, Copy)]
enum Source {
    Reads,
    Writes,
    Opened,
}

impl Channel {
    pub fn new(config: &Config) -> Self {
        let timing = &config.timing;
        let refresh_interval = timing.refi.map(|refi| u64::from(refi.max(1)));
        let next_refresh = refresh_interval.unwrap_or(u64::MAX);
        let banks = config.mapping.banks.clamp(1, MAX_BANKS);
        Self {
            device: Device::new(timing, banks),
            config: config.controller,
            banks,
            bursts: config.mapping.bursts(),
            burst_clocks: u64::from(timing.burst),
            read_latency: u64::from(timing.read_latency()),
            refresh_interval,
            reads: Queue::new(config.controller.read_queue, banks),
            writes: Queue::new(config.controller.write_queue, banks),
            opened: Queue::new(banks as usize, banks),
            draining: false,
            flushing: false,
            refreshes_due: 0,
            next_refresh,
            row_uses: RowUses::new(banks, config.controller.row_hit_cap),
            returning: VecDeque::new(),
            arrivals: 0,
            wake: next_refresh,
            ran_to: 0,
            log: None,
        }
    }

    /// Puts a request into its queue after running clock `now`; false if that queue is full.
    pub fn offer(
        &mut self,
        request: Request,
        address: Address,
        now: u64,
        stats: &mut ChannelStats,
    ) -> bool {
        self.run(now, stats);
        let Request { addr, write, tag } = request;
        let source = if write { Source::Writes } else { Source::Reads };
        if self.queue(source).is_full() {
            return false;
        }
        let arrival = self.arrivals;
        self.arrivals += 1;
        self.flushing = false;
        if !write && (self.writes.writes_to(addr) || self.opened.writes_to(addr)) {
            stats.forwarded_reads += 1;
            self.give_back(tag, self.ran_to + 1);
            return true;
        }
        let bursts_left = self.bursts;
        let request = Waiting { addr, write, tag, address, bursts_left, started: false, arrival };
        self.queue_mut(source).insert(request);
        self.wake = self.ran_to + 1;
        true
    }

    /// Drains writes however few they are, until something is offered.
    pub fn flush(&mut self) {
        self.flushing = true;
        self.wake = self.ran_to + 1;
    }

    /// Runs all clocks up to and including `now` that have not been run.
    #[inline]
    pub fn run(&mut self, now: u64, stats: &mut ChannelStats) {
        while self.wake <= now {
            self.step(self.wake, stats);
        }
        self.ran_to = self.ran_to.max(now);
    }

    /// The first clock after `now` at which something can happen; `None` if no request is here.
    pub fn next_event(&self, now: u64) -> Option<u64> {
        let command = self.has_waiting().then_some(self.wake.max(now + 1));
        let data = self.returning.iter().map(|(ready, _)| *ready).find(|ready| *ready > now);
        command.into_iter().chain(data).min()
    }

    pub fn is_idle(&self) -> bool {
        !self.has_waiting() && self.returning.is_empty()
    }

    /// When the next read that comes back is there.
    #[inline]
    pub fn next_done(&self) -> Option<u64> {
        self.returning.front().map(|(ready, _)| *ready)
    }

    pub fn take_done(&mut self) -> Option<u64> {
        self.returning.pop_front().map(|(_, tag)| tag)
    }

    /// Clocks before `clocks` in which a bank was open.
    pub fn active_clocks(&self, clocks: u64) -> u64 {
        self.device.active_clocks(clocks)
    }

    /// Keeps a record of all commands from now on.
    pub fn record(&mut self) {
        self.log.get_or_insert_default();
    }

    pub fn log(&self) -> &[Issued] {
        self.log.as_deref().unwrap_or_default()
    }

    fn has_waiting(&self) -> bool {
        !self.reads.is_empty() || !self.writes.is_empty() || !self.opened.is_empty()
    }

    fn step(&mut self, now: u64, stats: &mut ChannelStats) {
        if let Some(interval) = self.refresh_interval
            && self.next_refresh <= now
        {
            self.refreshes_due += 1;
            self.next_refresh += interval;
        }
        self.draining = self.drains_next();
        let again = match self.serve(Source::Opened, now, stats) {
            Ok(()) => now,
            Err(opened) => {
                let served = match (self.refreshes_due, self.draining) {
                    (0, false) => self.serve(Source::Reads, now, stats),
                    (0, true) => self.serve(Source::Writes, now, stats),
                    _ => self.refresh(now, stats),
                };
                served.map_or_else(|again| again.min(opened), |()| now)
            }
        };
        // Thresholds that overlap change the mode each clock.
        let again = if self.drains_next() == self.draining { again } else { now };
        self.wake = again.min(self.next_refresh).max(now + 1);
    }

    fn drains_next(&self) -> bool {
        let above = if self.flushing { 0 } else { self.config.drain_above };
        match self.draining {
            true => self.writes.len() >= self.config.drain_below || self.reads.is_empty(),
            false => self.writes.len() > above || self.reads.is_empty(),
        }
    }

    /// Brings the oldest refresh on, or says when to try again.
    fn refresh(&mut self, now: u64, stats: &mut ChannelStats) -> Result<(), u64> {
        let command = match self.device.open_banks() {
            0 => Command::Refresh,
            _ => Command::PrechargeAll,
        };
        let earliest = self.device.earliest(command, Address::default());
        if earliest > now {
            return Err(earliest);
        }
        self.issue(command, Address::default(), now, stats)?;
        if command == Command::Refresh {
            self.refreshes_due -= 1;
        }
        Ok(())
    }

    /// Brings a request of a queue on, or says when to try again.
    fn serve(&mut self, source: Source, now: u64, stats: &mut ChannelStats) -> Result<(), u64> {
        let (device, uses) = (&self.device, &self.row_uses);
        let chosen = match source {
            Source::Reads => self.reads.choose(Command::Read, device, uses, now),
            Source::Writes => self.writes.choose(Command::Write, device, uses, now),
            Source::Opened => self.opened.choose_of_few(device, uses, now),
        }?;
        let Some(&request) = self.queue(source).get(chosen) else { return Err(u64::MAX) };
        let command = request.needs(self.device.open_row(request.address.bank));
        self.issue(command, request.address, now, stats)?;
        if !request.started {
            match command {
                Command::Activate => stats.row_misses += 1,
                Command::Precharge => stats.row_conflicts += 1,
                _ => stats.row_hits += 1,
            }
        }

        let queue = self.queue_mut(source);
        match command {
            Command::Activate => {
                if let Some(request) = queue.remove(chosen) {
                    self.opened.insert(Waiting { started: true, ..request });
                }
            }
            Command::Read | Command::Write if request.bursts_left == 1 => {
                queue.remove(chosen);
                if request.write {
                    stats.writes += 1;
                } else {
                    stats.reads += 1;
                    self.give_back(request.tag, now + self.read_latency);
                }
            }
            _ => {
                if let Some(waiting) = queue.get_mut(chosen) {
                    let bursts = u32::from(command != Command::Precharge);
                    waiting.started = true;
                    waiting.bursts_left -= bursts;
                    waiting.address.column += bursts;
                }
            }
        }
        Ok(())
    }

    fn queue(&self, source: Source) -> &Queue {
        match source {
            Source::Reads => &self.reads,
            Source::Writes => &self.writes,
            Source::Opened => &self.opened,
        }
    }

    fn queue_mut(&mut self, source: Source) -> &mut Queue {
        match source {
            Source::Reads => &mut self.reads,
            Source::Writes => &mut self.writes,
            Source::Opened => &mut self.opened,
        }
    }

    /// Issues a command that the rules were asked about. Were the device to refuse it, it would be
    /// tried again each clock, and the request would never be done.
    fn issue(
        &mut self,
        command: Command,
        address: Address,
        now: u64,
        stats: &mut ChannelStats,
    ) -> Result<(), u64> {
        let closed = self.device.issue(command, address, now).map_err(|_| now + 1)?;
        if let Some(log) = &mut self.log {
            log.push(Issued { clock: now, command, address });
        }
        stats.precharges += u64::from(closed);
        match command {
            Command::Activate => {
                stats.activates += 1;
                self.row_uses.reset(address.bank);
                self.queues().into_iter().for_each(|queue| queue.row_opened(address));
            }
            Command::Precharge => {
                self.queues().into_iter().for_each(|queue| queue.row_closed(address.bank));
            }
            Command::PrechargeAll => {
                for bank in 0..self.banks {
                    self.queues().into_iter().for_each(|queue| queue.row_closed(bank));
                }
            }
            Command::Read | Command::Write => {
                let bursts = match command {
                    Command::Read => &mut stats.read_bursts,
                    _ => &mut stats.write_bursts,
                };
                *bursts += 1;
                stats.busy_clocks += self.burst_clocks;
                self.row_uses.count(address.bank);
            }
            Command::Refresh => stats.refreshes += 1,
        }
        Ok(())
    }

    fn queues(&mut self) -> [&mut Queue; 3] {
        [&mut self.reads, &mut self.writes, &mut self.opened]
    }

    /// Data comes back in order, one request a clock at most.
    fn give_back(&mut self, tag: u64, ready: u64) {
        let after = self.returning.back().map_or(0, |(last, _)| last + 1);
        self.returning.push_back((ready.max(after), tag));
    }
}
