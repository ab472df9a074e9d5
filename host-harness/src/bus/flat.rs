//! A flat array of bytes.

use xylem_core::mem::{Bus, ByteAddr, Region};

/// Memory from address 0 on, zero at first.
#[derive(Debug, Clone, Default)]
pub struct FlatMemory {
    bytes: Vec<u8>,
}

/// Why a simulated memory refused an access.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MemoryError {
    /// The access leaves the memory.
    #[error("{len} bytes at {addr} are outside the {size} bytes of memory")]
    OutOfRange {
        /// First byte.
        addr: ByteAddr,
        /// Length of the access in bytes.
        len: usize,
        /// Bytes of memory.
        size: usize,
    },
    /// The memory is a [`Snapshot`].
    #[error("write to {addr} in memory that is being read by several threads")]
    ReadOnly {
        /// First byte.
        addr: ByteAddr,
    },
}

impl FlatMemory {
    /// Memory of `size` bytes.
    pub fn new(size: usize) -> Self {
        Self { bytes: vec![0; size] }
    }

    /// All bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// All bytes, to load a scene or to corrupt one.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut self.bytes
    }

    /// The bytes of a region, or as much of it as there is.
    pub fn region(&self, region: Region) -> &[u8] {
        let start = (region.base.0 as usize).min(self.bytes.len());
        let end = (start + region.size as usize).min(self.bytes.len());
        &self.bytes[start..end]
    }

    /// A read-only bus on this memory; any number of them work side by side.
    pub fn snapshot(&self) -> Snapshot<'_> {
        Snapshot { bytes: &self.bytes }
    }
}

impl Bus for FlatMemory {
    type Error = MemoryError;

    #[inline]
    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        self.snapshot().read(addr, buf)
    }

    #[inline]
    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        let size = self.bytes.len();
        let start = addr.0 as usize;
        let target = self.bytes.get_mut(start..start + bytes.len());
        let target = target.ok_or(MemoryError::OutOfRange { addr, len: bytes.len(), size })?;
        target.copy_from_slice(bytes);
        Ok(())
    }
}

/// A read-only view of a [`FlatMemory`].
#[derive(Debug, Clone, Copy)]
pub struct Snapshot<'a> {
    bytes: &'a [u8],
}

impl Bus for Snapshot<'_> {
    type Error = MemoryError;

    #[inline]
    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        let (start, len, size) = (addr.0 as usize, buf.len(), self.bytes.len());
        let source = self.bytes.get(start..start + len);
        buf.copy_from_slice(source.ok_or(MemoryError::OutOfRange { addr, len, size })?);
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, _: &[u8]) -> Result<(), MemoryError> {
        Err(MemoryError::ReadOnly { addr })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accesses_outside_are_refused_whole() {
        let mut memory = FlatMemory::new(8);
        memory.write(ByteAddr(4), &[1; 4]).unwrap();
        let error = memory.write(ByteAddr(6), &[2; 4]).unwrap_err();
        assert_eq!(error.to_string(), "4 bytes at 0x00000006 are outside the 8 bytes of memory");
        assert_eq!(memory.bytes(), [0, 0, 0, 0, 1, 1, 1, 1]);
        assert!(memory.read(ByteAddr(u32::MAX), &mut [0; 2]).is_err());
    }

    #[test]
    fn a_snapshot_reads_and_does_not_write() {
        let memory = FlatMemory::new(8);
        let mut snapshot = memory.snapshot();
        snapshot.read(ByteAddr(0), &mut [0; 8]).unwrap();
        let error = MemoryError::ReadOnly { addr: ByteAddr(1) };
        assert_eq!(snapshot.write(ByteAddr(1), &[0]), Err(error));
    }
}
