//! The firmware's job on the host.

use xylem_core::mem::Region;
use xylem_firmware::animation::FrameReport;
use xylem_firmware::job::{self, Buffers, JobError, NoClock};
use xylem_firmware::map::EXTERNAL;
use xylem_firmware::report::Report;

use super::{SceneBlob, SocError};
use crate::bus::{FlatMemory, MemoryError};

/// What the job said on the host. Cycles are 0 in its reports, as the host has no such clock.
#[derive(Clone, PartialEq, Debug)]
pub struct HostRun {
    /// The report of the whole.
    pub report: Report,
    /// The reports of the frames, if the scene is animated.
    pub frames: Vec<FrameReport>,
}

/// Runs the job on the host.
///
/// # Errors
/// [`SocError::TooLarge`] or [`SocError::Frames`] for a scene that no blob holds. The job's own error is the
/// inner one.
pub fn run_on_host(scene: &SceneBlob) -> Result<Result<HostRun, JobError<MemoryError>>, SocError> {
    let mut memory = external_memory(&scene.to_bytes(false)?);
    // No output holds an address, so the memory may lie anywhere.
    let all = Region::new(0, EXTERNAL.size);
    let mut buffers = Box::new(Buffers::new());
    let mut frames = Vec::new();
    let mut observer = |frame: &FrameReport| frames.push(*frame);
    let done = job::run(&mut memory, all, &mut buffers, &mut NoClock, &mut observer);
    Ok(done.map(|done| HostRun { report: done.report, frames }))
}

/// Memory of the size of external memory that starts with `blob`, cut off where it is longer.
pub(super) fn external_memory(blob: &[u8]) -> FlatMemory {
    let mut memory = FlatMemory::new(EXTERNAL.size as usize);
    let len = blob.len().min(memory.bytes().len());
    memory.bytes_mut()[..len].copy_from_slice(&blob[..len]);
    memory
}
