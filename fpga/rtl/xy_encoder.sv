// Child encoder: a child's code in its parent's context, the context that this gives the child, and whether
// that differs from the one in which the child's own children were encoded.
//
//   place, box ──► encode ──► code, cells ──► child's place, mismatch with old ──► out
//
// Handshake   enable_i moves everything one stage on; with it low, everything stays.
// Latency     2 enabled cycles.
// Throughput  one child a cycle.
// Cut paths   all.
module xy_encoder #(
    parameter int unsigned Bits     = 6,
    parameter int unsigned MinScale = 0
) (
    input  logic              clk_i,
    input  logic              rst_ni,
    input  logic              enable_i,
    input  logic              modulo_i,
    input  xy_pkg::place_t    place_i,   // of the parent
    input  xy_pkg::box_t      box_i,     // of the child
    input  xy_pkg::place_t    old_i,     // of the child, in which its children were encoded
    output logic [6*Bits-1:0] code_o,
    output xy_pkg::place_t    old_o,
    output xy_pkg::place_t    new_o,     // of the child
    output logic              needed_o,  // the child is to be encoded again
    output logic              ok_o       // the box is inside the parent's
);

  logic [6*Bits-1:0] code, code1_q;
  xy_pkg::cells_t    cells, cells1_q;
  xy_pkg::place_t    place1_q, old1_q, child;
  logic              ok, ok1_q, needed;

  xy_encode #(.Bits(Bits)) u_encode (
      .modulo_i,
      .place_i,
      .box_i,
      .code_o (code),
      .cells_o(cells),
      .ok_o   (ok)
  );

  xy_child #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_child (
      .place_i(place1_q),
      .cells_i(cells1_q),
      .place_o(child)
  );

  xy_mismatch #(.Bits(Bits)) u_mismatch (
      .modulo_i,
      .old_i   (old1_q),
      .new_i   (child),
      .needed_o(needed)
  );

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      code1_q  <= code;
      cells1_q <= cells;
      place1_q <= place_i;
      old1_q   <= old_i;
      ok1_q    <= ok;

      code_o   <= code1_q;
      old_o    <= old1_q;
      new_o    <= child;
      needed_o <= needed;
      ok_o     <= ok1_q;
    end
  end

  logic unused_reset;
  assign unused_reset = rst_ni;

endmodule
