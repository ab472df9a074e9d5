//! Replaying a trace of requests without timestamps.

use super::memory::{Memory, Request};

/// Offers requests in program order, each as early as its channel's queue accepts it and at most one
/// a clock, until all are done; returns the clocks that took.
///
/// This is what Ramulator 1 does with a DRAM trace. As there, a request whose queue is full holds up
/// those behind it, even if they go to other channels, and once all are accepted writes drain at once. `done` is told of every read that comes back,
/// by its place in the trace, and `step` of every request that was accepted.
///
/// # Errors
/// The first error among the requests.
pub fn replay<E>(
    memory: &mut Memory,
    requests: impl IntoIterator<Item = Result<(u64, bool), E>>,
    mut step: impl FnMut(u64),
    mut done: impl FnMut(u64),
) -> Result<u64, E> {
    let mut clock = 0;
    let mut requests = (0..).zip(requests);
    let mut next = requests.next();
    loop {
        let accepted = match next {
            Some((tag, request)) => {
                let (addr, write) = request?;
                let accepted = memory.offer(Request { addr, write, tag }, clock);
                if accepted {
                    step(tag);
                    next = requests.next();
                } else {
                    next = Some((tag, Ok((addr, write))));
                }
                accepted
            }
            None if memory.is_idle() => return Ok(clock),
            None => {
                memory.flush();
                false
            }
        };
        // A full queue stays full until something happens.
        let event = if accepted { None } else { memory.next_event(clock) };
        clock = event.unwrap_or(clock + 1);
        memory.tick(clock);
        while let Some(tag) = memory.take_done() {
            done(tag);
        }
    }
}
