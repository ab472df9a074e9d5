//! What a job left in memory, and the clock.

use xylem_core::geom::{Ray, Triangle};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{Bvh2Node, Bvh2View, NodeIndex};
use xylem_firmware::job::{Clock, Finished};

use super::{Failure, Step};
use crate::Cfu;

/// Where steps are measured.
pub(super) struct Bench<'a, B, K, C> {
    pub(super) bus: &'a mut B,
    pub(super) finished: &'a Finished,
    pub(super) clock: &'a mut K,
    pub(super) cfu: &'a C,
}

impl<B: Bus, K: Clock, C: Cfu> Bench<'_, B, K, C> {
    /// The cycles that `work` takes, and what it comes to.
    pub(super) fn timed<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> (u64, T) {
        let start = self.clock.cycles();
        let result = work(self);
        (self.clock.cycles().wrapping_sub(start), result)
    }

    /// Compares two regions of one size.
    pub(super) fn equal(&mut self, step: Step, a: Region, b: Region) -> Result<(), Failure> {
        for word in 0..a.size / 4 {
            let (Some(a), Some(b)) = (self.word(a, word), self.word(b, word)) else {
                return Err(Failure::Impossible(step));
            };
            if a != b {
                return Err(Failure::Differ(step));
            }
        }
        Ok(())
    }

    fn word(&mut self, region: Region, index: u32) -> Option<[u8; 4]> {
        let mut bytes = [0; 4];
        self.bus.read(region.record(index, 4)?, &mut bytes).ok()?;
        Some(bytes)
    }

    pub(super) fn node(&mut self, NodeIndex(index): NodeIndex) -> Option<Bvh2Node> {
        let mut bytes = [0; Bvh2Node::BYTES];
        let addr = self.finished.exact.nodes.record(index, Bvh2Node::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Bvh2View::new(&bytes).to_repr()
    }

    pub(super) fn ray(&mut self, index: u32) -> Option<Ray> {
        let mut bytes = [0; Ray::BYTES];
        let addr = self.finished.blob.rays.record(index, Ray::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Ray::from_bytes(&bytes).ok()
    }

    pub(super) fn triangle(&mut self, index: u32) -> Option<Triangle> {
        let mut bytes = [0; Triangle::BYTES];
        let addr = self.finished.blob.triangles.record(index, Triangle::BYTES as u32)?;
        self.bus.read(addr, &mut bytes).ok()?;
        Some(Triangle::from_bytes(&bytes))
    }
}
