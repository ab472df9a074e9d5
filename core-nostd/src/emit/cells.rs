//! The bounded buffer for what the emitter hands out above its threshold.

use super::{Cell, Emitter, Level, Step};
use crate::probe::Probe;

/// How cells are cut from the Morton order.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub struct CellConfig {
    /// The most cells that there may be, 1 at least: what the buffer on chip holds.
    pub capacity: u32,
    /// How many bits at the top of the Morton code are not split at below the cells, before the
    /// buffer is full: 0 makes the whole scene one cell, all bits a cell of each leaf.
    pub bits: u32,
}

impl Default for CellConfig {
    /// 8192 cells of 32 bytes are as much as P2's scratchpad; 20 bits make about as many of a
    /// surface, which fills two dimensions of three: 13 · 3 / 2.
    fn default() -> Self {
        Self { capacity: 8192, bits: 20 }
    }
}

/// The cells of a scene in an on-chip buffer of any size.
///
/// P2 fixes the threshold and has as many cells as that gives. Here the buffer fixes their number:
/// whenever it is full and more cells come, the threshold is raised to the lowest split between
/// cells at hand, and the emitter joins them and all that follow up to it, as it would have with this
/// threshold from the start. Nothing is lost, whatever the scene and the buffer, and the tree below
/// the cells is the LBVH in any case. Each raise is by a level at least, so there are fewer than
/// [`MAX_DEPTH`](super::MAX_DEPTH).
#[derive(Debug)]
pub struct CellBuffer<'a> {
    cells: &'a mut [Cell],
    len: usize,
}

impl<'a> CellBuffer<'a> {
    /// An empty buffer that uses `cells`, whatever is in them.
    pub const fn new(cells: &'a mut [Cell]) -> Self {
        Self { cells, len: 0 }
    }

    /// Takes the next cell of `emitter`, and coarsens if the buffer is then full and more will come.
    /// `write` receives the emitter's steps while it does. Gives back `false` if there is no room at
    /// all.
    ///
    /// # Errors
    /// Those of `write`.
    pub fn push<E, P: Probe>(
        &mut self,
        cell: Cell,
        emitter: &mut Emitter,
        probe: &mut P,
        mut write: impl FnMut(&Step, &mut P) -> Result<(), E>,
    ) -> Result<bool, E> {
        if !self.keep(cell) {
            return Ok(false);
        }
        probe.top_cell();
        if self.len < self.cells.len() || cell.level == Level::INFINITE {
            return Ok(true);
        }
        // Not empty.
        let lowest =
            self.cells[..self.len].iter().map(|cell| cell.level).min().unwrap_or(cell.level);
        emitter.raise_threshold(lowest);
        probe.top_coarsen(self.len);
        let full = core::mem::take(&mut self.len);
        for i in 0..full {
            // The last cell's step left the emitter ready.
            let resumed = emitter.resume(self.cells[i]).is_ok();
            debug_assert!(resumed, "cells come out of an idle emitter");
            while !emitter.is_ready() {
                match emitter.step(probe) {
                    // No more come out than went in.
                    step @ Step::Cell(cell) => {
                        write(&step, probe)?;
                        probe.top_cell();
                        self.keep(cell);
                    }
                    step => write(&step, probe)?,
                }
            }
        }
        Ok(true)
    }

    /// The cells so far.
    pub fn cells(&mut self) -> &mut [Cell] {
        &mut self.cells[..self.len]
    }

    fn keep(&mut self, cell: Cell) -> bool {
        let Some(place) = self.cells.get_mut(self.len) else { return false };
        *place = cell;
        self.len += 1;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Aabb, PrimIndex};
    use crate::node::{Bvh2Node, Child, NodeIndex};
    use crate::sort::Item;
    use heapless::Vec;

    type Ranges = Vec<[u32; 2], 128>;

    fn size(child: Child, nodes: &[Bvh2Node]) -> u32 {
        match child {
            Child::Leaf { count, .. } => count,
            Child::Inner(NodeIndex(i)) => {
                nodes[i as usize].children.iter().map(|c| size(c.child, nodes)).sum()
            }
        }
    }

    fn first(child: Child, nodes: &[Bvh2Node]) -> u32 {
        match child {
            Child::Leaf { first, .. } => first,
            Child::Inner(NodeIndex(i)) => first(nodes[i as usize].children[0].child, nodes),
        }
    }

    /// The primitive ranges of all nodes, and of the cells or the root.
    fn emit(codes: &[u64], mut emitter: Emitter, capacity: usize) -> (Ranges, Ranges) {
        let mut nodes = Vec::<Bvh2Node, 128>::new();
        let mut storage = [Cell::EMPTY; 64];
        let mut cells = CellBuffer::new(&mut storage[..capacity]);
        let mut tops = Vec::<Child, 64>::new();
        for i in 0..=codes.len() {
            match codes.get(i) {
                Some(&code) => {
                    let p = glam::IVec3::splat(i as i32);
                    let item = Item { code, bounds: Aabb::new(p, p), reference: i as u32 };
                    let entry = emitter.accept(&item, &mut ()).unwrap();
                    assert!(entry.is_none_or(|e| e.primitive == PrimIndex(i as u32 - 1)));
                }
                None => _ = emitter.finish(),
            }
            while !emitter.is_ready() {
                match emitter.step(&mut ()) {
                    Step::Node(node) => nodes.push(node).unwrap(),
                    Step::Root(root) => tops.push(root.child).unwrap(),
                    Step::Cell(cell) => {
                        let kept = cells.push(cell, &mut emitter, &mut (), |step, ()| {
                            if let Step::Node(node) = step {
                                nodes.push(*node).unwrap();
                            }
                            Ok::<(), ()>(())
                        });
                        assert_eq!(kept, Ok(true));
                    }
                    Step::Push | Step::JoinLeaves { .. } | Step::Idle => {}
                }
            }
        }
        tops.extend(cells.cells().iter().map(|cell| cell.subtree.child));
        let range = |child: &Child| [first(*child, &nodes), size(*child, &nodes)];
        let inner = (0..nodes.len() as u32).map(|i| range(&Child::Inner(NodeIndex(i))));
        let mut inner: Ranges = inner.collect();
        inner.sort_unstable();
        (inner, tops.iter().map(range).collect())
    }

    /// 60 codes with gaps of all sizes.
    fn codes() -> Vec<u64, 60> {
        let mut codes: Vec<u64, 60> =
            (0..60u64).map(|i| (i * i * i * 2_654_435_761) & 0x3fff_ffff).collect();
        codes.sort_unstable();
        codes
    }

    #[test]
    fn a_threshold_hands_out_what_differs_in_the_top_bits() {
        let cells =
            |bits| emit(&[0b0000, 0b0100, 0b0101, 0b1000, 0b1000, 0b1010], with_bits(bits, 4), 64);
        assert_eq!(cells(0).1.as_slice(), [[0, 6]]);
        assert_eq!(cells(1).1.as_slice(), [[0, 3], [3, 3]]);
        assert_eq!(cells(2).1.as_slice(), [[0, 1], [1, 2], [3, 3]]);
        assert_eq!(cells(4).1.as_slice(), [[0, 1], [1, 1], [2, 1], [3, 2], [5, 1]]);
        assert!(cells(4).0.is_empty());
        assert_eq!(cells(99).1, cells(4).1);
    }

    fn with_bits(bits: u32, width: u32) -> Emitter {
        Emitter::with_threshold(255, Level::below(bits, width))
    }

    #[test]
    fn a_full_buffer_coarsens_and_loses_nothing() {
        let codes = codes();
        let (lbvh, root) = emit(&codes, Emitter::new(255), 1);
        assert_eq!(root.as_slice(), [[0, 60]]);
        for capacity in [1, 2, 3, 7, 20, 59, 60] {
            let (inner, cells) = emit(&codes, with_bits(30, 30), capacity);
            assert!(cells.len() <= capacity);
            let mut next = 0;
            for [first, size] in cells {
                assert_eq!(first, next, "{capacity}");
                next += size;
            }
            assert_eq!(next, 60);
            // What is below the cells is of the LBVH.
            assert!(inner.iter().all(|range| lbvh.contains(range)), "{capacity}");
        }
    }

    #[test]
    fn coarsening_ends_where_the_raised_threshold_would_have() {
        let codes = codes();
        let (inner, cells) = emit(&codes, with_bits(30, 30), 20);
        let same = (0..30).rev().map(|bits| emit(&codes, with_bits(bits, 30), 64));
        assert!(same.into_iter().any(|at| at == (inner.clone(), cells.clone())));
    }

    #[test]
    fn no_room_at_all_is_said() {
        let mut cells = CellBuffer::new(&mut []);
        let mut emitter = with_bits(30, 30);
        let pushed = cells.push(Cell::EMPTY, &mut emitter, &mut (), |_, ()| Ok::<(), ()>(()));
        assert_eq!(pushed, Ok(false));
    }
}
