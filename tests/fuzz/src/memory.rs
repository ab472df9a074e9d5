//! Memory that counts.

use std::sync::atomic::{AtomicU64, Ordering};

use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::NodeFormat;

/// A read or a write past the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfMemory;

/// Memory with a tree in it. It counts how many bytes of damaged nodes are read, and ends the run if an operation
/// takes more accesses than it may.
pub struct Memory {
    /// Everything.
    pub bytes: Vec<u8>,
    /// The format of the nodes that are damaged.
    pub format: NodeFormat,
    /// Where they are.
    pub nodes: Region,
    /// What the nodes were before; a read of others counts. Empty if nothing in them was sound.
    pub before: Vec<u8>,
    /// Accesses that are still allowed.
    pub accesses_left: u64,
}

/// Bytes of damaged nodes read since the start, by the format: 64-byte nodes, pairs, wide and
/// shared-plane nodes.
static DAMAGED: [AtomicU64; 4] = [const { AtomicU64::new(0) }; 4];
static EXECUTIONS: AtomicU64 = AtomicU64::new(0);

impl Memory {
    /// Memory of which nothing is damaged, and as many accesses as one likes.
    pub const fn new(bytes: Vec<u8>, format: NodeFormat) -> Self {
        let nodes = Region::new(0, 0);
        Self { bytes, format, nodes, before: Vec::new(), accesses_left: u64::MAX }
    }

    /// Counts damage that a target does on its own.
    pub fn count_damaged(format: NodeFormat, bytes: usize) {
        let counter = match format {
            NodeFormat::Bvh2 => 0,
            NodeFormat::Quantized(_) => 1,
            NodeFormat::Wide(_) => 2,
            NodeFormat::Shared(_) => 3,
        };
        DAMAGED[counter].fetch_add(bytes as u64, Ordering::Relaxed);
    }

    /// Counts an execution; prints the totals now and then.
    pub fn count_execution() {
        let executions = EXECUTIONS.fetch_add(1, Ordering::Relaxed) + 1;
        if executions.is_multiple_of(4096) || executions.is_power_of_two() {
            let [exact, pairs, wide, shared] =
                DAMAGED.each_ref().map(|bytes| bytes.load(Ordering::Relaxed));
            eprintln!(
                "{executions} executions; bytes of damaged nodes: 64-byte nodes {exact}, pairs {pairs}, \
                 wide nodes {wide}, shared-plane nodes {shared}"
            );
        }
    }

    fn range(&self, addr: ByteAddr, len: usize) -> Result<std::ops::Range<usize>, OutOfMemory> {
        let at = addr.0 as usize;
        if at + len > self.bytes.len() { Err(OutOfMemory) } else { Ok(at..at + len) }
    }

    fn burn(&mut self) {
        assert!(self.accesses_left > 0, "more accesses than the operation may take");
        self.accesses_left -= 1;
    }
}

impl Bus for Memory {
    type Error = OutOfMemory;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), OutOfMemory> {
        self.burn();
        let range = self.range(addr, buf.len())?;
        buf.copy_from_slice(&self.bytes[range]);
        let from = addr.0.wrapping_sub(self.nodes.base.0) as usize;
        if from < self.nodes.size as usize {
            let before = self.before.get(from..from + buf.len());
            if before != Some(&*buf) {
                Self::count_damaged(self.format, buf.len());
            }
        }
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), OutOfMemory> {
        self.burn();
        let range = self.range(addr, bytes.len())?;
        self.bytes[range].copy_from_slice(bytes);
        Ok(())
    }
}
