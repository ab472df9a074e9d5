//! Hands the linker script to the linker when the target is the soft core.

fn main() {
    println!("cargo::rerun-if-changed=link.x");
    if std::env::var("CARGO_CFG_TARGET_ARCH").as_deref() == Ok("riscv32") {
        let folder = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
        // By its path: the firmware has a script of the same name.
        println!("cargo::rustc-link-arg-bins=-T{folder}/link.x");
    }
}
