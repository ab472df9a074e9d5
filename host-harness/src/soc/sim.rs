//! The instruction simulator: `rvsim`'s interpreter on the harness's own memory.

use std::mem::size_of;
use std::time::Instant;

use rvsim::{Clock, CpuError, CpuState, Interp, Memory, MemoryAccess, Op};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_firmware::map::{EXTERNAL, LOCAL, POWER_OFF, UART, UART_READY, UART_STATUS};

use super::host::external_memory;
use super::{Costs, End, Image, Options, Ran, SocError, power_off};
use crate::bus::{FlatMemory, MemoryError, MemoryTiming, Tally};

/// Runs a program until it powers off, crashes or exceeds the limits.
pub(super) fn run(
    image: &Image,
    blob: &[u8],
    costs: Costs,
    options: &Options,
) -> Result<Ran, SocError> {
    let mut space = Space {
        local: image.local_memory(),
        protected_end: image.protected_end(),
        external: External {
            memory: external_memory(blob),
            timing: options.memory,
            tally: Tally::default(),
        },
        uart: Vec::new(),
        power: None,
        refused: None,
    };
    let mut state = CpuState::new(LOCAL.base.0);
    let mut clock = CoreClock::default();
    let start = Instant::now();
    let end = loop {
        let pc = state.pc;
        let waited = space.external.tally.millicycles;
        match Interp::new(&mut state, &mut space, &mut clock).step() {
            Ok(op) => {
                let wait = (space.external.tally.millicycles - waited).div_ceil(1000);
                clock.cycles += u64::from(costs.of(&op, pc, state.pc)) + wait;
            }
            Err((error, op)) => break End::Crash(crash(error, op, pc, space.refused)),
        }
        if let Some(word) = space.power {
            break power_off(word);
        }
        // Looking at the wall clock is dear; a million instructions take some 10 ms.
        if clock.instructions.is_multiple_of(1 << 20) && start.elapsed() > options.time {
            break End::TimeOut(options.time);
        }
    };
    Ok(Ran {
        uart: space.uart,
        end,
        instructions: Some(clock.instructions),
        cycles: Some(clock.cycles),
        external: Some(space.external.tally),
        time: start.elapsed(),
    })
}

/// External memory as a core sees it that waits for every access.
#[derive(Debug)]
struct External {
    memory: FlatMemory,
    timing: MemoryTiming,
    tally: Tally,
}

impl External {
    /// Adds the time of an access: the whole latency, as nothing overlaps, and the transfer.
    fn wait(&mut self, bytes: usize) {
        let rate = u64::from(self.timing.deci_bytes_per_cycle);
        let transfer = (bytes as u64 * 10_000).checked_div(rate).unwrap_or(0);
        self.tally.millicycles += u64::from(self.timing.latency_cycles) * 1000 + transfer;
    }
}

impl Bus for External {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        self.memory.read(ByteAddr(addr.0.wrapping_sub(EXTERNAL.base.0)), buf)?;
        self.tally.reads += 1;
        self.tally.read_bytes += buf.len() as u64;
        self.wait(buf.len());
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        self.memory.write(ByteAddr(addr.0.wrapping_sub(EXTERNAL.base.0)), bytes)?;
        self.tally.writes += 1;
        self.tally.write_bytes += bytes.len() as u64;
        self.wait(bytes.len());
        Ok(())
    }
}

/// Says what stopped the core.
fn crash(error: CpuError, op: Option<Op>, pc: u32, refused: Option<Refused>) -> String {
    let op = op.map_or(String::new(), |op| format!(" of {op:?}"));
    match (error, refused) {
        (CpuError::IllegalAccess | CpuError::IllegalFetch, Some(refused)) => {
            let Refused { addr, size, why } = refused;
            format!("access{op} at {pc:#010x} to {size} bytes at {addr:#010x}: {why}")
        }
        _ => format!("{error:?}{op} at {pc:#010x}"),
    }
}

/// The counters that the program can read.
#[derive(Debug, Default)]
struct CoreClock {
    cycles: u64,
    instructions: u64,
}

impl Clock for CoreClock {
    fn read_cycle(&self) -> u64 {
        self.cycles
    }
    fn read_time(&self) -> u64 {
        self.cycles
    }
    fn read_instret(&self) -> u64 {
        self.instructions
    }
    fn progress(&mut self, _: &Op) {
        self.instructions += 1;
    }
}

/// The core's address space.
#[derive(Debug)]
struct Space {
    local: Vec<u8>,
    protected_end: u32,
    external: External,
    uart: Vec<u8>,
    power: Option<u32>,
    refused: Option<Refused>,
}

/// The last access that was refused.
#[derive(Clone, Copy, Debug)]
struct Refused {
    addr: u32,
    size: usize,
    why: &'static str,
}

/// Room for one access, aligned for all.
#[repr(align(8))]
struct Word([u8; 8]);

/// Whether `addr` is in a region.
const fn within(addr: u32, region: Region) -> bool {
    addr.wrapping_sub(region.base.0) < region.size
}

impl Memory for Space {
    #[inline]
    fn access<T: Copy>(&mut self, addr: u32, access: MemoryAccess<T>) -> bool {
        let size = size_of::<T>();
        let store = matches!(access, MemoryAccess::Store(_));
        let why = if !addr.is_multiple_of(size as u32) {
            "it is not aligned, which this core refuses"
        } else if within(addr, LOCAL) {
            if !store || addr >= self.protected_end {
                // The simulator's own access to a byte slice; it checks the end.
                return Memory::access(&mut self.local[..], addr - LOCAL.base.0, access);
            }
            "code and constants are read-only; did the stack overflow?"
        } else if matches!(access, MemoryAccess::Exec(_)) {
            "there is no code"
        } else if self.device(addr, size, access) {
            return true;
        } else {
            "nothing answers there"
        };
        self.refused = Some(Refused { addr, size, why });
        false
    }
}

impl Space {
    /// Accesses whatever is not local memory; false if nothing is there.
    fn device<T: Copy>(&mut self, addr: u32, size: usize, access: MemoryAccess<T>) -> bool {
        let mut word = Word([0; 8]);
        let Some(bytes) = word.0.get_mut(..size) else { return false };
        if let MemoryAccess::Store(_) = access {
            if !Memory::access(bytes, 0, access) {
                return false;
            }
            match (addr, size) {
                (UART, 1) => self.uart.push(bytes[0]),
                (POWER_OFF, 4) => {
                    self.power = Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
                }
                _ if within(addr, EXTERNAL) => {
                    return self.external.write(ByteAddr(addr), bytes).is_ok();
                }
                _ => return false,
            }
            return true;
        }
        match (addr, size) {
            (UART_STATUS, 1) => bytes[0] = UART_READY,
            _ if within(addr, EXTERNAL) => {
                if self.external.read(ByteAddr(addr), bytes).is_err() {
                    return false;
                }
            }
            _ => return false,
        }
        Memory::access(bytes, 0, access)
    }
}
