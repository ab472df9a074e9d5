//! The command line: thin. A command parses its options, calls the library and prints a report.
//!
//! What a command finds goes to standard output: text for people, or with `--json` exactly one
//! object. Progress and errors go to standard error. Exit codes: 0 done, 1 failed, 2 wrong usage.

mod build;
mod console;
mod demo;
mod dram;
mod error;
mod format;
mod machine;
mod options;
mod output;
mod progress;
mod rays;
mod render;
mod reproduce;
mod scene;
mod soc;
mod trace;

use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use console::Console;
pub use error::CliError;

/// The command line of `xylem`.
#[derive(Debug, Parser)]
#[command(
    name = "xylem",
    version,
    about = "Grows ray-tracing trees as the hardware would, and traces rays through them",
    long_about = "Grows ray-tracing trees as the hardware would, and traces rays through them.\n\n\
        Without a command: sorts a scene by Morton code, emits its tree, compresses it to 16-byte \
        nodes, traces camera and diffuse rays through both in fixed point, prints what that took \
        and leaves a report with pictures.",
    after_help = "Examples:\n  \
        xylem                                        the whole road on a bundled scene\n  \
        xylem build bunny.obj.gz --format cbvh       build and compress one mesh\n  \
        xylem trace bunny.obj.gz --rays my.rays --hits my.hits\n  \
        xylem render terrain --out terrain.png       a picture of a computed scene\n  \
        xylem soc cornell                            the same code on a RISC-V core\n  \
        xylem scene list                             scenes that need no file\n  \
        xylem dram --trace my.trace --memory fast    requests on a clocked DRAM\n  \
        xylem reproduce p2-table6                    a table of the papers, ours beside theirs\n\n\
        Exit codes: 0 done, 1 failed, 2 wrong usage.",
    max_term_width = 100
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    demo: demo::Args,
    /// Print one JSON object on standard output and nothing else there
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    Build(build::Args),
    Trace(trace::Args),
    Render(render::Args),
    Scene(scene::Args),
    Soc(soc::Args),
    Dram(dram::Args),
    Reproduce(reproduce::Args),
}

/// Runs the command line of this process and returns its exit code.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse().and_then(Cli::check) {
        Ok(cli) => cli,
        Err(error) => {
            // Where neither stream can be written to, the exit code is all there is to say.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    let console = Console { json: cli.json };
    let done = match cli.command {
        None => demo::run(&cli.demo, console),
        Some(Command::Build(args)) => build::run(&args, console),
        Some(Command::Trace(args)) => trace::run(&args, console),
        Some(Command::Render(args)) => render::run(&args, console),
        Some(Command::Scene(args)) => scene::run(&args, console),
        Some(Command::Soc(args)) => soc::run(&args, console),
        Some(Command::Dram(args)) => dram::run(&args, console),
        Some(Command::Reproduce(args)) => reproduce::run(&args, console),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console.error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

impl Cli {
    /// Refuses options of the bare command where a command is given.
    fn check(self) -> Result<Self, clap::Error> {
        if self.command.is_some() && self.demo.is_given() {
            let message = "--scene, --size, --up and --out before a command belong to the bare `xylem`; \
                           put options after the command";
            return Err(Self::command().error(ErrorKind::ArgumentConflict, message));
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_definition_of_the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
