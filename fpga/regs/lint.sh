#!/usr/bin/env bash
# Lints the generated register block with Verilator. Every waiver is argued in rtl/gen/xy_regs.vlt.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

need_apt verilator

gen=fpga/rtl/gen
verilator --lint-only -Wall $gen/xy_regs.vlt $gen/xy_regs_pkg.sv $gen/xy_regs.sv
echo "register block: lint is clean"
