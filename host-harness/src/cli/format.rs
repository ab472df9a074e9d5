//! Options about the format of nodes and how they get it.

use clap::{Args, ValueEnum};
use xylem_core::compress::{Compression, MAX_LINES, Repairs};
use xylem_core::node::{Coordinates, NodeFormat, Quantization, Sharing};

use super::CliError;

/// The format of nodes.
#[derive(Debug, Clone, Args)]
pub(super) struct FormatArgs {
    /// Nodes: bvh2 is two exact boxes in 64 bytes, cbvh two quantized ones in 16, cbvh4 up to four in
    /// 32, cbvh8 two that take half of their planes from their parent, in 8; the last two are made as
    /// nodes are emitted [default: bvh2, or cbvh if an option about it is given]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// How cbvh nodes are made: by a pass from the root down over the finished tree, or bottom-up as
    /// the builder emits them [default: topdown, or bottomup with --treelet-depth, --margin or
    /// --held-lines]
    #[arg(long, value_enum)]
    compress: Option<Compress>,
    /// What coordinates of cbvh nodes count from: the parent's corner, or the scene's modulo 2^N
    /// [default: modulo]
    #[arg(long, value_enum)]
    coords: Option<Coords>,
    /// N: bits of a cbvh coordinate, 4 to 8; above 6 a node takes 20 bytes [default: 6]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8)
          .range(i64::from(*Quantization::WIDTHS.start())..=i64::from(*Quantization::WIDTHS.end())))]
    quant_bits: Option<u8>,
    /// No local grid of cbvh nodes is finer than 2^S units of the scene's [default: 0]
    #[arg(long, value_name = "S", value_parser = clap::value_parser!(u8)
          .range(..=i64::from(Quantization::MAX_MIN_SCALE)))]
    min_scale: Option<u8>,
    /// With bottomup: how many nodes deep the treelets are that are compressed from their root down; 1
    /// is none [default: 1]
    #[arg(long, value_name = "DEPTH", value_parser = clap::value_parser!(u8)
          .range(1..=i64::from(Compression::MAX_TREELET_DEPTH)))]
    treelet_depth: Option<u8>,
    /// With bottomup: how much coarser than a node's grid its parent's is guessed to be, in powers of
    /// two, 0 to 3; 0 is the paper's guess [default: 1]
    #[arg(long, value_name = "POWER", value_parser = clap::value_parser!(u8)
          .range(..=i64::from(Compression::MAX_MARGIN)))]
    margin: Option<u8>,
    /// With bottomup: keep the last N lines of 64 bytes on chip, where repairing a node costs no
    /// traffic; 0 repairs each in memory, as the paper counts [default: 0]
    #[arg(long, value_name = "N", value_parser = held_lines)]
    held_lines: Option<u8>,
}

/// `--format`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// 64 bytes, two exact boxes
    Bvh2,
    /// 16 bytes, two quantized boxes
    Cbvh,
    /// 32 bytes, up to four quantized boxes
    Cbvh4,
    /// 8 bytes, two quantized boxes that share planes with their parent
    Cbvh8,
}

/// `--compress`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Compress {
    /// From the root down, over the finished tree
    Topdown,
    /// As nodes are emitted, with repairs where a parent turns out to need another grid
    Bottomup,
}

/// `--coords`.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Coords {
    /// From the parent's corner
    Relative,
    /// From the scene's corner, modulo 2^N cells
    Modulo,
}

impl FormatArgs {
    /// The format, and how the builder compresses, if it does.
    ///
    /// # Errors
    /// [`CliError::Usage`] if they contradict each other.
    pub fn resolve(&self) -> Result<(NodeFormat, Option<Compression>), CliError> {
        let streamed =
            self.treelet_depth.is_some() || self.margin.is_some() || self.held_lines.is_some();
        let quantized = self.compress.is_some()
            || self.coords.is_some()
            || self.quant_bits.is_some()
            || self.min_scale.is_some()
            || streamed;
        let name = match self.format {
            Some(Format::Bvh2) => "bvh2",
            Some(Format::Cbvh8) => "cbvh8",
            Some(Format::Cbvh4) => "cbvh4",
            _ => "cbvh",
        };
        if quantized && !matches!(name, "cbvh" | "cbvh4") {
            let message = format!(
                "--compress, --coords, --quant-bits, --min-scale, --treelet-depth, --margin and \
                 --held-lines are about nodes of quantized boxes, but --format is {name}; use --format \
                 cbvh or cbvh4, or leave them out"
            );
            return Err(CliError::Usage(message));
        }
        if streamed && self.compress == Some(Compress::Topdown) {
            let message = "--treelet-depth, --margin and --held-lines are about --compress bottomup; use \
                           that or leave them out";
            return Err(CliError::Usage(message.into()));
        }
        if self.format == Some(Format::Cbvh8) {
            return Ok((NodeFormat::Shared(Sharing::STREAMED), None));
        }
        let wide = self.format == Some(Format::Cbvh4);
        if wide && self.compress == Some(Compress::Topdown) {
            let message = "nodes of four children are made as the builder emits them; use --compress \
                           bottomup or leave it out, or use --format cbvh";
            return Err(CliError::Usage(message.into()));
        }
        if !quantized && !wide && self.format != Some(Format::Cbvh) {
            return Ok((NodeFormat::Bvh2, None));
        }
        let quantization = Quantization {
            coordinates: match self.coords {
                Some(Coords::Relative) => Coordinates::Relative,
                Some(Coords::Modulo) | None => Coordinates::Modulo,
            },
            bits: self.quant_bits.unwrap_or(Quantization::MODULO.bits),
            min_scale: self.min_scale.unwrap_or(Quantization::MIN_SCALE),
        };
        let compression = Compression {
            quantization,
            treelet_depth: self.treelet_depth.unwrap_or(1),
            margin: self.margin.unwrap_or(Compression::MARGIN),
            repairs: match self.held_lines {
                None | Some(0) => Repairs::InMemory,
                Some(lines) => Repairs::InLines(lines),
            },
        };
        if wide {
            return Ok((NodeFormat::Wide(quantization), Some(compression)));
        }
        let streamed = streamed || self.compress == Some(Compress::Bottomup);
        Ok((NodeFormat::Quantized(quantization), streamed.then_some(compression)))
    }
}

fn held_lines(text: &str) -> Result<u8, String> {
    match text.parse() {
        Ok(lines) if lines == 0 || (2..=MAX_LINES).contains(&usize::from(lines)) => Ok(lines),
        _ => Err(format!("there can be 0, or 2 to {MAX_LINES} lines")),
    }
}
