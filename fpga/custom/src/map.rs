//! The memory map of the bench around VexRiscv (`fpga/soc/vexriscv_tb.cpp`).
//!
//! | address       | size   | what                                                            |
//! |---------------|--------|-----------------------------------------------------------------|
//! | `0x4000_0000` | 8 MiB  | local memory: code, constants, stack, variables; reset goes here |
//! | `0x4080_0000` | 56 MiB | external memory: the scene blob, then the job's work space       |
//! | `0xf000_0000` | 4 B    | UART: a word written sends its lowest byte                       |
//! | `0xf000_0004` | 4 B    | power switch: a word written ends the run, 0 in success          |
//!
//! It is not the firmware's: VexRiscv's data cache takes every address with its highest bit set for a device.

use xylem_core::mem::Region;

/// Code, constants, stack and variables.
pub const LOCAL: Region = Region::new(0x4000_0000, 8 << 20);

/// The scene blob, and what the job writes.
pub const EXTERNAL: Region = Region::new(0x4080_0000, 56 << 20);

/// The UART's only register.
pub const UART: u32 = 0xf000_0000;

/// The power switch.
pub const POWER_OFF: u32 = 0xf000_0004;
