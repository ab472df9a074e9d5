//! Traversal of 64-byte nodes.

use super::search::{Pending, Traversable};
use super::slab::Slabs;
use crate::geom::Ray;
use crate::node::{Bvh2Node, Bvh2View, Subtree};
use crate::num::Grid;

/// Nodes with exact boxes: each plane distance is computed from the origin.
#[derive(Debug)]
pub(super) struct Exact;

impl Traversable<2> for Exact {
    type Context = ();
    type Bytes = [u8; Bvh2Node::BYTES];
    const EMPTY: Self::Bytes = [0; Bvh2Node::BYTES];

    fn root(&self, _: &Ray, _: &Subtree, _: i64) -> Option<()> {
        Some(())
    }

    #[inline(always)]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Self::Bytes,
        (): &(),
        t_max: i64,
    ) -> Option<[Option<Pending<()>>; 2]> {
        let view = Bvh2View::new(bytes);
        let test = |i| {
            let bounds = view.bounds(i);
            // Off the grid, distances are wider than the test takes them to be.
            if !Grid::DEFAULT.contains(bounds.min) || !Grid::DEFAULT.contains(bounds.max) {
                return None;
            }
            let slabs = Slabs::new(ray, &bounds);
            let Some(entry) = slabs.entry(ray, ray.t_min().to_bits(), t_max) else {
                return Some(None);
            };
            Some(Some(Pending { child: view.child(i)?, entry, context: () }))
        };
        Some([test(0)?, test(1)?])
    }
}
