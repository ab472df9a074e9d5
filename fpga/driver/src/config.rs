//! Why a job is refused before any register is written.

use core::fmt;
use core::ops::RangeInclusive;

use xylem_core::mem::Region;
use xylem_regs::{REGION_ALIGN, RegionId};

/// What is wrong with a job. The accelerator was not touched.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// This accelerator was synthesized without something that the job needs.
    Unsupported {
        /// What it cannot do.
        what: &'static str,
    },
    /// There is nothing to do.
    Empty {
        /// What is empty.
        what: &'static str,
    },
    /// A parameter is outside this accelerator's limits.
    OutOfRange {
        /// The parameter.
        parameter: &'static str,
        /// What was asked for.
        value: u32,
        /// The least possible value.
        min: u32,
        /// The greatest possible value.
        max: u32,
    },
    /// 8-byte pairs hold 30-bit Morton codes only.
    PairCode,
    /// The tree to compress consists of quantized nodes already.
    AlreadyCompressed,
    /// A region that the job needs has size 0.
    ZeroSize {
        /// The region.
        region: RegionId,
    },
    /// A region's base or size is not a multiple of [`REGION_ALIGN`] bytes.
    Misaligned {
        /// The region.
        region: RegionId,
        /// Its first byte.
        base: u32,
        /// Its size in bytes.
        size: u32,
    },
    /// A region extends past the 32-bit address space.
    BeyondAddressSpace {
        /// The region.
        region: RegionId,
    },
    /// A region is smaller than what the job is known to put there or take from there.
    TooSmall {
        /// The region.
        region: RegionId,
        /// Bytes needed.
        needed: u64,
        /// Bytes that the region has.
        available: u32,
    },
    /// Two regions share bytes.
    Overlap {
        /// The one with the lower id.
        first: RegionId,
        /// The one with the higher id.
        second: RegionId,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsupported { what } => {
                write!(f, "this accelerator was synthesized without {what}; see its capabilities")
            }
            Self::Empty { what } => write!(f, "the {what} is empty; there is nothing to start"),
            Self::OutOfRange { parameter, value, min, max } => {
                write!(f, "{parameter} is {value}; this accelerator takes {min} to {max}")
            }
            Self::PairCode => {
                f.write_str("8-byte pairs hold 30-bit Morton codes; use another record for 63 bits")
            }
            Self::AlreadyCompressed => {
                f.write_str("the tree has quantized nodes already; compress the two-box tree")
            }
            Self::ZeroSize { region } => write!(f, "region {region} has size 0; set it aside"),
            Self::Misaligned { region, base, size } => write!(
                f,
                "region {region}, {size:#x} bytes at {base:#010x}, is not aligned; base and size \
                 must be multiples of {REGION_ALIGN} bytes"
            ),
            Self::BeyondAddressSpace { region } => {
                write!(
                    f,
                    "region {region} extends past the 32-bit address space; move or shrink it"
                )
            }
            Self::TooSmall { region, needed, available } => {
                write!(f, "region {region} has {available} bytes; the job needs {needed}")
            }
            Self::Overlap { first, second } => {
                write!(f, "regions {first} and {second} overlap; move one of them")
            }
        }
    }
}

impl core::error::Error for ConfigError {}

pub(crate) fn require(holds: bool, error: ConfigError) -> Result<(), ConfigError> {
    if holds { Ok(()) } else { Err(error) }
}

pub(crate) fn within(
    parameter: &'static str,
    value: u32,
    range: RangeInclusive<u32>,
) -> Result<(), ConfigError> {
    let (min, max) = (*range.start(), *range.end());
    require(range.contains(&value), ConfigError::OutOfRange { parameter, value, min, max })
}

/// Checks every region that `needed` gives a least size in bytes, then each pair of them. Both
/// slices are in the order of [`RegionId::ALL`].
pub(crate) fn check_regions(regions: &[Region], needed: &[Option<u64>]) -> Result<(), ConfigError> {
    let used = || {
        let all = RegionId::ALL.into_iter().zip(regions).zip(needed);
        all.filter_map(|((id, region), needed)| Some((id, region, (*needed)?)))
    };
    for (id, region, needed) in used() {
        check_region(id, region, needed)?;
    }
    for (first, a, _) in used() {
        for (second, b, _) in used().filter(|&(other, ..)| (other as u8) > first as u8) {
            let (a, b) = (span(a), span(b));
            let disjoint = a.end <= b.start || b.end <= a.start;
            require(disjoint, ConfigError::Overlap { first, second })?;
        }
    }
    Ok(())
}

fn check_region(region: RegionId, at: &Region, needed: u64) -> Result<(), ConfigError> {
    let (base, size) = (at.base.0, at.size);
    require(size > 0, ConfigError::ZeroSize { region })?;
    let aligned = base.is_multiple_of(REGION_ALIGN) && size.is_multiple_of(REGION_ALIGN);
    require(aligned, ConfigError::Misaligned { region, base, size })?;
    require(span(at).end <= 1 << 32, ConfigError::BeyondAddressSpace { region })?;
    let available = size;
    let fits = needed <= u64::from(available);
    require(fits, ConfigError::TooSmall { region, needed, available })
}

/// The byte addresses of a region.
fn span(region: &Region) -> core::ops::Range<u64> {
    let base = u64::from(region.base.0);
    base..base + u64::from(region.size)
}
