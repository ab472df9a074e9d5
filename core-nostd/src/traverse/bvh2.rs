//! Traversal of 64-byte nodes.

use super::search::{Pending, Traversable};
use super::slab::Slabs;
use crate::geom::{Aabb, Ray};
use crate::node::{Bvh2Node, Bvh2View, Subtree};
use crate::num::Grid;

/// How the exact boxes of 64-byte nodes are tested: by [`SlabTest`], or by instructions that the machine has
/// for it.
pub trait BoxTest {
    /// When `ray` enters `bounds`, if it does so within its `t_min < t <= t_max`: what [`Slabs::entry`]
    /// says of [`Slabs::new`]. The outer `None` says that the box is off the grid.
    fn entry(&self, ray: &Ray, bounds: &Aabb, t_max: i64) -> Option<Option<i64>>;
}

/// The box test of this crate.
#[derive(Clone, Copy, Debug)]
pub struct SlabTest;

impl BoxTest for SlabTest {
    #[inline(always)]
    fn entry(&self, ray: &Ray, bounds: &Aabb, t_max: i64) -> Option<Option<i64>> {
        // Off the grid, distances are wider than the test takes them to be.
        if !Grid::DEFAULT.contains(bounds.min) || !Grid::DEFAULT.contains(bounds.max) {
            return None;
        }
        Some(Slabs::new(ray, bounds).entry(ray, ray.t_min().to_bits(), t_max))
    }
}

/// Nodes with exact boxes: each plane distance is computed from the origin.
#[derive(Debug)]
pub(super) struct Exact<T>(pub T);

impl<T: BoxTest> Traversable<2> for Exact<T> {
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
            let Some(entry) = self.0.entry(ray, &view.bounds(i), t_max)? else {
                return Some(None);
            };
            Some(Some(Pending { child: view.child(i)?, entry, context: () }))
        };
        Some([test(0)?, test(1)?])
    }
}
