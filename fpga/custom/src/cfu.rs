//! The instructions, by name. What each does is written in `fpga/rtl/xy_cfu.sv`.

/// What executes the instructions.
///
/// The unit has state: instructions take effect in the order in which they are executed.
pub trait Cfu {
    /// Executes the R-type instruction of opcode custom-0 with `UNIT` as funct3 and `OP` as funct7.
    fn call<const UNIT: u32, const OP: u32>(&self, a: u32, b: u32) -> u32;

    /// Executes an instruction on two halves of a word of 64 bits, the lower one first.
    #[inline(always)]
    fn call_wide<const UNIT: u32, const OP: u32>(&self, word: u64) -> u32 {
        self.call::<UNIT, OP>(word as u32, (word >> 32) as u32)
    }
}

/// Part of the custom function unit: the instruction's funct3.
#[derive(Clone, Copy, Debug)]
pub struct Unit;

impl Unit {
    /// Keys of the merge heap.
    pub const HEAP: u32 = 0;
    /// Rays against boxes.
    pub const BOXES: u32 = 1;
    /// Boxes on their parents' grids.
    pub const ENCODE: u32 = 2;
}

/// Operations of [`Unit::HEAP`].
pub(crate) mod heap {
    pub const KEY_LOAD: u32 = 0;
    pub const KEY_MEET: u32 = 1;
    pub const REST_HIGH: u32 = 2;
    pub const KEY_LOW: u32 = 3;
    pub const KEY_HIGH: u32 = 4;
}

/// Operations of [`Unit::BOXES`].
pub(crate) mod boxes {
    pub const RAY_X: u32 = 0;
    pub const RAY_Y: u32 = 1;
    pub const RAY_Z: u32 = 2;
    pub const TIME_MIN: u32 = 4;
    pub const TIME_MAX: u32 = 5;
    pub const BOX_X: u32 = 8;
    pub const BOX_Y: u32 = 9;
    pub const BOX_Z: u32 = 10;
    pub const VERDICT: u32 = 16;
    pub const ENTRY_LOW: u32 = 17;
    pub const ENTRY_HIGH: u32 = 18;
}

/// Operations of [`Unit::ENCODE`].
pub(crate) mod encode {
    pub const PARENT_X: u32 = 0;
    pub const PARENT_Y: u32 = 1;
    pub const PARENT_Z: u32 = 2;
    pub const MODULO: u32 = 3;
    pub const CHILD_X: u32 = 8;
    pub const CHILD_Y: u32 = 9;
    pub const CHILD_Z: u32 = 10;
    pub const CODE_LOW: u32 = 16;
    pub const CODE_HIGH: u32 = 17;
    pub const LOWER_X: u32 = 20;
    pub const LOWER_Y: u32 = 21;
    pub const LOWER_Z: u32 = 22;
    pub const SHAPE_X: u32 = 24;
    pub const SHAPE_Y: u32 = 25;
    pub const SHAPE_Z: u32 = 26;
}
