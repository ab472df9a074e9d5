//! The memory that machines use.

use super::config::Config;
use super::controller::{Channel, Issued};
use super::energy::Energy;
use super::mapping::REQUEST_BYTES;
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
        let addr = request.addr - request.addr % REQUEST_BYTES;
        let (channel, address) = self.config.mapping.locate(addr);
        match (self.channels.get_mut(channel), self.stats.channels.get_mut(channel)) {
            (Some(channel), Some(stats)) => {
                channel.offer(Request { addr, ..request }, address, now, stats)
            }
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

    /// Says that nothing more will be offered, so that waiting writes are drained at once rather than
    /// once there are more. The next request that is offered takes it back for its channel.
    pub fn flush(&mut self) {
        self.channels.iter_mut().for_each(Channel::flush);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(name: &str) -> Memory {
        Memory::new(Config::by_name(name).unwrap())
    }

    /// When a read that is offered alone comes back.
    fn read(memory: &mut Memory, addr: u64, now: u64) -> u64 {
        assert!(memory.offer(Request { addr, write: false, tag: now }, now));
        let mut clock = now;
        loop {
            clock = memory.next_event(clock).unwrap();
            memory.tick(clock);
            if memory.take_done() == Some(now) {
                return clock - now;
            }
        }
    }

    #[test]
    fn an_unloaded_read_takes_what_the_formula_says() {
        // Closed tRCD + CL + tDQSCK + 4 + 1, hit without tRCD, conflict with tRP.
        for (name, expected) in [("slow", [34, 19, 49]), ("fast", [29, 17, 41])] {
            let mut memory = memory(name);
            let row = 8 * 8192 * u64::from(memory.config().mapping.channels);
            let latencies = [(0, 0), (0, 200), (row, 400)];
            let latencies = latencies.map(|(addr, now)| read(&mut memory, addr, now));
            assert_eq!(latencies, expected, "{name}");
            let stats = memory.stats().total();
            let outcomes = [stats.row_misses, stats.row_hits, stats.row_conflicts];
            assert_eq!(outcomes, [1; 3], "{name}");
        }
    }

    #[test]
    fn the_order_of_tick_and_offer_within_a_clock_does_not_matter() {
        let [mut before, mut after] = [memory("slow"), memory("slow")];
        let request = Request { addr: 0, write: false, tag: 7 };
        for now in 0..100 {
            if now == 50 {
                assert!(before.offer(request, now));
            }
            before.tick(now);
            after.tick(now);
            if now == 50 {
                assert!(after.offer(request, now));
            }
            let done = before.take_done();
            assert_eq!(done, after.take_done());
            assert_eq!(done.is_some(), now == 50 + 34, "{now}");
        }
    }

    #[test]
    fn a_request_on_a_narrow_channel_is_two_bursts_and_done_with_the_second() {
        let mut memory = memory("p3");
        assert_eq!(read(&mut memory, 0, 0), 34 + 4);
        assert_eq!(memory.stats().total().read_bursts, 2);
        assert_eq!(memory.stats().total().reads, 1);
    }

    #[test]
    fn a_read_of_what_waits_to_be_written_is_answered_at_once() {
        let mut memory = memory("slow");
        assert!(memory.offer(Request { addr: 640, write: true, tag: 0 }, 0));
        assert_eq!(read(&mut memory, 640, 0), 1);
        let stats = memory.stats().total();
        assert_eq!((stats.forwarded_reads, stats.read_bursts), (1, 0));
    }

    #[test]
    fn full_queues_refuse_and_an_idle_memory_has_no_events() {
        let mut memory = memory("slow");
        let offer = |memory: &mut Memory, tag, write| {
            memory.offer(Request { addr: tag * 64, write, tag }, 0)
        };
        assert!((0..32).all(|tag| offer(&mut memory, tag, false)));
        assert!(!offer(&mut memory, 32, false));
        assert!((100..132).all(|tag| offer(&mut memory, tag, true)));
        assert!(!offer(&mut memory, 132, true));
        let (mut clock, mut done) = (0, 0);
        while let Some(next) = memory.next_event(clock) {
            clock = next;
            memory.tick(clock);
            done += std::iter::from_fn(|| memory.take_done()).count();
        }
        assert_eq!(done, 32);
        assert!(memory.is_idle());
        assert_eq!(memory.stats().total().writes, 32);
    }

    #[test]
    fn an_idle_memory_is_refreshed_at_the_right_times_whenever_it_is_ticked() {
        let mut memory = memory("slow");
        memory.record_commands();
        memory.tick(4 * 3120 + 5);
        let clocks: Vec<u64> = memory.commands(0).iter().map(|issued| issued.clock).collect();
        assert_eq!(clocks, [3120, 2 * 3120, 3 * 3120, 4 * 3120]);
        let mut unrefreshed = self::memory("p1-16");
        unrefreshed.tick(1 << 40);
        assert_eq!(unrefreshed.stats().total().refreshes, 0);
    }

    #[test]
    fn refreshes_and_open_rows_are_paid_for() {
        let mut memory = memory("medium");
        read(&mut memory, 0, 0);
        let energy = memory.energy(100).unwrap();
        // One channel of two dies: an activate, a burst, and a bank open from clock 1 to 100.
        assert!((energy.activate_pj - 2.0 * 2943.0).abs() < 1.0, "{energy:?}");
        assert!((energy.read_pj - 2.0 * 1317.0).abs() < 1.0, "{energy:?}");
        assert_eq!((energy.write_pj, energy.refresh_pj), (0.0, 0.0));
        let background = 4.0 * 100.0 * 1.25 * 49.2 + 2.0 * 99.0 * 1.25 * (57.6 - 49.2);
        assert!((energy.background_pj - background).abs() < 1.0, "{energy:?}");
        let dynamic = energy.activate_pj + energy.read_pj + 2.0 * 99.0 * 1.25 * (57.6 - 49.2);
        assert!((energy.dynamic_pj() - dynamic).abs() < 1.0, "{energy:?}");
    }
}
