//! The generated register block under Verilator keeps what the generated metadata promise.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use xylem_regs::*;

/// A running simulation of the register block, out of reset.
struct Block {
    process: Child,
    commands: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Block {
    fn ask(&mut self, command: &str) -> String {
        let commands = self.commands.as_mut().expect("open until dropped");
        writeln!(commands, "{command}").and_then(|()| commands.flush()).expect("simulation runs");
        let mut answer = String::new();
        self.answers.read_line(&mut answer).expect("simulation answers");
        answer.trim().to_owned()
    }

    /// The value read, or `None` for a bus error.
    fn read(&mut self, offset: u32) -> Option<u32> {
        u32::from_str_radix(&self.ask(&format!("r {offset:x}")), 16).ok()
    }

    /// How many cycles `ctrl.start` was high, or `None` for a bus error.
    fn write(&mut self, offset: u32, value: u32) -> Option<u32> {
        self.ask(&format!("w {offset:x} {value:x}")).strip_prefix("ok ")?.parse().ok()
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        self.commands = None; // The end of its input ends the simulation.
        let _ = self.process.wait();
    }
}

/// Builds the simulation, or says why `test` is skipped.
fn block(test: &str) -> Option<Block> {
    if Command::new("verilator").arg("--version").output().is_err() {
        let message = format!("skipped: {test}: verilator is missing; apt-get install verilator");
        assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{message}");
        println!("{message}");
        return None;
    }
    let regs = Path::new(env!("CARGO_MANIFEST_DIR"));
    let generated = regs.join("../rtl/gen");
    let build = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    let output = Command::new("verilator")
        .args(["--cc", "--exe", "--build", "-Wall", "--assert", "--top-module", "xy_regs_tb"])
        .args(["-O1", "-CFLAGS", "-O1", "--Mdir"])
        .arg(&build)
        .args(["xy_regs.vlt", "xy_regs_pkg.sv", "xy_regs.sv"].map(|file| generated.join(file)))
        .args([regs.join("tests/rtl/xy_regs_tb.vlt"), regs.join("tests/rtl/xy_regs_tb.sv")])
        .arg(regs.join("tests/rtl/xy_regs_tb.cpp"))
        .output()
        .expect("verilator starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut process = Command::new(build.join("Vxy_regs_tb"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the simulation starts");
    let commands = process.stdin.take();
    let answers = BufReader::new(process.stdout.take().expect("piped"));
    Some(Block { process, commands, answers })
}

fn held(register: &RegisterInfo) -> u32 {
    register.mask(|access| access == Access::ReadWrite)
}

/// One test, as building the simulation takes longer than running it.
#[test]
fn the_register_block_keeps_what_the_metadata_promise() {
    let Some(mut block) = block("the_register_block_keeps_what_the_metadata_promise") else {
        return;
    };

    for register in &REGISTERS {
        let found = block.read(register.offset);
        assert_eq!(found, Some(register.reset), "{} after reset", register.path);
    }
    for hole in (0..512).step_by(4).filter(|&offset| RegisterInfo::at(offset).is_none()) {
        assert_eq!((block.read(hole), block.write(hole, 0)), (None, None), "hole at {hole:#x}");
    }

    // All bits that hold a value hold ones, then zeros; the others do not care.
    for (bits, word) in [(u32::MAX, "ones"), (0, "zeros")] {
        for register in REGISTERS.iter().filter(|r| r.offset != CTRL.offset()) {
            let RegisterInfo { path, offset, reset, .. } = *register;
            let taken = block.write(offset, bits).is_some();
            assert_eq!(taken, register.writable() != 0, "{path}: writing {word}");
            let expected = (reset & !held(register)) | (bits & held(register));
            assert_eq!(block.read(offset), Some(expected), "{path}: {word} read back");
        }
    }

    // While busy, what is locked keeps its value and the rest does not.
    block.ask("b 1");
    for register in REGISTERS.iter().filter(|r| held(r) != 0 && r.offset != CTRL.offset()) {
        block.write(register.offset, u32::MAX).expect("a locked write is no error");
        let expected = held(register) & !register.locked();
        assert_eq!(block.read(register.offset), Some(expected), "{} while busy", register.path);
    }
    assert_eq!(block.read(STATUS.offset()), Some(1));
    block.ask("b 0");

    // A start is one pulse, remembers the job, and reads as 0.
    let start = Ctrl::RESET.with_job(JobKind::Trace).with_start(true);
    assert_eq!(block.write(CTRL.offset(), start.bits()), Some(1));
    assert_eq!(block.read(CTRL.offset()), Some(start.with_start(false).bits()));
    block.ask("b 1");
    assert_eq!(block.write(CTRL.offset(), 0), Some(0));
    assert_eq!(block.read(CTRL.offset()), Some(start.with_start(false).bits()), "ctrl while busy");
    block.ask("b 0");

    // An event stays until 1 is written to it; only an enabled one raises the line.
    block.write(INT_ENABLE.offset(), 0);
    block.ask("d");
    assert_eq!((block.read(INT_STATUS.offset()), block.ask("i").as_str()), (Some(1), "0"));
    block.write(INT_ENABLE.offset(), 1);
    assert_eq!(block.ask("i"), "1");
    block.write(INT_STATUS.offset(), 0b10);
    assert_eq!(block.ask("i"), "1", "clearing another event");
    block.write(INT_STATUS.offset(), 0b01);
    assert_eq!((block.read(INT_STATUS.offset()), block.ask("i").as_str()), (Some(0), "0"));
}
