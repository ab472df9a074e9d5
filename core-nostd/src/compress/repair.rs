//! Backtracking: nodes that were encoded in a context that turned out to be wrong are encoded
//! again (P3 Algorithm 1, `Backtrack`).

use glam::IVec3;
use heapless::Vec;

use super::lines::LineBuffer;
use super::{CellBox, Placement};
use crate::emit::MAX_DEPTH;
use crate::error::BuildError;
use crate::geom::Aabb;
use crate::mem::Bus;
use crate::node::{Child, Coordinates, NodeIndex, Quantization, QuantizedPair, QuantizedView};
use crate::probe::Probe;

/// A node and the context that it is in, and the one that it is to be in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Repair {
    pub index: NodeIndex,
    pub old: Placement,
    pub new: Placement,
}

impl Repair {
    /// Whether the node must be encoded again.
    ///
    /// Modulo coordinates name cells of a scene-wide grid: they stay right while its scale does (P3
    /// §4.2). Relative ones must also count from the same lower bound; the number of its cell modulo
    /// 2^N tells, as both boxes hold the same exact one and span 2^N cells at most. Boxes that were
    /// encoded on a coarser grid before may also stick out of a decoded box that has become smaller.
    pub fn is_needed(&self, quantization: &Quantization) -> bool {
        let (old, new) = (&self.old.context, &self.new.context);
        let moved = quantization.coordinates == Coordinates::Relative && old.low != new.low;
        old.scale != new.scale || moved || !self.new.decoded().contains(&self.old.decoded())
    }
}

/// Encodes a node and all below it again, as far as contexts differ. `through` lines are read
/// from and written back to memory one by one, as P3 assumes; otherwise they are kept.
///
/// A child has a lower index than its parent, or the tree is corrupt; so every way down ends.
///
/// # Errors
/// [`BuildError::Bus`]; [`BuildError::CorruptNode`] for a node that no compressor wrote.
pub(super) fn backtrack<B: Bus, P: Probe>(
    bus: &mut B,
    lines: &mut LineBuffer,
    through: bool,
    quantization: &Quantization,
    first: Repair,
    probe: &mut P,
) -> Result<(), BuildError<B::Error>> {
    // A repair is popped before its two children are pushed, so depth + 1 entries are enough.
    let mut stack = Vec::<(Repair, u8), { MAX_DEPTH + 1 }>::new();
    let mut next = Some((first, 1));
    while let Some((repair, depth)) = next {
        let NodeIndex(index) = repair.index;
        let corrupt = BuildError::CorruptNode { index };
        let len = quantization.node_bytes();
        let offset = index.checked_mul(len).ok_or(BuildError::CorruptNode { index })?;
        probe.backtrack(depth);
        if through {
            lines.release(bus, offset, len as usize, probe)?;
        }
        let mut bytes = [0; QuantizedPair::MAX_BYTES];
        lines.get(bus, offset, &mut bytes[..len as usize], probe)?;
        let view = QuantizedView::new(&bytes, quantization.bits);

        let recode = |i: usize| {
            let child = view.child(i);
            let cells = repair.old.context.decode(&child, quantization)?;
            let bounds = inclusive(&repair.old, &cells, &repair.new);
            let (code, recoded) = repair.new.encode(&bounds, child.child, quantization)?;
            let (old, new) = (&repair.old, &repair.new);
            let below = match child.child {
                Child::Inner(below) if below.0 < index => Some(Repair {
                    index: below,
                    old: old.child(&cells, quantization),
                    new: new.child(&recoded, quantization),
                }),
                Child::Inner(_) => return None,
                Child::Leaf { .. } => None,
            };
            Some((code, below.filter(|repair| repair.is_needed(quantization))))
        };
        let (Some(left), Some(right)) = (recode(0), recode(1)) else { return Err(corrupt) };
        let pair = QuantizedPair { children: [left.0, right.0] };
        lines.put(bus, offset, &pair.to_bytes(quantization.bits)[..len as usize], probe)?;
        if through {
            lines.release(bus, offset, len as usize, probe)?;
        }
        for below in [right.1, left.1].into_iter().flatten() {
            stack
                .push((below, depth.saturating_add(1)))
                .map_err(|_| BuildError::CorruptNode { index })?;
        }
        next = stack.pop();
    }
    Ok(())
}

/// The decoded box of a child, with its upper bound inside, cut to its parent's new box.
///
/// Decoded upper bounds are outside a box by P3 Eq. 1, so that rounding one again must not add
/// another cell to it. The exact box is in both the child's and the parent's.
fn inclusive(parent: &Placement, child: &CellBox, new: &Placement) -> Aabb {
    let scale = parent.context.scale;
    let low = |axis: usize| parent.lower[axis] + (i32::from(child.low[axis]) << scale[axis]);
    let high = |axis: usize| low(axis) + (i32::from(child.width[axis]) << scale[axis]) - 1;
    let decoded = new.decoded();
    Aabb::new(
        IVec3::new(low(0), low(1), low(2)).max(decoded.min),
        IVec3::new(high(0), high(1), high(2)).min(decoded.max - IVec3::ONE),
    )
}
