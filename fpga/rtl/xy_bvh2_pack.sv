// The bytes of a 64-byte node (P2 §4.1, Fig. 2): two boxes, two pointers.
//
//   bytes 0..24   child 0: lowest corner x, y, z, highest corner x, y, z, each sign-extended to 32 bits
//   bytes 24..48  child 1: the same
//   bytes 48..56  child 0: index, leaf size (0 for a node)
//   bytes 56..64  child 1: the same
//
// Handshake   none: wires.
module xy_bvh2_pack (
    input  xy_pkg::subtree_t left_i,
    input  xy_pkg::subtree_t right_i,
    output logic [511:0]     node_o
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  logic [11:0][C-1:0] coords;
  logic [11:0][31:0]  words;
  assign coords = {right_i.box, left_i.box};

  always_comb begin
    for (int unsigned i = 0; i < 12; i++) begin
      words[i] = {{(32 - C) {coords[i][C-1]}}, coords[i]};
    end
  end

  assign node_o = {
    24'd0, right_i.count, right_i.index, 24'd0, left_i.count, left_i.index, words
  };

endmodule
