//! Quantized trees: local grids, relative and modulo coordinates, compression.
//!
//! A node's children are stored on a grid that is aligned to the whole scene's grid and just fine
//! enough that the node's own (decoded) box spans at most 2^N of its cells (P3 §3, Eqs. 1–2, and
//! Eq. 6 for the alignment). Which grid that is follows from the parent's decoded box, so a reader
//! carries a [`Context`] down the tree and stores nothing.
//!
//! Shared-plane nodes take half of that room: see [`SharedContext`] for reading and [`OpenNode`] for
//! writing them.

mod context;
mod lines;
mod repair;
mod shared;
mod shared_stream;
mod streaming;
mod topdown;
mod treelet;
mod wide;

pub use context::{CellBox, Context, Placement};
pub use lines::MAX_LINES;
pub use shared::{OpenNode, SharedContext, share};
pub use shared_stream::SharedCompressor;
pub use streaming::{Compression, Compressor, Repairs};
pub use topdown::{PairEncoder, PlacementEncoder, compress_encoding, compress_top_down};
pub use treelet::{HeldNode, Place};
pub use wide::{OpenWide, WideCompressor};
