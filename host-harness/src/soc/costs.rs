//! What an instruction costs on the simulated core: a model, in one table.

use rvsim::Op;

/// Cycles by class of instruction, for a core that does one thing at a time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Costs {
    /// An operation on registers or immediates; also `lui`, `auipc` and `fence`.
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
    /// A read of a counter.
    pub counter: u32,
    /// What a 32-bit instruction that straddles two words takes in addition: its second fetch. It
    /// is also spent on one that was fetched behind a taken branch for nothing.
    pub straddle: u32,
}

/// An instruction that was executed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Step {
    /// The instruction.
    pub op: Op,
    /// Where it is.
    pub pc: u32,
    /// Its length in bytes.
    pub bytes: u32,
    /// The length in bytes of the instruction behind it in memory.
    pub following_bytes: u32,
    /// Where the core is after it.
    pub next: u32,
}

impl Step {
    /// Whether this is a conditional branch that went to its target.
    #[inline]
    fn is_taken_branch(&self) -> bool {
        let (Op::Beq { b_imm, .. }
        | Op::Bne { b_imm, .. }
        | Op::Blt { b_imm, .. }
        | Op::Bge { b_imm, .. }
        | Op::Bltu { b_imm, .. }
        | Op::Bgeu { b_imm, .. }) = self.op
        else {
            return false;
        };
        self.next == self.pc.wrapping_add(b_imm as u32)
    }
}

impl Costs {
    /// PicoRV32 with single-cycle multiplier, divider and barrel shifter, on memory that answers
    /// within the cycle. What external memory takes beyond that comes on top.
    ///
    /// The classes are those of the table in PicoRV32's README ("Cycles per Instruction
    /// Performance"). What that does not list was measured on the RTL with strings of one
    /// instruction: multiplication, division, counters and straddling. With that, the job's stages
    /// take the same cycles here as on the RTL.
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
        counter: 4,
        straddle: 1,
    };

    /// The cycles that fetching an instruction takes before it begins.
    #[inline]
    pub fn fetch(&self, pc: u32, bytes: u32) -> u32 {
        if straddles(pc, bytes) { self.straddle } else { 0 }
    }

    /// The cycles of an instruction once it is fetched.
    #[inline]
    pub fn of(&self, step: &Step) -> u32 {
        // A branch finds out that it is taken while what follows it is being fetched.
        let wasted =
            step.is_taken_branch() && straddles(step.pc + step.bytes, step.following_bytes);
        self.class(step) + if wasted { self.straddle } else { 0 }
    }

    #[inline]
    fn class(&self, step: &Step) -> u32 {
        match step.op {
            Op::Lb { .. } | Op::Lh { .. } | Op::Lw { .. } | Op::Lbu { .. } | Op::Lhu { .. } => {
                self.load
            }
            Op::Sb { .. } | Op::Sh { .. } | Op::Sw { .. } => self.store,
            Op::Beq { .. }
            | Op::Bne { .. }
            | Op::Blt { .. }
            | Op::Bge { .. }
            | Op::Bltu { .. }
            | Op::Bgeu { .. } => {
                if step.is_taken_branch() {
                    self.branch_taken
                } else {
                    self.branch_not_taken
                }
            }
            Op::Jal { .. } => self.jump,
            Op::Jalr { .. } => self.jump_indirect,
            Op::Mul { .. } | Op::Mulh { .. } | Op::Mulhsu { .. } | Op::Mulhu { .. } => {
                self.multiply
            }
            Op::Div { .. } | Op::Divu { .. } | Op::Rem { .. } | Op::Remu { .. } => self.divide,
            Op::Csrrw { .. }
            | Op::Csrrs { .. }
            | Op::Csrrc { .. }
            | Op::Csrrwi { .. }
            | Op::Csrrsi { .. }
            | Op::Csrrci { .. } => self.counter,
            _ => self.alu,
        }
    }
}

/// Whether an instruction lies in two words of memory.
#[inline]
const fn straddles(pc: u32, bytes: u32) -> bool {
    pc % 4 + bytes > 4
}

#[cfg(test)]
mod tests {
    use super::*;

    const COSTS: Costs = Costs::PICORV32;

    fn step(op: Op, bytes: u32, pc: u32, next: u32) -> Step {
        Step { op, pc, bytes, following_bytes: 2, next }
    }

    #[test]
    fn a_branch_costs_by_where_it_went() {
        let branch = Op::Beq { rs1: 1, rs2: 2, b_imm: -16 };
        let to = |bytes, next| COSTS.of(&step(branch, bytes, 0x100, next));
        assert_eq!(to(4, 0xf0), COSTS.branch_taken);
        assert_eq!(to(4, 0x104), COSTS.branch_not_taken);
        assert_eq!(to(2, 0x102), COSTS.branch_not_taken);
    }

    #[test]
    fn a_taken_branch_pays_for_the_straddling_instruction_behind_it() {
        let branch = Op::Beq { rs1: 1, rs2: 2, b_imm: -16 };
        let with = |bytes, following_bytes, next| {
            COSTS.of(&Step { following_bytes, ..step(branch, bytes, 0x100, next) })
        };
        assert_eq!(with(2, 4, 0xf0), COSTS.branch_taken + 1);
        assert_eq!(with(2, 2, 0xf0), COSTS.branch_taken);
        assert_eq!(with(4, 4, 0xf0), COSTS.branch_taken);
        assert_eq!(with(2, 4, 0x102), COSTS.branch_not_taken);
    }

    #[test]
    fn classes_are_told_apart() {
        let of = |op: Op| COSTS.of(&step(op, 4, 0, 4));
        assert_eq!(of(Op::Lw { rd: 1, rs1: 2, i_imm: 0 }), COSTS.load);
        assert_eq!(of(Op::Sb { rs1: 1, rs2: 2, s_imm: 0 }), COSTS.store);
        assert_eq!(of(Op::Mulhu { rd: 1, rs1: 2, rs2: 3 }), COSTS.multiply);
        assert_eq!(of(Op::Remu { rd: 1, rs1: 2, rs2: 3 }), COSTS.divide);
        assert_eq!(of(Op::Csrrs { rd: 1, rs1: 0, csr: 0xc00 }), COSTS.counter);
        assert_eq!(of(Op::Addi { rd: 1, rs1: 2, i_imm: 0 }), COSTS.alu);
    }

    #[test]
    fn only_a_long_instruction_in_the_middle_of_a_word_straddles() {
        let at = |bytes, pc| COSTS.fetch(pc, bytes);
        assert_eq!([at(2, 0), at(2, 2), at(4, 0), at(4, 2)], [0, 0, 0, 1]);
    }
}
