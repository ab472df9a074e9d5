//! The soft core's program: it does the job on the scene blob in external memory, then every step again in
//! software and with custom instructions, and says over the UART, a line each, what they took.
//!
//! ```text
//! stage NAME CYCLES                       a stage of the job, in software
//! step NAME COUNT SOFTWARE CUSTOM         see xylem_custom::measure
//! ```
//!
//! It powers off with 0; with 1, after a line that says why, if the job failed or results differ; with 2 after a
//! panic and 3 after a trap.
#![cfg_attr(target_arch = "riscv32", no_std, no_main)]
#![deny(unsafe_code)]

#[cfg(target_arch = "riscv32")]
mod machine;

#[cfg(target_arch = "riscv32")]
mod program {
    use core::fmt::Write;
    use core::panic::PanicInfo;

    use xylem_custom::map;
    use xylem_custom::measure::{self, Storage};
    use xylem_firmware::job::{self, Buffers};
    use xylem_firmware::report::STAGES;

    use crate::machine::{self, CustomInstructions, CycleCounter, ExternalMemory, Uart};

    /// Runs once. The reset code calls this with memory ready.
    pub fn main(mut memory: ExternalMemory, buffers: &mut Buffers, storage: &mut Storage) -> ! {
        let failed = |what: &dyn core::fmt::Display| -> ! {
            // The UART takes everything.
            let _ = writeln!(Uart, "failed {what}");
            machine::power_off(1)
        };
        let mut clock = CycleCounter;
        let finished = job::run(&mut memory, map::EXTERNAL, buffers, &mut clock, &mut |_| {});
        let finished = match finished {
            Ok(finished) => finished,
            Err(error) => failed(&error),
        };
        for (stage, cycles) in STAGES.iter().zip(finished.report.cycles) {
            let _ = writeln!(Uart, "stage {stage:?} {cycles}");
        }
        let mut observe = |measured: &measure::Measured| {
            let _ = writeln!(Uart, "step {measured}");
        };
        let cfu = CustomInstructions;
        let done = measure::all(&mut memory, &finished, storage, &mut clock, &cfu, &mut observe);
        match done {
            Ok(()) => machine::power_off(0),
            Err(failure) => failed(&failure),
        }
    }

    /// Reports an exception.
    pub fn trap(cause: u32, pc: u32, value: u32) -> ! {
        let _ = writeln!(Uart, "failed trap {cause} at {pc:#010x}, value {value:#010x}");
        machine::power_off(3)
    }

    #[panic_handler]
    fn panic(info: &PanicInfo) -> ! {
        let _ = writeln!(Uart, "failed {info}");
        machine::power_off(2)
    }
}

#[cfg(not(target_arch = "riscv32"))]
fn main() {
    eprintln!("this program is for the soft core; build it with tests/firmware.sh custom");
}
