//! One sweep as a streaming unit: a window of clusters and a row of distance units.

use super::{Cluster, MAX_RADIUS, Token};
use crate::probe::Probe;

/// The deepest tree that a sweep makes, in nodes from top to bottom. From here on the gate halves
/// each list, at the cost of one level a pass, and 2³¹ clusters take 31 of those.
pub const SWEEP_DEPTH: u8 = (super::super::MAX_DEPTH - 32) as u8;

/// Clusters of the widest window: one, and a radius to each side of it.
const WINDOW: usize = 2 * MAX_RADIUS as usize + 1;

/// What becomes of the oldest cluster of a window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Decision {
    /// Nothing leaves the window in this step.
    Nothing,
    /// It leaves as it is.
    Pass(Cluster),
    /// It and a later one, which is thereby done, chose each other.
    Merge(Cluster, Cluster),
    /// The list has ended.
    End,
}

/// A cluster in the window and its nearest neighbour so far.
#[derive(Clone, Copy, Debug)]
struct Slot {
    cluster: Cluster,
    /// The lowest key of a pair with it, or all ones.
    key: u64,
    /// Position of the other one of that pair.
    partner: u32,
    /// It has left as the later one of a merged pair.
    taken: bool,
}

/// The unit.
///
/// A cluster that enters meets the `radius` clusters before it, all at once in hardware; both sides
/// of each pair keep the lower key. When the cluster at `k + 2 · radius` has entered, the nearest
/// neighbours of `k` and of its partner are final and `k` leaves, merged or as it is. A merged
/// cluster takes the place of its earlier part, so the order is kept.
#[derive(Debug)]
pub(super) struct Sweep {
    slots: [Slot; WINDOW],
    radius: u32,
    /// Position of the oldest cluster in the window.
    head: u32,
    /// Position of the next cluster to enter.
    next: u32,
    ended: bool,
    done: bool,
}

impl Sweep {
    /// A unit without a list.
    pub const fn new(radius: u32) -> Self {
        let slot = Slot { cluster: Cluster::ZERO, key: u64::MAX, partner: 0, taken: false };
        Self { slots: [slot; WINDOW], radius, head: 0, next: 0, ended: false, done: true }
    }

    /// Begins a list.
    pub fn start(&mut self) {
        (self.head, self.next, self.ended, self.done) = (0, 0, false, false);
    }

    /// Takes what the unit before has put out and decides on one cluster at most.
    #[inline]
    pub fn step<P: Probe>(&mut self, input: Token, probe: &mut P) -> Decision {
        match input {
            Token::Cluster(cluster) => self.enter(cluster, probe),
            Token::Bubble => {}
            Token::End => self.ended = true,
        }
        if self.done {
            Decision::Nothing
        } else if self.next - self.head > 2 * self.radius || self.ended && self.head < self.next {
            self.decide()
        } else if self.ended {
            self.done = true;
            Decision::End
        } else {
            Decision::Nothing
        }
    }

    #[inline]
    fn enter<P: Probe>(&mut self, cluster: Cluster, probe: &mut P) {
        let own = self.next;
        let first = own.saturating_sub(self.radius).max(self.head);
        let (mut key, mut partner) = (u64::MAX, 0);
        for other in first..own {
            let slot = &mut self.slots[other as usize % WINDOW];
            let pair = pair_key(&slot.cluster, &cluster, other ^ own);
            if pair < slot.key {
                (slot.key, slot.partner) = (pair, own);
            }
            if pair < key {
                (key, partner) = (pair, other);
            }
        }
        probe.ploc_distances(own - first);
        self.slots[own as usize % WINDOW] = Slot { cluster, key, partner, taken: false };
        self.next += 1;
    }

    #[inline]
    fn decide(&mut self) -> Decision {
        let own = self.head;
        self.head += 1;
        let Slot { cluster, key, partner, taken } = self.slots[own as usize % WINDOW];
        if taken {
            return Decision::Nothing;
        }
        if key != u64::MAX && partner > own {
            let other = &mut self.slots[partner as usize % WINDOW];
            if other.partner == own && other.key == key {
                other.taken = true;
                return Decision::Merge(cluster, other.cluster);
            }
        }
        Decision::Pass(cluster)
    }
}

/// What two clusters at positions that differ by exclusive or are ordered by, or all ones where
/// they may not merge: half the area of the box around both in bits 6..56, then the positions.
#[inline]
fn pair_key(a: &Cluster, b: &Cluster, positions: u32) -> u64 {
    if a.joint_depth(b) > SWEEP_DEPTH {
        return u64::MAX;
    }
    a.bounds().union(b.bounds()).half_area() << 6 | u64::from(positions & 63)
}
