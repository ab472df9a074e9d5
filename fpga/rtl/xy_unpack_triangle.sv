// The box of a triangle of 40 bytes in memory, and whether it is a primitive: all its vertices on the grid.
// Its primitive is its position, which is given; what identifier it has is its owner's business.
// Or, with triangle_i low, a record that is given: it is chosen in the same step as the last corner, as no time
// is left for one of its own.
//
// Latency     none. Throughput  one record a cycle. Cut paths  none.
module xy_unpack_triangle (
    input  logic                            triangle_i,
    input  logic [xy_pkg::TriangleBits-1:0] bytes_i,
    input  logic [31:0]                     index_i,
    input  xy_pkg::record_t                 record_i,
    input  logic                            valid_i,
    output xy_pkg::record_t                 record_o,
    output logic                            valid_o
);

  localparam int unsigned W = xy_pkg::CoordWidth;

  // x, y and z of each vertex
  logic [8:0][31:0]     words;
  logic [8:0]           on_grid;
  logic [2:0][W-1:0]    lo, hi, given_lo, given_hi;
  assign words                = bytes_i[287:0];
  assign {given_hi, given_lo} = record_i.box;

  for (genvar i = 0; i < 9; i++) begin : gen_word
    // All bits above a coordinate are its sign.
    assign on_grid[i] = (words[i][31:W-1] == '0) || (words[i][31:W-1] == '1);
  end
  for (genvar i = 0; i < 3; i++) begin : gen_axis
    logic [W-1:0] a, b, c;
    logic [W-1:0] a_up, b_up, c_up;  // with 0 in the middle: what is compared without a sign needs carries only
    logic         ab, bc, ac;        // the first is below the second
    logic         low_c, high_c;
    assign a      = words[i][W-1:0];
    assign b      = words[i+3][W-1:0];
    assign c      = words[i+6][W-1:0];
    assign a_up   = {!a[W-1], a[W-2:0]};
    assign b_up   = {!b[W-1], b[W-2:0]};
    assign c_up   = {!c[W-1], c[W-2:0]};
    xy_less #(.Width(W)) u_ab (.a_i(a_up), .b_i(b_up), .less_o(ab));
    xy_less #(.Width(W)) u_bc (.a_i(b_up), .b_i(c_up), .less_o(bc));
    xy_less #(.Width(W)) u_ac (.a_i(a_up), .b_i(c_up), .less_o(ac));
    assign low_c  = ab ? !ac : !bc;
    assign high_c = ab ? bc : ac;
    assign lo[i]  = (low_c || !triangle_i) ? (triangle_i ? c : given_lo[i]) : (ab ? a : b);
    assign hi[i]  = (high_c || !triangle_i) ? (triangle_i ? c : given_hi[i]) : (ab ? b : a);
  end

  assign record_o.prim = triangle_i ? index_i : record_i.prim;
  assign record_o.box  = {hi, lo};
  assign valid_o       = triangle_i ? (&on_grid) && !index_i[31] : valid_i;

  // The identifier is not read.
  logic unused_rest;
  assign unused_rest = ^bytes_i[319:288];

endmodule
