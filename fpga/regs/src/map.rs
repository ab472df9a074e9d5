// Generated from fpga/regs/xylem.rdl by fpga/regs/generate.sh. Do not edit.

//! The generated map: where each register is, and what it holds.

use crate::register::{Access, FieldInfo, Readable, Reg, Register, RegisterInfo};
use crate::register::{UnknownValue, Writable, get, set};

/// Bytes of address space that the map takes, from offset 0 on.
pub const MAP_SIZE: u32 = 0x1d0;

/// `magic`: Tells a Xylem from an empty bus. Read it before anything else.
pub const MAGIC: Reg<Magic> = Reg::new(0x000);

/// `version`: Version of this register map. Software needs the same major number and at least its own minor number; while major is 0, the same minor number.
pub const VERSION: Reg<Version> = Reg::new(0x004);

/// `cap.sort`: Size of the sorter's memories.
pub const CAP_SORT: Reg<CapSort> = Reg::new(0x010);

/// `cap.merge`: Limits of the merge and of the leaves it ends in.
pub const CAP_MERGE: Reg<CapMerge> = Reg::new(0x014);

/// `cap.geometry`: Widths of the number system.
pub const CAP_GEOMETRY: Reg<CapGeometry> = Reg::new(0x018);

/// `cap.features`: What was synthesized; 1 is present. Using what is absent is a `bad_config` error.
pub const CAP_FEATURES: Reg<CapFeatures> = Reg::new(0x01c);

/// `cap.trace`: Record sizes and stack depth of the traversal unit; all 0 if it is absent.
pub const CAP_TRACE: Reg<CapTrace> = Reg::new(0x020);

/// `ctrl`: Starts and stops jobs. At most one of `start`, `abort_job` and `soft_reset` may be written as 1.
pub const CTRL: Reg<Ctrl> = Reg::new(0x040);

/// `status`: State of the running or the last job.
pub const STATUS: Reg<Status> = Reg::new(0x044);

/// `error_info`: The first error of the last job. Cleared by `start` and `soft_reset`.
pub const ERROR_INFO: Reg<ErrorInfo> = Reg::new(0x048);

/// `error_addr`: Where the first error of the last job happened. Meaningful for bus, region and node errors.
pub const ERROR_ADDR: Reg<ErrorAddr> = Reg::new(0x04c);

/// `int_status`: Events since they were last cleared. Write 1 to clear a bit.
pub const INT_STATUS: Reg<IntStatus> = Reg::new(0x050);

/// `int_enable`: Which events raise the interrupt line. The line is active high and stays so until every enabled event is cleared.
pub const INT_ENABLE: Reg<IntEnable> = Reg::new(0x054);

/// `job.primitives`: Length of the input of a build; in a trace the number of triangles.
pub const JOB_PRIMITIVES: Reg<JobPrimitives> = Reg::new(0x080);

/// `job.rays`: Length of the input of a trace.
pub const JOB_RAYS: Reg<JobRays> = Reg::new(0x084);

/// `job.nodes`: Nodes of the tree to compress or trace. A node index from here on is a `corrupt_node` error.
pub const JOB_NODES: Reg<JobNodes> = Reg::new(0x088);

/// `job.entries`: Leaf table entries of the tree to trace. A leaf that extends further is a `corrupt_node` error.
pub const JOB_ENTRIES: Reg<JobEntries> = Reg::new(0x08c);

/// `job.format`: Byte formats that the job reads and writes.
pub const JOB_FORMAT: Reg<JobFormat> = Reg::new(0x090);

/// `job.limits`: Sizes that shape the tree.
pub const JOB_LIMITS: Reg<JobLimits> = Reg::new(0x094);

/// `root.lo_x`: Lower corner of the root's box, x.
pub const ROOT_LO_X: Reg<Coordinate> = Reg::new(0x0c0);

/// `root.lo_y`: Lower corner of the root's box, y.
pub const ROOT_LO_Y: Reg<Coordinate> = Reg::new(0x0c4);

/// `root.lo_z`: Lower corner of the root's box, z.
pub const ROOT_LO_Z: Reg<Coordinate> = Reg::new(0x0c8);

/// `root.hi_x`: Upper corner of the root's box, x.
pub const ROOT_HI_X: Reg<Coordinate> = Reg::new(0x0cc);

/// `root.hi_y`: Upper corner of the root's box, y.
pub const ROOT_HI_Y: Reg<Coordinate> = Reg::new(0x0d0);

/// `root.hi_z`: Upper corner of the root's box, z.
pub const ROOT_HI_Z: Reg<Coordinate> = Reg::new(0x0d4);

/// `root.pointer`: Where the root is. Quantized nodes have the index of the two-box node that they came from.
pub const ROOT_POINTER: Reg<RootPointer> = Reg::new(0x0d8);

/// `root.leaf_size`: Tells a tree that is a single leaf from one with nodes.
pub const ROOT_LEAF_SIZE: Reg<RootLeafSize> = Reg::new(0x0dc);

/// `result.nodes`: Two-box nodes that the last build wrote.
pub const RESULT_NODES: Reg<ResultCount> = Reg::new(0x0e0);

/// `result.leaves`: Leaves of the last build.
pub const RESULT_LEAVES: Reg<ResultCount> = Reg::new(0x0e4);

/// `result.quantized`: Quantized nodes that the last compression wrote.
pub const RESULT_QUANTIZED: Reg<ResultCount> = Reg::new(0x0e8);

/// `result.hits`: Rays of the last trace that hit something.
pub const RESULT_HITS: Reg<ResultCount> = Reg::new(0x0ec);

/// `region.primitives.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Primitives.
pub const REGION_PRIMITIVES_BASE: Reg<RegionBase> = Reg::new(0x100);

/// `region.primitives.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Primitives.
pub const REGION_PRIMITIVES_SIZE: Reg<RegionSize> = Reg::new(0x104);

/// `region.runs_a.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Runs A.
pub const REGION_RUNS_A_BASE: Reg<RegionBase> = Reg::new(0x108);

/// `region.runs_a.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Runs A.
pub const REGION_RUNS_A_SIZE: Reg<RegionSize> = Reg::new(0x10c);

/// `region.runs_b.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Runs B.
pub const REGION_RUNS_B_BASE: Reg<RegionBase> = Reg::new(0x110);

/// `region.runs_b.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Runs B.
pub const REGION_RUNS_B_SIZE: Reg<RegionSize> = Reg::new(0x114);

/// `region.nodes.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Nodes.
pub const REGION_NODES_BASE: Reg<RegionBase> = Reg::new(0x118);

/// `region.nodes.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Nodes.
pub const REGION_NODES_SIZE: Reg<RegionSize> = Reg::new(0x11c);

/// `region.leaf_table.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Leaf table.
pub const REGION_LEAF_TABLE_BASE: Reg<RegionBase> = Reg::new(0x120);

/// `region.leaf_table.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Leaf table.
pub const REGION_LEAF_TABLE_SIZE: Reg<RegionSize> = Reg::new(0x124);

/// `region.quantized.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Quantized nodes.
pub const REGION_QUANTIZED_BASE: Reg<RegionBase> = Reg::new(0x128);

/// `region.quantized.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Quantized nodes.
pub const REGION_QUANTIZED_SIZE: Reg<RegionSize> = Reg::new(0x12c);

/// `region.rays.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Rays.
pub const REGION_RAYS_BASE: Reg<RegionBase> = Reg::new(0x130);

/// `region.rays.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Rays.
pub const REGION_RAYS_SIZE: Reg<RegionSize> = Reg::new(0x134);

/// `region.hits.base`: First byte of a region. The whole register is the byte address; it is a multiple of 64. Hit records.
pub const REGION_HITS_BASE: Reg<RegionBase> = Reg::new(0x138);

/// `region.hits.size`: Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error. Hit records.
pub const REGION_HITS_SIZE: Reg<RegionSize> = Reg::new(0x13c);

/// `counters.cycles.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Clock cycles while busy.
pub const COUNTERS_CYCLES_LO: Reg<CounterLo> = Reg::new(0x180);

/// `counters.cycles.hi`: High half of a 64-bit event counter. Clock cycles while busy.
pub const COUNTERS_CYCLES_HI: Reg<CounterHi> = Reg::new(0x184);

/// `counters.bytes_read.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Bytes read from external memory.
pub const COUNTERS_BYTES_READ_LO: Reg<CounterLo> = Reg::new(0x188);

/// `counters.bytes_read.hi`: High half of a 64-bit event counter. Bytes read from external memory.
pub const COUNTERS_BYTES_READ_HI: Reg<CounterHi> = Reg::new(0x18c);

/// `counters.bytes_written.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Bytes written to external memory.
pub const COUNTERS_BYTES_WRITTEN_LO: Reg<CounterLo> = Reg::new(0x190);

/// `counters.bytes_written.hi`: High half of a 64-bit event counter. Bytes written to external memory.
pub const COUNTERS_BYTES_WRITTEN_HI: Reg<CounterHi> = Reg::new(0x194);

/// `counters.nodes.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Nodes emitted.
pub const COUNTERS_NODES_LO: Reg<CounterLo> = Reg::new(0x198);

/// `counters.nodes.hi`: High half of a 64-bit event counter. Nodes emitted.
pub const COUNTERS_NODES_HI: Reg<CounterHi> = Reg::new(0x19c);

/// `counters.leaves.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Leaves emitted.
pub const COUNTERS_LEAVES_LO: Reg<CounterLo> = Reg::new(0x1a0);

/// `counters.leaves.hi`: High half of a 64-bit event counter. Leaves emitted.
pub const COUNTERS_LEAVES_HI: Reg<CounterHi> = Reg::new(0x1a4);

/// `counters.heap_replaces.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Replace operations of the merge heap.
pub const COUNTERS_HEAP_REPLACES_LO: Reg<CounterLo> = Reg::new(0x1a8);

/// `counters.heap_replaces.hi`: High half of a 64-bit event counter. Replace operations of the merge heap.
pub const COUNTERS_HEAP_REPLACES_HI: Reg<CounterHi> = Reg::new(0x1ac);

/// `counters.backtracks.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Nodes repaired by the compressor.
pub const COUNTERS_BACKTRACKS_LO: Reg<CounterLo> = Reg::new(0x1b0);

/// `counters.backtracks.hi`: High half of a 64-bit event counter. Nodes repaired by the compressor.
pub const COUNTERS_BACKTRACKS_HI: Reg<CounterHi> = Reg::new(0x1b4);

/// `counters.node_fetches.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Nodes fetched by the traversal unit.
pub const COUNTERS_NODE_FETCHES_LO: Reg<CounterLo> = Reg::new(0x1b8);

/// `counters.node_fetches.hi`: High half of a 64-bit event counter. Nodes fetched by the traversal unit.
pub const COUNTERS_NODE_FETCHES_HI: Reg<CounterHi> = Reg::new(0x1bc);

/// `counters.box_tests.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Ray-box tests.
pub const COUNTERS_BOX_TESTS_LO: Reg<CounterLo> = Reg::new(0x1c0);

/// `counters.box_tests.hi`: High half of a 64-bit event counter. Ray-box tests.
pub const COUNTERS_BOX_TESTS_HI: Reg<CounterHi> = Reg::new(0x1c4);

/// `counters.triangle_tests.lo`: Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ. Ray-triangle tests.
pub const COUNTERS_TRIANGLE_TESTS_LO: Reg<CounterLo> = Reg::new(0x1c8);

/// `counters.triangle_tests.hi`: High half of a 64-bit event counter. Ray-triangle tests.
pub const COUNTERS_TRIANGLE_TESTS_HI: Reg<CounterHi> = Reg::new(0x1cc);

/// Values of fields encoded as `job_kind`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum JobKind {
    /// No job. A start with it fails with `bad_config`.
    None = 0,
    /// Sorts the primitives and writes two-box nodes and the leaf table.
    Build = 1,
    /// Compresses an existing two-box tree top-down into quantized nodes.
    Compress = 2,
    /// Builds and compresses in one stream; two-box nodes never reach memory.
    BuildCompressed = 3,
    /// Traces a region of rays through a tree and writes one hit record per ray.
    Trace = 4,
}

impl JobKind {
    /// Every value, in ascending order.
    pub const ALL: [Self; 5] =
        [Self::None, Self::Build, Self::Compress, Self::BuildCompressed, Self::Trace];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::None),
            1 => Ok(Self::Build),
            2 => Ok(Self::Compress),
            3 => Ok(Self::BuildCompressed),
            4 => Ok(Self::Trace),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Build => "build",
            Self::Compress => "compress",
            Self::BuildCompressed => "build_compressed",
            Self::Trace => "trace",
        }
    }
}

impl core::fmt::Display for JobKind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `stage`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Stage {
    /// Nothing runs.
    Idle = 0,
    /// Partial sorts: primitives are read, sorted in the scratchpad, written as runs.
    Sort = 1,
    /// A merge pass that writes longer runs.
    Merge = 2,
    /// The last merge pass with hierarchy emission (and compression, if streamed).
    Emit = 3,
    /// Top-down compression.
    Compress = 4,
    /// Traversal.
    Trace = 5,
    /// The unit has stopped and waits for outstanding bursts to return.
    Drain = 6,
}

impl Stage {
    /// Every value, in ascending order.
    pub const ALL: [Self; 7] =
        [Self::Idle, Self::Sort, Self::Merge, Self::Emit, Self::Compress, Self::Trace, Self::Drain];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Idle),
            1 => Ok(Self::Sort),
            2 => Ok(Self::Merge),
            3 => Ok(Self::Emit),
            4 => Ok(Self::Compress),
            5 => Ok(Self::Trace),
            6 => Ok(Self::Drain),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Sort => "sort",
            Self::Merge => "merge",
            Self::Emit => "emit",
            Self::Compress => "compress",
            Self::Trace => "trace",
            Self::Drain => "drain",
        }
    }
}

impl core::fmt::Display for Stage {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `error_code`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum ErrorCode {
    /// The last job met no error.
    None = 0,
    /// The job's parameters contradict each other or the capabilities. Nothing was read or written.
    BadConfig = 1,
    /// The output did not fit the region named by `region`. Earlier output is intact.
    RegionFull = 2,
    /// A unit asked for an address outside `region`. The access was not made.
    OutOfRegion = 3,
    /// External memory answered a read with an error. `error_addr` is the burst's first byte.
    BusRead = 4,
    /// External memory answered a write with an error. `error_addr` is the burst's first byte.
    BusWrite = 5,
    /// External memory did not answer. `error_addr` is the burst's first byte.
    BusTimeout = 6,
    /// An input box or triangle lies outside the grid, or a box is inverted. In a trace, a triangle that a ray met.
    BadPrimitive = 7,
    /// A node or leaf table entry is not of such a tree: see *Errors of units*. `region` tells which of both.
    CorruptNode = 8,
    /// A bounded stack or context memory was too shallow for the tree.
    StackOverflow = 9,
    /// Software aborted the job. Output is incomplete.
    Aborted = 10,
    /// A record is not a ray: its direction is not normalized, or its origin or interval is out of range.
    BadRay = 11,
}

impl ErrorCode {
    /// Every value, in ascending order.
    pub const ALL: [Self; 12] = [
        Self::None,
        Self::BadConfig,
        Self::RegionFull,
        Self::OutOfRegion,
        Self::BusRead,
        Self::BusWrite,
        Self::BusTimeout,
        Self::BadPrimitive,
        Self::CorruptNode,
        Self::StackOverflow,
        Self::Aborted,
        Self::BadRay,
    ];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::None),
            1 => Ok(Self::BadConfig),
            2 => Ok(Self::RegionFull),
            3 => Ok(Self::OutOfRegion),
            4 => Ok(Self::BusRead),
            5 => Ok(Self::BusWrite),
            6 => Ok(Self::BusTimeout),
            7 => Ok(Self::BadPrimitive),
            8 => Ok(Self::CorruptNode),
            9 => Ok(Self::StackOverflow),
            10 => Ok(Self::Aborted),
            11 => Ok(Self::BadRay),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::BadConfig => "bad_config",
            Self::RegionFull => "region_full",
            Self::OutOfRegion => "out_of_region",
            Self::BusRead => "bus_read",
            Self::BusWrite => "bus_write",
            Self::BusTimeout => "bus_timeout",
            Self::BadPrimitive => "bad_primitive",
            Self::CorruptNode => "corrupt_node",
            Self::StackOverflow => "stack_overflow",
            Self::Aborted => "aborted",
            Self::BadRay => "bad_ray",
        }
    }
}

impl core::fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `region_id`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum RegionId {
    /// Input of a build, in the format of `job.format.input`; in a trace the 40-byte triangles that leaves refer to.
    Primitives = 0,
    /// Sorted runs, written by the partial sorts and every second merge pass.
    RunsA = 1,
    /// Sorted runs of the other merge passes; unused if one pass is enough.
    RunsB = 2,
    /// Two-box nodes, 64 bytes each.
    Nodes = 3,
    /// Leaf table: primitive indices in leaf order, 4 bytes each.
    LeafTable = 4,
    /// Quantized nodes, 16 bytes each.
    Quantized = 5,
    /// Rays, `cap.trace.ray_bytes` bytes each.
    Rays = 6,
    /// Hit records in the order of the rays, `cap.trace.hit_bytes` bytes each.
    Hits = 7,
}

impl RegionId {
    /// Every value, in ascending order.
    pub const ALL: [Self; 8] = [
        Self::Primitives,
        Self::RunsA,
        Self::RunsB,
        Self::Nodes,
        Self::LeafTable,
        Self::Quantized,
        Self::Rays,
        Self::Hits,
    ];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Primitives),
            1 => Ok(Self::RunsA),
            2 => Ok(Self::RunsB),
            3 => Ok(Self::Nodes),
            4 => Ok(Self::LeafTable),
            5 => Ok(Self::Quantized),
            6 => Ok(Self::Rays),
            7 => Ok(Self::Hits),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Primitives => "primitives",
            Self::RunsA => "runs_a",
            Self::RunsB => "runs_b",
            Self::Nodes => "nodes",
            Self::LeafTable => "leaf_table",
            Self::Quantized => "quantized",
            Self::Rays => "rays",
            Self::Hits => "hits",
        }
    }
}

impl core::fmt::Display for RegionId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `input_format`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum InputFormat {
    /// 32-byte records: a box and the primitive's reference.
    Aabb = 0,
    /// 40-byte records: three vertices; the reference is the position.
    Triangle = 1,
}

impl InputFormat {
    /// Every value, in ascending order.
    pub const ALL: [Self; 2] = [Self::Aabb, Self::Triangle];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Aabb),
            1 => Ok(Self::Triangle),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Aabb => "aabb",
            Self::Triangle => "triangle",
        }
    }
}

impl core::fmt::Display for InputFormat {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `record_format`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum RecordFormat {
    /// 32 bytes: box and reference; the Morton code is computed anew on reading.
    Box32 = 0,
    /// 8 bytes: 30-bit Morton code and position in the input.
    Pair8 = 1,
    /// 22 bytes: box in 24-bit coordinates, and reference.
    Packed22 = 2,
}

impl RecordFormat {
    /// Every value, in ascending order.
    pub const ALL: [Self; 3] = [Self::Box32, Self::Pair8, Self::Packed22];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Box32),
            1 => Ok(Self::Pair8),
            2 => Ok(Self::Packed22),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Box32 => "box32",
            Self::Pair8 => "pair8",
            Self::Packed22 => "packed22",
        }
    }
}

impl core::fmt::Display for RecordFormat {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `node_format`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum NodeFormat {
    /// 64-byte node with the boxes of both children.
    Bvh2 = 0,
    /// 16-byte quantized pair.
    Cbvh = 1,
}

impl NodeFormat {
    /// Every value, in ascending order.
    pub const ALL: [Self; 2] = [Self::Bvh2, Self::Cbvh];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Bvh2),
            1 => Ok(Self::Cbvh),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bvh2 => "bvh2",
            Self::Cbvh => "cbvh",
        }
    }
}

impl core::fmt::Display for NodeFormat {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `coord_mode`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum CoordMode {
    /// Planes relative to the parent's lower corner.
    Relative = 0,
    /// Planes modulo 2^N cells; a grown parent does not invalidate its children.
    Modulo = 1,
}

impl CoordMode {
    /// Every value, in ascending order.
    pub const ALL: [Self; 2] = [Self::Relative, Self::Modulo];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Relative),
            1 => Ok(Self::Modulo),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Relative => "relative",
            Self::Modulo => "modulo",
        }
    }
}

impl core::fmt::Display for CoordMode {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Values of fields encoded as `query`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Query {
    /// The nearest hit; equal distances go to the lowest primitive index.
    Closest = 0,
    /// Whether anything is hit at all: the first hit found ends the ray.
    Any = 1,
}

impl Query {
    /// Every value, in ascending order.
    pub const ALL: [Self; 2] = [Self::Closest, Self::Any];

    /// The value that `bits` encode.
    ///
    /// # Errors
    /// [`UnknownValue`] if this version of the map gives `bits` no meaning.
    pub const fn from_bits(bits: u32) -> Result<Self, UnknownValue> {
        match bits {
            0 => Ok(Self::Closest),
            1 => Ok(Self::Any),
            _ => Err(UnknownValue(bits)),
        }
    }

    /// The name in the register map.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Closest => "closest",
            Self::Any => "any",
        }
    }
}

impl core::fmt::Display for Query {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

/// Magic. Tells a Xylem from an empty bus. Read it before anything else.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Magic(u32);

impl Register for Magic {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x58594c4d;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::Constant, false)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for Magic {}

impl Magic {
    /// ASCII `XYLM`, first letter in the top byte. (Bits 31:0, constant.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }
}

/// Version. Version of this register map. Software needs the same major number and at least its own minor number; while major is 0, the same minor number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Version(u32);

impl Register for Version {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x20000;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("patch", 0, 16, Access::Constant, false),
        FieldInfo::new("minor", 16, 8, Access::Constant, false),
        FieldInfo::new("major", 24, 8, Access::Constant, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for Version {}

impl Version {
    /// Changes when only behaviour is repaired. (Bits 15:0, constant.)
    pub const fn patch(self) -> u16 {
        get(self.0, 0, 16) as u16
    }

    /// Changes when something is added. (Bits 23:16, constant.)
    pub const fn minor(self) -> u8 {
        get(self.0, 16, 8) as u8
    }

    /// Changes when software must change. (Bits 31:24, constant.)
    pub const fn major(self) -> u8 {
        get(self.0, 24, 8) as u8
    }
}

/// Sorter capabilities. Size of the sorter's memories.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapSort(u32);

impl Register for CapSort {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("scratch_records", 0, 24, Access::ReadOnly, false),
        FieldInfo::new("burst_records", 24, 8, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CapSort {}

impl CapSort {
    /// Scratchpad capacity M, in 32-byte records. (Bits 23:0, read-only.)
    pub const fn scratch_records(self) -> u32 {
        get(self.0, 0, 24)
    }

    /// Burst length B, in records. (Bits 31:24, read-only.)
    pub const fn burst_records(self) -> u8 {
        get(self.0, 24, 8) as u8
    }
}

/// Merge capabilities. Limits of the merge and of the leaves it ends in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapMerge(u32);

impl Register for CapMerge {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("width", 0, 16, Access::ReadOnly, false),
        FieldInfo::new("leaf_size", 16, 8, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CapMerge {}

impl CapMerge {
    /// Runs merged in one pass. (Bits 15:0, read-only.)
    pub const fn width(self) -> u16 {
        get(self.0, 0, 16) as u16
    }

    /// Most primitives in one leaf. (Bits 23:16, read-only.)
    pub const fn leaf_size(self) -> u8 {
        get(self.0, 16, 8) as u8
    }
}

/// Geometry capabilities. Widths of the number system.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapGeometry(u32);

impl Register for CapGeometry {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("grid_bits", 0, 6, Access::ReadOnly, false),
        FieldInfo::new("morton_bits", 8, 7, Access::ReadOnly, false),
        FieldInfo::new("plane_bits", 16, 4, Access::ReadOnly, false),
        FieldInfo::new("treelet_depth", 24, 3, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CapGeometry {}

impl CapGeometry {
    /// Bits of a grid coordinate, sign included. (Bits 5:0, read-only.)
    pub const fn grid_bits(self) -> u8 {
        get(self.0, 0, 6) as u8
    }

    /// Most bits of a Morton code. (Bits 14:8, read-only.)
    pub const fn morton_bits(self) -> u8 {
        get(self.0, 8, 7) as u8
    }

    /// Bits N of a quantized plane coordinate. (Bits 19:16, read-only.)
    pub const fn plane_bits(self) -> u8 {
        get(self.0, 16, 4) as u8
    }

    /// Depth of the treelets that the streaming compressor holds; 1 is none, 0 no such compressor. (Bits 26:24, read-only.)
    pub const fn treelet_depth(self) -> u8 {
        get(self.0, 24, 3) as u8
    }
}

/// Feature capabilities. What was synthesized; 1 is present. Using what is absent is a `bad_config` error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapFeatures(u32);

impl Register for CapFeatures {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("build", 0, 1, Access::ReadOnly, false),
        FieldInfo::new("compress", 1, 1, Access::ReadOnly, false),
        FieldInfo::new("trace", 2, 1, Access::ReadOnly, false),
        FieldInfo::new("build_compressed", 3, 1, Access::ReadOnly, false),
        FieldInfo::new("input_aabb", 4, 1, Access::ReadOnly, false),
        FieldInfo::new("input_triangle", 5, 1, Access::ReadOnly, false),
        FieldInfo::new("record_box32", 8, 1, Access::ReadOnly, false),
        FieldInfo::new("record_pair8", 9, 1, Access::ReadOnly, false),
        FieldInfo::new("record_packed22", 10, 1, Access::ReadOnly, false),
        FieldInfo::new("node_bvh2", 12, 1, Access::ReadOnly, false),
        FieldInfo::new("node_cbvh", 13, 1, Access::ReadOnly, false),
        FieldInfo::new("coords_relative", 16, 1, Access::ReadOnly, false),
        FieldInfo::new("coords_modulo", 17, 1, Access::ReadOnly, false),
        FieldInfo::new("counters", 20, 1, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CapFeatures {}

impl CapFeatures {
    /// Job `build`. (Bit 0, read-only.)
    pub const fn build(self) -> bool {
        get(self.0, 0, 1) != 0
    }

    /// Job `compress`. (Bit 1, read-only.)
    pub const fn compress(self) -> bool {
        get(self.0, 1, 1) != 0
    }

    /// Job `trace`. (Bit 2, read-only.)
    pub const fn trace(self) -> bool {
        get(self.0, 2, 1) != 0
    }

    /// Job `build_compressed`. (Bit 3, read-only.)
    pub const fn build_compressed(self) -> bool {
        get(self.0, 3, 1) != 0
    }

    /// Input format `aabb`. (Bit 4, read-only.)
    pub const fn input_aabb(self) -> bool {
        get(self.0, 4, 1) != 0
    }

    /// Input format `triangle`. (Bit 5, read-only.)
    pub const fn input_triangle(self) -> bool {
        get(self.0, 5, 1) != 0
    }

    /// Record format `box32`. (Bit 8, read-only.)
    pub const fn record_box32(self) -> bool {
        get(self.0, 8, 1) != 0
    }

    /// Record format `pair8`. (Bit 9, read-only.)
    pub const fn record_pair8(self) -> bool {
        get(self.0, 9, 1) != 0
    }

    /// Record format `packed22`. (Bit 10, read-only.)
    pub const fn record_packed22(self) -> bool {
        get(self.0, 10, 1) != 0
    }

    /// Node format `bvh2`, for tracing. (Bit 12, read-only.)
    pub const fn node_bvh2(self) -> bool {
        get(self.0, 12, 1) != 0
    }

    /// Node format `cbvh`, for tracing. (Bit 13, read-only.)
    pub const fn node_cbvh(self) -> bool {
        get(self.0, 13, 1) != 0
    }

    /// Coordinate mode `relative`. (Bit 16, read-only.)
    pub const fn coords_relative(self) -> bool {
        get(self.0, 16, 1) != 0
    }

    /// Coordinate mode `modulo`. (Bit 17, read-only.)
    pub const fn coords_modulo(self) -> bool {
        get(self.0, 17, 1) != 0
    }

    /// The event counters. Absent counters read as 0, which then means nothing. (Bit 20, read-only.)
    pub const fn counters(self) -> bool {
        get(self.0, 20, 1) != 0
    }
}

/// Traversal capabilities. Record sizes and stack depth of the traversal unit; all 0 if it is absent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CapTrace(u32);

impl Register for CapTrace {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("ray_bytes", 0, 8, Access::ReadOnly, false),
        FieldInfo::new("hit_bytes", 8, 8, Access::ReadOnly, false),
        FieldInfo::new("stack_entries", 16, 8, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CapTrace {}

impl CapTrace {
    /// Size of a ray record, in bytes. (Bits 7:0, read-only.)
    pub const fn ray_bytes(self) -> u8 {
        get(self.0, 0, 8) as u8
    }

    /// Size of a hit record, in bytes. (Bits 15:8, read-only.)
    pub const fn hit_bytes(self) -> u8 {
        get(self.0, 8, 8) as u8
    }

    /// Entries of the traversal stack: the most nodes that a walk from the root to a leaf passes. (Bits 23:16, read-only.)
    pub const fn stack_entries(self) -> u8 {
        get(self.0, 16, 8) as u8
    }
}

/// Control. Starts and stops jobs. At most one of `start`, `abort_job` and `soft_reset` may be written as 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ctrl(u32);

impl Register for Ctrl {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("start", 0, 1, Access::WriteOneToPulse, false),
        FieldInfo::new("abort_job", 1, 1, Access::WriteOneToPulse, false),
        FieldInfo::new("soft_reset", 2, 1, Access::WriteOneToPulse, false),
        FieldInfo::new("job", 8, 3, Access::ReadWrite, true),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for Ctrl {}

impl Writable for Ctrl {}

impl Ctrl {
    /// Sets `start`. Starts the job `job`. Ignored while busy. Clears `done`, `failed` and `error_info`. (Bit 0, write 1 to trigger, reads as 0.)
    #[must_use]
    pub const fn with_start(self, value: bool) -> Self {
        Self(set(self.0, 0, 1, value as u32))
    }

    /// Sets `abort_job`. Stops the running job after its outstanding bursts; it ends with error `aborted`. (Bit 1, write 1 to trigger, reads as 0.)
    #[must_use]
    pub const fn with_abort_job(self, value: bool) -> Self {
        Self(set(self.0, 1, 1, value as u32))
    }

    /// Sets `soft_reset`. Returns every unit to its state after power-up, once outstanding bursts have returned, and clears the counters. Configuration registers keep their values. (Bit 2, write 1 to trigger, reads as 0.)
    #[must_use]
    pub const fn with_soft_reset(self, value: bool) -> Self {
        Self(set(self.0, 2, 1, value as u32))
    }

    /// Which job `start` starts. Locked while busy. (Bits 10:8, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn job(self) -> Result<JobKind, UnknownValue> {
        JobKind::from_bits(get(self.0, 8, 3))
    }

    /// Sets `job`. Which job `start` starts. Locked while busy. (Bits 10:8, read-write, locked while busy.)
    #[must_use]
    pub const fn with_job(self, value: JobKind) -> Self {
        Self(set(self.0, 8, 3, value as u32))
    }
}

/// Status. State of the running or the last job.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status(u32);

impl Register for Status {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("busy", 0, 1, Access::ReadOnly, false),
        FieldInfo::new("done", 1, 1, Access::ReadOnly, false),
        FieldInfo::new("failed", 2, 1, Access::ReadOnly, false),
        FieldInfo::new("stage", 8, 4, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for Status {}

impl Status {
    /// A job, an abort or a soft reset is under way. (Bit 0, read-only.)
    pub const fn busy(self) -> bool {
        get(self.0, 0, 1) != 0
    }

    /// The last job ended, well or not. Cleared by `start` and `soft_reset`. (Bit 1, read-only.)
    pub const fn done(self) -> bool {
        get(self.0, 1, 1) != 0
    }

    /// The last job ended in an error: see `error_info`. Cleared like `done`. (Bit 2, read-only.)
    pub const fn failed(self) -> bool {
        get(self.0, 2, 1) != 0
    }

    /// What runs now. (Bits 11:8, read-only.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn stage(self) -> Result<Stage, UnknownValue> {
        Stage::from_bits(get(self.0, 8, 4))
    }
}

/// Error information. The first error of the last job. Cleared by `start` and `soft_reset`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ErrorInfo(u32);

impl Register for ErrorInfo {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("code", 0, 8, Access::ReadOnly, false),
        FieldInfo::new("stage", 8, 4, Access::ReadOnly, false),
        FieldInfo::new("region_valid", 15, 1, Access::ReadOnly, false),
        FieldInfo::new("region", 16, 4, Access::ReadOnly, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for ErrorInfo {}

impl ErrorInfo {
    /// What went wrong. (Bits 7:0, read-only.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn code(self) -> Result<ErrorCode, UnknownValue> {
        ErrorCode::from_bits(get(self.0, 0, 8))
    }

    /// The stage in which it went wrong. (Bits 11:8, read-only.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn stage(self) -> Result<Stage, UnknownValue> {
        Stage::from_bits(get(self.0, 8, 4))
    }

    /// Whether `region` means anything. (Bit 15, read-only.)
    pub const fn region_valid(self) -> bool {
        get(self.0, 15, 1) != 0
    }

    /// The region concerned. (Bits 19:16, read-only.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn region(self) -> Result<RegionId, UnknownValue> {
        RegionId::from_bits(get(self.0, 16, 4))
    }
}

/// Error address. Where the first error of the last job happened. Meaningful for bus, region and node errors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ErrorAddr(u32);

impl Register for ErrorAddr {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("addr", 0, 32, Access::ReadOnly, false)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for ErrorAddr {}

impl ErrorAddr {
    /// Byte address in external memory. (Bits 31:0, read-only.)
    pub const fn addr(self) -> u32 {
        get(self.0, 0, 32)
    }
}

/// Interrupt status. Events since they were last cleared. Write 1 to clear a bit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct IntStatus(u32);

impl Register for IntStatus {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("done", 0, 1, Access::WriteOneToClear, false),
        FieldInfo::new("failed", 1, 1, Access::WriteOneToClear, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for IntStatus {}

impl Writable for IntStatus {}

impl IntStatus {
    /// A job ended without an error. (Bit 0, write 1 to clear.)
    pub const fn done(self) -> bool {
        get(self.0, 0, 1) != 0
    }

    /// Sets `done`. A job ended without an error. (Bit 0, write 1 to clear.)
    #[must_use]
    pub const fn with_done(self, value: bool) -> Self {
        Self(set(self.0, 0, 1, value as u32))
    }

    /// A job ended in an error (an abort included). (Bit 1, write 1 to clear.)
    pub const fn failed(self) -> bool {
        get(self.0, 1, 1) != 0
    }

    /// Sets `failed`. A job ended in an error (an abort included). (Bit 1, write 1 to clear.)
    #[must_use]
    pub const fn with_failed(self, value: bool) -> Self {
        Self(set(self.0, 1, 1, value as u32))
    }
}

/// Interrupt enable. Which events raise the interrupt line. The line is active high and stays so until every enabled event is cleared.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct IntEnable(u32);

impl Register for IntEnable {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("done", 0, 1, Access::ReadWrite, false),
        FieldInfo::new("failed", 1, 1, Access::ReadWrite, false),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for IntEnable {}

impl Writable for IntEnable {}

impl IntEnable {
    /// Enables `int_status.done`. (Bit 0, read-write.)
    pub const fn done(self) -> bool {
        get(self.0, 0, 1) != 0
    }

    /// Sets `done`. Enables `int_status.done`. (Bit 0, read-write.)
    #[must_use]
    pub const fn with_done(self, value: bool) -> Self {
        Self(set(self.0, 0, 1, value as u32))
    }

    /// Enables `int_status.failed`. (Bit 1, read-write.)
    pub const fn failed(self) -> bool {
        get(self.0, 1, 1) != 0
    }

    /// Sets `failed`. Enables `int_status.failed`. (Bit 1, read-write.)
    #[must_use]
    pub const fn with_failed(self, value: bool) -> Self {
        Self(set(self.0, 1, 1, value as u32))
    }
}

/// Primitive count. Length of the input of a build; in a trace the number of triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobPrimitives(u32);

impl Register for JobPrimitives {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobPrimitives {}

impl Writable for JobPrimitives {}

impl JobPrimitives {
    /// Number of primitives; 0 is a `bad_config` error, as is 2^27 or more of a build, 2^26 or more of a trace. (Bits 31:0, read-write, locked while busy.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }

    /// Sets `value`. Number of primitives; 0 is a `bad_config` error, as is 2^27 or more of a build, 2^26 or more of a trace. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_value(self, value: u32) -> Self {
        Self(set(self.0, 0, 32, value))
    }
}

/// Ray count. Length of the input of a trace.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobRays(u32);

impl Register for JobRays {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobRays {}

impl Writable for JobRays {}

impl JobRays {
    /// Number of rays; 0 is a `bad_config` error, as is 2^26 or more. (Bits 31:0, read-write, locked while busy.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }

    /// Sets `value`. Number of rays; 0 is a `bad_config` error, as is 2^26 or more. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_value(self, value: u32) -> Self {
        Self(set(self.0, 0, 32, value))
    }
}

/// Node count. Nodes of the tree to compress or trace. A node index from here on is a `corrupt_node` error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobNodes(u32);

impl Register for JobNodes {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobNodes {}

impl Writable for JobNodes {}

impl JobNodes {
    /// Number of nodes, 0 if the root is a leaf; in a trace, 2^26 or more is a `bad_config` error. (Bits 31:0, read-write, locked while busy.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }

    /// Sets `value`. Number of nodes, 0 if the root is a leaf; in a trace, 2^26 or more is a `bad_config` error. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_value(self, value: u32) -> Self {
        Self(set(self.0, 0, 32, value))
    }
}

/// Leaf table length. Leaf table entries of the tree to trace. A leaf that extends further is a `corrupt_node` error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobEntries(u32);

impl Register for JobEntries {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobEntries {}

impl Writable for JobEntries {}

impl JobEntries {
    /// Number of entries; 2^26 or more is a `bad_config` error. (Bits 31:0, read-write, locked while busy.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }

    /// Sets `value`. Number of entries; 2^26 or more is a `bad_config` error. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_value(self, value: u32) -> Self {
        Self(set(self.0, 0, 32, value))
    }
}

/// Job formats. Byte formats that the job reads and writes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobFormat(u32);

impl Register for JobFormat {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("input", 0, 2, Access::ReadWrite, true),
        FieldInfo::new("record", 4, 2, Access::ReadWrite, true),
        FieldInfo::new("node", 8, 1, Access::ReadWrite, true),
        FieldInfo::new("coords", 12, 1, Access::ReadWrite, true),
        FieldInfo::new("query", 16, 1, Access::ReadWrite, true),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobFormat {}

impl Writable for JobFormat {}

impl JobFormat {
    /// Primitives (build). (Bits 1:0, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn input(self) -> Result<InputFormat, UnknownValue> {
        InputFormat::from_bits(get(self.0, 0, 2))
    }

    /// Sets `input`. Primitives (build). (Bits 1:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_input(self, value: InputFormat) -> Self {
        Self(set(self.0, 0, 2, value as u32))
    }

    /// Sorted records (build). (Bits 5:4, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn record(self) -> Result<RecordFormat, UnknownValue> {
        RecordFormat::from_bits(get(self.0, 4, 2))
    }

    /// Sets `record`. Sorted records (build). (Bits 5:4, read-write, locked while busy.)
    #[must_use]
    pub const fn with_record(self, value: RecordFormat) -> Self {
        Self(set(self.0, 4, 2, value as u32))
    }

    /// Nodes to walk (trace). (Bit 8, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn node(self) -> Result<NodeFormat, UnknownValue> {
        NodeFormat::from_bits(get(self.0, 8, 1))
    }

    /// Sets `node`. Nodes to walk (trace). (Bit 8, read-write, locked while busy.)
    #[must_use]
    pub const fn with_node(self, value: NodeFormat) -> Self {
        Self(set(self.0, 8, 1, value as u32))
    }

    /// Quantized coordinates (compress, build_compressed, trace). (Bit 12, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn coords(self) -> Result<CoordMode, UnknownValue> {
        CoordMode::from_bits(get(self.0, 12, 1))
    }

    /// Sets `coords`. Quantized coordinates (compress, build_compressed, trace). (Bit 12, read-write, locked while busy.)
    #[must_use]
    pub const fn with_coords(self, value: CoordMode) -> Self {
        Self(set(self.0, 12, 1, value as u32))
    }

    /// What is asked of each ray (trace). (Bit 16, read-write, locked while busy.)
    ///
    /// # Errors
    /// [`UnknownValue`] if the map gives the bits no meaning.
    pub const fn query(self) -> Result<Query, UnknownValue> {
        Query::from_bits(get(self.0, 16, 1))
    }

    /// Sets `query`. What is asked of each ray (trace). (Bit 16, read-write, locked while busy.)
    #[must_use]
    pub const fn with_query(self, value: Query) -> Self {
        Self(set(self.0, 16, 1, value as u32))
    }
}

/// Job limits. Sizes that shape the tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct JobLimits(u32);

impl Register for JobLimits {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[
        FieldInfo::new("morton_bits", 0, 7, Access::ReadWrite, true),
        FieldInfo::new("leaf_size", 8, 8, Access::ReadWrite, true),
        FieldInfo::new("treelet_depth", 16, 3, Access::ReadWrite, true),
    ];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for JobLimits {}

impl Writable for JobLimits {}

impl JobLimits {
    /// Bits of the Morton code, 30 or 63; at most `cap.geometry.morton_bits`. (Bits 6:0, read-write, locked while busy.)
    pub const fn morton_bits(self) -> u8 {
        get(self.0, 0, 7) as u8
    }

    /// Sets `morton_bits`. Bits of the Morton code, 30 or 63; at most `cap.geometry.morton_bits`. (Bits 6:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_morton_bits(self, value: u8) -> Self {
        Self(set(self.0, 0, 7, value as u32))
    }

    /// Most primitives in a leaf; 1 gives single-primitive leaves. At most `cap.merge.leaf_size`. (Bits 15:8, read-write, locked while busy.)
    pub const fn leaf_size(self) -> u8 {
        get(self.0, 8, 8) as u8
    }

    /// Sets `leaf_size`. Most primitives in a leaf; 1 gives single-primitive leaves. At most `cap.merge.leaf_size`. (Bits 15:8, read-write, locked while busy.)
    #[must_use]
    pub const fn with_leaf_size(self, value: u8) -> Self {
        Self(set(self.0, 8, 8, value as u32))
    }

    /// Treelet depth (build_compressed); other than `cap.geometry.treelet_depth` is a `bad_config` error. (Bits 18:16, read-write, locked while busy.)
    pub const fn treelet_depth(self) -> u8 {
        get(self.0, 16, 3) as u8
    }

    /// Sets `treelet_depth`. Treelet depth (build_compressed); other than `cap.geometry.treelet_depth` is a `bad_config` error. (Bits 18:16, read-write, locked while busy.)
    #[must_use]
    pub const fn with_treelet_depth(self, value: u8) -> Self {
        Self(set(self.0, 16, 3, value as u32))
    }
}

/// Root box coordinate. One coordinate of a corner of the root's box, signed. Bits above `cap.geometry.grid_bits` are not looked at: the next one is the sign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Coordinate(u32);

impl Register for Coordinate {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for Coordinate {}

impl Writable for Coordinate {}

impl Coordinate {
    /// Two's complement, in grid units. (Bits 31:0, read-write, locked while busy.)
    pub const fn value(self) -> i32 {
        get(self.0, 0, 32) as i32
    }

    /// Sets `value`. Two's complement, in grid units. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_value(self, value: i32) -> Self {
        Self(set(self.0, 0, 32, value as u32))
    }
}

/// Root pointer. Where the root is. Quantized nodes have the index of the two-box node that they came from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RootPointer(u32);

impl Register for RootPointer {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("index", 0, 32, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for RootPointer {}

impl Writable for RootPointer {}

impl RootPointer {
    /// Node index, or first leaf table entry if the root is a leaf. (Bits 31:0, read-write, locked while busy.)
    pub const fn index(self) -> u32 {
        get(self.0, 0, 32)
    }

    /// Sets `index`. Node index, or first leaf table entry if the root is a leaf. (Bits 31:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_index(self, value: u32) -> Self {
        Self(set(self.0, 0, 32, value))
    }
}

/// Root leaf size. Tells a tree that is a single leaf from one with nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RootLeafSize(u32);

impl Register for RootLeafSize {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("count", 0, 8, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for RootLeafSize {}

impl Writable for RootLeafSize {}

impl RootLeafSize {
    /// Primitives of the root if it is a leaf, 0 if it is a node. (Bits 7:0, read-write, locked while busy.)
    pub const fn count(self) -> u8 {
        get(self.0, 0, 8) as u8
    }

    /// Sets `count`. Primitives of the root if it is a leaf, 0 if it is a node. (Bits 7:0, read-write, locked while busy.)
    #[must_use]
    pub const fn with_count(self, value: u8) -> Self {
        Self(set(self.0, 0, 8, value as u32))
    }
}

/// Result count. One result of the last job, valid once it is done; 0 if the job does not produce it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ResultCount(u32);

impl Register for ResultCount {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadOnly, false)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for ResultCount {}

impl ResultCount {
    /// Count. (Bits 31:0, read-only.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }
}

/// Region base. First byte of a region. The whole register is the byte address; it is a multiple of 64.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RegionBase(u32);

impl Register for RegionBase {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("line", 6, 26, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for RegionBase {}

impl Writable for RegionBase {}

impl RegionBase {
    /// Bits 31:6 of the byte address (unit: 64 bytes). (Bits 31:6, read-write, locked while busy.)
    pub const fn line(self) -> u32 {
        get(self.0, 6, 26)
    }

    /// Sets `line`. Bits 31:6 of the byte address (unit: 64 bytes). (Bits 31:6, read-write, locked while busy.)
    #[must_use]
    pub const fn with_line(self, value: u32) -> Self {
        Self(set(self.0, 6, 26, value))
    }
}

/// Region size. Length of a region. The whole register is the size in bytes; it is a multiple of 64. A region of size 0 is absent: any access to it is an `out_of_region` error.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RegionSize(u32);

impl Register for RegionSize {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("lines", 6, 26, Access::ReadWrite, true)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for RegionSize {}

impl Writable for RegionSize {}

impl RegionSize {
    /// Bits 31:6 of the size in bytes (unit: 64 bytes). (Bits 31:6, read-write, locked while busy.)
    pub const fn lines(self) -> u32 {
        get(self.0, 6, 26)
    }

    /// Sets `lines`. Bits 31:6 of the size in bytes (unit: 64 bytes). (Bits 31:6, read-write, locked while busy.)
    #[must_use]
    pub const fn with_lines(self, value: u32) -> Self {
        Self(set(self.0, 6, 26, value))
    }
}

/// Counter, low half. Low half of a 64-bit event counter. Read high, low, high and repeat if the highs differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CounterLo(u32);

impl Register for CounterLo {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadOnly, false)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CounterLo {}

impl CounterLo {
    /// Bits 31:0 of the count. (Bits 31:0, read-only.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }
}

/// Counter, high half. High half of a 64-bit event counter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CounterHi(u32);

impl Register for CounterHi {
    const RESET: Self = Self(Self::RESET_BITS);
    const RESET_BITS: u32 = 0x0;
    const FIELDS: &'static [FieldInfo] = &[FieldInfo::new("value", 0, 32, Access::ReadOnly, false)];

    fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    fn bits(self) -> u32 {
        self.0
    }
}

impl Readable for CounterHi {}

impl CounterHi {
    /// Bits 63:32 of the count. (Bits 31:0, read-only.)
    pub const fn value(self) -> u32 {
        get(self.0, 0, 32)
    }
}

/// Every register of the map, by ascending offset.
pub const REGISTERS: [RegisterInfo; 67] = [
    RegisterInfo::new("magic", MAGIC),
    RegisterInfo::new("version", VERSION),
    RegisterInfo::new("cap.sort", CAP_SORT),
    RegisterInfo::new("cap.merge", CAP_MERGE),
    RegisterInfo::new("cap.geometry", CAP_GEOMETRY),
    RegisterInfo::new("cap.features", CAP_FEATURES),
    RegisterInfo::new("cap.trace", CAP_TRACE),
    RegisterInfo::new("ctrl", CTRL),
    RegisterInfo::new("status", STATUS),
    RegisterInfo::new("error_info", ERROR_INFO),
    RegisterInfo::new("error_addr", ERROR_ADDR),
    RegisterInfo::new("int_status", INT_STATUS),
    RegisterInfo::new("int_enable", INT_ENABLE),
    RegisterInfo::new("job.primitives", JOB_PRIMITIVES),
    RegisterInfo::new("job.rays", JOB_RAYS),
    RegisterInfo::new("job.nodes", JOB_NODES),
    RegisterInfo::new("job.entries", JOB_ENTRIES),
    RegisterInfo::new("job.format", JOB_FORMAT),
    RegisterInfo::new("job.limits", JOB_LIMITS),
    RegisterInfo::new("root.lo_x", ROOT_LO_X),
    RegisterInfo::new("root.lo_y", ROOT_LO_Y),
    RegisterInfo::new("root.lo_z", ROOT_LO_Z),
    RegisterInfo::new("root.hi_x", ROOT_HI_X),
    RegisterInfo::new("root.hi_y", ROOT_HI_Y),
    RegisterInfo::new("root.hi_z", ROOT_HI_Z),
    RegisterInfo::new("root.pointer", ROOT_POINTER),
    RegisterInfo::new("root.leaf_size", ROOT_LEAF_SIZE),
    RegisterInfo::new("result.nodes", RESULT_NODES),
    RegisterInfo::new("result.leaves", RESULT_LEAVES),
    RegisterInfo::new("result.quantized", RESULT_QUANTIZED),
    RegisterInfo::new("result.hits", RESULT_HITS),
    RegisterInfo::new("region.primitives.base", REGION_PRIMITIVES_BASE),
    RegisterInfo::new("region.primitives.size", REGION_PRIMITIVES_SIZE),
    RegisterInfo::new("region.runs_a.base", REGION_RUNS_A_BASE),
    RegisterInfo::new("region.runs_a.size", REGION_RUNS_A_SIZE),
    RegisterInfo::new("region.runs_b.base", REGION_RUNS_B_BASE),
    RegisterInfo::new("region.runs_b.size", REGION_RUNS_B_SIZE),
    RegisterInfo::new("region.nodes.base", REGION_NODES_BASE),
    RegisterInfo::new("region.nodes.size", REGION_NODES_SIZE),
    RegisterInfo::new("region.leaf_table.base", REGION_LEAF_TABLE_BASE),
    RegisterInfo::new("region.leaf_table.size", REGION_LEAF_TABLE_SIZE),
    RegisterInfo::new("region.quantized.base", REGION_QUANTIZED_BASE),
    RegisterInfo::new("region.quantized.size", REGION_QUANTIZED_SIZE),
    RegisterInfo::new("region.rays.base", REGION_RAYS_BASE),
    RegisterInfo::new("region.rays.size", REGION_RAYS_SIZE),
    RegisterInfo::new("region.hits.base", REGION_HITS_BASE),
    RegisterInfo::new("region.hits.size", REGION_HITS_SIZE),
    RegisterInfo::new("counters.cycles.lo", COUNTERS_CYCLES_LO),
    RegisterInfo::new("counters.cycles.hi", COUNTERS_CYCLES_HI),
    RegisterInfo::new("counters.bytes_read.lo", COUNTERS_BYTES_READ_LO),
    RegisterInfo::new("counters.bytes_read.hi", COUNTERS_BYTES_READ_HI),
    RegisterInfo::new("counters.bytes_written.lo", COUNTERS_BYTES_WRITTEN_LO),
    RegisterInfo::new("counters.bytes_written.hi", COUNTERS_BYTES_WRITTEN_HI),
    RegisterInfo::new("counters.nodes.lo", COUNTERS_NODES_LO),
    RegisterInfo::new("counters.nodes.hi", COUNTERS_NODES_HI),
    RegisterInfo::new("counters.leaves.lo", COUNTERS_LEAVES_LO),
    RegisterInfo::new("counters.leaves.hi", COUNTERS_LEAVES_HI),
    RegisterInfo::new("counters.heap_replaces.lo", COUNTERS_HEAP_REPLACES_LO),
    RegisterInfo::new("counters.heap_replaces.hi", COUNTERS_HEAP_REPLACES_HI),
    RegisterInfo::new("counters.backtracks.lo", COUNTERS_BACKTRACKS_LO),
    RegisterInfo::new("counters.backtracks.hi", COUNTERS_BACKTRACKS_HI),
    RegisterInfo::new("counters.node_fetches.lo", COUNTERS_NODE_FETCHES_LO),
    RegisterInfo::new("counters.node_fetches.hi", COUNTERS_NODE_FETCHES_HI),
    RegisterInfo::new("counters.box_tests.lo", COUNTERS_BOX_TESTS_LO),
    RegisterInfo::new("counters.box_tests.hi", COUNTERS_BOX_TESTS_HI),
    RegisterInfo::new("counters.triangle_tests.lo", COUNTERS_TRIANGLE_TESTS_LO),
    RegisterInfo::new("counters.triangle_tests.hi", COUNTERS_TRIANGLE_TESTS_HI),
];
