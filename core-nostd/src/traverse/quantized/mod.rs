//! Traversal of quantized pairs, in three ways.
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
use crate::node::{Quantization, QuantizedPair, QuantizedView};

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
type Bytes = [u8; QuantizedPair::MAX_BYTES];

/// Decodes both children and tests their boxes, or gives `None` if one leaves its parent's. `test`
/// gives the time at which a box is entered and what to keep of the child.
#[inline(always)]
fn children<C>(
    quantization: &Quantization,
    bytes: &Bytes,
    context: &Context,
    test: impl Fn(&CellBox) -> Option<(i64, C)>,
) -> Option<[Option<Pending<C>>; 2]> {
    let view = QuantizedView::new(bytes, quantization.bits);
    let one = |i| {
        let child = view.child(i);
        let cells = context.decode(&child, quantization)?;
        let pending = |(entry, context)| Pending { child: child.child, entry, context };
        Some(test(&cells).map(pending))
    };
    Some([one(0)?, one(1)?])
}
