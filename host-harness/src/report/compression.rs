//! How nodes were quantized, and what streaming them took.

use serde::Serialize;
use xylem_core::compress::{Compression, Repairs};
use xylem_core::node::NodeFormat;

use crate::machine::compressor::CompressorEvents;

/// The quantization of a build.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CompressionReport {
    /// How nodes were quantized, as `--compress` names it.
    pub compress: &'static str,
    /// Bits of a coordinate.
    pub quant_bits: u8,
    /// No local grid is finer than two to the power of this many grid units.
    pub min_scale: u8,
    /// How deep treelets were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub treelet_depth: Option<u8>,
    /// How much coarser than a node's grid its parent's was guessed to be, in powers of two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin: Option<u8>,
    /// Lines that stayed on chip for repairs; 0 for repairs in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_lines: Option<u8>,
    /// Nodes that were encoded again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backtracks: Option<u64>,
    /// The same by how many levels they were below the node that asked for it, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backtracks_by_depth: Option<Vec<u64>>,
}

impl CompressionReport {
    /// What there is to say of a tree in `format`; nothing of 64-byte nodes.
    pub fn new(
        format: NodeFormat,
        compression: Option<&Compression>,
        events: &CompressorEvents,
    ) -> Option<Self> {
        let NodeFormat::Quantized(quantization) = format else { return None };
        let by_depth = compression.map(|_| {
            let deepest = events.backtracks_by_depth.iter().rposition(|&count| count > 0);
            events.backtracks_by_depth[..deepest.map_or(0, |at| at + 1)].to_vec()
        });
        Some(Self {
            compress: if compression.is_some() { "bottomup" } else { "topdown" },
            quant_bits: quantization.bits,
            min_scale: quantization.min_scale,
            treelet_depth: compression.map(|c| c.treelet_depth),
            margin: compression.map(|c| c.margin),
            held_lines: compression.map(|c| match c.repairs {
                Repairs::InMemory => 0,
                Repairs::InLines(lines) => lines,
            }),
            backtracks: compression.map(|_| events.backtracks()),
            backtracks_by_depth: by_depth,
        })
    }

    /// The same in words.
    pub fn words(&self) -> String {
        let Self { quant_bits, min_scale, .. } = self;
        let mut words = format!("{} bits, finest grid 2^{min_scale}", quant_bits);
        match (self.treelet_depth, self.held_lines, self.backtracks) {
            (Some(depth), Some(lines), Some(backtracks)) => {
                let lines =
                    if lines == 0 { String::new() } else { format!(", {lines} lines held") };
                words += &format!(", streamed, treelets {depth} deep{lines}: {backtracks} repairs");
            }
            _ => words += ", from the root down",
        }
        words
    }
}
