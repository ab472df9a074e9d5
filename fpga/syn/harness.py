"""Surrounds any unit with registers, so that nextpnr times every path into and out of it, and so that it
needs six pins however wide it is: inputs come from a shift register; outputs are loaded into another and
shifted out.
"""

import re


def ports(listing):
    """Name, direction and width of each port, of what yosys' `portlist` prints."""
    pattern = r"\b(input|output)\s+(?:\[(\d+):0\]\s+)?(\w+)"
    return [(name, way, int(high or 0) + 1) for way, high, name in re.findall(pattern, listing)]


def text(module, of_ports):
    """The harness of a module whose clock is clk_i and whose reset is rst_ni."""
    inputs = [(n, w) for n, way, w in of_ports if way == "input" and n not in ("clk_i", "rst_ni")]
    outputs = [(n, w) for n, way, w in of_ports if way == "output"]
    connections = [".clk_i(clk_i)"] + [".rst_ni(rst_ni)"] * ("rst_ni" in (n for n, _, _ in of_ports))
    for bits, some in (("in_q", inputs), ("out", outputs)):
        at = 0
        for name, width in some:
            connections.append(f".{name}({bits}[{at}+:{width}])")
            at += width
    in_width, out_width = (sum(width for _, width in some) for some in (inputs, outputs))
    joined = ",\n      ".join(connections)
    return f"""module xy_harness (
    input  logic clk_i,
    input  logic rst_ni,
    input  logic shift_i,
    input  logic data_i,
    input  logic load_i,
    output logic data_o
);
  logic [{in_width - 1}:0]  in_q;
  logic [{out_width - 1}:0] out, out_q;

  always_ff @(posedge clk_i) begin
    if (shift_i) in_q <= {{in_q, data_i}};
    if (load_i) out_q <= out;
    else out_q <= {{out_q, 1'b0}};
  end
  assign data_o = out_q[{out_width - 1}];

  {module} u_unit (
      {joined}
  );
endmodule
"""
