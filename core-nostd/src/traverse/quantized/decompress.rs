//! Decompress and test.

use super::Bytes;
use crate::compress::Placement;
use crate::geom::Ray;
use crate::node::{Quantization, QuantizedPair, Subtree};
use crate::traverse::search::{Pending, Traversable};
use crate::traverse::slab::Slabs;

/// Pairs of any width and coordinates, whose boxes are decoded to grid units (P3 Eq. 3).
#[derive(Debug)]
pub(in crate::traverse) struct Decompress(pub Quantization);

impl Traversable for Decompress {
    type Context = Placement;
    type Bytes = Bytes;
    const EMPTY: Bytes = [0; QuantizedPair::MAX_BYTES];

    fn root(&self, _: &Ray, root: &Subtree, _: i64) -> Option<Placement> {
        Placement::root(&root.bounds, &self.0)
    }

    #[inline(always)]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Bytes,
        placement: &Placement,
        t_max: i64,
    ) -> Option<[Option<Pending<Placement>>; 2]> {
        super::children(&self.0, bytes, &placement.context, |cells| {
            let child = placement.child(cells, &self.0);
            let slabs = Slabs::new(ray, &child.decoded());
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max)?;
            Some((entry, child))
        })
    }
}
