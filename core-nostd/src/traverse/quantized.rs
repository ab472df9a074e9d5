//! Traversal of 16-byte quantized pairs with incremental plane distances.
//!
//! As in P3 Eq. 5, after Vaidyanathan et al. 2016: a child's planes are found from its parent's by
//! a step of a few cells, a multiplication of the 24-bit mantissa by a 6-bit count. The near plane's
//! step is rounded down, and so is the far plane's, which is counted inward from the parent's *far*
//! plane and subtracted: near times only err downward and far times upward, however deep the tree.

use super::search::{ChildTest, Traversable};
use super::slab::Slabs;
use crate::compress::{CellBox, Context, Coordinates, Placement};
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
        let slabs = step(ray, state, &cells);
        let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max);
        let context = State { context: state.context.child(&cells), slabs };
        Some(ChildTest { child: child.child, entry, context })
    };
    Some([test(0)?, test(1)?])
}

/// The plane distances of a child from those of its parent.
#[inline(always)]
fn step(ray: &Ray, parent: &State, child: &CellBox) -> Slabs {
    let mut slabs = parent.slabs;
    for (i, axis) in ray.axes().iter().enumerate() {
        // Cells from the parent's lower plane to the child's, and from the child's upper plane to
        // the parent's.
        let below = i32::from(child.low[i]);
        let above = i32::from(parent.context.cells[i]) - below - i32::from(child.width[i]);
        let (near, far) = if axis.negative { (above, below) } else { (below, above) };
        let scale = u32::from(parent.context.scale[i]);
        let inward = |cells| axis.reciprocal.step_down(cells, scale).to_bits();
        slabs.near[i] = slabs.near[i].wrapping_add(inward(near));
        slabs.far[i] = slabs.far[i].wrapping_sub(inward(far));
    }
    slabs
}
