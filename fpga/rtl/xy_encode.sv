// A child's box on its parent's grid: P3 Eq. 1 and Eqs. 7 and 8, all by floor division.
//
// code_o has, from bit 0 on, x lower bound, x upper bound, then y and z, Bits bits each.
//
// Handshake   none: combinational.
// Latency     0; a shift, a subtraction and comparisons.
// Cut paths   none.
module xy_encode #(
    parameter int unsigned Bits = 6
) (
    input  logic              modulo_i,  // coordinates are modulo 2^Bits, not relative
    input  xy_pkg::place_t    place_i,   // of the parent
    input  xy_pkg::box_t      box_i,
    output logic [6*Bits-1:0] code_o,
    output xy_pkg::cells_t    cells_o,
    output logic              ok_o       // the box is one, and inside the parent's
);

  localparam int unsigned C = xy_pkg::CoordWidth;
  localparam int unsigned Q = xy_pkg::MaxQuant;

  logic [2:0][C-1:0] lo, hi, low, high, base;
  logic [2:0][C:0]   below, width;  // signed
  logic [2:0]        fits;
  assign {hi, lo} = box_i;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      low[axis]  = $signed(lo[axis]) >>> place_i.scale[axis];
      high[axis] = $signed(hi[axis]) >>> place_i.scale[axis];
      base[axis] = $signed(place_i.lower[axis]) >>> place_i.scale[axis];

      // Cells between the parent's lower bound and the child's, and between the child's two.
      below[axis] = {low[axis][C-1], low[axis]} - {base[axis][C-1], base[axis]};
      width[axis] = {high[axis][C-1], high[axis]} - {low[axis][C-1], low[axis]} + 1'b1;
      fits[axis] = ($signed(lo[axis]) <= $signed(hi[axis])) && !below[axis][C]
          && (below[axis] + width[axis] <= (C + 1)'(place_i.cells[axis]));

      cells_o.low[axis]   = below[axis][Q-1:0];
      cells_o.width[axis] = width[axis][Q:0];

      // A relative upper bound is stored less one, a modulo one is the cell behind the box.
      code_o[2*Bits*axis+:Bits] = modulo_i ? low[axis][Bits-1:0] : below[axis][Bits-1:0];
      code_o[2*Bits*axis+Bits+:Bits] = modulo_i ? high[axis][Bits-1:0] + 1'b1
          : below[axis][Bits-1:0] + width[axis][Bits-1:0] - 1'b1;
    end
  end

  assign ok_o = fits == '1;

endmodule
