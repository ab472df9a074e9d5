//! Traversal of quantized pairs and wide nodes, in three ways.
//!
//! All of them find the same hits. They differ in what the search keeps of a node, in what they
//! multiply to test the boxes of its children, and in how much wider than decoded a box appears:
//! see [`Method`] for what each is, and [`Cost`] for its widths. For coordinates of 6 bits:
//!
//! | method      | multipliers for the two boxes of a node | for the point            | stack entry            |
//! |-------------|------------------------------|-----------------------------------|------------------------|
//! | decompress  | 12 of 31 × 24 bits           |                                   | 168 bits               |
//! | point       | 12 of 9 × 10                 | 3 of 31 × 10; after a pop 31 × 34 | 168                    |
//! | incremental | 12 of 24 × 6                 |                                   | 288; modulo 306        |

mod cost;
mod decompress;
mod incremental;
mod point;

pub use cost::{Cost, Multipliers};
pub(super) use decompress::Decompress;
pub(super) use incremental::Incremental;
pub(super) use point::ByPoint;
pub use point::TraversalPoint;

use super::search::Pending;
use crate::compress::{CellBox, Context};
use crate::node::{Quantization, QuantizedChild, QuantizedView, WideNode, WideView};

/// How the boxes of quantized nodes are tested.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Method {
    /// Decompress and test: a child's planes are decoded to grid units and tested like those of a
    /// 64-byte node. Exact up to the rounding of its distances.
    Decompress,
    /// Keely's traversal-point update (Keely 2014, as thesis §3.2 describes it): the origin is moved
    /// along the ray to where it enters the node. Seen from there, the node's local grid is all
    /// there is, and both distances and reciprocals may be short numbers.
    TraversalPoint,
    /// Vaidyanathan's incremental distances (P3 Eq. 5): a child's plane distances are its parent's
    /// plus a step of some cells.
    #[default]
    Incremental,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::Decompress, Self::TraversalPoint, Self::Incremental];
}

/// The bytes of a node.
type Bytes = [u8; WideNode::MAX_BYTES];

/// Child `i` of a node of `N`, if it has that many.
#[inline(always)]
fn child<const N: usize>(
    quantization: &Quantization,
    bytes: &Bytes,
    i: usize,
) -> Option<QuantizedChild> {
    if N == 2 {
        let pair = bytes.first_chunk()?;
        return Some(QuantizedView::new(pair, quantization.bits).child(i));
    }
    WideView::new(bytes, quantization.bits).child(i)
}

/// How many children a node has.
#[inline(always)]
fn boxes<const N: usize>(quantization: &Quantization, bytes: &Bytes) -> usize {
    if N == 2 { N } else { (0..N).filter_map(|i| child::<N>(quantization, bytes, i)).count() }
}

/// Decodes the children and tests their boxes, or gives `None` if one leaves its parent's. `test`
/// gives the time at which a box is entered and what to keep of the child.
#[inline(always)]
fn children<C: Copy, const N: usize>(
    quantization: &Quantization,
    bytes: &Bytes,
    context: &Context,
    test: impl Fn(&CellBox) -> Option<(i64, C)>,
) -> Option<[Option<Pending<C>>; N]> {
    let mut children = [None; N];
    for (i, pending) in children.iter_mut().enumerate() {
        let Some(code) = child::<N>(quantization, bytes, i) else { continue };
        let cells = context.decode(&code, quantization)?;
        let found = |(entry, context)| Pending { child: code.child, entry, context };
        *pending = test(&cells).map(found);
    }
    Some(children)
}
