//! The hierarchy emitter between its ports, and what becomes of its cells.

use heapless::Deque;

use super::nodes::NodePort;
use super::{BuildConfig, BuildRegions, TreeStorage};
use crate::emit::{Cell, CellBuffer, Emitter, Level, Step};
use crate::error::{BuildError, RegionName};
use crate::mem::{BurstWriter, Bus};
use crate::node::{Bvh2Node, LeafEntry, NodeIndex, Subtree, Tree};
use crate::probe::{Probe, Stage};
use crate::sort::Item;
use crate::toplevel::{Exhausted, NodeSink, TopLevel, TopNode};

/// The largest leaf that the joining of leaves makes, in primitives.
pub(super) const MAX_JOINED: usize = 16;

/// The emitter with its two write ports.
#[derive(Debug)]
pub(super) struct TreeWriter<'a> {
    emitter: Emitter,
    cells: CellBuffer<'a>,
    top_nodes: &'a mut [TopNode],
    nodes: NodePort<'a>,
    leaf_table: LeafPort,
    tree: Tree,
}

impl<'a> TreeWriter<'a> {
    pub fn new(
        config: &BuildConfig,
        regions: &BuildRegions,
        storage: &'a mut TreeStorage<'_>,
    ) -> Self {
        let port =
            |region, name| BurstWriter::new(region, name, Stage::Emit, config.write_burst as usize);
        let TreeStorage { top, held, open } = storage;
        let max_leaf_size = config.max_leaf_size;
        let mut emitter = match config.top_level {
            TopLevel::None => Emitter::new(max_leaf_size),
            _ => {
                let threshold = Level::below(config.cells.bits, config.morton.bits());
                Emitter::with_threshold(max_leaf_size, threshold)
            }
        };
        emitter.join_leaves(config.join_leaves);
        Self {
            emitter,
            cells: CellBuffer::new(prefix(top.cells, config.cells.capacity)),
            top_nodes: prefix(top.nodes, config.cells.capacity),
            nodes: NodePort::new(config, regions, held, open),
            leaf_table: LeafPort {
                writer: port(regions.leaf_table, RegionName::LeafTable),
                held: Deque::new(),
                delay: config.join_leaves as usize,
            },
            tree: Tree::empty(config.format(), regions.nodes, regions.leaf_table),
        }
    }

    #[inline(always)]
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        item: &Item,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.tree.entry_count += 1;
        if self.emitter.is_plain() && self.nodes.is_exact() {
            let (entry, closed) = self.emitter.next(item, probe);
            probe.stage(Stage::Emit);
            self.write_entry(bus, entry)?;
            if let Some(closed) = closed {
                let nodes = &mut self.nodes;
                let write = |first: &_, second: &_| nodes.push_exact(bus, [first, second]);
                self.emitter.settle(closed, probe, write)?;
            }
        } else {
            let entry = self.emitter.accept(item, probe).map_err(|_| BuildError::Internal)?;
            probe.stage(Stage::Emit);
            self.write_entry(bus, entry)?;
            self.drain(bus, probe)?;
        }
        probe.stage(Stage::Merge);
        Ok(())
    }

    pub fn finish<B: Bus, P: Probe>(
        mut self,
        bus: &mut B,
        top_level: TopLevel,
        probe: &mut P,
    ) -> Result<Tree, BuildError<B::Error>> {
        probe.stage(Stage::Emit);
        let entry = self.emitter.finish();
        self.write_entry(bus, entry)?;
        self.tree.root = self.drain(bus, probe)?;
        self.leaf_table.flush(bus)?;
        if top_level != TopLevel::None {
            self.nodes.enter(bus, Stage::TopLevel, probe)?;
            self.build_top(bus, top_level, probe)?;
        }
        self.tree.leaf_count = self.emitter.leaves();
        self.nodes.finish(bus, &mut self.tree, probe)?;
        Ok(self.tree)
    }

    #[inline(always)]
    fn write_entry<B: Bus>(
        &mut self,
        bus: &mut B,
        entry: Option<LeafEntry>,
    ) -> Result<(), BuildError<B::Error>> {
        match entry {
            Some(entry) => self.leaf_table.push(bus, entry),
            None => Ok(()),
        }
    }

    /// Steps the emitter until it is ready; gives the root if the input has ended.
    #[inline]
    fn drain<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        probe: &mut P,
    ) -> Result<Option<Subtree>, BuildError<B::Error>> {
        while !self.emitter.is_ready() {
            match self.emitter.step(probe) {
                Step::Root(root) => return Ok(Some(root)),
                Step::Cell(cell) => self.keep(bus, cell, probe)?,
                step => write_step(bus, &mut self.nodes, &mut self.leaf_table, &step, probe)?,
            }
        }
        Ok(None)
    }

    /// Joins the cells to one root.
    fn build_top<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        top_level: TopLevel,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let cells = self.cells.cells();
        match top_level {
            TopLevel::None => {}
            TopLevel::Binned(binned) => {
                binned.arrange(cells, probe).ok_or(BuildError::Unsorted)?;
                self.emitter.join_cells();
                for cell in cells {
                    self.emitter.resume(*cell).map_err(|_| BuildError::Internal)?;
                    while !self.emitter.is_ready() {
                        match self.emitter.step(probe) {
                            Step::Root(root) => self.tree.root = Some(root),
                            step => write_step(
                                bus,
                                &mut self.nodes,
                                &mut self.leaf_table,
                                &step,
                                probe,
                            )?,
                        }
                    }
                }
            }
            TopLevel::Atrbvh(atrbvh) => {
                let mut sink = TopSink { bus, nodes: &mut self.nodes };
                let root = atrbvh.build(cells, self.top_nodes, &mut sink, probe);
                self.tree.root = root.map_err(|exhausted| match exhausted {
                    Exhausted::Sink(error) => error,
                    Exhausted::Stack => BuildError::Unsorted,
                })?;
            }
        }
        Ok(())
    }

    fn keep<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        cell: Cell,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        self.nodes.settle(bus, probe)?;
        let Self { nodes, leaf_table, emitter, cells, .. } = self;
        let write = |step: &Step, probe: &mut P| match step {
            Step::Cell(_) => nodes.settle(bus, probe),
            step => write_step(bus, nodes, leaf_table, step, probe),
        };
        // There is room for a cell, as the storage was checked.
        let kept = cells.push(cell, emitter, probe, write)?;
        if kept { Ok(()) } else { Err(BuildError::Internal) }
    }
}

/// Writes what a step of the emitter completed.
#[inline]
fn write_step<B: Bus, P: Probe>(
    bus: &mut B,
    nodes: &mut NodePort<'_>,
    leaf_table: &mut LeafPort,
    step: &Step,
    probe: &mut P,
) -> Result<(), BuildError<B::Error>> {
    match step {
        Step::Node(node) => {
            nodes.push(bus, node, probe)?;
        }
        Step::JoinLeaves { entries } => leaf_table.unmark(*entries),
        Step::Push | Step::Cell(_) | Step::Root(_) | Step::Idle => {}
    }
    Ok(())
}

/// The leaf table's write port. While leaves may still be joined, the entries whose marks depend on
/// it wait in a delay line.
#[derive(Debug)]
struct LeafPort {
    writer: BurstWriter,
    held: Deque<LeafEntry, MAX_JOINED>,
    delay: usize,
}

impl LeafPort {
    #[inline(always)]
    fn push<B: Bus>(&mut self, bus: &mut B, entry: LeafEntry) -> Result<(), BuildError<B::Error>> {
        if self.delay == 0 {
            return self.writer.push(bus, &entry.to_bytes());
        }
        if self.held.len() == self.delay
            && let Some(oldest) = self.held.pop_front()
        {
            self.writer.push(bus, &oldest.to_bytes())?;
        }
        self.held.push_back(entry).map_err(|_| BuildError::Internal)
    }

    /// Takes the mark from the entry in front of the last `entries`.
    fn unmark(&mut self, entries: u32) {
        if let Some(entry) = self.held.iter_mut().rev().nth(entries as usize) {
            entry.last = false;
        }
    }

    fn flush<B: Bus>(&mut self, bus: &mut B) -> Result<(), BuildError<B::Error>> {
        while let Some(oldest) = self.held.pop_front() {
            self.writer.push(bus, &oldest.to_bytes())?;
        }
        self.writer.flush(bus)
    }
}

/// The node port during the top-level build.
struct TopSink<'a, 'n, B> {
    bus: &'a mut B,
    nodes: &'a mut NodePort<'n>,
}

impl<B: Bus> NodeSink for TopSink<'_, '_, B> {
    type Error = BuildError<B::Error>;

    fn node<P: Probe>(&mut self, node: &Bvh2Node, probe: &mut P) -> Result<NodeIndex, Self::Error> {
        self.nodes.push(self.bus, node, probe)
    }
}

/// The first `count` of some storage, or all if there is less.
fn prefix<T>(storage: &mut [T], count: u32) -> &mut [T] {
    let count = storage.len().min(count as usize);
    &mut storage[..count]
}
