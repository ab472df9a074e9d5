//! What follows the sort: primitives in Morton order in, a tree out.

use super::ploc::PlocWriter;
use super::tree::TreeWriter;
use super::{BuildConfig, BuildRegions, TreeStorage};
use crate::emit::EmitterKind;
use crate::error::{BuildError, RegionName};
use crate::mem::{Bus, Region};
use crate::node::Tree;
use crate::probe::Probe;
use crate::sort::Item;

/// The emitter that a [`BuildConfig`] asks for, with its ports and what it builds on top.
///
/// [`build`](super::build) feeds it from the last merge. On its own it serves models that time it: the
/// primitives of one [`TreeStream::accept`] after the other are all that it knows of the sorter.
#[derive(Debug)]
pub struct TreeStream<'a>(Kind<'a>);

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and nothing to put it on")]
enum Kind<'a> {
    Lbvh(TreeWriter<'a>, &'a BuildConfig),
    Ploc(PlocWriter<'a>),
}

impl<'a> TreeStream<'a> {
    /// A stream of `count` primitives to come. Lists of clusters are kept in `lists`, the run region
    /// that the last merge leaves free; top-level builds and nodes that wait for compression in
    /// `storage`. All have been checked
    /// ([`BuildRegions::check`], [`TreeStorage::check`]).
    pub fn new<P: Probe>(
        config: &'a BuildConfig,
        regions: &BuildRegions,
        lists: (Region, RegionName),
        count: u32,
        storage: &'a mut TreeStorage<'_>,
        probe: &mut P,
    ) -> Self {
        Self(match &config.emitter {
            EmitterKind::Lbvh => Kind::Lbvh(TreeWriter::new(config, regions, storage), config),
            EmitterKind::Ploc(ploc) => Kind::Ploc(PlocWriter::new(
                config,
                ploc,
                regions,
                lists,
                count,
                storage.held,
                probe,
            )),
        })
    }

    /// Takes the next primitive in order.
    ///
    /// # Errors
    /// A full region, or the bus's.
    #[inline]
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        item: &Item,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        match &mut self.0 {
            Kind::Lbvh(tree, _) => tree.accept(bus, item, probe),
            Kind::Ploc(tree) => tree.accept(bus, item, probe),
        }
    }

    /// Ends the input and finishes the tree. Lists that fit `scratchpad`, the sorter's storage, which
    /// is idle by now, stay in it.
    ///
    /// # Errors
    /// A full region, or the bus's.
    pub fn finish<B: Bus, P: Probe>(
        self,
        bus: &mut B,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<Tree, BuildError<B::Error>> {
        match self.0 {
            Kind::Lbvh(tree, config) => tree.finish(bus, config.top_level, probe),
            Kind::Ploc(tree) => tree.finish(bus, scratchpad, probe),
        }
    }
}
