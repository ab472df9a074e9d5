"""Generates gateware for a ULX3S with an LFE5U-85F: VexRiscv, SDRAM, UART, and Xylem on the bus.

    soft core ── Wishbone ──┬── registers of xy_top (AXI4-Lite)
                            └── SDRAM controller ──── xy_top's memory port (AXI4, DataWidth bits)

Called by build.sh. Xylem's memory port goes past the CPU's caches: there is no second-level cache, and
software has to flush the first level's after a job.
"""

import pathlib
import tomllib

from litedram.frontend.axi import LiteDRAMAXI2Native
from litex.gen import LiteXModule
from litex.soc.integration.builder import Builder
from litex.soc.integration.soc import SoCRegion
from litex.soc.interconnect import axi
from litex.soc.interconnect.csr_eventmanager import EventManager, EventSourceLevel
from litex_boards.platforms import radiona_ulx3s
from litex_boards.targets.radiona_ulx3s import BaseSoC
from migen import ClockSignal, Constant, Instance, ResetSignal

RTL = pathlib.Path(__file__).resolve().parent.parent / "rtl"

REGISTERS = 0xB000_0000  # of Xylem; uncached, as all above 0x8000_0000
REGISTER_BYTES = 512
ID_BITS = 4


class Xylem(LiteXModule):
    """xy_top: registers, memory port, interrupt."""

    def __init__(self, platform, values):
        data_bits = values["data_bits"]
        self.registers = axi.AXILiteInterface(data_width=32, address_width=32)
        self.memory = axi.AXIInterface(data_width=data_bits, address_width=32, id_width=ID_BITS)
        self.ev = EventManager()
        self.ev.job = EventSourceLevel(description="A job has ended.")
        self.ev.finalize()

        pins = {"i_clk_i": ClockSignal("sys"), "i_rst_ni": ~ResetSignal("sys"), "o_irq_o": self.ev.job.trigger}
        pins |= channel("s_axil", "aw", self.registers.aw, to_xylem=True, fields=["addr"])
        pins |= channel("s_axil", "w", self.registers.w, to_xylem=True, fields=["data", "strb"])
        pins |= channel("s_axil", "b", self.registers.b, to_xylem=False, fields=["resp"])
        pins |= channel("s_axil", "ar", self.registers.ar, to_xylem=True, fields=["addr"])
        pins |= channel("s_axil", "r", self.registers.r, to_xylem=False, fields=["data", "resp"])
        asked = ["id", "addr", "len", "size", "burst"]
        pins |= channel("m_axi", "ar", self.memory.ar, to_xylem=False, fields=asked)
        pins |= channel("m_axi", "r", self.memory.r, to_xylem=True, fields=["id", "data", "resp", "last"])
        pins |= channel("m_axi", "aw", self.memory.aw, to_xylem=False, fields=asked)
        pins |= channel("m_axi", "w", self.memory.w, to_xylem=False, fields=["data", "strb", "last"])
        pins |= channel("m_axi", "b", self.memory.b, to_xylem=True, fields=["id", "resp"])
        # The register block takes the low bits of an address.
        for name in ("i_s_axil_awaddr_i", "i_s_axil_araddr_i"):
            pins[name] = pins[name][:9]
        self.specials += Instance("xy_top", **parameters(values), **pins)

        for line in (RTL / "top.f").read_text().split():
            platform.add_source(str(RTL / line), language="systemverilog")


def channel(bus, name, stream, to_xylem, fields):
    """Pins of xy_top for one channel of a bus."""
    into, out_of = ("i", "o") if to_xylem else ("o", "i")
    side = "_i" if to_xylem else "_o"
    back = "_o" if to_xylem else "_i"
    pins = {
        f"{into}_{bus}_{name}valid{side}": stream.valid,
        f"{out_of}_{bus}_{name}ready{back}": stream.ready,
    }
    for field in fields:
        pins[f"{into}_{bus}_{name}{field}{side}"] = getattr(stream, field)
    return pins


def parameters(values):
    """Parameters of xy_top from a configuration, whose key data_bits is for DataWidth."""
    names = {key: "".join(word.title() for word in key.split("_")) for key in values}
    return {
        "p_" + (name[:-4] + "Width" if name.endswith("Bits") else name): Constant(values[key], 32)
        for key, name in names.items()
    }


class Soc(BaseSoC):
    """The board's system with Xylem in it."""

    def __init__(self, values, **kwargs):
        super().__init__(device="LFE5U-85F", **kwargs)
        self.xylem = Xylem(self.platform, values)
        self.bus.add_slave(
            "xylem", self.xylem.registers, region=SoCRegion(origin=REGISTERS, size=REGISTER_BYTES, cached=False)
        )
        self.irq.add("xylem", use_loc_if_exists=True)
        port = self.sdram.crossbar.get_port(data_width=values["data_bits"])
        self.xylem_memory = LiteDRAMAXI2Native(
            self.xylem.memory, port, base_address=self.bus.regions["main_ram"].origin
        )
        self.add_constant("XYLEM_BASE", REGISTERS)


def main():
    """Generates the system and, with --build, the bitstream."""
    # Not importable before the modules above.
    from litex.build.parser import LiteXArgumentParser

    parser = LiteXArgumentParser(platform=radiona_ulx3s.Platform, description=__doc__)
    parser.add_target_argument("--config", default="ecp5", help="Configuration of xy_top in configs.toml.")
    parser.add_target_argument("--sys-clk-freq", default=50e6, type=float, help="System clock in Hz.")
    parser.add_target_argument("--sdram-module", default="MT48LC16M16", help="SDRAM of the board.")
    args = parser.parse_args()
    values = tomllib.loads((RTL / "configs.toml").read_text())["top"][args.config]
    soc = Soc(
        values,
        sys_clk_freq=args.sys_clk_freq,
        sdram_module_cls=args.sdram_module,
        toolchain=args.toolchain,
        **parser.soc_argdict,
    )
    builder = Builder(soc, **parser.builder_argdict)
    if args.build:
        builder.build(**parser.toolchain_argdict)


main()
