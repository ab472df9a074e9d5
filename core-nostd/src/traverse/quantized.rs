//! Traversal of quantized pairs with incremental plane distances.
//!
//! As in P3 Eq. 5, after Vaidyanathan et al. 2016: a child's planes are found from its parent's by
//! a step of a few cells, see [`Slabs::step`].

use super::search::{Pending, Traversable};
use super::slab::Slabs;
use crate::compress::{Context, Placement};
use crate::geom::Ray;
use crate::node::{Quantization, QuantizedPair, QuantizedView, Subtree};

/// Pairs of any width and coordinates.
#[derive(Debug)]
pub(super) struct Quantized(pub Quantization);

/// What the search keeps of a node: its grid and its plane distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    context: Context,
    slabs: Slabs,
}

impl Traversable for Quantized {
    type Context = State;
    type Bytes = [u8; QuantizedPair::MAX_BYTES];
    const EMPTY: Self::Bytes = [0; QuantizedPair::MAX_BYTES];

    fn root(&self, ray: &Ray, root: &Subtree) -> Option<(Slabs, State)> {
        let placement = Placement::root(&root.bounds, &self.0)?;
        let slabs = Slabs::new(ray, &placement.decoded());
        Some((slabs, State { context: placement.context, slabs }))
    }

    #[inline(always)]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Self::Bytes,
        State { context, slabs }: &State,
        t_max: i64,
    ) -> Option<[Option<Pending<State>>; 2]> {
        let quantization = &self.0;
        let view = QuantizedView::new(bytes, quantization.bits);
        let test = |i| {
            let child = view.child(i);
            let cells = context.decode(&child, quantization)?;
            let slabs = slabs.step(ray, context, &cells);
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max);
            let pending = |entry| {
                let context = State { context: context.child(&cells, quantization), slabs };
                Pending { child: child.child, entry, context }
            };
            Some(entry.map(pending))
        };
        Some([test(0)?, test(1)?])
    }
}
