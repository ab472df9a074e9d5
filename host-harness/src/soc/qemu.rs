//! QEMU's `virt` machine, counting one cycle for each instruction.

use std::path::Path;
use std::process::{Command, Stdio};

use xylem_firmware::map::EXTERNAL;

use super::{End, Engine, Options, Ran, SocError, process};

const QEMU: &str = "qemu-system-riscv32";

/// Whether QEMU is installed.
pub(super) fn check() -> Result<(), SocError> {
    let mut command = Command::new(QEMU);
    command.arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        _ => Err(SocError::ToolMissing {
            engine: Engine::Qemu,
            tool: QEMU.into(),
            hint: "install Debian's qemu-system-misc or the like".into(),
        }),
    }
}

/// Runs a program until it powers off or exceeds the limits. A crash that the program does not
/// catch by itself is a time-out here.
pub(super) fn run(elf: &Path, blob: &[u8], options: &Options) -> Result<Ran, SocError> {
    check()?;
    if options.accelerator.is_some() {
        return Err(SocError::NoAccelerator { engine: Engine::Qemu });
    }
    let folder = process::Folder::new("qemu")?;
    let blob = folder.write("scene.blob", blob)?;
    let mut command = Command::new(QEMU);
    command
        .args(["-machine", "virt", "-m", "64M", "-bios", "none", "-icount", "shift=0"])
        .args(["-display", "none", "-monitor", "none", "-serial", "stdio"])
        .arg("-kernel")
        .arg(elf)
        .arg("-device")
        // QEMU splits at commas; a comma in a path is written twice.
        .arg(format!(
            "loader,file={},addr={},force-raw=on",
            blob.display().to_string().replace(',', ",,"),
            EXTERNAL.base
        ));
    let finished = process::run(&mut command, options.time)?;
    let end = match finished.status.map(|status| (status.code(), status)) {
        None => End::TimeOut(options.time),
        // The power switch's failure code is QEMU's exit code. QEMU's own complaints come on its
        // standard error and end it with 1 before the program logs anything.
        Some((Some(1), _)) if finished.stdout.is_empty() => {
            End::Crash(format!("QEMU said: {}", finished.stderr.trim()))
        }
        Some((Some(code @ 0..=255), _)) => End::PowerOff { code: code as u8 },
        Some((_, status)) => {
            End::Crash(format!("QEMU ended with {status}: {}", finished.stderr.trim()))
        }
    };
    Ok(Ran {
        uart: finished.stdout,
        end,
        instructions: None,
        cycles: None,
        external: None,
        time: finished.time,
    })
}
