//! The types of `xy_pkg` as bytes, lowest first, as pins carry them.

use xylem_core::compress::{Context, Placement};
use xylem_core::geom::Aabb;
use xylem_core::node::{Child, NodeIndex, QuantizedChild, Subtree};
use xylem_core::sort::Item;

/// A `box_t`: six coordinates of 24 bits.
pub fn box_bytes(bounds: &Aabb) -> Vec<u8> {
    let corners = [bounds.min, bounds.max];
    let coords = corners.iter().flat_map(|corner| corner.to_array());
    coords.flat_map(|c| c.to_le_bytes().into_iter().take(3)).collect()
}

/// A `record_t`.
pub fn record_bytes(item: &Item) -> Vec<u8> {
    let mut bytes = box_bytes(&item.bounds);
    bytes.extend(item.reference.to_le_bytes());
    bytes
}

/// A `split_t`: whether the code of a record differs from that of the one before it, and the highest bit
/// in which it does.
pub fn split(before: u64, code: u64) -> u64 {
    let bits = before ^ code;
    u64::from(bits > 0) << 6 | u64::from(bits.checked_ilog2().unwrap_or(0))
}

/// A `subtree_t`.
pub fn subtree_bytes(subtree: &Subtree) -> Vec<u8> {
    let (index, count) = match subtree.child {
        Child::Inner(NodeIndex(index)) => (index, 0),
        Child::Leaf { first, count } => (first, count as u8),
    };
    let mut bytes = box_bytes(&subtree.bounds);
    bytes.push(count);
    bytes.extend(index.to_le_bytes());
    bytes
}

/// A `place_t`.
pub fn place_bytes(place: &Placement) -> Vec<u8> {
    let Context { scale, cells, .. } = place.context;
    let scales = scale.map(|scale| (u64::from(scale), 5));
    let cells = cells.map(|cells| (u64::from(cells), 9));
    let lower = place.lower.to_array().map(|c| (c as u64 & 0xff_ffff, 24));
    packed(scales.into_iter().chain(cells).chain(lower))
}

/// The coordinates of a quantized child, `bits` bits each.
pub fn code_bytes(child: &QuantizedChild, bits: u8) -> Vec<u8> {
    let axis = |axis: usize| [child.low[axis], child.high[axis]];
    packed((0..3).flat_map(axis).map(|c| (u64::from(c), u32::from(bits))))
}

/// Fields of some bits each, the lowest first.
fn packed(fields: impl Iterator<Item = (u64, u32)>) -> Vec<u8> {
    let (mut word, mut at) = (0u128, 0);
    for (value, bits) in fields {
        word |= u128::from(value) << at;
        at += bits;
    }
    word.to_le_bytes()[..at.div_ceil(8) as usize].to_vec()
}
