//! What is counted during a build on the function engine.

use xylem_core::probe::{Probe, Stage};

use crate::bus::StageClock;
use crate::machine::compressor::CompressorEvents;
use crate::machine::toplevel::TopEvents;

/// Counts what follows the sort and tells a clock of the stage.
#[derive(Debug)]
pub struct BuildWatch<'a> {
    stage: &'a StageClock,
    /// What the top-level builders did.
    pub top: TopEvents,
    /// What the streaming compressor did.
    pub compressor: CompressorEvents,
}

impl<'a> BuildWatch<'a> {
    /// A watch that has seen nothing.
    pub fn new(stage: &'a StageClock) -> Self {
        Self { stage, top: TopEvents::default(), compressor: CompressorEvents::default() }
    }
}

impl Probe for BuildWatch<'_> {
    #[inline]
    fn stage(&mut self, stage: Stage) {
        // The clock is a shared cell; its reference is the probe.
        (&mut &*self.stage).stage(stage);
    }
    fn top_cell(&mut self) {
        self.top.top_cell();
    }
    fn top_coarsen(&mut self, cells: usize) {
        self.top.top_coarsen(cells);
    }
    fn top_sweep(&mut self, cells: usize) {
        self.top.top_sweep(cells);
    }
    fn top_treelet(&mut self, leaves: usize, better: bool) {
        self.top.top_treelet(leaves, better);
    }
    fn compress_node(&mut self) {
        self.compressor.compress_node();
    }
    fn backtrack(&mut self, depth: u8) {
        self.compressor.backtrack(depth);
    }
}
