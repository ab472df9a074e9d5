"""The rows of units.toml: modules, their parameters, and what is expected of them."""

import hashlib
import math
import pathlib
import re
import tomllib

HERE = pathlib.Path(__file__).parent
RTL = HERE.parent / "rtl"


class Row:
    """One module in one configuration."""

    def __init__(self, name, unit, config, values):
        self.name, self.unit, self.config = name, unit, config
        self.key = f"{name}/{config}"
        self.module = f"xy_{name}"
        given = unit.get("parameters")
        if given is None:
            self.parameters = {parameter(key): value for key, value in values.items()}
        else:
            self.parameters = {key: product(text, values) for key, text in given.items()}

    def files(self):
        """Source files, each after those it uses."""
        lines = (RTL / f"{self.name}.f").read_text().splitlines()
        return [RTL / line for line in lines if line.endswith(".sv")]

    def hash(self):
        """Tells different sources and parameters apart; comments and assertions don't count."""
        text = [str(sorted(self.parameters.items()))]
        for file in self.files():
            source = re.sub(r"`ifndef SYNTHESIS.*?`endif", "", file.read_text(), flags=re.S)
            source = re.sub(r"//[^\n]*", "", source)
            text.append(" ".join(source.split()))
        return hashlib.sha256("\n".join(text).encode()).hexdigest()[:12]

    def misses(self, result):
        """What is wrong with a result, as a list of sentences."""
        wrong = []
        for kind, cell in (("distributed", "TRELLIS_DPR16X4"), ("block", "DP16KD")):
            wanted = self.unit.get(kind, {}).get(self.config)
            found = result["cells"].get(cell, 0)
            if wanted is not None and found != wanted:
                wrong.append(f"{self.key}: {found} {kind} memories, {wanted} expected")
        floor = self.unit.get("floor_mhz", {}).get(self.config, 0)
        if result["fmax"] < floor:
            wrong.append(f"{self.key}: {result['fmax']:.1f} MHz, below the floor of {floor} MHz")
        return wrong


def parameter(key):
    """The parameter that a value of configs.toml is for: key_bits is KeyWidth."""
    return re.sub("Bits$", "Width", "".join(word.title() for word in key.split("_"))) if "_" in key else key.title()


def product(text, values):
    """A number, a value, or a product of them."""
    factors = [factor.strip() for factor in str(text).split("*")]
    return math.prod(int(f) if f.isdigit() else values[f] for f in factors)


def rows():
    """Every row, in the order of units.toml."""
    configs = tomllib.loads((RTL / "configs.toml").read_text())
    found = []
    for name, unit in tomllib.loads((HERE / "units.toml").read_text()).items():
        table = configs[unit.get("of", name)]
        for config in unit["configs"]:
            found.append(Row(name, unit, config, table[config]))
    return found
