//! Traversal of 16-byte quantized pairs with incremental plane distances.
//!
//! As in P3 Eq. 5, after Vaidyanathan et al. 2016: a child's planes are found from its parent's by
//! a step of a few cells, see [`Slabs::step`].

use super::search::{ChildTest, Traversable};
use super::slab::Slabs;
use crate::compress::{Context, Coordinates, Placement};
use crate::geom::Ray;
use crate::node::{QuantizedPair, QuantizedView, Subtree};

/// Pairs in relative coordinates.
#[derive(Debug)]
pub(super) struct Relative;

/// Pairs in modulo coordinates.
#[derive(Debug)]
pub(super) struct Modulo;

/// What the search keeps of a node: its grid and its plane distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    context: Context,
    slabs: Slabs,
}

impl Traversable for Relative {
    type Context = State;
    type Bytes = [u8; QuantizedPair::BYTES];
    const EMPTY: Self::Bytes = [0; QuantizedPair::BYTES];

    fn root(ray: &Ray, root: &Subtree) -> Option<(Slabs, State)> {
        root_state(ray, root)
    }

    #[inline]
    fn children(
        ray: &Ray,
        bytes: &Self::Bytes,
        state: &State,
        t_max: i64,
    ) -> Option<[ChildTest<State>; 2]> {
        child_states(ray, bytes, state, t_max, Coordinates::Relative)
    }
}

impl Traversable for Modulo {
    type Context = State;
    type Bytes = [u8; QuantizedPair::BYTES];
    const EMPTY: Self::Bytes = [0; QuantizedPair::BYTES];

    fn root(ray: &Ray, root: &Subtree) -> Option<(Slabs, State)> {
        root_state(ray, root)
    }

    #[inline]
    fn children(
        ray: &Ray,
        bytes: &Self::Bytes,
        state: &State,
        t_max: i64,
    ) -> Option<[ChildTest<State>; 2]> {
        child_states(ray, bytes, state, t_max, Coordinates::Modulo)
    }
}

fn root_state(ray: &Ray, root: &Subtree) -> Option<(Slabs, State)> {
    let placement = Placement::root(&root.bounds)?;
    let slabs = Slabs::new(ray, &placement.decoded());
    Some((slabs, State { context: placement.context, slabs }))
}

#[inline(always)]
fn child_states(
    ray: &Ray,
    bytes: &[u8; QuantizedPair::BYTES],
    state: &State,
    t_max: i64,
    coordinates: Coordinates,
) -> Option<[ChildTest<State>; 2]> {
    let view = QuantizedView::new(bytes);
    let test = |i| {
        let child = view.child(i);
        let cells = state.context.decode(&child, coordinates)?;
        let slabs = state.slabs.step(ray, &state.context, &cells);
        let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max);
        let context = State { context: state.context.child(&cells), slabs };
        Some(ChildTest { child: child.child, entry, context })
    };
    Some([test(0)?, test(1)?])
}
