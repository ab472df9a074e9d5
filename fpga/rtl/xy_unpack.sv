// A record of 32 bytes in memory as the units hold it, and whether it is one: its box on the grid and not
// inverted, its primitive below 2^31.
//
// Latency     none. Throughput  one record a cycle. Cut paths  none.
module xy_unpack (
    input  logic [xy_pkg::RecordBits-1:0] bytes_i,
    output xy_pkg::record_t               record_o,
    output logic                          valid_o
);

  localparam int unsigned W = xy_pkg::CoordWidth;

  // lo.x, lo.y, lo.z, hi.x, hi.y, hi.z
  logic [5:0][31:0] words;
  logic [5:0]       on_grid;
  logic [2:0]       in_order;
  assign words = bytes_i[191:0];

  assign record_o.prim = bytes_i[223:192];
  assign record_o.box  = {words[5][W-1:0], words[4][W-1:0], words[3][W-1:0],
                          words[2][W-1:0], words[1][W-1:0], words[0][W-1:0]};

  for (genvar i = 0; i < 6; i++) begin : gen_word
    // All bits above a coordinate are its sign.
    assign on_grid[i] = (words[i][31:W-1] == '0) || (words[i][31:W-1] == '1);
  end
  for (genvar i = 0; i < 3; i++) begin : gen_axis
    assign in_order[i] = $signed(words[i]) <= $signed(words[i+3]);
  end

  assign valid_o = (&on_grid) && (&in_order) && !bytes_i[223];

  // The last word is not read.
  logic unused_rest;
  assign unused_rest = ^bytes_i[255:224];

endmodule
