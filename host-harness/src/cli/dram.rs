//! `xylem dram`.

use std::path::PathBuf;
use std::time::Instant;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::{CliError, Console, progress};
use crate::dram::{CONFIGS, Config, Memory, TraceFile, replay};
use crate::report::DramReport;

/// Replay a trace of memory requests on a cycle-level DRAM model
///
/// A trace is text, a request of 64 bytes a line: the byte address in hexadecimal and R or W, as in
/// `0x00001f40 R`. It may be gzipped. Empty lines and what follows a # do not count. There are no
/// timestamps: requests are offered in the order of the file, at most one a memory clock, each as
/// soon as the queue of its channel accepts it; one that is not accepted holds up those behind it.
///
/// The model counts every command of every bank: row hits, misses and conflicts, refreshes, turns of
/// the data bus. The controller is that of Ramulator 1: FR-FCFS with a row-hit cap of 16, 32 reads and
/// 32 writes, writes drained above 25 or while no read waits, down to 5. Energy is by DRAMPower's
/// equations, without I/O and termination.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem dram --trace merge.trace\n  \
    xylem dram --trace merge.trace.gz --memory fast --json\n  \
    printf '0x0 R\\n0x40 R\\n' > two.trace && xylem dram --trace two.trace")]
pub(super) struct Args {
    /// The trace
    #[arg(long, value_name = "FILE")]
    trace: PathBuf,
    /// The memory
    #[arg(long, value_name = "MEMORY", default_value = "slow", value_parser = memory_parser())]
    memory: &'static Config,
}

/// Requests between two signs of life.
const STEP: u64 = 1 << 16;

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let trace = TraceFile::open(&args.trace)?;
    let spinner = progress::spinner("replaying");
    let begun = Instant::now();
    let mut memory = Memory::new(args.memory);
    let accepted = |request: u64| {
        if request.is_multiple_of(STEP) {
            spinner.set_message(format!("replaying: {request} requests"));
        }
    };
    let clocks = replay(&mut memory, trace, accepted, |_| {})?;
    spinner.finish_and_clear();
    let name = args.trace.display().to_string();
    let report = DramReport::new(&name, &memory, clocks, begun.elapsed());
    console.result(&report, || report.to_string())
}

fn memory_parser() -> impl TypedValueParser<Value = &'static Config> {
    let values = CONFIGS.map(|config| PossibleValue::new(config.name).help(config.about));
    PossibleValuesParser::new(values).try_map(|name| Config::by_name(&name).ok_or("no such memory"))
}
