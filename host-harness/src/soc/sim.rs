//! The instruction simulator: `rvsim`'s interpreter on the harness's own memory.

use std::mem::size_of;
use std::time::Instant;

use rvsim::{Clock, CpuError, CpuState, Interp, Memory, MemoryAccess, Op};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_firmware::map::{
    ACCELERATOR, ACCELERATOR_INTERRUPT, EXTERNAL, LOCAL, POWER_OFF, UART, UART_READY, UART_STATUS,
};

use super::accelerator::Accelerator;
use super::host::external_memory;
use super::{Costs, End, Image, Options, Ran, SocError, Step, power_off};
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
        accelerator: options
            .accelerator
            .map(|beside| Accelerator::new(beside.config, beside.latency, EXTERNAL.base.0)),
        now: 0,
        register_cycles: 0,
        uart: Vec::new(),
        power: None,
        refused: None,
    };
    let mut state = CpuState::new(LOCAL.base.0);
    let mut clock = CoreClock::default();
    let start = Instant::now();
    let end = loop {
        let pc = state.pc;
        let bytes = space.instruction_bytes(pc);
        clock.cycles += u64::from(costs.fetch(pc, bytes));
        let waited = space.external.tally.millicycles;
        (space.now, space.register_cycles) = (clock.cycles, 0);
        match Interp::new(&mut state, &mut space, &mut clock).step() {
            Ok(op) => {
                let wait = (space.external.tally.millicycles - waited).div_ceil(1000);
                let following_bytes = space.instruction_bytes(pc.wrapping_add(bytes));
                let step = Step { op, pc, bytes, following_bytes, next: state.pc };
                clock.cycles += u64::from(costs.of(&step)) + wait + space.register_cycles;
            }
            Err((error, op)) => break End::Crash(crash(error, op, pc, space.refused)),
        }
        if let Some(accelerator) = &mut space.accelerator
            && accelerator.due() <= clock.cycles
        {
            accelerator.advance(clock.cycles, &mut space.external.memory);
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
    accelerator: Option<Accelerator>,
    /// The cycle in which the instruction under way was fetched.
    now: u64,
    /// What it waits for registers beyond the cycles of its class.
    register_cycles: u64,
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
    /// The length of the instruction at `pc`: its lowest bits say.
    #[inline]
    fn instruction_bytes(&self, pc: u32) -> u32 {
        let byte = self.local.get(pc.wrapping_sub(LOCAL.base.0) as usize).copied().unwrap_or(0);
        if byte & 3 == 3 { 4 } else { 2 }
    }

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
                _ if within(addr, ACCELERATOR) && size == 4 => {
                    let value = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                    self.write_register(addr - ACCELERATOR.base.0, value);
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
            (ACCELERATOR_INTERRUPT, 4) => {
                bytes[0] = u8::from(self.accelerator.as_ref().is_some_and(Accelerator::interrupt));
            }
            _ if within(addr, ACCELERATOR) && size == 4 => {
                bytes.copy_from_slice(&self.read_register(addr - ACCELERATOR.base.0).to_le_bytes());
            }
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

impl Space {
    /// A register of the accelerator; 0 where there is none.
    fn read_register(&mut self, offset: u32) -> u32 {
        let Some(accelerator) = &self.accelerator else { return 0 };
        self.register_cycles += REGISTER_CYCLES;
        accelerator.read(offset, self.now)
    }

    /// Writes a register of the accelerator; nothing where there is none.
    fn write_register(&mut self, offset: u32, value: u32) {
        let Some(accelerator) = &mut self.accelerator else { return };
        self.register_cycles += REGISTER_CYCLES;
        accelerator.write(offset, value, self.now, &mut self.external.memory);
    }
}

/// What an access over AXI4-Lite takes beyond one to memory.
const REGISTER_CYCLES: u64 = 2;

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::soc::Segment;

    /// Runs a program of 32-bit words; `x5` starts as 0x8040_0000, writable local memory.
    fn run_words(words: &[u32], options: &Options) -> Ran {
        let mut bytes = 0x8040_02b7u32.to_le_bytes().to_vec();
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
        let region = Region { size: bytes.len() as u32, ..LOCAL };
        let segments = vec![Segment { region, bytes, writable: false }];
        let image = Image { path: "test".into(), elf: Vec::new(), segments };
        run(&image, b"scene", Costs::PICORV32, options).expect("a run")
    }

    fn end(words: &[u32]) -> String {
        match run_words(words, &Options::default()).end {
            End::Crash(what) => what,
            end => format!("{end:?}"),
        }
    }

    const NOP: u32 = 0x0000_0013;
    const LOOP: u32 = 0x0000_006f;
    /// `lui x6, 0x00100; lui x7, 0x5; addi x7, x7, 0x555; sw x7, 0(x6)`
    const POWER_OFF_WITH_PASS: [u32; 4] = [0x0010_0337, 0x0000_53b7, 0x5553_8393, 0x0073_2023];

    #[test]
    fn a_program_takes_exactly_the_cycles_of_its_instructions() {
        let ran = run_words(&POWER_OFF_WITH_PASS, &Options::default());
        assert!(matches!(ran.end, End::PowerOff { code: 0 }), "{:?}", ran.end);
        assert_eq!((ran.instructions, ran.cycles), (Some(5), Some(4 * 3 + 5)));
        // lw x8, 0(x5): local memory takes no more than the load itself.
        let mut words = vec![0x0002_a403, NOP];
        words.extend(POWER_OFF_WITH_PASS);
        let ran = run_words(&words, &Options::default());
        assert_eq!(ran.cycles, Some(17 + 5 + 3));
    }

    #[test]
    fn external_memory_makes_the_core_wait_and_counts_the_access() {
        // lui x9, 0x80800; lw x8, 0(x9)
        let mut words = vec![0x8080_04b7, 0x0004_a403];
        words.extend(POWER_OFF_WITH_PASS);
        let slow = *MemoryTiming::by_name("slow").expect("a known memory");
        let ran = run_words(&words, &Options { memory: slow, ..Options::default() });
        // 4 bytes at 12.8 bytes a cycle are 0.3125 cycles, behind 43 of latency.
        assert_eq!(ran.cycles, Some(17 + 3 + 5 + 44));
        let tally = ran.external.expect("a count");
        assert_eq!((tally.reads, tally.read_bytes, tally.writes), (1, 4, 0));
    }

    #[test]
    fn a_store_into_code_crashes_and_names_the_likely_cause() {
        // lui x9, 0x80000; sw x0, 0(x9)
        let what = end(&[0x8000_04b7, 0x0004_a023]);
        assert!(what.contains("to 4 bytes at 0x80000000: code and constants"), "{what}");
        assert!(what.contains("at 0x80000008"), "{what}");
    }

    #[test]
    fn accesses_that_the_hardware_refuses_crash() {
        // lw x8, 2(x5); lw x8, 0(x0); sb x0, 8(x6) behind the power switch; a word to the UART
        for (words, why) in [
            (&[0x0022_a403][..], "not aligned"),
            (&[0x0000_2403], "nothing answers there"),
            (&[0x0010_0337, 0x0003_0423], "nothing answers there"),
            (&[0x1000_0337, 0x0003_2023], "nothing answers there"),
            (&[0x8080_0337, 0x0003_0067], "there is no code"),
            (&[0], "IllegalInstruction"),
            (&[0x3000_9073], "IllegalInstruction"),
        ] {
            let what = end(words);
            assert!(what.contains(why), "{words:08x?}: {what}");
        }
    }

    #[test]
    fn a_power_switch_word_without_a_meaning_is_no_success() {
        // lui x6, 0x00100; sw x0, 0(x6)
        assert!(end(&[0x0010_0337, 0x0003_2023]).contains("means nothing"));
        // lui x6, 0x00100; lui x7, 0x23; addi x7, x7, 0x333; sw x7, 0(x6)
        let fail = [0x0010_0337, 0x0002_33b7, 0x3333_8393, 0x0073_2023];
        assert_eq!(end(&fail), "PowerOff { code: 2 }");
    }

    #[test]
    fn a_loop_without_end_is_stopped() {
        let options = Options { time: Duration::from_millis(50), ..Options::default() };
        assert!(matches!(run_words(&[LOOP], &options).end, End::TimeOut(_)));
    }
}
