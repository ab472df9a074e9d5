//! Whole streams that the steps are part of.

use xylem_core::compress::{compress_encoding, compress_top_down};
use xylem_core::geom::Ray;
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{Quantization, Tree};
use xylem_core::traverse::{BoxTest, Hit, Query, Scene, SlabTest, trace_testing};
use xylem_firmware::job::{Clock, Finished};

use super::bench::Bench;
use super::{Failure, Measured, Step};
use crate::{Cfu, CustomBoxTest, CustomEncoder};

impl<B: Bus, K: Clock, C: Cfu> Bench<'_, B, K, C> {
    /// Compresses the whole tree.
    pub(super) fn compress(&mut self) -> Result<Measured, Failure> {
        let step = Step::Compress;
        let impossible = Failure::Impossible(step);
        let Finished { layout, exact, .. } = *self.finished;
        let quantization = Quantization::RELATIVE;
        let size = exact.node_count * quantization.node_bytes();
        let target = Region { size, ..layout.quantized_nodes };
        let beside = Region { size, ..layout.free };
        if size > layout.free.size {
            return Err(impossible);
        }
        let (software, tree) = self.timed(|bench| {
            compress_top_down(bench.bus, &exact, target, &quantization, &mut ()).ok()
        });
        tree.ok_or(impossible)?;
        let (custom, tree) = self.timed(|bench| {
            let mut encoder = CustomEncoder::new(bench.cfu, quantization);
            compress_encoding(&mut encoder, bench.bus, &exact, beside, &quantization, &mut ()).ok()
        });
        tree.ok_or(impossible)?;
        self.equal(step, target, beside)?;
        Ok(Measured { step, count: exact.node_count, software, custom })
    }

    /// Traces all rays through 64-byte nodes.
    pub(super) fn trace(&mut self) -> Result<Measured, Failure> {
        let step = Step::Trace;
        let impossible = Failure::Impossible(step);
        let (hits, free) = (self.finished.layout.hits, self.finished.layout.free);
        let beside = Region { size: hits.size, ..free };
        if hits.size > free.size {
            return Err(impossible);
        }
        let (software, done) = self.timed(|bench| bench.trace_all(hits, |_, _| SlabTest));
        done.ok_or(impossible)?;
        let (custom, done) = self.timed(|bench| bench.trace_all(beside, CustomBoxTest::new));
        done.ok_or(impossible)?;
        self.equal(step, hits, beside)?;
        Ok(Measured { step, count: self.finished.blob.header.rays, software, custom })
    }

    /// Traces all rays, each with the box test that `test` makes for it.
    fn trace_all<'a, T: BoxTest>(
        &'a mut self,
        hits: Region,
        test: impl Fn(&'a C, &Ray) -> T,
    ) -> Option<()> {
        let Finished { blob, exact, .. } = self.finished;
        let (triangles, triangle_count) = (blob.triangles, blob.header.triangles);
        let scene = Scene { tree: Tree { ..*exact }, triangles, triangle_count };
        for index in 0..blob.header.rays {
            let ray = self.ray(index)?;
            let test = test(self.cfu, &ray);
            let hit = trace_testing(test, self.bus, &scene, &ray, Query::Closest, &mut ());
            let bytes = Hit::to_bytes(hit.ok()?.as_ref());
            self.bus.write(hits.record(index, Hit::BYTES as u32)?, &bytes).ok()?;
        }
        Some(())
    }
}
