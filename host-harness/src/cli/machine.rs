//! Options of the clocked builder.

use clap::ValueEnum;

use super::CliError;
use crate::machine::config::MachineConfig;
use crate::run::BuildOptions;

/// What computes a build, and the sizes of the units that do.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct MachineArgs {
    /// What computes the build: the functions themselves, or the builder's units on the clock
    #[arg(long, value_enum, default_value_t = Engine::Function)]
    engine: Engine,
    /// Clock of the builder in MHz; this and the next six need --engine cycle [default: 1000]
    #[arg(long, value_name = "MHZ", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    clock: Option<u32>,
    /// Insertion sorters [default: 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    sorters: Option<u32>,
    /// Records in the FIFO after the merge [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    fifo: Option<u32>,
    /// Lines of 64 bytes that the primitive reader asks for ahead [default: 32]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    read_ahead: Option<u32>,
    /// Spare buffers of B records for --schedule forecast [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    spare: Option<u32>,
    /// Fill one half of the scratchpad while the other is merged; halves the length of a run
    #[arg(long)]
    overlap: bool,
    /// Let few runs share the whole scratchpad while they are merged
    #[arg(long)]
    share: bool,
}

/// `--engine`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Engine {
    /// What is computed, and its memory traffic
    Function,
    /// The same work, clock by clock
    Cycle,
}

impl MachineArgs {
    /// The machine asked for, if one is.
    ///
    /// # Errors
    /// [`CliError::Usage`] for options that need a machine where there is none, and for what no
    /// machine can do.
    pub fn config(&self, options: &BuildOptions) -> Result<Option<MachineConfig>, CliError> {
        let sizes = [self.clock, self.sorters, self.fifo, self.read_ahead, self.spare];
        if self.engine == Engine::Function {
            if sizes.iter().any(Option::is_some) || self.overlap || self.share {
                let message = "--clock, --sorters, --fifo, --read-ahead, --spare, --overlap and \
                               --share are sizes of the clocked builder; add --engine cycle";
                return Err(CliError::Usage(message.into()));
            }
            return Ok(None);
        }
        let base = MachineConfig::p2(options.config);
        let config = MachineConfig {
            clock_mhz: self.clock.unwrap_or(base.clock_mhz),
            sorters: self.sorters.unwrap_or(base.sorters),
            fifo: self.fifo.unwrap_or(base.fifo),
            read_ahead: self.read_ahead.unwrap_or(base.read_ahead),
            spare_buffers: self.spare.unwrap_or(base.spare_buffers),
            overlap: self.overlap,
            share: self.share,
            ..base
        };
        config.check().map_err(|error| CliError::Usage(error.to_string()))?;
        Ok(Some(config))
    }
}
