// Whether a node that was encoded in one context must be encoded again for another (P3 §4.2).
//
// Modulo coordinates stay right while the scale does. Relative ones must also count from the same cell. And a
// box that was encoded on a coarser grid before may stick out of one that has become smaller.
//
// Handshake   none: combinational.
// Latency     0; two decoded boxes compared.
// Cut paths   none.
module xy_mismatch #(
    parameter int unsigned Bits = 6
) (
    input  logic           modulo_i,
    input  xy_pkg::place_t old_i,
    input  xy_pkg::place_t new_i,
    output logic           needed_o
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  logic [2:0][C:0]   old_upper, new_upper;
  logic [2:0][C-1:0] moved;
  logic [2:0]        differs;

  xy_decoded u_old (.place_i(old_i), .upper_o(old_upper));
  xy_decoded u_new (.place_i(new_i), .upper_o(new_upper));

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      // Where scales are equal, the lower bounds' cells differ modulo 2^Bits if these bits do.
      moved[axis]   = (old_i.lower[axis] ^ new_i.lower[axis]) >> old_i.scale[axis];
      differs[axis] = (old_i.scale[axis] != new_i.scale[axis])
          || (!modulo_i && (moved[axis][Bits-1:0] != '0))
          || ($signed(new_i.lower[axis]) > $signed(old_i.lower[axis]))
          || ($signed(new_upper[axis]) < $signed(old_upper[axis]));
    end
  end

  assign needed_o = differs != '0;

  logic unused_bits;
  assign unused_bits = ^moved;

endmodule
