//! Streaming hierarchy emission: sorted primitives in, nodes in bottom-up order out.

mod hierarchy;

pub use hierarchy::{Emitter, MAX_DEPTH, Step};
