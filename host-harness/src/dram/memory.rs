//! The memory that machines use.

use super::config::Config;
use super::controller::{Channel, Issued};
use super::energy::Energy;
use super::stats::{ChannelStats, Stats};

/// One access of 64 bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// The byte address, a multiple of 64; lower bits are ignored.
    pub addr: u64,
    /// Whether it writes.
    pub write: bool,
    /// What [`Memory::take_done`] gives back for a read.
    pub tag: u64,
}

/// A memory of one or more channels, in clocks of its own.
///
/// Within a clock, what is offered is seen by the controller in the next clock, in whichever order
/// [`Memory::tick`] and [`Memory::offer`] are called. Clocks never go back; a clock before the last
/// is taken for the last.
#[derive(Debug, Clone)]
pub struct Memory {
    config: Config,
    channels: Vec<Channel>,
    stats: Stats,
    now: u64,
}

impl Memory {
    /// A memory at clock 0 with all banks closed.
    pub fn new(config: &Config) -> Self {
        let channels = config.mapping.channels.max(1) as usize;
        Self {
            config: *config,
            channels: vec![Channel::new(config); channels],
            stats: Stats { channels: vec![ChannelStats::default(); channels] },
            now: 0,
        }
    }

    /// What this memory is.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Puts a request into its channel's queue; false if that queue is full (offer it again later).
    ///
    /// A write is done when it is accepted. A read of an address for which a write waits is answered
    /// from the write queue.
    pub fn offer(&mut self, request: Request, now: u64) -> bool {
        let Request { addr, write, tag } = request;
        let addr = addr - addr % super::REQUEST_BYTES;
        let (channel, address) = self.config.mapping.locate(addr);
        match (self.channels.get_mut(channel), self.stats.channels.get_mut(channel)) {
            (Some(channel), Some(stats)) => channel.offer((addr, write, tag), address, now, stats),
            _ => false,
        }
    }

    /// Runs the memory up to and including clock `now`. Clocks may be skipped: what happened in them
    /// happens at its own time.
    #[inline]
    pub fn tick(&mut self, now: u64) {
        for (channel, stats) in self.channels.iter_mut().zip(&mut self.stats.channels) {
            channel.run(now, stats);
        }
        self.now = self.now.max(now);
    }

    /// The tag of a read whose last beat of data arrived at or before the last tick, the oldest
    /// first; of several in one clock, that of the lowest channel.
    #[inline]
    pub fn take_done(&mut self) -> Option<u64> {
        let now = self.now;
        let done = |channel: &mut Channel| channel.next_done().filter(|ready| *ready <= now);
        let channels = self.channels.iter_mut();
        let (_, channel) = channels
            .filter_map(|channel| done(channel).map(|ready| (ready, channel)))
            .min_by_key(|(ready, _)| *ready)?;
        channel.take_done()
    }

    /// The first clock after `now` at which anything can happen if nothing is offered: a command of a
    /// waiting request may become legal, or data arrives. `None` if no request waits or is on its
    /// way; refreshes alone are not events, as they happen at their own time whenever the memory is
    /// ticked again.
    pub fn next_event(&self, now: u64) -> Option<u64> {
        self.channels.iter().filter_map(|channel| channel.next_event(now)).min()
    }

    /// Whether all queues are empty and all data has been taken.
    pub fn is_idle(&self) -> bool {
        self.channels.iter().all(Channel::is_idle)
    }

    /// What was counted up to the last tick.
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// What the memory used from clock 0 to `clocks`; `None` if there are no currents for it.
    pub fn energy(&self, clocks: u64) -> Option<Energy> {
        let channels = self.channels.iter().zip(&self.stats.channels);
        let counted = channels.map(|(channel, stats)| (*stats, channel.active_clocks(clocks)));
        Energy::of(&self.config, clocks, counted)
    }

    /// Keeps a record of all commands from now on.
    pub fn record_commands(&mut self) {
        self.channels.iter_mut().for_each(Channel::record);
    }

    /// The commands recorded on a channel, in order.
    pub fn commands(&self, channel: usize) -> &[Issued] {
        self.channels.get(channel).map(Channel::log).unwrap_or_default()
    }
}
