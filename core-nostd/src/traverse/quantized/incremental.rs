//! Incremental plane distances.
//!
//! As in P3 Eq. 5, after Vaidyanathan et al. 2016: a child's planes are found from its parent's by
//! a step of a few cells, see [`Slabs::step`].

use super::Bytes;
use crate::compress::{Context, Placement};
use crate::geom::Ray;
use crate::node::{Quantization, Subtree, WideNode};
use crate::traverse::search::{Pending, Traversable};
use crate::traverse::slab::Slabs;

/// Nodes of `N` children, 2 or 4, and any width and coordinates.
#[derive(Debug)]
pub(in crate::traverse) struct Incremental<const N: usize>(pub Quantization);

/// What the search keeps of a node: its grid and its plane distances.
#[derive(Clone, Copy, Debug)]
pub(in crate::traverse) struct State {
    context: Context,
    slabs: Slabs,
}

impl<const N: usize> Traversable<N> for Incremental<N> {
    type Context = State;
    type Bytes = Bytes;
    const EMPTY: Bytes = [0; WideNode::MAX_BYTES];

    fn root(&self, ray: &Ray, root: &Subtree, _: i64) -> Option<State> {
        let placement = Placement::root(&root.bounds, &self.0)?;
        let slabs = Slabs::new(ray, &placement.decoded());
        Some(State { context: placement.context, slabs })
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
        State { context, slabs }: &State,
        t_max: i64,
    ) -> Option<[Option<Pending<State>>; N]> {
        super::children(&self.0, bytes, context, |cells| {
            let slabs = slabs.step(ray, context, cells);
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max)?;
            Some((entry, State { context: context.child(cells, &self.0), slabs }))
        })
    }
}
