#!/usr/bin/env bash
# The firmware on the soft core.
#
#   tests/firmware.sh build   builds it; prints the path of the ELF file
#   tests/firmware.sh core    checks that the core alone builds for a target without std
#   tests/firmware.sh tools   installs QEMU, Verilator and PicoRV32's Verilog
#   tests/firmware.sh custom  builds the program for VexRiscv with custom instructions and installs that core's
#                             Verilog; prints the program's path
#   tests/firmware.sh run     builds, installs, and compares its digests with the host's on all engines
#
# XYLEM_RISCV_TOOLCHAIN=rustup or debian chooses the compiler; by default rustup's target is used if
# it is there or can be added, and Debian's packages otherwise.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/tools.sh"
cd "$XYLEM_ROOT"

target=riscv32imc-unknown-none-elf
folder=$XYLEM_ROOT/target/riscv

# Runs cargo for the soft core with whichever toolchain there is.
riscv_cargo() {
    case ${XYLEM_RISCV_TOOLCHAIN:=$(choose_toolchain)} in
    rustup)
        cargo "$@" --target "$target" --target-dir "$folder"
        ;;
    debian)
        need_apt rustc-web cargo-web rust-web-src rust-web-llvm lld || return 1
        RUSTC_BOOTSTRAP=1 RUSTC=/usr/bin/rustc \
            CARGO_TARGET_RISCV32IMC_UNKNOWN_NONE_ELF_LINKER=ld.lld \
            CARGO_TARGET_RISCV32IM_UNKNOWN_NONE_ELF_LINKER=ld.lld \
            /usr/bin/cargo "$@" -Z build-std=core --target "$target" --target-dir "$folder-debian"
        ;;
    *)
        echo "firmware: XYLEM_RISCV_TOOLCHAIN is rustup or debian, not $XYLEM_RISCV_TOOLCHAIN" >&2
        return 2
        ;;
    esac
}

choose_toolchain() {
    if command -v rustup >/dev/null &&
        { rustup target list --installed 2>/dev/null | grep -qx "$target" ||
            timeout 120 rustup target add "$target" >/dev/null 2>&1; }; then
        echo rustup
    else
        echo debian
    fi
}

# Builds a program and prints its path.
build() {
    export DEFMT_LOG=${DEFMT_LOG:-info}
    riscv_cargo build --quiet --release --locked -p "$1" --features device >&2
    local built=$folder
    [ "$XYLEM_RISCV_TOOLCHAIN" = rustup ] || built=$folder-debian
    echo "$built/$target/release/$1"
}

tools() {
    need_apt qemu-system-misc verilator g++ make
    need_pip pythondata-cpu-picorv32==1.0.post218
}

case ${1:-} in
build) build xylem-firmware ;;
custom)
    # VexRiscv with a custom function port takes no compressed instructions.
    target=riscv32im-unknown-none-elf
    need_pip pythondata-cpu-vexriscv==1.0.1.post407
    build xylem-custom
    ;;
core) riscv_cargo check --quiet --release --locked -p xylem-core ;;
tools) tools ;;
run)
    tools
    XYLEM_FIRMWARE=$(build xylem-firmware)
    export XYLEM_FIRMWARE XYLEM_REQUIRE_TOOLS=1
    cargo test --quiet --locked -p xylem --test soc --test accelerator -- --nocapture
    ;;
*)
    sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
    exit 2
    ;;
esac
