// Recoder: a child's code in its parent's old context to its code in the parent's new one (P3 Algorithm 1,
// `Backtrack`), with both contexts of the child.
//
//   code ──► decode in old, cut to new ──► encode in new ──► child's places, mismatch ──► out
//
// The decoded box, its upper bound put inside so that rounding it again adds no cell, is cut to the new
// decoded box: the exact box is in both.
//
// Handshake   enable_i moves everything one stage on; with it low, everything stays.
// Latency     3 enabled cycles.
// Throughput  one child a cycle.
// Cut paths   all.
module xy_recoder #(
    parameter int unsigned Bits     = 6,
    parameter int unsigned MinScale = 0
) (
    input  logic              clk_i,
    input  logic              rst_ni,
    input  logic              enable_i,
    input  logic              modulo_i,
    input  xy_pkg::place_t    old_i,     // of the parent
    input  xy_pkg::place_t    new_i,     // of the parent
    input  logic [6*Bits-1:0] code_i,
    output logic [6*Bits-1:0] code_o,
    output xy_pkg::place_t    old_o,     // of the child
    output xy_pkg::place_t    new_o,     // of the child
    output logic              needed_o,  // the child is to be encoded again
    output logic              ok_o       // both boxes are inside the parent's
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  xy_pkg::cells_t  cells;
  xy_pkg::place_t  old_child;
  logic            decode_ok;
  logic [2:0][C:0] new_upper;

  xy_decode #(.Bits(Bits)) u_decode (
      .modulo_i,
      .place_i(old_i),
      .code_i,
      .cells_o(cells),
      .ok_o   (decode_ok)
  );

  xy_child #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_old_child (
      .place_i(old_i),
      .cells_i(cells),
      .place_o(old_child)
  );

  xy_decoded u_new (.place_i(new_i), .upper_o(new_upper));

  // One bit more than a coordinate, signed: a decoded box may reach the edge of the grid.
  logic [2:0][C:0]   old_low, new_low, low, high, last;
  logic [2:0][C-1:0] lo, hi;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      old_low[axis] = {old_i.lower[axis][C-1], old_i.lower[axis]};
      new_low[axis] = {new_i.lower[axis][C-1], new_i.lower[axis]};
      low[axis]     = old_low[axis] + ((C + 1)'(cells.low[axis]) << old_i.scale[axis]);
      high[axis]    = low[axis] + ((C + 1)'(cells.width[axis]) << old_i.scale[axis]) - 1'b1;
      last[axis]    = new_upper[axis] - 1'b1;
      lo[axis]      = ($signed(low[axis]) < $signed(new_low[axis])) ? new_low[axis][C-1:0]
          : low[axis][C-1:0];
      hi[axis]      = ($signed(high[axis]) > $signed(last[axis])) ? last[axis][C-1:0]
          : high[axis][C-1:0];
    end
  end

  xy_pkg::box_t   box1_q;
  xy_pkg::place_t new1_q, old_child1_q;
  logic           ok1_q, ok2_q, ok3_q, encode_ok;

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      box1_q       <= {hi, lo};
      new1_q       <= new_i;
      old_child1_q <= old_child;
      ok1_q        <= decode_ok;
      ok2_q        <= ok1_q;
      ok3_q        <= ok2_q;
    end
  end

  xy_encoder #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_encoder (
      .clk_i,
      .rst_ni,
      .enable_i,
      .modulo_i,
      .place_i(new1_q),
      .box_i  (box1_q),
      .old_i  (old_child1_q),
      .code_o,
      .old_o,
      .new_o,
      .needed_o,
      .ok_o   (encode_ok)
  );

  assign ok_o = ok3_q && encode_ok;

endmodule
