#!/usr/bin/env bash
# Breaks each stage of tests/run.sh on purpose, in a copy of the committed sources, and checks that
# the stage then fails.
#
#   tests/mutations.sh            all stages
#   tests/mutations.sh STAGE...   only these
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/tools.sh"
cd "$XYLEM_ROOT"

# stage, what is broken, file, sed expression
mutations=(
    "format|a line is indented wrongly|core-nostd/src/lib.rs|s/^pub mod compress;/ pub mod compress;/"
    "clippy|a value is never used|host-harness/src/lib.rs|\$a fn unused() {}"
    "docs|a link leads nowhere|core-nostd/src/lib.rs|1a //! [\`NoSuchItem\`]"
    "tests|the emitter combines too late|core-nostd/src/emit/hierarchy.rs|s/top.level <= pending.level/top.level >= pending.level/"
    "no-std|the core wants std|core-nostd/src/lib.rs|s/^#!\[no_std\]/#![no_std]\nextern crate std;/"
    "firmware|times round down on the soft core only|core-nostd/src/geom/triangle.rs|s/let up = i128::from(/let up = i128::from(!cfg!(target_arch = \"riscv32\") \&\& /"
    "proof|a repaired upper bound keeps its cell|tests/proof/lemmas.py|s/q < (end \/ cell + 1) \* cell/q < (end \/ cell) * cell/"
    "registers|the source has another magic number|fpga/regs/xylem.rdl|s/0x58594C4D/0x58594C4E/"
    "lint|a signal is never used|fpga/rtl/xy_heap.sv|s/^endmodule/  logic stray;\n  assign stray = op_valid_i;\nendmodule/"
    "cosim|the higher of two children rises|fpga/rtl/xy_heap_stage.sv|s/.a_i(right_i), .b_i(left_i)/.a_i(left_i), .b_i(right_i)/"
    "synthesis|a memory can be reset, so it is none|fpga/rtl/xy_ram.sv|s/if (write_i) mem\[write_addr_i\] <= write_data_i;/if (write_i) for (int i = 0; i < 2**AddrWidth; i++) mem[i] <= write_data_i;/"
    "demo|the report gets another name|host-harness/src/cli/demo.rs|s/index\.html/index.htm/"
)

copy=$XYLEM_ROOT/target/mutant
caught=0 missed=()
for mutation in "${mutations[@]}"; do
    IFS='|' read -r stage what file expression <<<"$mutation"
    [ $# -eq 0 ] || printf '%s\n' "$@" | grep -qx -- "$stage" || continue
    rm -rf "$copy" && mkdir -p "$copy"
    git archive HEAD | tar -x -C "$copy"
    ln -s "$XYLEM_ROOT/target" "$copy/target"
    sed -i "$expression" "$copy/$file"
    if git diff --no-index --quiet "$file" "$copy/$file"; then
        echo "mutations: $stage: the mutation no longer applies to $file" >&2
        missed+=("$stage")
    elif "$copy/tests/run.sh" "$stage" >"$XYLEM_ROOT/target/logs/mutant-$stage.log" 2>&1; then
        echo "$stage: NOT caught: $what"
        missed+=("$stage")
    else
        echo "$stage: caught: $what"
        caught=$((caught + 1))
    fi
done
rm -rf "$copy"
echo "mutations: $caught passed, ${#missed[@]} failed"
[ ${#missed[@]} -eq 0 ]
