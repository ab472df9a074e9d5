//! The soft core's program: it runs the job on the scene blob in external memory, logs over the
//! UART and powers off.
//!
//! Each frame of an animation leaves a line `frame` with the bytes of its
//! [report](xylem_firmware::animation::FrameReport); the last line of a successful run is `report` with
//! those of the [whole](xylem_firmware::report). If the blob says that there is an accelerator, it does the
//! job too, and a line `accelerated` has the bytes of [what it did](xylem_firmware::accelerated). Exit
//! codes: 1 the job failed, 2 a panic, 3 a trap, 4 the accelerator failed.
#![cfg_attr(target_arch = "riscv32", no_std, no_main)]
#![deny(unsafe_code)]

#[cfg(target_arch = "riscv32")]
mod machine;

#[cfg(target_arch = "riscv32")]
mod program {
    use core::panic::PanicInfo;

    use xylem_firmware::accelerated::PARTS;
    use xylem_firmware::animation::FrameReport;
    use xylem_firmware::job::{Buffers, Finished};
    use xylem_firmware::report::{OUTPUTS, STAGES};
    use xylem_firmware::{accelerator, blob::Blob, job, map};

    use crate::machine::{self, Accelerator, CycleCounter, ExternalMemory, Trap};

    defmt::timestamp!("{=u64}", machine::cycles());

    /// Runs the job, once. The reset code calls this with memory ready.
    pub fn main(mut memory: ExternalMemory, hardware: Accelerator, buffers: &mut Buffers) -> ! {
        if Blob::parse(&mut memory, map::EXTERNAL).is_ok_and(|blob| blob.header.machine_traps) {
            machine::catch_traps();
        }
        defmt::info!("xylem firmware {=str}", env!("CARGO_PKG_VERSION"));
        let mut observer = |frame: &FrameReport| {
            defmt::println!("frame {=[u8]:02x}", frame.to_bytes());
        };
        match job::run(&mut memory, map::EXTERNAL, buffers, &mut CycleCounter, &mut observer) {
            Ok(finished) => {
                let report = &finished.report;
                defmt::info!(
                    "{=u32} primitives, {=u32} leaves, {=u32} nodes, {=u32} cells, {=u32} rays, \
                     {=u32} hits",
                    report.primitives,
                    report.leaves,
                    report.nodes,
                    report.cells,
                    report.rays,
                    report.hits
                );
                for (stage, cycles) in STAGES.iter().zip(report.cycles) {
                    defmt::info!("{}: {=u64} cycles", stage, cycles);
                }
                for (output, digest) in OUTPUTS.iter().zip(report.outputs) {
                    defmt::info!(
                        "{}: {=u32} bytes, crc32 {=u32:08x}",
                        output,
                        digest.bytes,
                        digest.crc
                    );
                }
                defmt::println!("report {=[u8]:02x}", report.to_bytes());
                if finished.blob.header.accelerator {
                    accelerate(&mut memory, hardware, &finished);
                }
                machine::power_off(map::POWER_OFF_PASS)
            }
            Err(error) => {
                defmt::error!("job failed: {}", error);
                machine::power_off(map::power_off_fail(1))
            }
        }
    }

    /// Does the job once more with the accelerator.
    fn accelerate(memory: &mut ExternalMemory, hardware: Accelerator, finished: &Finished) {
        match accelerator::run(memory, finished, &mut CycleCounter, hardware.into_parts()) {
            Ok(report) => {
                for (part, done) in PARTS.iter().zip(report.parts) {
                    let Some(done) = done else { continue };
                    defmt::info!(
                        "accelerated {}: {=u64} cycles, {=u64} of them the accelerator's",
                        part,
                        done.cycles,
                        done.counters.cycles
                    );
                }
                for part in report.missing(finished.blob.header.treelet_depth) {
                    defmt::info!(
                        "the accelerator has no unit for this, it stays software: {}",
                        part
                    );
                }
                defmt::println!("accelerated {=[u8]:02x}", report.to_bytes());
            }
            Err(error) => {
                defmt::error!("accelerator: {}", error);
                machine::power_off(map::power_off_fail(4))
            }
        }
    }

    #[panic_handler]
    fn panic(info: &PanicInfo) -> ! {
        defmt::error!("panic: {}", defmt::Display2Format(info));
        machine::power_off(map::power_off_fail(2))
    }

    /// Reports an exception that the core caught. Only cores with trap registers come here.
    pub fn trap(trap: Trap) -> ! {
        defmt::error!(
            "trap: cause {=u32} at {=u32:#010x}, value {=u32:#010x}",
            trap.cause,
            trap.pc,
            trap.value
        );
        machine::power_off(map::power_off_fail(3))
    }
}

#[cfg(not(target_arch = "riscv32"))]
fn main() {
    eprintln!("this program is for the soft core; build it with tests/firmware.sh build");
}
