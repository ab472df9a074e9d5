// A child's decoded box in cells of its parent's grid, from its code: see xy_encode.
//
// The width comes first, because it is never 0 and so has a unique value modulo 2^Bits.
//
// Handshake   none: combinational.
// Latency     0; a shift, additions and a comparison of a few bits.
// Cut paths   none.
module xy_decode #(
    parameter int unsigned Bits = 6
) (
    input  logic              modulo_i,
    input  xy_pkg::place_t    place_i,  // of the parent
    input  logic [6*Bits-1:0] code_i,
    output xy_pkg::cells_t    cells_o,
    output logic              ok_o      // the box is inside the parent's
);

  localparam int unsigned C = xy_pkg::CoordWidth;
  localparam int unsigned Q = xy_pkg::MaxQuant;

  logic [2:0][C-1:0]    base;
  logic [2:0][Bits-1:0] low, high, below;
  logic [2:0][Bits-1:0] less_one;  // the width, less one
  logic [2:0]           fits;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      base[axis]     = $signed(place_i.lower[axis]) >>> place_i.scale[axis];
      low[axis]      = code_i[2*Bits*axis+:Bits];
      high[axis]     = code_i[2*Bits*axis+Bits+:Bits];
      below[axis]    = modulo_i ? low[axis] - base[axis][Bits-1:0] : low[axis];
      less_one[axis] = modulo_i ? high[axis] - low[axis] - 1'b1 : high[axis] - low[axis];

      cells_o.low[axis]   = Q'(below[axis]);
      cells_o.width[axis] = (Q + 1)'(less_one[axis]) + 1'b1;

      fits[axis] = (modulo_i || (low[axis] <= high[axis]))
          && ((Q + 2)'(below[axis]) + (Q + 2)'(less_one[axis]) < (Q + 2)'(place_i.cells[axis]));
    end
  end

  assign ok_o = fits == '1;

  logic unused_bits;
  assign unused_bits = ^base;

endmodule
