//! Backtracking: nodes that were encoded in a context that turned out to be wrong are encoded
//! again (P3 Algorithm 1, `Backtrack`).

use heapless::Vec;

use super::Placement;
use super::lines::LineBuffer;
use crate::emit::MAX_DEPTH;
use crate::error::BuildError;
use crate::mem::Bus;
use crate::node::{
    Child, NodeIndex, Quantization, QuantizedChild, QuantizedPair, QuantizedView, WideNode,
    WideView,
};
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
    pub fn is_needed(&self, quantization: &Quantization) -> bool {
        self.old.is_outdated(&self.new, quantization)
    }
}

/// The children of a node; a pair has two.
pub(super) type Children = [Option<QuantizedChild>; WideNode::CHILDREN];

/// A format of quantized nodes, as repairs see it.
pub(super) trait Record {
    /// Bytes of a node.
    fn len(quantization: &Quantization) -> u32;
    /// The children of the node in the first bytes.
    fn read(bytes: &[u8; WideNode::MAX_BYTES], bits: u8) -> Children;
    /// The node with these children.
    fn write(children: Children, bits: u8) -> [u8; WideNode::MAX_BYTES];
}

impl Record for QuantizedPair {
    fn len(quantization: &Quantization) -> u32 {
        quantization.node_bytes()
    }

    fn read(bytes: &[u8; WideNode::MAX_BYTES], bits: u8) -> Children {
        let mut pair = [0; Self::MAX_BYTES];
        pair.copy_from_slice(&bytes[..Self::MAX_BYTES]);
        let view = QuantizedView::new(&pair, bits);
        [Some(view.child(0)), Some(view.child(1)), None, None]
    }

    fn write([first, second, ..]: Children, bits: u8) -> [u8; WideNode::MAX_BYTES] {
        let child = |child: Option<_>| child.unwrap_or(QuantizedChild::EMPTY);
        let pair = Self { children: [child(first), child(second)] };
        let mut bytes = [0; WideNode::MAX_BYTES];
        bytes[..Self::MAX_BYTES].copy_from_slice(&pair.to_bytes(bits));
        bytes
    }
}

impl Record for WideNode {
    fn len(quantization: &Quantization) -> u32 {
        quantization.wide_bytes()
    }

    fn read(bytes: &[u8; WideNode::MAX_BYTES], bits: u8) -> Children {
        WideView::new(bytes, bits).to_repr().children
    }

    fn write(children: Children, bits: u8) -> [u8; WideNode::MAX_BYTES] {
        Self { children }.to_bytes(bits)
    }
}

/// Encodes a node and all below it again, as far as contexts differ. `through` lines are read
/// from and written back to memory one by one, as P3 assumes; otherwise they are kept.
///
/// A child has a lower index than its parent, or the tree is corrupt; so every way down ends. And no
/// node is below two others, so that there is no more to do than there are nodes.
///
/// # Errors
/// [`BuildError::Bus`]; [`BuildError::CorruptNode`] for a node that no compressor wrote.
pub(super) fn backtrack<R: Record, B: Bus, P: Probe>(
    bus: &mut B,
    lines: &mut LineBuffer,
    through: bool,
    quantization: &Quantization,
    first: Repair,
    probe: &mut P,
) -> Result<(), BuildError<B::Error>> {
    // A repair is popped before its children are pushed, and each but the last of four is another
    // level of the binary tree or beside one.
    let mut stack = Vec::<(Repair, u8), { 3 * MAX_DEPTH + 1 }>::new();
    let mut next = Some((first, 1));
    let mut left = first.index.0;
    let len = R::len(quantization);
    while let Some((repair, depth)) = next {
        let NodeIndex(index) = repair.index;
        let corrupt = BuildError::CorruptNode { index };
        let offset = index.checked_mul(len).ok_or(BuildError::CorruptNode { index })?;
        probe.backtrack(depth);
        if through {
            lines.release(bus, offset, len as usize, probe)?;
        }
        let mut bytes = [0; WideNode::MAX_BYTES];
        lines.get(bus, offset, &mut bytes[..len as usize], probe)?;

        let (old, new) = (&repair.old, &repair.new);
        let recode = |child: &QuantizedChild| {
            let (code, [old, new]) = old.recode(new, child, quantization)?;
            let below = match child.child {
                Child::Inner(below) if below.0 < index => Some(Repair { index: below, old, new }),
                Child::Inner(_) => return None,
                Child::Leaf { .. } => None,
            };
            Some((code, below.filter(|repair| repair.is_needed(quantization))))
        };
        let mut children = R::read(&bytes, quantization.bits);
        let mut below = [None; WideNode::CHILDREN];
        for (child, below) in children.iter_mut().zip(&mut below) {
            let Some(code) = child else { continue };
            let Some(recoded) = recode(code) else { return Err(corrupt) };
            (*code, *below) = recoded;
        }
        let bytes = R::write(children, quantization.bits);
        lines.put(bus, offset, &bytes[..len as usize], probe)?;
        if through {
            lines.release(bus, offset, len as usize, probe)?;
        }
        for below in below.into_iter().rev().flatten() {
            left = left.checked_sub(1).ok_or(BuildError::CorruptNode { index })?;
            let pushed = stack.push((below, depth.saturating_add(1)));
            pushed.map_err(|_| BuildError::CorruptNode { index })?;
        }
        next = stack.pop();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use glam::IVec3;

    use super::*;
    use crate::compress::Context;
    use crate::mem::{ByteAddr, Region};

    const NODES: u32 = 40;

    /// Memory that returns what it held at first, whatever is written.
    struct Stubborn {
        nodes: [[u8; 16]; NODES as usize],
        reads: u32,
    }

    impl Bus for Stubborn {
        type Error = ();

        fn read(&mut self, ByteAddr(addr): ByteAddr, buf: &mut [u8]) -> Result<(), ()> {
            self.reads += 1;
            buf.copy_from_slice(&self.nodes.as_flattened()[addr as usize..][..buf.len()]);
            Ok(())
        }

        fn write(&mut self, _: ByteAddr, _: &[u8]) -> Result<(), ()> {
            Ok(())
        }
    }

    /// A chain of nodes, each of which needs a repair and has the one before as child 1, and as child 0
    /// what `child` says. Repairs the last one.
    fn repair_chain(child: impl Fn(u32) -> Child) -> (Result<(), BuildError<()>>, u32) {
        let quantization = Quantization::MODULO;
        let leaf = Child::Leaf { first: 0, count: Child::TO_MARK };
        // The parent's box again: 64 cells from cell 1 on, which are 33 on the next coarser grid.
        let whole = |child| QuantizedChild { low: [1; 3], high: [1; 3], child };
        let mut bus = Stubborn { nodes: [[0; 16]; NODES as usize], reads: 0 };
        for (i, node) in (0u32..).zip(&mut bus.nodes) {
            let below = i.checked_sub(1).map_or(leaf, |below| Child::Inner(NodeIndex(below)));
            let first = if i == 0 { leaf } else { child(i) };
            let pair = QuantizedPair { children: [whole(first), whole(below)] };
            node.copy_from_slice(&pair.to_bytes(6)[..16]);
        }
        let place = |scale, cells, low: u8| Placement {
            context: Context { scale: [scale; 3], cells: [cells; 3], low: [low; 3] },
            lower: IVec3::splat(i32::from(low) << scale),
        };
        let first =
            Repair { index: NodeIndex(NODES - 1), old: place(7, 64, 1), new: place(8, 33, 0) };
        let mut lines = LineBuffer::new(Region::new(0, 16 * NODES), 2);
        let outcome = backtrack::<QuantizedPair, _, _>(
            &mut bus,
            &mut lines,
            true,
            &quantization,
            first,
            &mut (),
        );
        (outcome, bus.reads)
    }

    #[test]
    fn a_chain_is_repaired_node_by_node() {
        let leaf = |_| Child::Leaf { first: 0, count: Child::TO_MARK };
        assert_eq!(repair_chain(leaf), (Ok(()), NODES));
    }

    #[test]
    fn nodes_below_two_others_do_not_multiply_the_work() {
        // Were each way down followed, there would be 2^40.
        let (outcome, reads) = repair_chain(|i| Child::Inner(NodeIndex(i - 1)));
        assert!(matches!(outcome, Err(BuildError::CorruptNode { .. })), "{outcome:?}");
        assert!(reads <= NODES, "{reads}");
    }
}
