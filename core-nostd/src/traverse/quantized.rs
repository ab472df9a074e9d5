//! Traversal of 16-byte quantized pairs with incremental plane distances.
//!
//! As in P3 Eq. 5, after Vaidyanathan et al. 2016: a child's planes are found from its parent's by
//! a step of a few cells, see [`Slabs::step`].

use super::search::{Pending, Traversable};
use super::slab::Slabs;
use crate::compress::{Context, Coordinates, Placement};
use crate::geom::Ray;
use crate::node::{QuantizedPair, QuantizedView, Subtree};

/// Pairs in modulo coordinates, or else in relative ones.
#[derive(Debug)]
pub(super) struct Quantized<const MODULO: bool>;

/// What the search keeps of a node: its grid and its plane distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    context: Context,
    slabs: Slabs,
}

impl<const MODULO: bool> Traversable for Quantized<MODULO> {
    type Context = State;
    type Bytes = [u8; QuantizedPair::BYTES];
    const EMPTY: Self::Bytes = [0; QuantizedPair::BYTES];

    fn root(ray: &Ray, root: &Subtree) -> Option<(Slabs, State)> {
        let placement = Placement::root(&root.bounds)?;
        let slabs = Slabs::new(ray, &placement.decoded());
        Some((slabs, State { context: placement.context, slabs }))
    }

    #[inline(always)]
    fn children(
        ray: &Ray,
        bytes: &Self::Bytes,
        State { context, slabs }: &State,
        t_max: i64,
    ) -> Option<[Option<Pending<State>>; 2]> {
        let coordinates = if MODULO { Coordinates::Modulo } else { Coordinates::Relative };
        let view = QuantizedView::new(bytes);
        let test = |i| {
            let child = view.child(i);
            let cells = context.decode(&child, coordinates)?;
            let slabs = slabs.step(ray, context, &cells);
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max);
            let pending = |entry| {
                let context = State { context: context.child(&cells), slabs };
                Pending { child: child.child, entry, context }
            };
            Some(entry.map(pending))
        };
        Some([test(0)?, test(1)?])
    }
}
