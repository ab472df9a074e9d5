//! What an instruction costs on the simulated core: a model, in one table.

use rvsim::Op;

/// Cycles by class of instruction, for a core that does one thing at a time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Costs {
    /// An operation on registers or immediates; also `lui`, `auipc`, `fence` and counter reads.
    pub alu: u32,
    /// `jal`.
    pub jump: u32,
    /// `jalr`, returns included.
    pub jump_indirect: u32,
    /// A branch that is taken.
    pub branch_taken: u32,
    /// A branch that is not.
    pub branch_not_taken: u32,
    /// A load, with memory that answers at once.
    pub load: u32,
    /// A store, with memory that answers at once.
    pub store: u32,
    /// `mul` and its kin.
    pub multiply: u32,
    /// `div`, `rem` and their kin.
    pub divide: u32,
}

impl Costs {
    /// PicoRV32 with single-cycle multiplier, divider and barrel shifter, on memory that answers
    /// within the cycle. What external memory takes beyond that comes on top.
    ///
    /// The classes are those of the table in PicoRV32's README ("Cycles per Instruction
    /// Performance"). Multiplication and division are not in it and were measured on the RTL.
    /// Left out: a jump to the middle of a word, where a 32-bit instruction takes a second fetch.
    pub const PICORV32: Self = Self {
        alu: 3,
        jump: 3,
        jump_indirect: 6,
        branch_taken: 5,
        branch_not_taken: 3,
        load: 5,
        store: 5,
        multiply: 6,
        divide: 40,
    };

    /// The cycles of an instruction at `pc` after which the core is at `next`.
    #[inline]
    pub fn of(&self, op: &Op, pc: u32, next: u32) -> u32 {
        let branch = |offset: i32| {
            if next == pc.wrapping_add(offset as u32) {
                self.branch_taken
            } else {
                self.branch_not_taken
            }
        };
        match *op {
            Op::Lb { .. } | Op::Lh { .. } | Op::Lw { .. } | Op::Lbu { .. } | Op::Lhu { .. } => {
                self.load
            }
            Op::Sb { .. } | Op::Sh { .. } | Op::Sw { .. } => self.store,
            Op::Beq { b_imm, .. }
            | Op::Bne { b_imm, .. }
            | Op::Blt { b_imm, .. }
            | Op::Bge { b_imm, .. }
            | Op::Bltu { b_imm, .. }
            | Op::Bgeu { b_imm, .. } => branch(b_imm),
            Op::Jal { .. } => self.jump,
            Op::Jalr { .. } => self.jump_indirect,
            Op::Mul { .. } | Op::Mulh { .. } | Op::Mulhsu { .. } | Op::Mulhu { .. } => {
                self.multiply
            }
            Op::Div { .. } | Op::Divu { .. } | Op::Rem { .. } | Op::Remu { .. } => self.divide,
            _ => self.alu,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_branch_costs_by_where_it_went() {
        let costs = Costs::PICORV32;
        let branch = Op::Beq { rs1: 1, rs2: 2, b_imm: -16 };
        assert_eq!(costs.of(&branch, 0x100, 0xf0), costs.branch_taken);
        assert_eq!(costs.of(&branch, 0x100, 0x104), costs.branch_not_taken);
        assert_eq!(costs.of(&branch, 0x100, 0x102), costs.branch_not_taken);
    }

    #[test]
    fn classes_are_told_apart() {
        let costs = Costs::PICORV32;
        let of = |op: Op| costs.of(&op, 0, 4);
        assert_eq!(of(Op::Lw { rd: 1, rs1: 2, i_imm: 0 }), costs.load);
        assert_eq!(of(Op::Sb { rs1: 1, rs2: 2, s_imm: 0 }), costs.store);
        assert_eq!(of(Op::Mulhu { rd: 1, rs1: 2, rs2: 3 }), costs.multiply);
        assert_eq!(of(Op::Remu { rd: 1, rs1: 2, rs2: 3 }), costs.divide);
        assert_eq!(of(Op::Addi { rd: 1, rs1: 2, i_imm: 0 }), costs.alu);
    }
}
