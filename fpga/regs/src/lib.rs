//! The register map of the Xylem accelerator, as Rust types.
//!
//! [`map`] is generated from `xylem.rdl`, the same source that the RTL register block comes from:
//! a constant for each register says where it is and what type its contents have, a type for each
//! kind of register has an accessor for each field, and [`REGISTERS`] describes the whole map to
//! fakes and tools. The crate moves no data: `xylem-driver` does, over memory-mapped I/O or SPI.
//!
//! ```
//! use xylem_regs::{CTRL, Ctrl, JobKind, Register, Stage, Status};
//!
//! let word = Ctrl::RESET.with_job(JobKind::Trace).with_start(true).bits();
//! assert_eq!((CTRL.offset(), word), (0x040, 0x0000_0401));
//!
//! let status = Status::from_bits(0x0000_0501);
//! assert!(status.busy());
//! assert_eq!(status.stage(), Ok(Stage::Trace));
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod map;
mod register;

pub use map::*;
pub use register::{
    Access, FieldInfo, Readable, Reg, Register, RegisterInfo, UnknownValue, Writable,
};

/// The alignment of region bases and sizes, in bytes: their low six bits do not exist.
pub const REGION_ALIGN: u32 = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_ascend_by_words_and_end_inside_the_map() {
        assert!(REGISTERS.windows(2).all(|pair| pair[0].offset < pair[1].offset));
        assert!(REGISTERS.iter().all(|r| r.offset % 4 == 0 && r.offset + 4 <= MAP_SIZE));
    }

    #[test]
    fn fields_of_a_register_neither_overlap_nor_leave_the_word() {
        for register in &REGISTERS {
            let mut taken = 0;
            for field in register.fields {
                assert!(field.lsb + field.width <= 32, "{}.{}", register.path, field.name);
                assert_eq!(taken & field.mask(), 0, "{}.{}", register.path, field.name);
                taken |= field.mask();
            }
        }
    }

    #[test]
    fn a_register_is_found_at_its_own_offset_only() {
        assert_eq!(RegisterInfo::at(STATUS.offset()).map(|r| r.path), Some("status"));
        assert_eq!(RegisterInfo::at(STATUS.offset() + 1), None);
        assert_eq!(RegisterInfo::at(MAP_SIZE), None);
    }

    #[test]
    fn the_magic_number_spells_the_name() {
        assert_eq!(&Magic::RESET.value().to_be_bytes(), b"XYLM");
    }

    #[test]
    fn a_setter_changes_its_own_field_alone_and_drops_what_does_not_fit() {
        let limits = JobLimits::from_bits(u32::MAX).with_morton_bits(30);
        assert_eq!((limits.bits(), limits.morton_bits()), (0xffff_ff9e, 30));
        assert_eq!(JobLimits::RESET.with_treelet_depth(0xff).bits(), 0x0007_0000);
    }

    #[test]
    fn enumerations_decode_every_value_they_encode_and_no_other() {
        for code in ErrorCode::ALL {
            let info = ErrorInfo::from_bits(code as u32);
            assert_eq!(info.code(), Ok(code));
        }
        assert_eq!(ErrorInfo::from_bits(0xff).code(), Err(UnknownValue(0xff)));
    }

    #[test]
    fn signed_fields_keep_their_sign() {
        let low = Coordinate::RESET.with_value(-5);
        assert_eq!((low.bits(), low.value()), (0xffff_fffb, -5));
    }

    #[test]
    fn region_registers_hold_byte_values_whose_low_bits_do_not_exist() {
        let info = RegisterInfo::at(REGION_RUNS_B_SIZE.offset()).expect("a register");
        assert_eq!(info.writable(), !(REGION_ALIGN - 1));
        assert_eq!(info.locked(), info.writable());
    }

    #[test]
    fn masks_follow_the_access_kinds() {
        let ctrl = RegisterInfo::at(CTRL.offset()).expect("a register");
        assert_eq!((ctrl.writable(), ctrl.readable()), (0x707, 0x700));
        let status = RegisterInfo::at(STATUS.offset()).expect("a register");
        assert_eq!(status.writable(), 0);
        let events = RegisterInfo::at(INT_STATUS.offset()).expect("a register");
        assert_eq!(events.mask(|access| access == Access::WriteOneToClear), 0b11);
    }
}
