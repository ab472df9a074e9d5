//! Frame after frame: refit the tree or build it anew, and trace.
//!
//! The triangles of every frame lie in the blob. The first frame's tree is built; in every further
//! frame the tree that is there is refitted, and its SAH cost, which the refit measures, goes to the
//! rule ([`Upkeep`]). If that says so, the tree is built anew at once, so that no frame is traced
//! through a tree that the rule refuses. What a quantized tree costs is what its exact boxes cost.

use xylem_core::mem::{Bus, Region};
use xylem_core::node::{NodeFormat, Tree};
use xylem_core::quality::SahCost;
use xylem_core::refit::{CostMeter, InPlace, Update, Upkeep, refit};

use crate::blob::Animation;
use crate::digest;
use crate::job::{Buffers, Finished, JobError, Plan};
use crate::report::{Report, STAGES, halves, to_bytes, words};
use crate::stages::{Clock, StageCycles};

/// What happened in one frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct FrameReport {
    /// Its number, from 0.
    pub frame: u32,
    /// What was done; the first frame is a rebuild.
    pub update: Update,
    /// The SAH cost of the tree that was there before, refitted to this frame; 0 in the first frame.
    pub refitted: SahCost,
    /// The SAH cost of the tree that rays were traced through.
    pub cost: SahCost,
    /// Rays that hit something.
    pub hits: u32,
    /// The CRC-32 of all hit records.
    pub hits_crc: u32,
    /// Cycles of each of [`STAGES`] in this frame.
    pub cycles: [u64; STAGES.len()],
}

/// Runs the animation of a blob.
pub(crate) fn run<B: Bus, C: Clock>(
    bus: &mut B,
    plan: &Plan,
    animation: &Animation,
    buffers: &mut Buffers,
    stages: &mut StageCycles<'_, C>,
    observer: &mut impl FnMut(&FrameReport),
) -> Result<Finished, JobError<B::Error>> {
    let mut upkeep = Upkeep::new(animation.rule);
    let count = plan.blob.header.triangles;
    let compressed = plan.blob.header.format != NodeFormat::Bvh2;
    let mut exact = Tree::empty(NodeFormat::Bvh2, Region::default(), Region::default());
    let mut tree = exact;
    let mut totals = Report::default();
    for frame in 0..animation.frames {
        let Some(triangles) = plan.blob.frame(frame) else { break };
        let mut refitted = SahCost::ZERO;
        let mut update = Update::Rebuild;
        if frame > 0 {
            let mut sink = InPlace { nodes: exact.nodes };
            let done = refit(bus, &exact, (triangles, count), &mut sink, stages);
            let done = done.map_err(JobError::Build)?;
            (exact.root, refitted) = (done.root, done.cost);
            update = upkeep.after_refit(refitted);
        }
        let mut cost = refitted;
        if update == Update::Rebuild {
            stages.meter = Some(CostMeter::new());
            exact = plan.build(bus, triangles, buffers, stages)?;
            let meter = stages.meter.take().unwrap_or_default();
            cost = exact.root.map_or(SahCost::ZERO, |root| meter.cost(&root));
            upkeep.after_rebuild(cost);
        }
        tree = if compressed { plan.compress(bus, &exact, buffers, stages)? } else { exact };
        let hits = plan.trace(bus, &tree, triangles, stages)?;
        let cycles = stages.take();
        let hits_crc = digest::of_region(bus, plan.layout.hits).map_err(JobError::Bus)?;
        observer(&FrameReport { frame, update, refitted, cost, hits, hits_crc, cycles });
        totals.hits = totals.hits.saturating_add(hits);
        totals.rays = totals.rays.saturating_add(plan.blob.header.rays);
        for (total, cycles) in totals.cycles.iter_mut().zip(cycles) {
            *total += cycles;
        }
    }
    let mut outputs = plan.layout.outputs(&exact);
    if !compressed {
        outputs[2].size = 0;
    }
    let outputs = plan.digest(bus, outputs)?;
    let Report { hits, rays, cycles, .. } = totals;
    let report = Report { hits, rays, cycles, outputs, ..plan.report(&exact, stages.cells) };
    Ok(plan.finished(report, exact, tree))
}

impl FrameReport {
    /// Bytes of a frame's report on the wire.
    pub const BYTES: usize = 32 + 8 * STAGES.len();

    /// The report's bytes, little-endian: number, update (0 refit, 1 rebuild), the two costs as UQ32.32,
    /// hits, their CRC, and cycles.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let update = u32::from(self.update == Update::Rebuild);
        let words = [self.frame, update]
            .into_iter()
            .chain(halves(self.refitted.to_bits()))
            .chain(halves(self.cost.to_bits()))
            .chain([self.hits, self.hits_crc])
            .chain(self.cycles.into_iter().flat_map(halves));
        to_bytes(words)
    }

    /// The report of some bytes, or `None` if there are more or fewer than [`FrameReport::BYTES`] or the
    /// update has no meaning.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut words = words::<{ Self::BYTES }>(bytes)?;
        let mut word = || words.next().unwrap_or_default();
        let frame = word();
        let update = match word() {
            0 => Update::Refit,
            1 => Update::Rebuild,
            _ => return None,
        };
        let mut long = || u64::from(word()) | u64::from(word()) << 32;
        let refitted = SahCost::from_bits(long());
        let cost = SahCost::from_bits(long());
        let pair = long();
        let (hits, hits_crc) = (pair as u32, (pair >> 32) as u32);
        let cycles = [(); STAGES.len()].map(|()| long());
        Some(Self { frame, update, refitted, cost, hits, hits_crc, cycles })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_reports_round_trip() {
        for update in [Update::Refit, Update::Rebuild] {
            let report = FrameReport {
                frame: 7,
                update,
                refitted: SahCost::from_bits(1 << 40 | 3),
                cost: SahCost::from_bits(5 << 32),
                hits: 11,
                hits_crc: u32::MAX - 1,
                cycles: core::array::from_fn(|i| (1 << 33) + i as u64),
            };
            let mut bytes = report.to_bytes();
            assert_eq!(FrameReport::from_bytes(&bytes), Some(report));
            assert_eq!(FrameReport::from_bytes(&bytes[4..]), None);
            bytes[4] = 2;
            assert_eq!(FrameReport::from_bytes(&bytes), None);
        }
    }
}
