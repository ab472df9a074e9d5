//! Streaming hierarchy emission: sorted primitives in, nodes in bottom-up order out.

mod cells;
mod hierarchy;
mod ploc;

pub use cells::{CellBuffer, CellConfig};
pub use hierarchy::{Cell, Emitter, Level, MAX_DEPTH, Step};
pub use ploc::{
    Chain, Cluster, MAX_CHAIN, MAX_OPEN_LEAF, MAX_RADIUS, PlocConfig, Port, SWEEP_DEPTH, Token,
    list_bound,
};

/// Which tree is emitted from the sorted stream.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum EmitterKind {
    /// The hierarchy of the Morton codes' bits: [`Emitter`].
    #[default]
    Lbvh,
    /// Clusters of nearest neighbours: [`Chain`].
    Ploc(PlocConfig),
}
