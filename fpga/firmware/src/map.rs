//! The soft core's memory map, the same on the simulator, QEMU's `virt` machine and the RTL.
//!
//! | address       | size   | what                                                            |
//! |---------------|--------|-----------------------------------------------------------------|
//! | `0x0010_0000` | 4 B    | power-off: [`POWER_OFF_PASS`], or [`power_off_fail`] of a code  |
//! | `0x1000_0000` | 8 B    | UART (16550): byte 0 sends, bit 5 of byte 5 says it may          |
//! | `0x8000_0000` | 8 MiB  | local memory: code, constants, stack, variables; reset goes here |
//! | `0x8080_0000` | 56 MiB | external memory: the scene blob, then the job's work space       |

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
