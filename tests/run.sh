#!/usr/bin/env bash
# Runs every check of the project and installs what they need.
#
#   tests/run.sh              all stages
#   tests/run.sh STAGE...     only these
#   tests/run.sh --list       what the stages are
#
# Stages run in order and all of them run, also after one has failed; the exit code is 1 if any did.
# XYLEM_SCENES and XYLEM_ORACLE may name folders with meshes and reference hits; tests that want them
# and find none say so.
set -uo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/tools.sh"
cd "$XYLEM_ROOT"
export XYLEM_REQUIRE_TOOLS=1 CARGO_TERM_COLOR=${CARGO_TERM_COLOR:-auto}
# Everything is built once here; what would make the next build quicker fills gigabytes.
export CARGO_INCREMENTAL=${CARGO_INCREMENTAL:-0}

# name, what it promises, command
stages=(
    "format|sources are formatted|cargo fmt --all --check"
    "tools|the external tools are there|install_tools"
    "clippy|no lint is broken|cargo clippy --quiet --workspace --all-targets -- -D warnings"
    "docs|documentation builds and its links hold|build_docs"
    "no-std|the core builds alone for a target without std|tests/firmware.sh core"
    "firmware|simulator, QEMU and PicoRV32 agree with the host|tests/firmware.sh run"
    # After the firmware, which some of them run.
    "tests|unit, property and differential tests pass|run_tests"
    "proof|a solver proves the lemmas of watertightness at any width|prove_lemmas"
    "registers|generated registers are current, and the RTL keeps them|check_registers"
    "lint|the RTL is clean in Verilator and yosys|fpga/rtl/lint.sh"
    "formal|proofs about the RTL hold, and each can fail|fpga/formal/run.sh"
    "cosim|RTL and cycle models agree in every cycle|run_cosim"
    "synthesis|small units place and route|fpga/syn/run.sh --smoke"
    "demo|the main job runs and leaves its report|run_demo"
)

# Tests that a stage of their own runs.
elsewhere=(gives_the_host_s_digests the_register_block_keeps)

install_tools() {
    need_apt verilator g++ make qemu-system-misc
}

build_docs() {
    RUSTDOCFLAGS="-D warnings" cargo doc --quiet --workspace --no-deps --exclude xylem-peers
}

run_tests() {
    XYLEM_FIRMWARE=$(tests/firmware.sh build) || return 1
    export XYLEM_FIRMWARE
    cargo test --quiet --no-fail-fast --workspace --exclude xylem-peers --exclude xylem-cosim -- \
        --nocapture "${elsewhere[@]/#/--skip=}"
}

# By their names, not by package: cargo then finds everything built as the stage before left it. The tests of the
# whole accelerator run beside those of the units, as most of their time they use one core.
run_cosim() {
    local file name whole=() units=() log=target/logs/cosim-whole.log failed=0
    XYLEM_CUSTOM=$(tests/firmware.sh custom) || return 1
    export XYLEM_CUSTOM
    for file in fpga/cosim/tests/*.rs; do
        name=$(basename "$file" .rs)
        case $name in
        end_to_end | top*) whole+=(--test "$name") ;;
        *) units+=(--test "$name") ;;
        esac
    done
    cargo test --quiet --no-run "${whole[@]}" "${units[@]}" || return 1
    cargo test --quiet --no-fail-fast "${whole[@]}" -- --nocapture >"$log" 2>&1 &
    cargo test --quiet --no-fail-fast "${units[@]}" -- --nocapture || failed=1
    wait $! || failed=1
    cat "$log"
    return $failed
}

prove_lemmas() {
    need_pip z3-solver==5.4.0.0 && python tests/proof/lemmas.py
}

check_registers() {
    fpga/regs/generate.sh --check && fpga/regs/lint.sh && cargo test --quiet --test rtl
}

# The README's first command, into a folder of its own.
run_demo() {
    local out=$XYLEM_ROOT/target/demo-report
    rm -rf "$out"
    cargo run --quiet --release -- --out "$out" && [ -s "$out/index.html" ]
}

list() {
    local stage name promise
    for stage in "${stages[@]}"; do
        IFS='|' read -r name promise _ <<<"$stage"
        printf '%-12s %s\n' "$name" "$promise"
    done
}

[ "${1:-}" = --list ] && { list; exit 0; }
for wanted in "$@"; do
    list | cut -d' ' -f1 | grep -qx -- "$wanted" || { echo "no stage '$wanted'; see --list" >&2; exit 2; }
done

mkdir -p target/logs
passed=0 failed=() start=$SECONDS
for stage in "${stages[@]}"; do
    IFS='|' read -r name promise command <<<"$stage"
    [ $# -eq 0 ] || printf '%s\n' "$@" | grep -qx -- "$name" || continue
    log=target/logs/$name.log began=$SECONDS
    printf '== %-12s %s\n' "$name" "$promise"
    if $command >"$log" 2>&1; then
        passed=$((passed + 1)) verdict=passed
        # What was covered, what was skipped, and what was measured.
        grep -hE '^(skipped:|test result:|[a-z0-9-]+: .*(cycles|equal|passed|proved))' "$log" | sort | uniq -c |
            sed -E 's/^ +1 /   /; s/^ +([0-9]+) /   \1 x /' | head -n 40
    else
        failed+=("$name") verdict=FAILED
        tail -n 60 "$log"
    fi
    printf '   %s in %d s (%s)\n' "$verdict" $((SECONDS - began)) "$log"
done

echo
[ ${#failed[@]} -eq 0 ] || printf 'failed: %s\n' "${failed[*]}"
echo "all stages took $((SECONDS - start)) s"
echo "stages: $passed passed, ${#failed[@]} failed"
[ ${#failed[@]} -eq 0 ]
