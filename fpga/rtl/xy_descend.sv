// A step down a chain of contexts: from a node's place to that of a child whose box is known.
//
//   place, box ──► encode ──► cells ──► child's place
//
// Handshake   enable_i moves everything one stage on; with it low, everything stays.
// Latency     2 enabled cycles.
// Throughput  one step a cycle.
// Cut paths   all.
module xy_descend #(
    parameter int unsigned Bits     = 6,
    parameter int unsigned MinScale = 0
) (
    input  logic           clk_i,
    input  logic           rst_ni,
    input  logic           enable_i,
    input  xy_pkg::place_t place_i,
    input  xy_pkg::box_t   box_i,
    input  logic           ok_i,
    output xy_pkg::place_t place_o,
    output logic           ok_o  // all boxes so far were inside their parents'
);

  logic [6*Bits-1:0] code;
  xy_pkg::cells_t    cells, cells1_q;
  xy_pkg::place_t    place1_q, child;
  logic              ok, ok1_q;

  xy_encode #(.Bits(Bits)) u_encode (
      .modulo_i(1'b0),
      .place_i,
      .box_i,
      .code_o  (code),
      .cells_o (cells),
      .ok_o    (ok)
  );

  xy_child #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_child (
      .place_i(place1_q),
      .cells_i(cells1_q),
      .place_o(child)
  );

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      cells1_q <= cells;
      place1_q <= place_i;
      ok1_q    <= ok_i && ok;
      place_o  <= child;
      ok_o     <= ok1_q;
    end
  end

  logic unused_bits;
  assign unused_bits = ^{code, rst_ni};

endmodule
