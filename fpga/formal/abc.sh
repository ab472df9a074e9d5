#!/bin/sh
# Debian's ABC for SymbiYosys, which asks for an option that this version's pdr has not: its log is
# longer without.
exec berkeley-abc "$1" "$(printf '%s' "$2" | sed 's/pdr -v -l/pdr -v/')"
