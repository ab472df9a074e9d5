// The decoded box of a place, half-open: the upper corner is the first point outside on every axis.
//
// Handshake   none: combinational.
// Latency     0; a shift and an addition.
// Cut paths   none.
module xy_decoded (
    input  xy_pkg::place_t                      place_i,
    output logic [2:0][xy_pkg::CoordWidth:0]    upper_o  // signed; one bit more than a coordinate
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      upper_o[axis] = {place_i.lower[axis][C-1], place_i.lower[axis]}
          + ((C + 1)'(place_i.cells[axis]) << place_i.scale[axis]);
    end
  end

endmodule
