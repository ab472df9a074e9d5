//! A program's ELF file as the machine loads it.

use std::path::{Path, PathBuf};

use object::{Architecture, Object, ObjectSegment, SegmentFlags, elf};
use xylem_core::mem::Region;
use xylem_firmware::map::LOCAL;

use super::SocError;

/// A program, loaded from its file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Image {
    /// Where it came from.
    pub path: PathBuf,
    /// The whole file: the log's tables are in it.
    pub elf: Vec<u8>,
    /// What is placed in local memory.
    pub segments: Vec<Segment>,
}

/// A piece of a program in memory.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Segment {
    /// Where it lies.
    pub region: Region,
    /// What it starts with; the rest of the region is zero.
    pub bytes: Vec<u8>,
    /// Whether the program may write it.
    pub writable: bool,
}

impl Image {
    /// Reads a program.
    ///
    /// # Errors
    /// [`SocError::Io`]; [`SocError::Elf`] if it is not a 32-bit RISC-V program that starts at the
    /// reset address and lies in local memory.
    pub fn read(path: &Path) -> Result<Self, SocError> {
        let elf =
            std::fs::read(path).map_err(SocError::io(format!("reading {}", path.display())))?;
        let segments =
            segments(&elf).map_err(|what| SocError::Elf { path: path.to_path_buf(), what })?;
        Ok(Self { path: path.to_path_buf(), elf, segments })
    }

    /// The end of the memory, from its start on, that the program may not write: its code and
    /// constants.
    pub fn protected_end(&self) -> u32 {
        let ends = self.segments.iter().filter(|s| !s.writable);
        ends.map(|s| s.region.base.0 + s.region.size).max().unwrap_or(LOCAL.base.0)
    }

    /// Local memory as the loader leaves it.
    pub fn local_memory(&self) -> Vec<u8> {
        let mut memory = vec![0; LOCAL.size as usize];
        for segment in &self.segments {
            let from = (segment.region.base.0 - LOCAL.base.0) as usize;
            memory[from..from + segment.bytes.len()].copy_from_slice(&segment.bytes);
        }
        memory
    }
}

/// The segments of a file, all of them inside local memory.
fn segments(elf: &[u8]) -> Result<Vec<Segment>, String> {
    let file = object::File::parse(elf).map_err(|error| error.to_string())?;
    if file.architecture() != Architecture::Riscv32 {
        return Err(format!("it is for {:?}, not Riscv32", file.architecture()));
    }
    if file.entry() != u64::from(LOCAL.base.0) {
        return Err(format!("it starts at {:#x}, the core at {}", file.entry(), LOCAL.base));
    }
    let mut segments = Vec::new();
    for segment in file.segments() {
        let (address, size) = (segment.address(), segment.size());
        let inside = address
            .checked_sub(u64::from(LOCAL.base.0))
            .and_then(|offset| offset.checked_add(size))
            .is_some_and(|end| end <= u64::from(LOCAL.size));
        if !inside {
            return Err(format!("{size} bytes at {address:#x} are outside local memory"));
        }
        let bytes = segment.data().map_err(|error| error.to_string())?.to_vec();
        if bytes.len() as u64 > size {
            return Err(format!("the segment at {address:#x} is longer than its memory"));
        }
        let writable = match segment.flags() {
            SegmentFlags::Elf { p_flags } => p_flags & elf::PF_W != 0,
            _ => true,
        };
        let region = Region::new(address as u32, size as u32);
        segments.push(Segment { region, bytes, writable });
    }
    Ok(segments)
}
