// The smallest box around two boxes.
//
// Handshake   none: combinational.
// Latency     0; a comparison and a choice for each of six coordinates.
// Cut paths   none.
module xy_union (
    input  xy_pkg::box_t a_i,
    input  xy_pkg::box_t b_i,
    output xy_pkg::box_t box_o
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  logic [2:0][C-1:0] lo_a, lo_b, hi_a, hi_b, lo, hi;
  assign {hi_a, lo_a} = a_i;
  assign {hi_b, lo_b} = b_i;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      lo[axis] = $signed(lo_a[axis]) < $signed(lo_b[axis]) ? lo_a[axis] : lo_b[axis];
      hi[axis] = $signed(hi_a[axis]) < $signed(hi_b[axis]) ? hi_b[axis] : hi_a[axis];
    end
  end

  assign box_o = {hi, lo};

endmodule
