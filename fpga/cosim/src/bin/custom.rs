//! What the inner steps take in software, as custom instructions and in the accelerator, for
//! `fpga/soc/custom.py`.

use std::process::ExitCode;

use xylem_cosim::custom::{self, CustomError, Machine};

const HELP: &str = "\
What the inner steps of building, tracing and compressing take on VexRiscv in software, there with the custom
instructions of xy_cfu, and in the accelerator's units.

usage: custom SCENE [SIDE]

  SCENE  as in `xylem scene list`; 256 triangles at least: the heap merges so many runs
  SIDE   the camera has SIDE x SIDE rays (default 12)

Prints the scene, then a line a step; cycles are those of one time:

  scene NAME TRIANGLES RAYS
  step NAME TIMES SOFTWARE CUSTOM ACCELERATOR

It needs the program and the core's Verilog, which `tests/firmware.sh custom` makes ready, and Verilator.
Exit code 1 if results differ or something is missing, 2 if the command is wrong.
";

/// Far more than a scene of ten thousand triangles takes.
const LIMIT: u64 = 4_000_000_000;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (name, side) = match arguments[..] {
        ["--help" | "-h", ..] => {
            print!("{HELP}");
            return ExitCode::SUCCESS;
        }
        [name] => (name, Some(12)),
        [name, side] => (name, side.parse().ok().filter(|side| (1..=1000).contains(side))),
        _ => ("", None),
    };
    let Some(side) = side else {
        eprint!("{HELP}");
        return ExitCode::from(2);
    };
    match print(name, side) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("custom: {error}");
            ExitCode::FAILURE
        }
    }
}

fn print(name: &str, side: u32) -> Result<(), CustomError> {
    let scene = custom::view(name, side)?;
    let rows = custom::compare(&Machine::new()?, &scene, LIMIT)?;
    println!("scene {name} {} {}", scene.triangles.len(), scene.rays.len());
    for custom::Row { step, count, software, custom, accelerator } in rows {
        let step = step.as_str();
        println!("step {step} {count} {software:.1} {custom:.1} {accelerator:.2}");
    }
    Ok(())
}
