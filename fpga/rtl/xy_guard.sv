// The region check in front of the memory port: an access outside the region that its unit may use is
// not made.
//
// Handshake   valid_i with an address and the region's number; valid_o is valid_i inside the region.
//             Outside, violation_o is high as long as the request stands; it goes nowhere, and the control
//             takes the unit that made it out of work.
// Regions     base and end in lines; an end has a bit more, as it may be behind the last line of memory. A
//             region that ends where it begins is absent: no address is in it.
// Latency     0 cycles.
// Cut paths   none: valid_i, addr_i and region_i to valid_o and violation_o.
module xy_guard #(
    parameter int unsigned Regions = 8
) (
    input  logic [Regions-1:0][25:0]     base_i,
    input  logic [Regions-1:0][26:0]     end_i,

    input  logic                         valid_i,
    input  logic [31:0]                  addr_i,
    input  logic [$clog2(Regions)-1:0]   region_i,

    output logic                         valid_o,
    output logic                         violation_o
);

  logic [25:0] line;
  logic        allowed;
  assign line    = addr_i[31:6];
  assign allowed = (line >= base_i[region_i]) && ({1'b0, line} < end_i[region_i]);

  assign valid_o     = valid_i && allowed;
  assign violation_o = valid_i && !allowed;

  // A line is fetched or written whole.
  logic unused_offset;
  assign unused_offset = ^addr_i[5:0];

endmodule
