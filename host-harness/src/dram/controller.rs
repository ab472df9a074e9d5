//! The controller of one channel: FR-FCFS with a row-hit cap, after Ramulator 1's.
//!
//! Each clock issues at most one command. In this order, a clock
//! 1. puts a refresh into its own queue if one is due, which then has precedence over everything;
//! 2. begins a drain of writes if `drain_from` of them wait or no read does, or ends it if at most
//!    `drain_to` are left and a read waits;
//! 3. takes from the queue that is served (refresh, writes or reads) the oldest request whose next
//!    command is legal now and whose row has not used up its hits, or else simply the oldest;
//! 4. issues that request's next command if it is legal: a precharge if another row is open, an
//!    activate if none is, else the burst itself.
//!
//! A hit thus waits for nothing but the rules, and a precharge that is legal while the data bus is
//! busy may close a row that still has hits waiting. This is what Ramulator does, and it costs the
//! second activates that the reference figures show.
//!
//! Clocks in which no command can become legal are skipped: the result is that of stepping each.

use std::collections::VecDeque;

use super::config::{Config, ControllerConfig};
use super::device::{Address, Device};
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
    bursts: u32,
    burst_clocks: u64,
    read_latency: u64,
    refresh_interval: Option<u64>,
    reads: Vec<Waiting>,
    writes: Vec<Waiting>,
    draining: bool,
    refreshes_due: u32,
    next_refresh: u64,
    /// Bursts that used each bank's open row.
    row_uses: Vec<u32>,
    /// Reads on their way back, in order: when their last beat arrives, and their tag.
    returning: VecDeque<(u64, u64)>,
    /// The next clock at which anything can happen if nothing is offered.
    wake: u64,
    ran_to: u64,
    log: Option<Vec<Issued>>,
}

/// A request in a queue, the oldest first.
#[derive(Debug, Clone, Copy)]
struct Waiting {
    addr: u64,
    tag: u64,
    address: Address,
    bursts_left: u32,
    started: bool,
}

impl Channel {
    pub fn new(config: &Config) -> Self {
        let timing = &config.timing;
        let refresh_interval = timing.refi.map(|refi| u64::from(refi.max(1)));
        Self {
            device: Device::new(timing, config.mapping.banks.max(1)),
            config: config.controller,
            bursts: config.mapping.bursts(),
            burst_clocks: u64::from(timing.burst),
            read_latency: u64::from(timing.read_latency()),
            refresh_interval,
            reads: Vec::with_capacity(config.controller.read_queue),
            writes: Vec::with_capacity(config.controller.write_queue),
            draining: false,
            refreshes_due: 0,
            next_refresh: refresh_interval.unwrap_or(u64::MAX),
            row_uses: vec![0; config.mapping.banks.max(1) as usize],
            returning: VecDeque::new(),
            wake: refresh_interval.unwrap_or(u64::MAX),
            ran_to: 0,
            log: None,
        }
    }

    /// Puts a request into its queue after running clock `now`; false if that queue is full.
    pub fn offer(
        &mut self,
        (addr, write, tag): (u64, bool, u64),
        address: Address,
        now: u64,
        stats: &mut ChannelStats,
    ) -> bool {
        self.run(now, stats);
        let (queue, limit) = match write {
            true => (&mut self.writes, self.config.write_queue),
            false => (&mut self.reads, self.config.read_queue),
        };
        if queue.len() >= limit {
            return false;
        }
        let request = Waiting { addr, tag, address, bursts_left: self.bursts, started: false };
        if !write && self.writes.iter().any(|waiting| waiting.addr == addr) {
            stats.forwarded_reads += 1;
            self.give_back(tag, self.ran_to + 1);
        } else {
            let queue = if write { &mut self.writes } else { &mut self.reads };
            queue.push(request);
            self.wake = self.ran_to + 1;
        }
        true
    }

    /// Runs all clocks up to and including `now` that have not been run.
    #[inline]
    pub fn run(&mut self, now: u64, stats: &mut ChannelStats) {
        while self.wake <= now {
            self.step(self.wake, stats);
        }
        self.ran_to = self.ran_to.max(now);
    }

    /// The next clock after `now` at which something can happen, unless idle.
    pub fn next_event(&self, now: u64) -> Option<u64> {
        let waiting = !self.reads.is_empty() || !self.writes.is_empty();
        let command = waiting.then_some(self.wake.max(now + 1));
        let data = self.returning.iter().map(|(ready, _)| *ready).find(|ready| *ready > now);
        command.into_iter().chain(data).min()
    }

    pub fn is_idle(&self) -> bool {
        self.reads.is_empty() && self.writes.is_empty() && self.returning.is_empty()
    }

    /// When the next read that comes back is there.
    #[inline]
    pub fn next_done(&self) -> Option<u64> {
        self.returning.front().map(|(ready, _)| *ready)
    }

    pub fn take_done(&mut self) -> Option<u64> {
        self.returning.pop_front().map(|(_, tag)| tag)
    }

    pub fn active_clocks(&self, clocks: u64) -> u64 {
        self.device.active_clocks(clocks)
    }

    pub fn record(&mut self) {
        self.log.get_or_insert_default();
    }

    pub fn log(&self) -> &[Issued] {
        self.log.as_deref().unwrap_or_default()
    }

    fn step(&mut self, now: u64, stats: &mut ChannelStats) {
        if let Some(interval) = self.refresh_interval
            && self.next_refresh <= now
        {
            self.refreshes_due += 1;
            self.next_refresh += interval;
        }
        if self.draining {
            self.draining = self.writes.len() > self.config.drain_to || self.reads.is_empty();
        } else {
            self.draining = self.writes.len() >= self.config.drain_from || self.reads.is_empty();
        }
        let again = match self.refreshes_due {
            0 => self.serve(now, stats),
            _ => self.refresh(now, stats),
        };
        self.wake = again.min(self.next_refresh).max(now + 1);
    }

    /// Brings the oldest refresh on; returns when to look again.
    fn refresh(&mut self, now: u64, stats: &mut ChannelStats) -> u64 {
        let command = match self.device.open_banks() {
            0 => Command::Refresh,
            _ => Command::PrechargeAll,
        };
        let earliest = self.device.earliest(command, Address::default());
        if earliest > now {
            return earliest;
        }
        self.issue(command, Address::default(), now, stats);
        if command == Command::Refresh {
            self.refreshes_due -= 1;
        }
        now + 1
    }

    /// Brings a request of the queue that is served on; returns when to look again.
    fn serve(&mut self, now: u64, stats: &mut ChannelStats) -> u64 {
        let write = self.draining;
        let chosen = match self.choose(write, now) {
            Ok(chosen) => chosen,
            Err(again) => return again,
        };
        let queue = if write { &mut self.writes } else { &mut self.reads };
        let Some(request) = queue.get_mut(chosen) else { return u64::MAX };
        let address = request.address;
        let (command, outcome) = match self.device.open_row(address.bank) {
            None => (Command::Activate, &mut stats.row_misses),
            Some(row) if row != address.row => (Command::Precharge, &mut stats.row_conflicts),
            Some(_) if write => (Command::Write, &mut stats.row_hits),
            Some(_) => (Command::Read, &mut stats.row_hits),
        };
        if !request.started {
            request.started = true;
            *outcome += 1;
        }
        if matches!(command, Command::Read | Command::Write) {
            request.address.column += 1;
            request.bursts_left = request.bursts_left.saturating_sub(1);
            if request.bursts_left == 0 {
                let tag = request.tag;
                queue.remove(chosen);
                match write {
                    true => stats.writes += 1,
                    false => {
                        stats.reads += 1;
                        self.give_back(tag, now + self.read_latency);
                    }
                }
            }
        }
        self.issue(command, address, now, stats);
        now + 1
    }

    /// The request of a queue to bring on, or when to look again.
    fn choose(&self, write: bool, now: u64) -> Result<usize, u64> {
        let queue = if write { &self.writes } else { &self.reads };
        let mut again = u64::MAX;
        for (i, request) in queue.iter().enumerate() {
            let address = request.address;
            let (command, uses) = match self.device.open_row(address.bank) {
                None => (Command::Activate, 0),
                Some(row) if row != address.row => (Command::Precharge, 0),
                Some(_) => {
                    let command = if write { Command::Write } else { Command::Read };
                    (command, self.row_uses.get(address.bank as usize).copied().unwrap_or(0))
                }
            };
            if uses > self.config.row_hit_cap && i > 0 {
                continue;
            }
            let earliest = self.device.earliest(command, address);
            if earliest <= now && uses <= self.config.row_hit_cap {
                return Ok(i);
            }
            again = again.min(earliest);
        }
        // The oldest, even if its row has used up its hits.
        if again <= now { Ok(0) } else { Err(again) }
    }

    fn issue(&mut self, command: Command, address: Address, now: u64, stats: &mut ChannelStats) {
        // The rules were asked before; a refusal would be a defect that the command log shows.
        let Ok(closed) = self.device.issue(command, address, now) else { return };
        if let Some(log) = &mut self.log {
            log.push(Issued { clock: now, command, address });
        }
        stats.precharges += u64::from(closed);
        let uses = self.row_uses.get_mut(address.bank as usize);
        match command {
            Command::Activate => {
                stats.activates += 1;
                uses.into_iter().for_each(|uses| *uses = 0);
            }
            Command::Read | Command::Write => {
                match command {
                    Command::Read => stats.read_bursts += 1,
                    _ => stats.write_bursts += 1,
                }
                stats.busy_clocks += self.burst_clocks;
                uses.into_iter().for_each(|uses| *uses += 1);
            }
            Command::Refresh => stats.refreshes += 1,
            Command::Precharge | Command::PrechargeAll => {}
        }
    }

    /// Data comes back in order, one request a clock at most.
    fn give_back(&mut self, tag: u64, ready: u64) {
        let after = self.returning.back().map_or(0, |(last, _)| last + 1);
        self.returning.push_back((ready.max(after), tag));
    }
}
