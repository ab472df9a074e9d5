// The region check in front of memory: an access outside the region that its unit may use is not made.
//
// Handshake   none: allowed_o says whether line_i is inside the region; what is not allowed goes nowhere, and the
//             control takes the unit that asked for it out of work.
// Regions     base and end in lines; an end has a bit more, as it may be behind the last line of memory. A
//             region that ends where it begins is absent: no address is in it.
// Latency     0 cycles.
// Cut paths   none.
module xy_guard #(
    parameter int unsigned Regions = 8
) (
    input  logic [Regions-1:0][25:0]   base_i,
    input  logic [Regions-1:0][26:0]   end_i,

    input  logic [25:0]                line_i,
    input  logic [$clog2(Regions)-1:0] region_i,
    output logic                       allowed_o
);

  assign allowed_o = (line_i >= base_i[region_i]) && ({1'b0, line_i} < end_i[region_i]);

endmodule
