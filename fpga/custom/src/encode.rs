//! The encoding of a node's children.

use glam::IVec3;
use xylem_core::compress::{Context, PairEncoder, Placement, PlacementEncoder};
use xylem_core::node::{Child, Coordinates, NodeIndex, Quantization, QuantizedPair, Subtree};

use crate::cfu::{Cfu, Unit, encode};

/// The encoder of children of [`Quantization::RELATIVE`] and [`Quantization::MODULO`] by the custom function
/// unit. Other quantizations are left to [`PlacementEncoder`].
#[derive(Debug)]
pub struct CustomEncoder<'a, C> {
    cfu: &'a C,
    quantization: Quantization,
}

const ENCODE: u32 = Unit::ENCODE;

impl<'a, C: Cfu> CustomEncoder<'a, C> {
    /// An encoder, and the only one until the next call.
    pub fn new(cfu: &'a C, quantization: Quantization) -> Self {
        let modulo = quantization.coordinates == Coordinates::Modulo;
        cfu.call::<ENCODE, { encode::MODULO }>(modulo.into(), 0);
        Self { cfu, quantization }
    }

    /// The 8 bytes of a child, and its placement if it is a node.
    #[inline(always)]
    fn child(&self, subtree: &Subtree) -> Option<(u64, Option<Placement>)> {
        let (min, max, cfu) = (subtree.bounds.min, subtree.bounds.max, self.cfu);
        cfu.call::<ENCODE, { encode::CHILD_X }>(min.x as u32, max.x as u32);
        cfu.call::<ENCODE, { encode::CHILD_Y }>(min.y as u32, max.y as u32);
        cfu.call::<ENCODE, { encode::CHILD_Z }>(min.z as u32, max.z as u32);
        let (leaf, pointer) = match subtree.child {
            Child::Inner(NodeIndex(index)) => (false, index),
            Child::Leaf { first, .. } => (true, first),
        };
        let high = cfu.call::<ENCODE, { encode::CODE_HIGH }>(0, 0);
        if high >> 31 == 0 {
            return None;
        }
        let low = cfu.call::<ENCODE, { encode::CODE_LOW }>(0, 0);
        // Code, leaf bit, pointer: see `QuantizedPair`.
        let high = high & 0xf | u32::from(leaf) << 4 | pointer << 5;
        let place = (!leaf).then(|| self.place());
        Some((u64::from(high) << 32 | u64::from(low), place))
    }

    /// The child's own placement.
    #[inline(always)]
    fn place(&self) -> Placement {
        let cfu = self.cfu;
        let lower = IVec3::new(
            cfu.call::<ENCODE, { encode::LOWER_X }>(0, 0) as i32,
            cfu.call::<ENCODE, { encode::LOWER_Y }>(0, 0) as i32,
            cfu.call::<ENCODE, { encode::LOWER_Z }>(0, 0) as i32,
        );
        let shapes = [
            cfu.call::<ENCODE, { encode::SHAPE_X }>(0, 0),
            cfu.call::<ENCODE, { encode::SHAPE_Y }>(0, 0),
            cfu.call::<ENCODE, { encode::SHAPE_Z }>(0, 0),
        ];
        let scale = shapes.map(|shape| (shape & 31) as u8);
        let mask = Quantization::RELATIVE.max_cells() - 1;
        let low = [0, 1, 2].map(|axis| (lower[axis] >> scale[axis] & mask) as u8);
        let cells = shapes.map(|shape| (shape >> 5) as u16);
        Placement { context: Context { scale, cells, low }, lower }
    }
}

impl<C: Cfu> PairEncoder for CustomEncoder<'_, C> {
    #[inline(always)]
    fn encode(
        &mut self,
        placement: &Placement,
        children: &[Subtree; 2],
        quantization: &Quantization,
    ) -> Option<([u8; QuantizedPair::MAX_BYTES], [Option<Placement>; 2])> {
        let fits = (quantization.bits, quantization.min_scale) == (6, 0);
        if !fits || *quantization != self.quantization {
            return PlacementEncoder.encode(placement, children, quantization);
        }
        let Placement { context, lower } = placement;
        let shape =
            |axis: usize| u32::from(context.cells[axis]) << 5 | u32::from(context.scale[axis]);
        let cfu = self.cfu;
        cfu.call::<ENCODE, { encode::PARENT_X }>(lower.x as u32, shape(0));
        cfu.call::<ENCODE, { encode::PARENT_Y }>(lower.y as u32, shape(1));
        cfu.call::<ENCODE, { encode::PARENT_Z }>(lower.z as u32, shape(2));
        let (left, right) = (self.child(&children[0])?, self.child(&children[1])?);
        let mut bytes = [0; QuantizedPair::MAX_BYTES];
        bytes[..8].copy_from_slice(&left.0.to_le_bytes());
        bytes[8..16].copy_from_slice(&right.0.to_le_bytes());
        Some((bytes, [left.1, right.1]))
    }
}
