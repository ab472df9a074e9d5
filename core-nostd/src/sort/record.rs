//! The byte formats that the sorter reads and writes.

use glam::IVec3;

use super::MAX_BURST;
use crate::error::{BuildError, RegionName};
use crate::geom::{Aabb, PrimIndex, Triangle};
use crate::mem::{BurstWriter, Bus, Region};
use crate::num::{Grid, MortonCoder};
use crate::probe::Stage;

/// A primitive on its way through the sorter: 256 bits in P2 §5.1, with a 32-bit code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(C)]
pub struct Item {
    /// The box.
    pub bounds: Aabb,
    /// The Morton code of the box's centre.
    pub code: u64,
    /// What the leaf table will hold: the primitive's reference, at most 31 bits.
    pub reference: u32,
}

impl Item {
    /// A point at the origin; a filler for storage.
    pub const ZERO: Self =
        Self { code: 0, bounds: Aabb::new(IVec3::ZERO, IVec3::ZERO), reference: 0 };
}

/// What the input region consists of.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum InputFormat {
    /// 32-byte boxes with a reference (P2 §5.1): lowest corner and highest corner as 3 × i32 each,
    /// the reference as u32, and 4 bytes that are not read (the code's place on chip).
    #[default]
    Box32,
    /// 40-byte triangles (P3 §5), see [`Triangle::BYTES`]; the reference is the position.
    Triangle40,
}

impl InputFormat {
    /// Bytes of a record.
    pub const fn bytes(self) -> u32 {
        match self {
            Self::Box32 => 32,
            Self::Triangle40 => Triangle::BYTES as u32,
        }
    }

    /// The box and the reference of the record at `index`.
    #[inline(always)]
    fn decode(self, bytes: &[u8], index: u32) -> (Aabb, u32) {
        match self {
            Self::Box32 => (read_box(bytes), word(bytes, 24) as u32),
            Self::Triangle40 => {
                let mut record = [0; Triangle::BYTES];
                record.copy_from_slice(&bytes[..Triangle::BYTES]);
                (Triangle::from_bytes(&record).bounds(), index)
            }
        }
    }
}

/// What a sorted run consists of. The tree that comes out is the same for all.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecordFormat {
    /// The 32-byte boxes of [`InputFormat::Box32`]; the code is computed anew on reading.
    #[default]
    Box32,
    /// 22 bytes: six 24-bit coordinates (lowest corner, highest corner) and the reference as u32.
    Packed22,
    /// 8 bytes: a 30-bit code and the position in the input. The box is fetched from the input when
    /// the hierarchy is emitted, in input order's place, not the run's (P2 Table I).
    Pair8,
}

impl RecordFormat {
    /// Bytes of a record.
    pub const fn bytes(self) -> u32 {
        match self {
            Self::Box32 => 32,
            Self::Packed22 => 22,
            Self::Pair8 => 8,
        }
    }

    /// The longest record, in bytes.
    pub const MAX_BYTES: usize = 32;

    /// Writes `item` to the start of `bytes`, which have room for a record.
    #[inline(always)]
    pub fn encode(self, item: &Item, bytes: &mut [u8]) {
        match self {
            Self::Box32 => {
                write_box(&item.bounds, bytes);
                bytes[24..28].copy_from_slice(&item.reference.to_le_bytes());
                bytes[28..32].fill(0);
            }
            Self::Packed22 => {
                let corners = [item.bounds.min, item.bounds.max];
                let coordinates = corners.iter().flat_map(|corner| corner.to_array());
                for (three, c) in bytes.chunks_exact_mut(3).zip(coordinates) {
                    three.copy_from_slice(&c.to_le_bytes()[..3]);
                }
                bytes[18..22].copy_from_slice(&item.reference.to_le_bytes());
            }
            Self::Pair8 => {
                bytes[..4].copy_from_slice(&(item.code as u32).to_le_bytes());
                bytes[4..8].copy_from_slice(&item.reference.to_le_bytes());
            }
        }
    }

    /// Accepts `item` in a burst writer.
    ///
    /// # Errors
    /// As [`BurstWriter::push`].
    #[inline(always)]
    pub(crate) fn push<B: Bus>(
        self,
        item: &Item,
        bus: &mut B,
        writer: &mut BurstWriter,
    ) -> Result<(), BuildError<B::Error>> {
        match self {
            Self::Box32 => self.encode(item, writer.reserve::<B, 32>(bus)?),
            Self::Packed22 => self.encode(item, writer.reserve::<B, 22>(bus)?),
            Self::Pair8 => self.encode(item, writer.reserve::<B, 8>(bus)?),
        }
        Ok(())
    }

    /// Writes a cluster's record, which has its code in the last 4 bytes.
    #[inline]
    pub(crate) fn encode_cluster(record: &Item, bytes: &mut [u8; Self::MAX_BYTES]) {
        Self::Box32.encode(record, bytes);
        bytes[28..].copy_from_slice(&(record.code as u32).to_le_bytes());
    }

    /// Reads a cluster's record from `bytes`, which hold a whole one.
    #[inline]
    pub(crate) fn decode_cluster(bytes: &[u8]) -> Item {
        let code = u64::from(word(bytes, 28) as u32);
        Item { code, bounds: read_box(bytes), reference: word(bytes, 24) as u32 }
    }

    /// Reads an item from the start of `bytes`, which hold a whole record. The item of a
    /// [`RecordFormat::Pair8`] has no box.
    #[inline(always)]
    pub fn decode(self, bytes: &[u8], coder: &MortonCoder) -> Item {
        let (bounds, reference) = match self {
            Self::Box32 => (read_box(bytes), word(bytes, 24) as u32),
            Self::Packed22 => {
                let c = |i: usize| {
                    i32::from_le_bytes([0, bytes[3 * i], bytes[3 * i + 1], bytes[3 * i + 2]]) >> 8
                };
                let (min, max) = (IVec3::new(c(0), c(1), c(2)), IVec3::new(c(3), c(4), c(5)));
                (Aabb::new(min, max), word(bytes, 18) as u32)
            }
            Self::Pair8 => {
                let code = u64::from(word(bytes, 0) as u32);
                return Item { code, reference: word(bytes, 4) as u32, ..Item::ZERO };
            }
        };
        Item { code: coder.code(bounds.min, bounds.max), bounds, reference }
    }
}

#[inline(always)]
fn word(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[inline(always)]
fn read_box(bytes: &[u8]) -> Aabb {
    let vector = |at: usize| IVec3::new(word(bytes, at), word(bytes, at + 4), word(bytes, at + 8));
    Aabb::new(vector(0), vector(12))
}

#[inline(always)]
fn write_box(bounds: &Aabb, bytes: &mut [u8]) {
    let coordinates = bounds.min.to_array().into_iter().chain(bounds.max.to_array());
    for (four, c) in bytes.chunks_exact_mut(4).zip(coordinates) {
        four.copy_from_slice(&c.to_le_bytes());
    }
}

/// Turns input records into items: checks them and computes their codes.
#[derive(Clone, Copy, Debug)]
pub struct PrimitiveDecoder {
    /// What a record is.
    pub format: InputFormat,
    /// The grid that its box must lie on.
    pub grid: Grid,
    /// What computes its code.
    pub coder: MortonCoder,
    /// The reference is the position, whatever the record says (for pairs, which come back for
    /// their box).
    pub by_position: bool,
}

impl PrimitiveDecoder {
    /// The item of the record in `bytes`, at position `index` of the input. `bytes` hold a whole
    /// record.
    ///
    /// # Errors
    /// The position, if the box is inverted or off the grid, or the reference has 32 bits.
    #[inline(always)]
    pub fn decode(&self, bytes: &[u8], index: u32) -> Result<Item, PrimIndex> {
        let (bounds, reference) = self.format.decode(bytes, index);
        let on_grid = self.grid.contains(bounds.min) && self.grid.contains(bounds.max);
        if !on_grid || !bounds.is_valid() || reference >> 31 != 0 {
            return Err(PrimIndex(index));
        }
        let reference = if self.by_position { index } else { reference };
        Ok(Item { code: self.coder.code(bounds.min, bounds.max), bounds, reference })
    }
}

/// The unit that reads primitives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PrimitiveReader {
    pub region: Region,
    pub count: u32,
    pub decoder: PrimitiveDecoder,
}

impl PrimitiveReader {
    /// Reads primitives `first ..` in one burst into `items`, at most [`MAX_BURST`] of them.
    ///
    /// # Errors
    /// A bus error, a region too small for `count` primitives, or one that
    /// [`PrimitiveDecoder::decode`] refuses.
    pub fn read<B: Bus>(
        &self,
        bus: &mut B,
        stage: Stage,
        first: u32,
        items: &mut [Item],
    ) -> Result<(), BuildError<B::Error>> {
        let mut buffer = [0; MAX_BURST * Triangle::BYTES];
        let stride = self.decoder.format.bytes() as usize;
        let bytes = &mut buffer[..items.len() * stride];
        let offset = first.checked_mul(stride as u32);
        let addr = offset.and_then(|offset| self.region.at(offset, bytes.len() as u32));
        let addr = addr.ok_or(BuildError::RegionFull {
            region: RegionName::Primitives,
            needed: u64::from(self.count) * stride as u64,
            available: self.region.size,
        })?;
        bus.read(addr, bytes).map_err(|error| BuildError::Bus { stage, addr, error })?;
        for (i, (item, record)) in items.iter_mut().zip(bytes.chunks_exact(stride)).enumerate() {
            let decoded = self.decoder.decode(record, first + i as u32);
            *item = decoded.map_err(|index| BuildError::InvalidPrimitive { index })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::MortonWidth;

    #[test]
    fn every_record_format_gives_the_item_back() {
        let coder = MortonCoder::new(Grid::DEFAULT, MortonWidth::Bits30);
        let bounds = Aabb::new(IVec3::new(-8_388_608, -1, 77), IVec3::new(8_388_607, 0, 78_000));
        let code = coder.code(bounds.min, bounds.max);
        let item = Item { code, bounds, reference: 0x7fff_fffe };
        for format in [RecordFormat::Box32, RecordFormat::Packed22, RecordFormat::Pair8] {
            let mut bytes = [0xaa; RecordFormat::MAX_BYTES];
            format.encode(&item, &mut bytes);
            let back = format.decode(&bytes[..format.bytes() as usize], &coder);
            assert_eq!((back.code, back.reference), (item.code, item.reference), "{format:?}");
            if format != RecordFormat::Pair8 {
                assert_eq!(back.bounds, item.bounds, "{format:?}");
            }
        }
    }
}
