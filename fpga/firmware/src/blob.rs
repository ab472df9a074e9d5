//! The scene blob: what the host lays down in external memory for the job.
//!
//! Little-endian 32-bit words, then the records; those of each kind and frame start on a multiple of 64
//! bytes, as the accelerator's regions do:
//!
//! | byte   | what                                                                          |
//! |--------|-------------------------------------------------------------------------------|
//! | 0      | magic, the bytes `XYLB`                                                       |
//! | 4      | version, [`Header::VERSION`]                                                  |
//! | 8      | flags: bit 0 says that the core has the standard trap registers (`mtvec`…),   |
//! |        | bit 1 that there is an accelerator, which is to do the job too; bits 8 to 11 |
//! |        | are the depth of treelets, see [`Header::treelet_depth`]                      |
//! | 12     | grid width in bits, 4 to 24                                                   |
//! | 16     | Morton code width in bits, 30 or 63                                           |
//! | 20     | traced format: 0 64-byte nodes, 1 quantized relative, 2 quantized modulo      |
//! | 24     | query: 0 closest hit, 1 any hit                                               |
//! | 28     | sorter's scratchpad `M` in records, see [`SortConfig::capacity`]              |
//! | 32     | sorter's burst `B` in records, see [`SortConfig::burst`]                      |
//! | 36     | record of a sorted run: 0 32-byte boxes, 1 22-byte boxes, 2 8-byte pairs      |
//! | 40     | largest leaf in primitives, 1 to 255                                          |
//! | 44     | number of triangles                                                           |
//! | 48     | number of rays                                                                |
//! | 52     | top of the tree: 0 as the rest; binned SAH, 1 with 8 bins, 2 with 16; ATRBVH  |
//! |        | with treelets of eight in two iterations, 3 from the Morton order, 4 from a   |
//! |        | binned tree with 8 bins, 5 with 16                                            |
//! | 56     | most cells that it is built over, see [`CellConfig::capacity`]                |
//! | 60     | Morton bits that cells differ in at first, see [`CellConfig::bits`]           |
//! | 64     | largest leaf that neighbours are joined to in primitives, 0 for not at all    |
//! | 68     | frames of an animation, or 0 for a still scene                                |
//! | 72     | when an animation rebuilds: 0 by drift, 1 by amortisation, see [`RebuildRule`] |
//! | 76     | that rule's parameter, UQ16.16; both words are 0 for a still scene            |
//! | 128    | triangles, 40 bytes each ([`Triangle::to_bytes`]); all of them in each frame  |
//! | behind | rays, 40 bytes each ([`Ray::to_bytes`])                                       |
//!
//! The job's work space is the memory behind the blob, from the next multiple of 64 bytes on. The
//! parser checks that every word has a meaning; whether the builder can work with its parameters is
//! for the core to say.
//!
//! Version 5 knows treelets; version 4 aligned the records and brought the accelerator, version 3 animations.

use core::fmt;

use xylem_core::emit::CellConfig;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::mem::{Bus, Region};
use xylem_core::node::{MAX_LEAF_SIZE, NodeFormat, Quantization};
use xylem_core::num::{Grid, MortonWidth};
use xylem_core::refit::{Factor, RebuildRule};
use xylem_core::sort::{RecordFormat, SortConfig};
use xylem_core::toplevel::{Atrbvh, Binned, Bins, TopLevel};
use xylem_core::traverse::Query;

/// What records start on a multiple of, in bytes: a region of the accelerator does.
pub const ALIGN: u32 = xylem_regs::REGION_ALIGN;

/// The head of a scene blob.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Header {
    /// Whether the core has the standard machine-mode trap registers. PicoRV32 has not.
    pub machine_traps: bool,
    /// Whether there is an accelerator that is to do the job too. Not where the triangles move.
    pub accelerator: bool,
    /// The grid of all coordinates.
    pub grid: Grid,
    /// The width of the sort key.
    pub morton: MortonWidth,
    /// The format that rays are traced through. Quantized nodes are always written: in modulo
    /// coordinates if this is that format, else in relative ones.
    pub format: NodeFormat,
    /// Quantized nodes are compressed as by a builder that compresses what it emits, with treelets of this
    /// depth, 1 or 2; or with 0 from the root down. Deeper treelets than 1 need a tree without a top level.
    pub treelet_depth: u8,
    /// What rays are asked.
    pub query: Query,
    /// The shape of the sorter.
    pub sort: SortConfig,
    /// The largest leaf, in primitives.
    pub max_leaf_size: u32,
    /// How the top of the tree is built. Only [`TOP_LEVELS`] can be written.
    pub top_level: TopLevel,
    /// With a top level, what it is built over.
    pub cells: CellConfig,
    /// Neighbouring leaves are joined up to this many primitives.
    pub join_leaves: u32,
    /// The triangles move, and how.
    pub animation: Option<Animation>,
    /// How many triangles there are, in each frame if they move.
    pub triangles: u32,
    /// How many rays follow those.
    pub rays: u32,
}

/// An animation: the same triangles in other places, frame after frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Animation {
    /// How many frames there are, at least 1.
    pub frames: u32,
    /// When the tree is rebuilt rather than refitted.
    pub rule: RebuildRule,
}

impl Animation {
    const fn words(&self) -> [u32; 3] {
        let (rule, parameter) = match self.rule {
            RebuildRule::Drift(factor) => (0, factor),
            RebuildRule::Amortised(price) => (1, price),
        };
        [self.frames, rule, parameter.to_bits()]
    }

    const fn from_words([frames, rule, parameter]: [u32; 3]) -> Option<Self> {
        let parameter = Factor::from_bits(parameter);
        let rule = match rule {
            0 => RebuildRule::Drift(parameter),
            1 => RebuildRule::Amortised(parameter),
            _ => return None,
        };
        Some(Self { frames, rule })
    }
}

/// A word of the configuration that does not accept every value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
#[non_exhaustive]
pub enum Setting {
    /// The grid's width.
    GridBits,
    /// The Morton code's width.
    MortonBits,
    /// The traced format.
    Format,
    /// The depth of treelets.
    TreeletDepth,
    /// The query.
    Query,
    /// The record of a sorted run.
    Record,
    /// The largest leaf.
    MaxLeafSize,
    /// The top of the tree.
    TopLevel,
    /// When an animation rebuilds.
    Rule,
    /// The accelerator's flag.
    Accelerator,
}

impl Setting {
    /// Its name and its legal values.
    const fn describe(self) -> (&'static str, &'static str) {
        match self {
            Self::GridBits => ("the grid's bits", "4 to 24"),
            Self::MortonBits => ("the Morton code's bits", "30 or 63"),
            Self::Format => ("the traced format", "0 to 2"),
            Self::TreeletDepth => ("the depth of treelets", "0 to 2"),
            Self::Query => ("the query", "0 or 1"),
            Self::Record => ("the sorter's record", "0 to 2"),
            Self::MaxLeafSize => ("the largest leaf", "1 to 255"),
            Self::TopLevel => ("the top of the tree", "0 to 5"),
            Self::Rule => ("the rule for rebuilding", "0 or 1"),
            Self::Accelerator => ("the accelerator's flag", "0 for triangles that move"),
        }
    }
}

/// Why memory does not hold a scene blob.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(target_arch = "riscv32", derive(defmt::Format))]
#[non_exhaustive]
pub enum BlobError<E> {
    /// The first word is not the magic.
    Magic {
        /// The word found.
        found: u32,
    },
    /// The blob has a version that this job cannot read.
    Version {
        /// The version found.
        found: u32,
    },
    /// A flag or a reserved word is set that this version does not know.
    Reserved {
        /// The word found.
        found: u32,
    },
    /// A word of the configuration has a value without a meaning.
    Setting {
        /// Which one.
        setting: Setting,
        /// The value found.
        found: u32,
    },
    /// The records do not fit into the memory that holds the blob.
    TooLarge {
        /// Bytes that the counts ask for, at most `u32::MAX`.
        needed: u32,
        /// Bytes that there are.
        size: u32,
    },
    /// The bus failed.
    Bus(E),
}

impl<E: fmt::Debug> fmt::Display for BlobError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic { found } => write!(
                f,
                "no scene blob in memory: it starts with {found:#010x}, not {:#010x}; load one",
                Header::MAGIC
            ),
            Self::Version { found } => write!(
                f,
                "scene blob has version {found}, this job reads {}; write it anew",
                Header::VERSION
            ),
            Self::Reserved { found } => {
                write!(f, "scene blob sets unknown flags or reserved bits: {found:#010x}")
            }
            Self::Setting { setting, found } => {
                let (name, legal) = setting.describe();
                write!(f, "scene blob sets {name} to {found}; legal is {legal}")
            }
            Self::TooLarge { needed, size } => {
                write!(f, "scene blob needs {needed} bytes, memory has {size}; use a smaller scene")
            }
            Self::Bus(error) => write!(f, "scene blob is not readable: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for BlobError<E> {}

/// A scene blob in memory, checked.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Blob {
    /// The head.
    pub header: Header,
    /// The triangle records of the first frame, or of the still scene.
    pub triangles: Region,
    /// The ray records.
    pub rays: Region,
    /// The memory behind the blob, from a multiple of 64 bytes on.
    pub work: Region,
}

impl Header {
    /// The deepest treelets that the job has room for.
    pub const MAX_TREELET_DEPTH: u8 = 2;

    /// Bytes of the header.
    pub const BYTES: usize = 80;

    /// Where the records begin.
    pub const RECORDS_AT: u32 = (Self::BYTES as u32).next_multiple_of(ALIGN);

    /// The first word of a blob: the bytes `XYLB`.
    pub const MAGIC: u32 = u32::from_le_bytes(*b"XYLB");

    /// The version of the format that this module describes.
    pub const VERSION: u32 = 5;

    /// The header's bytes.
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let [frames, rule, parameter] = self.animation.map_or([0; 3], |a| a.words());
        let words = [
            Self::MAGIC,
            Self::VERSION,
            u32::from(self.machine_traps)
                | u32::from(self.accelerator) << 1
                | u32::from(self.treelet_depth) << 8,
            u32::from(self.grid.bits()),
            self.morton.bits(),
            code_of(&FORMATS, self.format),
            code_of(&QUERIES, self.query),
            self.sort.capacity,
            self.sort.burst,
            code_of(&RECORDS, self.sort.record),
            self.max_leaf_size,
            self.triangles,
            self.rays,
            code_of(&TOP_LEVELS, self.top_level),
            self.cells.capacity,
            self.cells.bits,
            self.join_leaves,
            frames,
            rule,
            parameter,
        ];
        let mut bytes = [0; Self::BYTES];
        for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
            chunk.copy_from_slice(&word.to_le_bytes());
        }
        bytes
    }

    /// The header of some bytes.
    ///
    /// # Errors
    /// [`BlobError`], all kinds but `TooLarge` and `Bus`.
    pub fn from_bytes<E>(bytes: &[u8; Self::BYTES]) -> Result<Self, BlobError<E>> {
        let word = |i: usize| {
            u32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        if word(0) != Self::MAGIC {
            return Err(BlobError::Magic { found: word(0) });
        }
        if word(1) != Self::VERSION {
            return Err(BlobError::Version { found: word(1) });
        }
        let unused = if word(17) == 0 { word(18) | word(19) } else { 0 };
        let unknown = (word(2) & !0xf03) | unused;
        if unknown != 0 {
            return Err(BlobError::Reserved { found: unknown });
        }
        let bad = |setting: Setting, i: usize| BlobError::Setting { setting, found: word(i) };
        let grid = u8::try_from(word(3)).ok().and_then(Grid::new);
        let morton = match word(4) {
            30 => MortonWidth::Bits30,
            63 => MortonWidth::Bits63,
            _ => return Err(bad(Setting::MortonBits, 4)),
        };
        let animation = match word(17) {
            0 => None,
            frames => {
                let animation = Animation::from_words([frames, word(18), word(19)]);
                Some(animation.ok_or(bad(Setting::Rule, 18))?)
            }
        };
        let accelerator = word(2) & 2 != 0;
        if accelerator && animation.is_some() {
            return Err(BlobError::Setting { setting: Setting::Accelerator, found: 1 });
        }
        let treelet_depth = (word(2) >> 8 & 0xf) as u8;
        if treelet_depth > Self::MAX_TREELET_DEPTH {
            let (setting, found) = (Setting::TreeletDepth, treelet_depth.into());
            return Err(BlobError::Setting { setting, found });
        }
        if word(10) == 0 || word(10) > MAX_LEAF_SIZE {
            return Err(bad(Setting::MaxLeafSize, 10));
        }
        Ok(Self {
            machine_traps: word(2) & 1 == 1,
            accelerator,
            grid: grid.ok_or(bad(Setting::GridBits, 3))?,
            morton,
            format: of_code(&FORMATS, word(5)).ok_or(bad(Setting::Format, 5))?,
            treelet_depth,
            query: of_code(&QUERIES, word(6)).ok_or(bad(Setting::Query, 6))?,
            sort: SortConfig {
                capacity: word(7),
                burst: word(8),
                record: of_code(&RECORDS, word(9)).ok_or(bad(Setting::Record, 9))?,
                ..SortConfig::PAPER
            },
            max_leaf_size: word(10),
            top_level: of_code(&TOP_LEVELS, word(13)).ok_or(bad(Setting::TopLevel, 13))?,
            cells: CellConfig { capacity: word(14), bits: word(15) },
            join_leaves: word(16),
            animation,
            triangles: word(11),
            rays: word(12),
        })
    }

    /// Bytes of the whole blob, or `None` past 32 bits.
    pub fn blob_bytes(&self) -> Option<u32> {
        let frames = self.animation.map_or(1, |animation| animation.frames);
        let triangles = self.frame_bytes()?.checked_mul(frames)?;
        let rays = self.rays.checked_mul(Ray::BYTES as u32)?;
        Self::RECORDS_AT.checked_add(triangles)?.checked_add(rays)
    }

    /// Bytes from the triangles of a frame to those of the next, or `None` past 32 bits.
    fn frame_bytes(&self) -> Option<u32> {
        self.triangles.checked_mul(Triangle::BYTES as u32)?.checked_next_multiple_of(ALIGN)
    }
}

/// What the codes 0, 1, … of each setting stand for.
const FORMATS: [NodeFormat; 3] = [
    NodeFormat::Bvh2,
    NodeFormat::Quantized(Quantization::RELATIVE),
    NodeFormat::Quantized(Quantization::MODULO),
];
const QUERIES: [Query; 2] = [Query::Closest, Query::Any];
const RECORDS: [RecordFormat; 3] =
    [RecordFormat::Box32, RecordFormat::Packed22, RecordFormat::Pair8];

/// The builders of the top of the tree that a blob can ask for, by code.
pub const TOP_LEVELS: [TopLevel; 6] = [
    TopLevel::None,
    TopLevel::Binned(EIGHT),
    TopLevel::Binned(SIXTEEN),
    TopLevel::Atrbvh(treelets(None)),
    TopLevel::Atrbvh(treelets(Some(EIGHT))),
    TopLevel::Atrbvh(treelets(Some(SIXTEEN))),
];

const EIGHT: Binned = Binned { bins: Bins::Eight };
const SIXTEEN: Binned = Binned { bins: Bins::Sixteen };

/// P2's treelets.
const fn treelets(start: Option<Binned>) -> Atrbvh {
    Atrbvh { treelet: 8, iterations: 2, start }
}

/// The code of a value. One that has none gets a code that no parser accepts.
fn code_of<T: PartialEq>(values: &[T], value: T) -> u32 {
    values.iter().position(|v| *v == value).map_or(u32::MAX, |i| i as u32)
}

/// The value of a code.
fn of_code<T: Copy>(values: &[T], code: u32) -> Option<T> {
    values.get(code as usize).copied()
}

impl Blob {
    /// Finds the blob at the start of `memory`.
    ///
    /// # Errors
    /// [`BlobError`] when there is none or it does not fit.
    pub fn parse<B: Bus>(bus: &mut B, memory: Region) -> Result<Self, BlobError<B::Error>> {
        let mut bytes = [0; Header::BYTES];
        let size = memory.size;
        let start = memory.at(0, Header::BYTES as u32);
        let start = start.ok_or(BlobError::TooLarge { needed: Header::BYTES as u32, size })?;
        bus.read(start, &mut bytes).map_err(BlobError::Bus)?;
        let header = Header::from_bytes(&bytes)?;
        let bytes = header.blob_bytes();
        let too_large = BlobError::TooLarge { needed: bytes.unwrap_or(u32::MAX), size };
        let needed = bytes.filter(|bytes| *bytes <= size).ok_or(too_large)?;
        // Nothing below overflows: every sum is at most `needed`, or is clamped to `size`.
        let triangles_at = Header::RECORDS_AT;
        let frame = header.triangles * Triangle::BYTES as u32;
        let frames = header.animation.map_or(1, |animation| animation.frames);
        let rays_at = triangles_at + frames * frame.next_multiple_of(ALIGN);
        let work_at = needed.checked_next_multiple_of(ALIGN).unwrap_or(size).min(size);
        let piece = |from: u32, to: u32| Region::new(memory.base.0 + from, to - from);
        Ok(Self {
            header,
            triangles: piece(triangles_at, triangles_at + frame),
            rays: piece(rays_at, needed),
            work: piece(work_at, size),
        })
    }

    /// The triangle records of frame `index`, or `None` if there are not as many frames.
    pub fn frame(&self, index: u32) -> Option<Region> {
        let frames = self.header.animation.map_or(1, |animation| animation.frames);
        let Region { base, size } = self.triangles;
        // All frames are inside the blob, which ends below 2^32.
        (index < frames).then(|| Region::new(base.0 + index * size.next_multiple_of(ALIGN), size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use xylem_core::mem::ByteAddr;

    const HEADER: Header = Header {
        machine_traps: true,
        accelerator: false,
        grid: Grid::DEFAULT,
        morton: MortonWidth::Bits63,
        format: NodeFormat::Quantized(Quantization::MODULO),
        treelet_depth: 0,
        query: Query::Any,
        sort: SortConfig {
            capacity: 64,
            burst: 4,
            record: RecordFormat::Packed22,
            ..SortConfig::PAPER
        },
        max_leaf_size: 7,
        top_level: TopLevel::Binned(EIGHT),
        cells: CellConfig { capacity: 100, bits: 12 },
        join_leaves: 3,
        animation: None,
        triangles: 2,
        rays: 3,
    };

    /// A header at address 0x100; the records behind it are never read by the parser.
    struct Head([u8; Header::BYTES]);

    impl Bus for Head {
        type Error = Infallible;
        fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Infallible> {
            assert_eq!((addr, buf.len()), (ByteAddr(0x100), Header::BYTES));
            buf.copy_from_slice(&self.0);
            Ok(())
        }
        fn write(&mut self, _: ByteAddr, _: &[u8]) -> Result<(), Infallible> {
            unreachable!("parsing does not write")
        }
    }

    fn parse(header: [u8; Header::BYTES], size: u32) -> Result<Blob, BlobError<Infallible>> {
        Blob::parse(&mut Head(header), Region::new(0x100, size))
    }

    #[test]
    fn pieces_follow_each_other_and_work_space_starts_aligned() {
        let blob = parse(HEADER.to_bytes(), 1000).unwrap();
        assert_eq!(blob.header, HEADER);
        assert_eq!(blob.triangles, Region::new(0x180, 80));
        assert_eq!(blob.rays, Region::new(0x200, 120));
        assert_eq!(blob.work, Region::new(0x100 + 384, 1000 - 384));
    }

    #[test]
    fn a_blob_may_fill_memory_but_not_exceed_it() {
        assert_eq!(parse(HEADER.to_bytes(), 376).unwrap().work.size, 0);
        let error = BlobError::TooLarge { needed: 376, size: 375 };
        assert_eq!(parse(HEADER.to_bytes(), 375), Err(error));
        let huge = Header { triangles: u32::MAX, ..HEADER };
        let error = BlobError::TooLarge { needed: u32::MAX, size: 4096 };
        assert_eq!(parse(huge.to_bytes(), 4096), Err(error));
        assert_eq!(parse([0; 80], 79), Err(BlobError::TooLarge { needed: 80, size: 79 }));
    }

    #[test]
    fn every_field_of_the_header_is_checked() {
        let with = |word: usize, value: u32| {
            let mut bytes = HEADER.to_bytes();
            bytes[4 * word..4 * word + 4].copy_from_slice(&value.to_le_bytes());
            parse(bytes, 4096).map(|blob| blob.header)
        };
        assert_eq!(with(0, 7), Err(BlobError::Magic { found: 7 }));
        assert_eq!(with(1, 9), Err(BlobError::Version { found: 9 }));
        assert_eq!(with(2, 0), Ok(Header { machine_traps: false, ..HEADER }));
        assert_eq!(with(2, 3), Ok(Header { accelerator: true, ..HEADER }));
        assert_eq!(with(2, 4), Err(BlobError::Reserved { found: 4 }));
        assert_eq!(with(2, 0x201), Ok(Header { treelet_depth: 2, ..HEADER }));
        let setting = Setting::TreeletDepth;
        assert_eq!(with(2, 0x301), Err(BlobError::Setting { setting, found: 3 }));
        for reserved in [18, 19] {
            assert_eq!(with(reserved, 1), Err(BlobError::Reserved { found: 1 }));
        }
        for (word, value, setting) in [
            (3, 25, Setting::GridBits),
            (3, 256 + 24, Setting::GridBits),
            (4, 31, Setting::MortonBits),
            (5, 3, Setting::Format),
            (6, 2, Setting::Query),
            (9, u32::MAX, Setting::Record),
            (10, 0, Setting::MaxLeafSize),
            (10, 256, Setting::MaxLeafSize),
            (13, 6, Setting::TopLevel),
        ] {
            assert_eq!(with(word, value), Err(BlobError::Setting { setting, found: value }));
        }
    }

    #[test]
    fn frames_follow_one_another_and_rays_follow_the_last() {
        for rule in [RebuildRule::default(), RebuildRule::Amortised(Factor::from_bits(u32::MAX))] {
            let animation = Some(Animation { frames: 3, rule });
            let blob = parse(Header { animation, ..HEADER }.to_bytes(), 1000).unwrap();
            assert_eq!(blob.header.animation, animation);
            assert_eq!(blob.frame(0), Some(Region::new(0x180, 80)));
            assert_eq!(blob.frame(2), Some(Region::new(0x180 + 256, 80)));
            assert_eq!(blob.frame(3), None);
            assert_eq!(blob.rays, Region::new(0x180 + 384, 120));
            let error = BlobError::TooLarge { needed: 632, size: 631 };
            assert_eq!(parse(Header { animation, ..HEADER }.to_bytes(), 631), Err(error));
            let both = Header { animation, accelerator: true, ..HEADER };
            let error = BlobError::Setting { setting: Setting::Accelerator, found: 1 };
            assert_eq!(parse(both.to_bytes(), 1000), Err(error));
        }
        let still = parse(HEADER.to_bytes(), 1000).unwrap();
        assert_eq!((still.frame(0), still.frame(1)), (Some(still.triangles), None));
        let mut bytes = HEADER.to_bytes();
        bytes[68] = 1;
        bytes[72] = 2;
        let error = BlobError::Setting { setting: Setting::Rule, found: 2 };
        assert_eq!(parse(bytes, 1000), Err(error));
    }

    #[test]
    fn only_builders_with_a_code_can_be_asked_for() {
        for top_level in TOP_LEVELS {
            let header = Header { top_level, ..HEADER };
            assert_eq!(parse(header.to_bytes(), 4096).map(|blob| blob.header), Ok(header));
        }
        let once = TopLevel::Atrbvh(Atrbvh { iterations: 1, ..treelets(None) });
        let error = BlobError::Setting { setting: Setting::TopLevel, found: u32::MAX };
        assert_eq!(parse(Header { top_level: once, ..HEADER }.to_bytes(), 4096), Err(error));
    }
}
