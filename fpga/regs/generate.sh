#!/usr/bin/env bash
# Generates everything that follows from xylem.rdl.
#
#   fpga/regs/generate.sh            writes the committed outputs
#   fpga/regs/generate.sh --check    fails, with the difference, where a committed output is stale
#   fpga/regs/generate.sh --html     also writes browsable documentation to target/regs-html/
#
# Committed: fpga/rtl/gen/xy_regs.sv and xy_regs_pkg.sv, fpga/regs/src/map.rs, fpga/regs/registers.md.
# The HTML pages are 8 MiB, nearly all of it fonts, and therefore not committed.
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

need_pip peakrdl==1.5.0 peakrdl-regblock==1.3.1 peakrdl-html==2.12.2 systemrdl-compiler==1.33.0

source=fpga/regs/xylem.rdl
outputs=(fpga/rtl/gen/xy_regs.sv fpga/rtl/gen/xy_regs_pkg.sv fpga/regs/src/map.rs fpga/regs/registers.md)

# generate ROOT: writes all outputs below ROOT, which has the layout of the repository.
generate() {
    local root=$1
    mkdir -p "$root/fpga/rtl/gen" "$root/fpga/regs/src"
    peakrdl regblock "$source" -o "$root/fpga/rtl/gen" --module-name xy_regs --package-name xy_regs_pkg \
        --cpuif axi4-lite-flat --err-if-bad-addr --err-if-bad-rw --default-reset arst_n --type-style hier
    # yosys reads packed structs only. The members are plain vectors, so packing changes no meaning.
    sed -i 's/\bstruct {/struct packed {/' "$root"/fpga/rtl/gen/xy_regs{,_pkg}.sv
    python fpga/regs/exporters "$source" "$root/fpga/regs/src/map.rs" "$root/fpga/regs/registers.md"
    rustfmt --edition 2024 --config-path rustfmt.toml "$root/fpga/regs/src/map.rs"
}

case ${1-} in
--check)
    rm -rf target/regs-check
    generate target/regs-check
    stale=0
    for output in "${outputs[@]}"; do
        diff -u "$output" "target/regs-check/$output" || stale=1
    done
    if [ $stale -ne 0 ]; then
        echo "The outputs above are not what $source says. Run fpga/regs/generate.sh and commit them." >&2
        exit 1
    fi
    echo "register map: ${#outputs[@]} outputs are current"
    ;;
--html)
    generate .
    peakrdl html "$source" -o target/regs-html
    echo "browse target/regs-html/index.html"
    ;;
"")
    generate .
    ;;
*)
    echo "usage: fpga/regs/generate.sh [--check | --html]" >&2
    exit 2
    ;;
esac
