//! External merge sort of primitives by Morton code.
//!
//! As in P1 §3 and §4.2–4.4, P2 §4.2 and §5.2–5.5: blocks of `M` primitives that fit the scratchpad
//! are sorted on chip and written back as *runs* (partial sort); a wide multi-merge over a
//! replace-top heap then reads all runs side by side in bursts of `B` records and delivers one
//! sorted stream. More runs than the merge is wide take further passes.
//!
//! The order is by Morton code, ties by position in the input. It is the same for every `M`, `B`
//! and record format, because every step is stable: runs are numbered in input order, and equal
//! codes leave the heap in the order of their runs.

mod heap;
mod insertion;
mod multimerge;
mod partial;
mod record;

pub use heap::{HeapEntry, ReplaceHeap};
pub use multimerge::{MultiMerge, Queue};
pub use record::{InputFormat, Item, PrimitiveDecoder, RecordFormat};

pub(crate) use partial::partial_sort;
pub(crate) use record::PrimitiveReader;

use heapless::{Vec, VecView};

use crate::error::ConfigError;

/// The longest burst, in records.
pub const MAX_BURST: usize = 32;

/// How the multi-merge decides which burst to read next, and how much of the scratchpad a run owns.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub enum ReadSchedule {
    /// Each run owns two bursts; a consumed one is replaced by the run's next (P2 §5.3).
    #[default]
    DoubleBuffer,
    /// Each run owns one burst. The run whose last key on chip is lowest runs dry first, so its next
    /// burst is read first, into one of a few spare buffers that the hardware adds (P2 §7).
    Forecast,
}

/// The shape of the sorter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SortConfig {
    /// `M`: how many records the scratchpad holds; a power of two, at least `4 · burst`.
    pub capacity: u32,
    /// `B`: how many records a burst moves; a power of two, at most [`MAX_BURST`].
    pub burst: u32,
    /// What a run consists of.
    pub record: RecordFormat,
    /// How runs are read.
    pub schedule: ReadSchedule,
}

impl SortConfig {
    /// The configuration of P2 §6.2: `M` = 8192, `B` = 16, 32-byte boxes, double buffers.
    pub const PAPER: Self = Self {
        capacity: 8192,
        burst: 16,
        record: RecordFormat::Box32,
        schedule: ReadSchedule::DoubleBuffer,
    };

    /// How many runs are merged at once: `M / 2B` with double buffers, as each run owns two bursts
    /// of the scratchpad, and `M / B` with forecasting.
    pub const fn width(&self) -> u32 {
        self.capacity / self.share()
    }

    /// How many records of the scratchpad a run owns while runs are merged.
    const fn share(&self) -> u32 {
        match self.schedule {
            ReadSchedule::DoubleBuffer => 2 * self.burst,
            ReadSchedule::Forecast => self.burst,
        }
    }

    /// How many records the insertion sorters put in order at a time: two bursts.
    pub const fn piece(&self) -> u32 {
        2 * self.burst
    }

    /// Checks the parameters against each other.
    ///
    /// # Errors
    /// [`ConfigError`] naming the parameter.
    pub const fn check(&self) -> Result<(), ConfigError> {
        if !self.burst.is_power_of_two() || self.burst as usize > MAX_BURST {
            return Err(ConfigError::Burst);
        }
        if !self.capacity.is_power_of_two() || self.capacity < 4 * self.burst {
            return Err(ConfigError::Capacity);
        }
        Ok(())
    }

    /// Checks that a workspace is large enough.
    ///
    /// # Errors
    /// [`ConfigError::Workspace`].
    pub fn check_storage(&self, workspace: &Workspace<'_>) -> Result<(), ConfigError> {
        let width = self.width() as usize;
        let fits = workspace.items.len() >= self.capacity as usize
            && workspace.queues.capacity() >= width
            && workspace.heap.capacity() >= width;
        if fits { Ok(()) } else { Err(ConfigError::Workspace) }
    }
}

impl Default for SortConfig {
    fn default() -> Self {
        Self::PAPER
    }
}

/// The on-chip storage that the sorter borrows.
#[derive(Debug)]
pub struct Workspace<'a> {
    /// The scratchpad.
    pub items: &'a mut [Item],
    /// Read positions of the runs being merged.
    pub queues: &'a mut VecView<Queue>,
    /// The merge heap.
    pub heap: &'a mut VecView<HeapEntry>,
}

/// Storage for a [`Workspace`] of up to `M` records and a merge of up to `W` runs.
///
/// Large: keep it in a `static` or on a heap, not on a stack.
#[derive(Debug)]
pub struct SortBuffers<const M: usize, const W: usize> {
    items: [Item; M],
    queues: Vec<Queue, W>,
    heap: Vec<HeapEntry, W>,
}

impl<const M: usize, const W: usize> SortBuffers<M, W> {
    /// Empty buffers.
    pub const fn new() -> Self {
        Self { items: [Item::ZERO; M], queues: Vec::new(), heap: Vec::new() }
    }

    /// The buffers as a workspace.
    pub fn workspace(&mut self) -> Workspace<'_> {
        Workspace { items: &mut self.items, queues: &mut self.queues, heap: &mut self.heap }
    }
}

impl<const M: usize, const W: usize> Default for SortBuffers<M, W> {
    fn default() -> Self {
        Self::new()
    }
}
