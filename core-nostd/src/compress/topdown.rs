//! Top-down compression: a separate pass over a finished tree, the baseline of P3.

use heapless::Vec;

use super::Placement;
use crate::emit::MAX_DEPTH;
use crate::error::{BuildError, RegionName};
use crate::mem::{Bus, Region};
use crate::node::{
    Bvh2Node, Bvh2View, Child, NodeFormat, NodeIndex, Quantization, QuantizedPair, Subtree, Tree,
};
use crate::probe::{Probe, Stage};

/// How the children of a node are encoded: by [`PlacementEncoder`], or by instructions that the machine has for
/// it.
pub trait PairEncoder {
    /// The bytes of the quantized pair over `children` of a node in `placement`, and the placements of those
    /// that are nodes; `None` if a child's box is none or leaves its parent's. The quantization has been checked.
    fn encode(
        &mut self,
        placement: &Placement,
        children: &[Subtree; 2],
        quantization: &Quantization,
    ) -> Option<([u8; QuantizedPair::MAX_BYTES], [Option<Placement>; 2])>;
}

/// [`Placement::encode`] and [`Placement::child`].
#[derive(Clone, Copy, Debug)]
pub struct PlacementEncoder;

impl PairEncoder for PlacementEncoder {
    #[inline(always)]
    fn encode(
        &mut self,
        placement: &Placement,
        children: &[Subtree; 2],
        quantization: &Quantization,
    ) -> Option<([u8; QuantizedPair::MAX_BYTES], [Option<Placement>; 2])> {
        let encode = |i: usize| {
            let subtree = &children[i];
            let (code, cells) = placement.encode(&subtree.bounds, subtree.child, quantization)?;
            let inner = matches!(subtree.child, Child::Inner(_));
            Some((code, inner.then(|| placement.child(&cells, quantization))))
        };
        let (left, right) = (encode(0)?, encode(1)?);
        let pair = QuantizedPair { children: [left.0, right.0] };
        Some((pair.to_bytes(quantization.bits), [left.1, right.1]))
    }
}

/// Reads the 64-byte nodes of `tree` from the root down and writes each as a quantized pair, at the
/// same index, to `target`. Returns the descriptor of the quantized tree, which shares the leaf
/// table.
///
/// # Errors
/// A bus error; a target that is too small; more nodes or entries than 27-bit pointers can name; a
/// node in memory that no builder writes, among them one that is reached twice or a child outside
/// its parent's box. The source tree is left as it was.
pub fn compress_top_down<B: Bus, P: Probe>(
    bus: &mut B,
    tree: &Tree,
    target: Region,
    quantization: &Quantization,
    probe: &mut P,
) -> Result<Tree, BuildError<B::Error>> {
    compress_encoding(&mut PlacementEncoder, bus, tree, target, quantization, probe)
}

/// [`compress_top_down`] with the children encoded by `encoder`.
///
/// # Errors
/// As [`compress_top_down`].
pub fn compress_encoding<E: PairEncoder, B: Bus, P: Probe>(
    encoder: &mut E,
    bus: &mut B,
    tree: &Tree,
    target: Region,
    quantization: &Quantization,
    probe: &mut P,
) -> Result<Tree, BuildError<B::Error>> {
    const STAGE: Stage = Stage::Compress;
    quantization.check()?;
    let format = NodeFormat::Quantized(*quantization);
    let quantized = Tree { format, nodes: target, ..*tree };
    if tree.node_count.max(tree.entry_count) > QuantizedPair::MAX_POINTER {
        return Err(BuildError::PointerOverflow);
    }
    let needed = u64::from(tree.node_count) * u64::from(format.bytes());
    if needed > u64::from(target.size) {
        let region = RegionName::QuantizedNodes;
        return Err(BuildError::RegionFull { region, needed, available: target.size });
    }
    let Some(root) = tree.root else { return Ok(quantized) };
    let Child::Inner(root_index) = root.child else { return Ok(quantized) };
    if tree.format != NodeFormat::Bvh2 {
        return Err(BuildError::CorruptNode { index: root_index.0 });
    }
    probe.stage(STAGE);

    let corrupt = |index: NodeIndex| BuildError::CorruptNode { index: index.0 };
    let placement = Placement::root(&root.bounds, quantization).ok_or(corrupt(root_index))?;
    // A node is popped before its two children are pushed, so depth + 1 entries are enough.
    let mut stack = Vec::<(NodeIndex, Placement), { MAX_DEPTH + 1 }>::new();
    let mut next = Some((root_index, placement));
    let mut visits = 0;
    while let Some((index, placement)) = next {
        visits += 1;
        let stride = Bvh2Node::BYTES as u32;
        let source = tree.nodes.record(index.0, stride).filter(|_| index.0 < tree.node_count);
        let source = source.filter(|_| visits <= tree.node_count).ok_or(corrupt(index))?;
        let mut bytes = [0; Bvh2Node::BYTES];
        let failed = |addr| move |error| BuildError::Bus { stage: STAGE, addr, error };
        bus.read(source, &mut bytes).map_err(failed(source))?;
        let node = Bvh2View::new(&bytes).to_repr().ok_or(corrupt(index))?;

        let encoded = encoder.encode(&placement, &node.children, quantization);
        let (bytes, places) = encoded.ok_or(corrupt(index))?;
        let addr = target.record(index.0, format.bytes()).ok_or(corrupt(index))?;
        bus.write(addr, &bytes[..format.bytes() as usize]).map_err(failed(addr))?;

        for (subtree, place) in node.children.iter().zip(places).rev() {
            if let (Child::Inner(child_index), Some(place)) = (subtree.child, place) {
                stack.push((child_index, place)).map_err(|_| corrupt(index))?;
            }
        }
        next = stack.pop();
    }
    Ok(quantized)
}
