//! Builders of the top of a tree, over the cells that the hierarchy emitter leaves above its
//! threshold (P2 §5.6).
//!
//! - [`Binned`]: from the root down, by the surface area heuristic over a few bins.
//! - [`Atrbvh`]: the cells' own LBVH, improved by rebuilding small treelets agglomeratively.
//!
//! Both work in on-chip storage of the caller, with a stack of fixed size, and hand out nodes in an
//! order that has children before parents and the root last. Neither makes a tree in which any leaf is
//! deeper than [`MAX_DEPTH`] nodes.

mod atrbvh;
mod binned;

pub use atrbvh::{Atrbvh, TopNode};
pub use binned::{Binned, Bins};

use crate::emit::{Cell, CellConfig, MAX_DEPTH};
use crate::error::ConfigError;
use crate::node::{Bvh2Node, NodeIndex};
use crate::probe::Probe;

/// How the top of a tree is built.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum TopLevel {
    /// By Morton codes, like the rest.
    #[default]
    None,
    /// By the binned surface area heuristic.
    Binned(Binned),
    /// By restructuring treelets.
    Atrbvh(Atrbvh),
}

/// On-chip storage of a top-level build.
#[derive(Debug)]
pub struct TopStorage<'a> {
    /// [`CellConfig::capacity`] of them.
    pub cells: &'a mut [Cell],
    /// For [`Atrbvh`] only: one less.
    pub nodes: &'a mut [TopNode],
}

impl TopStorage<'_> {
    /// No storage: no top level can be built.
    pub const fn none() -> Self {
        Self { cells: &mut [], nodes: &mut [] }
    }
}

impl TopLevel {
    /// Checks the parameters, and that the storage suffices.
    ///
    /// # Errors
    /// [`ConfigError::TopLevel`].
    pub fn check_storage(
        &self,
        config: &CellConfig,
        storage: &TopStorage<'_>,
    ) -> Result<(), ConfigError> {
        let capacity = config.capacity as usize;
        let cells = capacity > 0 && storage.cells.len() >= capacity;
        let fits = match self {
            Self::None => true,
            Self::Binned(_) => cells,
            Self::Atrbvh(atrbvh) => {
                cells && storage.nodes.len() + 1 >= capacity && atrbvh.is_valid()
            }
        };
        if fits { Ok(()) } else { Err(ConfigError::TopLevel) }
    }
}

/// Why a top-level build stopped.
#[derive(Debug)]
pub(crate) enum Exhausted<E> {
    /// The nodes' place.
    Sink(E),
    /// A stack was full: the cells are not those of a sorted stream.
    Stack,
}

/// Puts finished nodes where they belong and says where that is.
pub(crate) trait NodeSink {
    /// Why a node could not be put there.
    type Error;

    /// Takes the next node.
    fn node<P: Probe>(&mut self, node: &Bvh2Node, probe: &mut P) -> Result<NodeIndex, Self::Error>;
}

const _: () = assert!(MAX_DEPTH < 255, "depths are bytes");
