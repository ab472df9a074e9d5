//! Queries and their answers.

use core::fmt;

use fixed::FixedU32;
use fixed::types::extra::U30;

use crate::error::RegionName;
use crate::geom::{Intersection, PrimIndex};
use crate::mem::ByteAddr;
use crate::num::Time;

/// A barycentric weight: UQ2.30, rounded down, in [0, 1].
pub type Barycentric = FixedU32<U30>;

/// What a ray is asked.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Query {
    /// The first triangle along the ray.
    #[default]
    Closest,
    /// Whether there is any triangle within the interval.
    Any,
}

/// Where a ray meets a triangle: `p = (1 - u - v) v0 + u v1 + v v2`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Hit {
    /// The triangle.
    pub primitive: PrimIndex,
    /// The time, rounded up.
    pub t: Time,
    /// Weight of vertex 1.
    pub u: Barycentric,
    /// Weight of vertex 2.
    pub v: Barycentric,
}

impl Hit {
    /// Bytes of a hit record: `t` as i64 (units of 2⁻⁶), the primitive as u32 (`0xffff_ffff` for a
    /// miss), `u` and `v` as u32 (units of 2⁻³⁰), and 4 bytes of zero; little-endian.
    pub const BYTES: usize = 24;

    /// The hit of a triangle at an intersection.
    pub fn new(primitive: PrimIndex, at: &Intersection) -> Self {
        // u and v are below 2^90 and at most the denominator, so neither step can overflow.
        let weight = |n: i128| Barycentric::from_bits(((n << 30) / at.denominator) as u32);
        Self { primitive, t: at.t, u: weight(at.u), v: weight(at.v) }
    }

    /// The record of a hit or a miss.
    pub fn to_bytes(hit: Option<&Self>) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let primitive = hit.map_or(u32::MAX, |hit| hit.primitive.0);
        bytes[8..12].copy_from_slice(&primitive.to_le_bytes());
        if let Some(hit) = hit {
            bytes[..8].copy_from_slice(&hit.t.to_bits().to_le_bytes());
            bytes[12..16].copy_from_slice(&hit.u.to_bits().to_le_bytes());
            bytes[16..20].copy_from_slice(&hit.v.to_bits().to_le_bytes());
        }
        bytes
    }
}

/// Why a ray could not be traced.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TraceError<E> {
    /// The bus failed.
    Bus {
        /// First byte of the failed read.
        addr: ByteAddr,
        /// What the bus said.
        error: E,
    },
    /// A node is not one that a builder writes, or is reached twice.
    CorruptNode {
        /// Its index.
        index: u32,
    },
    /// A leaf table entry is out of range or reached twice.
    CorruptLeaf {
        /// Its index.
        entry: u32,
    },
    /// A triangle has a vertex off the grid.
    CorruptTriangle {
        /// The triangle.
        primitive: PrimIndex,
    },
    /// A region is smaller than the scene says.
    OutOfRegion {
        /// Which one.
        region: RegionName,
    },
}

impl<E: fmt::Debug> fmt::Display for TraceError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus { addr, error } => write!(f, "bus error at {addr} while tracing: {error:?}"),
            Self::CorruptNode { index } => write!(f, "node {index} in memory is corrupt"),
            Self::CorruptLeaf { entry } => write!(f, "leaf table entry {entry} is corrupt"),
            Self::CorruptTriangle { primitive } => {
                write!(f, "triangle {} in memory is off the grid", primitive.0)
            }
            Self::OutOfRegion { region } => {
                write!(f, "region `{region}` is smaller than the scene says")
            }
        }
    }
}

impl<E: fmt::Debug> core::error::Error for TraceError<E> {}
