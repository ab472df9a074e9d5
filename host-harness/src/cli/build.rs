//! `xylem build`.

use std::str::FromStr;

use clap::ValueEnum;
use clap::builder::PossibleValuesParser;
use xylem_core::error::RegionName;
use xylem_core::sort::{InputFormat, ReadSchedule, RecordFormat, SortConfig};

use super::machine::MachineArgs;
use super::options::{self, TreeArgs, build_failed};
use super::{CliError, Console};
use crate::bus::{MEMORIES, MemoryTiming};
use crate::report::BuildReport;
use crate::run::{self, Buffers, BuildOptions};
use crate::scene::Mesh;

/// Build the tree of a scene and print what it took
///
/// Sorts the primitives by Morton code (external merge sort through simulated memory), emits the
/// tree in one stream and, with --format cbvh, compresses it to 16-byte nodes. Prints the tree's
/// size and quality, and the bytes and cycles of each stage.
///
/// Bytes are exact: they are what crosses the memory bus. Cycles are a model. With --engine function,
/// each access takes its bytes at the memory's rate and its share of the latency. With --engine
/// cycle, every unit of the builder and every command of the LPDDR3 is simulated clock by clock.
/// time_ms is build_cycles over the clock; host_ms is how long this machine took.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem build bunny.obj.gz --format bvh2 --json\n  \
    xylem build terrain:10 --format cbvh --coords relative --memory fast\n  \
    xylem build sphereflake --capacity 1024 --burst 8 --record pair8\n  \
    xylem build bunny --engine cycle --memory medium\n  \
    xylem build bunny --engine cycle --memory fast --overlap --share\n\n\
    JSON keys carry their unit; a quantity that was not measured is absent.")]
pub(super) struct Args {
    #[command(flatten)]
    tree: TreeArgs,
    /// What the builder reads: 32-byte boxes with a reference, or 40-byte triangles
    #[arg(long, value_enum, default_value_t = Input::Aabb)]
    input: Input,
    /// What the sorter writes and reads between its passes, by its size in bytes
    #[arg(long, value_enum, default_value_t = Record::Box32)]
    record: Record,
    /// M: records that the sorter's scratchpad holds; a power of two
    #[arg(long, value_name = "M", default_value_t = SortConfig::PAPER.capacity,
          value_parser = clap::value_parser!(u32).range(4..=1 << 20))]
    capacity: u32,
    /// B: records in a burst; a power of two, at most 32. M / 2B runs are merged at once
    #[arg(long, value_name = "B", default_value_t = SortConfig::PAPER.burst,
          value_parser = clap::value_parser!(u32).range(1..=32))]
    burst: u32,
    /// How the merge reads runs: double-buffer gives each run two bursts on chip, forecast one and
    /// reads those first that run dry first, so M / B runs are merged at once
    #[arg(long, value_enum, default_value_t = Schedule::DoubleBuffer)]
    schedule: Schedule,
    #[command(flatten)]
    machine: MachineArgs,
    /// The memory whose time is modelled: ideal takes no time; slow, medium and fast move 12.8, 25.6
    /// and 42.7 GB/s, p3 12.8 GB/s, p1-16 and p1-32 what they say
    #[arg(long, default_value = "slow", value_parser = memory_names())]
    memory: String,
    /// Give a region no more than BYTES; repeatable. Regions: primitives, runs-a, runs-b, nodes,
    /// leaf-table, quantized-nodes
    #[arg(long, value_name = "NAME=BYTES")]
    region_limit: Vec<RegionLimit>,
}

/// `--input`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Input {
    /// 32-byte boxes
    Aabb,
    /// 40-byte triangles
    Triangle,
}

/// `--record`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Record {
    /// 32 bytes: box and reference
    Box32,
    /// 22 bytes: the same, packed
    Packed22,
    /// 8 bytes: Morton code and reference; boxes are read again
    Pair8,
}

/// `--schedule`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Schedule {
    /// Two bursts a run
    DoubleBuffer,
    /// One burst a run, read in the order of their last keys
    Forecast,
}

/// `--region-limit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RegionLimit {
    region: RegionName,
    bytes: u32,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let mut options = args.tree.build_options()?;
    options.config.input = match args.input {
        Input::Aabb => InputFormat::Box32,
        Input::Triangle => InputFormat::Triangle40,
    };
    options.config.sort = SortConfig {
        capacity: args.capacity,
        burst: args.burst,
        record: match args.record {
            Record::Box32 => RecordFormat::Box32,
            Record::Packed22 => RecordFormat::Packed22,
            Record::Pair8 => RecordFormat::Pair8,
        },
        schedule: match args.schedule {
            Schedule::DoubleBuffer => ReadSchedule::DoubleBuffer,
            Schedule::Forecast => ReadSchedule::Forecast,
        },
    };
    options.memory = *MemoryTiming::by_name(&args.memory).unwrap_or(&options.memory);
    options.machine = args.machine.config(&options)?;
    let mesh = args.tree.load()?;
    fit_regions(&mesh, &options, &args.region_limit)?;
    let run = options::build(&mesh, &options)?;
    let quality = run.check().map_err(|e| build_failed(&mesh, e))?;
    let report = BuildReport::new(&mesh.name, &options, &run, &quality);
    console.result(&report, || report.to_string())
}

/// The names of all memories, for the parser.
pub(super) fn memory_names() -> PossibleValuesParser {
    PossibleValuesParser::new(MEMORIES.iter().map(|memory| memory.name))
}

impl FromStr for RegionLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, bytes) = text.split_once('=').ok_or("write NAME=BYTES, as nodes=65536")?;
        let regions = [
            RegionName::Primitives,
            RegionName::RunsA,
            RegionName::RunsB,
            RegionName::Nodes,
            RegionName::LeafTable,
            RegionName::QuantizedNodes,
        ];
        let words = |region: &RegionName| region.as_str().replace(' ', "-").to_lowercase();
        let region = regions.into_iter().find(|region| words(region) == name).ok_or_else(|| {
            let all: Vec<String> = regions.iter().map(words).collect();
            format!("there is no region '{name}'; there are {}", all.join(", "))
        })?;
        let bytes = bytes
            .parse()
            .map_err(|_| format!("'{bytes}' is not a number of bytes from 0 to {}", u32::MAX))?;
        Ok(Self { region, bytes })
    }
}

/// Tries the build in regions no larger than the limits: only the core knows what it needs where.
///
/// # Errors
/// [`CliError::Build`] naming the region that is too small.
fn fit_regions(
    mesh: &Mesh,
    options: &BuildOptions,
    limits: &[RegionLimit],
) -> Result<(), CliError> {
    if limits.is_empty() {
        return Ok(());
    }
    let loaded = run::load(&mesh.triangles, &options.config);
    let (mut memory, mut layout) = loaded.map_err(|e| build_failed(mesh, e))?;
    for limit in limits {
        let region = match limit.region {
            RegionName::RunsA => &mut layout.build.runs_a,
            RegionName::RunsB => &mut layout.build.runs_b,
            RegionName::Nodes => &mut layout.build.nodes,
            RegionName::LeafTable => &mut layout.build.leaf_table,
            // A compressor writes where the emitter would.
            RegionName::QuantizedNodes if options.config.compression.is_some() => {
                &mut layout.build.nodes
            }
            RegionName::QuantizedNodes => &mut layout.quantized_nodes,
            RegionName::Primitives | RegionName::Triangles => &mut layout.build.primitives,
        };
        region.size = region.size.min(limit.bytes);
    }
    let mut buffers = Buffers::new(&options.config);
    let count = mesh.triangles.len() as u32;
    run::job(&mut memory, &layout, options, count, &mut buffers, &mut ())
        .map_err(|e| build_failed(mesh, e))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn region_limits_parse_or_say_how() {
        let parse = |text: &str| text.parse::<RegionLimit>();
        let expect = RegionLimit { region: RegionName::LeafTable, bytes: 64 };
        assert_eq!(parse("leaf-table=64"), Ok(expect));
        assert!(parse("leaf-table").unwrap_err().contains("NAME=BYTES"));
        assert!(parse("leaves=1").unwrap_err().contains("there are primitives, runs-a"));
        assert!(parse("nodes=-1").unwrap_err().contains("'-1' is not a number of bytes"));
    }
}
