//! The firmware's job on the host.

use xylem_core::mem::Region;
use xylem_firmware::job::{self, Buffers, JobError, NoClock};
use xylem_firmware::map::EXTERNAL;
use xylem_firmware::report::Report;

use super::{SceneBlob, SocError};
use crate::bus::{FlatMemory, MemoryError};

/// Runs the job on the host. Cycles are 0 in its report, as the host has no such clock.
///
/// # Errors
/// [`SocError::TooLarge`] for a scene that no blob holds. The job's own error is the inner one.
pub fn run_on_host(scene: &SceneBlob) -> Result<Result<Report, JobError<MemoryError>>, SocError> {
    let mut memory = external_memory(&scene.to_bytes(false)?);
    // No output holds an address, so the memory may lie anywhere.
    let all = Region::new(0, EXTERNAL.size);
    let mut buffers = Box::new(Buffers::new());
    Ok(job::run(&mut memory, all, &mut buffers, &mut NoClock))
}

/// Memory of the size of external memory that starts with `blob`, cut off where it is longer.
pub(super) fn external_memory(blob: &[u8]) -> FlatMemory {
    let mut memory = FlatMemory::new(EXTERNAL.size as usize);
    let len = blob.len().min(memory.bytes().len());
    memory.bytes_mut()[..len].copy_from_slice(&blob[..len]);
    memory
}
