// The place of a child from its decoded box on its parent's grid (P3 Eq. 2): its own grid is the finest on
// which the box spans at most 2^Bits cells, but no finer than MinScale.
//
// Handshake   none: combinational.
// Latency     0; the highest bit of a width, then shifts.
// Cut paths   none.
module xy_child #(
    parameter int unsigned Bits     = 6,
    parameter int unsigned MinScale = 0
) (
    input  xy_pkg::place_t place_i,  // of the parent
    input  xy_pkg::cells_t cells_i,
    output xy_pkg::place_t place_o
);

  localparam int unsigned C = xy_pkg::CoordWidth;
  localparam int unsigned Q = xy_pkg::MaxQuant;

  logic [2:0][Q:0]   less_one;
  logic [2:0]        any;
  logic [2:0][2:0]   top_bit;
  logic [2:0][3:0]   room;     // powers of two that the width leaves
  logic [2:0][4:0]   limit, finer;
  logic [2:0][C-1:0] offset;

  for (genvar axis = 0; axis < 3; axis++) begin : gen_axis
    assign less_one[axis] = cells_i.width[axis] - 1'b1;
    xy_msb #(.Width(Q)) u_top (
        .bits_i (less_one[axis][Q-1:0]),
        .any_o  (any[axis]),
        .index_o(top_bit[axis])
    );
  end

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      room[axis]  = any[axis] ? 4'(Bits - 1) - {1'b0, top_bit[axis]} : 4'(Bits);
      limit[axis] = (place_i.scale[axis] > 5'(MinScale)) ? place_i.scale[axis] - 5'(MinScale)
          : 5'd0;
      finer[axis] = (5'(room[axis]) < limit[axis]) ? 5'(room[axis]) : limit[axis];

      offset[axis] = C'(cells_i.low[axis]) << place_i.scale[axis];

      place_o.scale[axis] = place_i.scale[axis] - finer[axis];
      place_o.cells[axis] = cells_i.width[axis] << finer[axis];
      place_o.lower[axis] = place_i.lower[axis] + offset[axis];
    end
  end

  logic unused_bits;
  assign unused_bits = ^{less_one[0][Q], less_one[1][Q], less_one[2][Q], place_i.cells};

endmodule
