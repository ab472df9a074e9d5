//! Micro-events that algorithms report while they run.
//!
//! A [`Probe`] has one no-op method per event. `()` is the probe that sees nothing and compiles to
//! nothing; counters, traces, heat maps and timing replays implement the events they want.

use crate::mem::ByteAddr;
use crate::node::Subtree;

/// The part of a job that is under way. Memory traffic is attributed to the stage last announced.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Primitives are read and written back as sorted runs.
    PartialSort,
    /// Runs are read and merged; in all passes but the last, written back as longer runs.
    Merge,
    /// Nodes and leaf table entries are written.
    Emit,
    /// The top of the tree is built over the cells that the emitter left.
    TopLevel,
    /// Finished nodes are read back and written in a quantized format.
    Compress,
    /// The boxes of a tree are computed anew from moved triangles.
    Refit,
    /// Rays are traced.
    Trace,
}

/// A listener to micro-events. Every method does nothing unless overridden.
#[allow(unused_variables, reason = "the defaults ignore what they are told")]
pub trait Probe {
    /// A stage begins or resumes.
    #[inline]
    fn stage(&mut self, stage: Stage) {}
    /// A compare-and-swap of an insertion sorter.
    #[inline]
    fn compare_swap(&mut self) {}
    /// A value entered the merge heap while it was being filled.
    #[inline]
    fn heap_insert(&mut self) {}
    /// The top of the merge heap was replaced by its successor or by infinity.
    #[inline]
    fn heap_replace(&mut self) {}
    /// The merge delivered a record.
    #[inline]
    fn merge_output(&mut self) {}
    /// The hierarchy emitter pushed its stack, which now holds `depth` entries.
    #[inline]
    fn emit_push(&mut self, depth: usize) {}
    /// The hierarchy emitter popped its stack and completed an inner node, or the clustering emitter
    /// made one.
    #[inline]
    fn emit_node(&mut self) {}
    /// A node of a tree that is being built is complete, with these children. Their boxes are exact,
    /// whatever is written.
    #[inline]
    fn built_node(&mut self, children: [&Subtree; 2]) {}
    /// A primitive, or an open leaf of the clustering emitter, joined an open leaf.
    #[inline]
    fn emit_extend_leaf(&mut self) {}
    /// The clustering emitter begins a pass over a list of `clusters`.
    #[inline]
    fn ploc_pass(&mut self, clusters: u32) {}
    /// A cluster entered a sweep of the clustering emitter and met `pairs` others.
    #[inline]
    fn ploc_distances(&mut self, pairs: u32) {}
    /// The clustering emitter closed a leaf of `entries` primitives.
    #[inline]
    fn ploc_leaf(&mut self, entries: u32) {}
    /// All sweeps of the clustering emitter have moved by one step; what was reported since the
    /// beat before happened in this one.
    #[inline]
    fn ploc_beat(&mut self) {}
    /// The emitter handed out a cell.
    #[inline]
    fn top_cell(&mut self) {}
    /// The cell buffer was full: its `cells` cells go through the emitter again.
    #[inline]
    fn top_coarsen(&mut self, cells: usize) {}
    /// The binned builder partitions and bins a range of `cells` cells in one sweep.
    #[inline]
    fn top_sweep(&mut self, cells: usize) {}
    /// A treelet of `leaves` leaves was looked at, and rebuilt if that was `better`.
    #[inline]
    fn top_treelet(&mut self, leaves: usize, better: bool) {}
    /// A top-level builder completed a node.
    #[inline]
    fn top_node(&mut self) {}
    /// The streaming compressor encoded a node for the first time.
    #[inline]
    fn compress_node(&mut self) {}
    /// A node is encoded again, `depth` levels below the one whose arrival asked for it.
    #[inline]
    fn backtrack(&mut self, depth: u8) {}
    /// Traversal fetched a node of `bytes` bytes.
    #[inline]
    fn node_fetch(&mut self, addr: ByteAddr, bytes: u32) {}
    /// Traversal tested a ray against one box.
    #[inline]
    fn box_test(&mut self) {}
    /// Traversal tested a ray against one triangle.
    #[inline]
    fn triangle_test(&mut self) {}
    /// The triangle tested last is the best hit so far.
    #[inline]
    fn best_hit(&mut self) {}
    /// Traversal pushed its stack, which now holds `depth` entries.
    #[inline]
    fn stack_push(&mut self, depth: usize) {}
    /// Traversal popped its stack.
    #[inline]
    fn stack_pop(&mut self) {}
}

impl Probe for () {}

impl<P: Probe + ?Sized> Probe for &mut P {
    #[inline]
    fn stage(&mut self, stage: Stage) {
        (**self).stage(stage);
    }
    #[inline]
    fn compare_swap(&mut self) {
        (**self).compare_swap();
    }
    #[inline]
    fn heap_insert(&mut self) {
        (**self).heap_insert();
    }
    #[inline]
    fn heap_replace(&mut self) {
        (**self).heap_replace();
    }
    #[inline]
    fn merge_output(&mut self) {
        (**self).merge_output();
    }
    #[inline]
    fn emit_push(&mut self, depth: usize) {
        (**self).emit_push(depth);
    }
    #[inline]
    fn emit_node(&mut self) {
        (**self).emit_node();
    }
    #[inline]
    fn built_node(&mut self, children: [&Subtree; 2]) {
        (**self).built_node(children);
    }
    #[inline]
    fn emit_extend_leaf(&mut self) {
        (**self).emit_extend_leaf();
    }
    #[inline]
    fn ploc_pass(&mut self, clusters: u32) {
        (**self).ploc_pass(clusters);
    }
    #[inline]
    fn ploc_distances(&mut self, pairs: u32) {
        (**self).ploc_distances(pairs);
    }
    #[inline]
    fn ploc_leaf(&mut self, entries: u32) {
        (**self).ploc_leaf(entries);
    }
    #[inline]
    fn ploc_beat(&mut self) {
        (**self).ploc_beat();
    }
    #[inline]
    fn top_cell(&mut self) {
        (**self).top_cell();
    }
    #[inline]
    fn top_coarsen(&mut self, cells: usize) {
        (**self).top_coarsen(cells);
    }
    #[inline]
    fn top_sweep(&mut self, cells: usize) {
        (**self).top_sweep(cells);
    }
    #[inline]
    fn top_treelet(&mut self, leaves: usize, better: bool) {
        (**self).top_treelet(leaves, better);
    }
    #[inline]
    fn top_node(&mut self) {
        (**self).top_node();
    }
    #[inline]
    fn compress_node(&mut self) {
        (**self).compress_node();
    }
    #[inline]
    fn backtrack(&mut self, depth: u8) {
        (**self).backtrack(depth);
    }
    #[inline]
    fn node_fetch(&mut self, addr: ByteAddr, bytes: u32) {
        (**self).node_fetch(addr, bytes);
    }
    #[inline]
    fn box_test(&mut self) {
        (**self).box_test();
    }
    #[inline]
    fn triangle_test(&mut self) {
        (**self).triangle_test();
    }
    #[inline]
    fn best_hit(&mut self) {
        (**self).best_hit();
    }
    #[inline]
    fn stack_push(&mut self, depth: usize) {
        (**self).stack_push(depth);
    }
    #[inline]
    fn stack_pop(&mut self) {
        (**self).stack_pop();
    }
}
