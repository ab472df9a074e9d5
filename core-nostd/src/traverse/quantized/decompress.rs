//! Decompress and test.

use super::Bytes;
use crate::compress::Placement;
use crate::geom::Ray;
use crate::node::{Quantization, Subtree, WideNode};
use crate::traverse::search::{Pending, Traversable};
use crate::traverse::slab::Slabs;

/// Nodes of `N` children, 2 or 4, and any width and coordinates, whose boxes are decoded to grid units (P3 Eq. 3).
#[derive(Debug)]
pub(in crate::traverse) struct Decompress<const N: usize>(pub Quantization);

impl<const N: usize> Traversable<N> for Decompress<N> {
    type Context = Placement;
    type Bytes = Bytes;
    const EMPTY: Bytes = [0; WideNode::MAX_BYTES];

    fn root(&self, _: &Ray, root: &Subtree, _: i64) -> Option<Placement> {
        Placement::root(&root.bounds, &self.0)
    }

    #[inline(always)]
    fn boxes(&self, bytes: &Bytes) -> usize {
        super::boxes::<N>(&self.0, bytes)
    }

    #[inline(always)]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Bytes,
        placement: &Placement,
        t_max: i64,
    ) -> Option<[Option<Pending<Placement>>; N]> {
        super::children(&self.0, bytes, &placement.context, |cells| {
            let child = placement.child(cells, &self.0);
            let slabs = Slabs::new(ray, &child.decoded());
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max)?;
            Some((entry, child))
        })
    }
}
