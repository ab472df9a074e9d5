// The box of a triangle of 40 bytes in memory, and whether it is a primitive: all its vertices on the grid.
// Its primitive is its position, which is given; what identifier it has is its owner's business.
//
// Latency     none. Throughput  one record a cycle. Cut paths  none.
module xy_unpack_triangle (
    input  logic [xy_pkg::TriangleBits-1:0] bytes_i,
    input  logic [31:0]                     index_i,
    output xy_pkg::record_t                 record_o,
    output logic                            valid_o
);

  localparam int unsigned W = xy_pkg::CoordWidth;

  // x, y and z of each vertex
  logic [8:0][31:0]     words;
  logic [8:0]           on_grid;
  logic [2:0][W-1:0]    lo, hi;
  assign words = bytes_i[287:0];

  for (genvar i = 0; i < 9; i++) begin : gen_word
    // All bits above a coordinate are its sign.
    assign on_grid[i] = (words[i][31:W-1] == '0) || (words[i][31:W-1] == '1);
  end
  for (genvar i = 0; i < 3; i++) begin : gen_axis
    logic signed [W-1:0] a, b, c, low, high;
    assign a     = words[i][W-1:0];
    assign b     = words[i+3][W-1:0];
    assign c     = words[i+6][W-1:0];
    assign low   = (a < b) ? a : b;
    assign high  = (a < b) ? b : a;
    assign lo[i] = (c < low) ? c : low;
    assign hi[i] = (c > high) ? c : high;
  end

  assign record_o.prim = index_i;
  assign record_o.box  = {hi, lo};
  assign valid_o       = (&on_grid) && !index_i[31];

  // The identifier is not read.
  logic unused_rest;
  assign unused_rest = ^bytes_i[319:288];

endmodule
