//! The soft core's memory map, the same on the simulator, QEMU's `virt` machine and the RTL.
//!
//! | address       | size   | what                                                            |
//! |---------------|--------|-----------------------------------------------------------------|
//! | `0x0010_0000` | 4 B    | power-off: [`POWER_OFF_PASS`], or [`power_off_fail`] of a code  |
//! | `0x1000_0000` | 8 B    | UART (16550): byte 0 sends, bit 5 of byte 5 says it may          |
//! | `0x4000_0000` | 512 B  | the accelerator's registers, where there is one                 |
//! | `0x4000_0800` | 4 B    | its interrupt line, in bit 0                                    |
//! | `0x8000_0000` | 8 MiB  | local memory: code, constants, stack, variables; reset goes here |
//! | `0x8080_0000` | 56 MiB | external memory: the scene blob, then the job's work space       |
//!
//! Where no accelerator is fitted, its registers and its line read as 0 and take what is written. QEMU has
//! none, and other devices in its place.

use xylem_core::mem::Region;

/// The power-off device's only register.
pub const POWER_OFF: u32 = 0x0010_0000;

/// The word that ends a run in success.
pub const POWER_OFF_PASS: u32 = 0x5555;

/// The word that ends a run in failure with `code`, 1 to 255.
pub const fn power_off_fail(code: u8) -> u32 {
    0x3333 | (code as u32) << 16
}

/// The UART's transmit register.
pub const UART: u32 = 0x1000_0000;

/// The UART's line status register.
pub const UART_STATUS: u32 = UART + 5;

/// The bits of [`UART_STATUS`] that say that a byte may be sent and that the line is idle.
pub const UART_READY: u8 = 0x60;

/// The core's own memory.
pub const LOCAL: Region = Region::new(0x8000_0000, 8 << 20);

/// The memory behind the bus. The scene blob starts it.
pub const EXTERNAL: Region = Region::new(0x8080_0000, 56 << 20);

/// The accelerator's registers: the map of `xylem-regs` from the first byte on.
pub const ACCELERATOR: Region = Region::new(0x4000_0000, 512);

/// The word whose lowest bit is the accelerator's interrupt line; the others are 0.
pub const ACCELERATOR_INTERRUPT: u32 = 0x4000_0800;

/// The clock that the core's delays are counted in.
pub const CLOCK_MHZ: u32 = 100;

const _: () = assert!(xylem_regs::MAP_SIZE <= ACCELERATOR.size);
