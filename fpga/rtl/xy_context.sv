// Context estimate: the grid on which a node is encoded before its parent is known (P3 §4.1), from its exact
// box.
//
//   box ──► sides, highest bit ──► scale ──► cells, lower bound ──► place
//
// The grid is the finest on which the box, rounded outward to one that is coarser by Margin powers of two,
// spans at most 2^Bits cells. With exact_i there is no margin: the grid of a root.
// That is found without a search: a side of d units spans at most d / 2^t + 2 cells of 2^t, so the scale
// follows from the highest bit of d but for one step, which the number of cells on that grid decides.
//
// Handshake   enable_i moves everything one stage on; with it low, everything stays.
// Latency     3 enabled cycles.
// Throughput  one box a cycle.
// Cut paths   all.
module xy_context #(
    parameter int unsigned Bits     = 6,  // of a coordinate, 4 to 8
    parameter int unsigned Margin   = 1,  // 0 to 3
    parameter int unsigned MinScale = 0   // no grid is finer, 0 to 15
) (
    input  logic           clk_i,
    input  logic           rst_ni,
    input  logic           enable_i,
    input  xy_pkg::box_t   box_i,
    input  logic           exact_i,
    output xy_pkg::place_t place_o,
    output logic           ok_o  // the box is none that is turned inside out
);

  localparam int unsigned C = xy_pkg::CoordWidth;

  // --- Stage 1: sides and their highest bits ---

  logic [2:0][C-1:0] lo, hi, side;
  logic [2:0]        inverted;
  assign {hi, lo} = box_i;

  logic [2:0]        any;
  logic [2:0][4:0]   top_bit;

  logic [2:0][C-1:0] lo1_q, hi1_q;
  logic [2:0][4:0]   top1_q;
  logic              ok1_q, exact1_q;

  for (genvar axis = 0; axis < 3; axis++) begin : gen_axis
    assign side[axis]     = hi[axis] - lo[axis];
    assign inverted[axis] = $signed(hi[axis]) < $signed(lo[axis]);
    xy_msb #(.Width(C)) u_top (
        .bits_i (side[axis]),
        .any_o  (any[axis]),
        .index_o(top_bit[axis])
    );
  end

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      lo1_q    <= lo;
      hi1_q    <= hi;
      top1_q   <= top_bit;
      exact1_q <= exact_i;
      ok1_q    <= inverted == '0;
    end
  end

  // --- Stage 2: the scale ---

  // With a margin, on the coarser grid the box spans at most 2^(Bits - Margin) cells.
  logic [4:0]        bits, margin;
  logic [2:0][4:0]   first, coarse, scale;
  logic [2:0][C-1:0] low_cell, high_cell, span;

  assign margin = exact1_q ? 5'd0 : 5'(Margin);
  assign bits   = 5'(Bits) - margin;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      // The finest grid on which the side, rounded down, is below 2^bits cells.
      first[axis]     = (top1_q[axis] >= bits) ? top1_q[axis] - bits + 5'd1 : 5'd0;
      low_cell[axis]  = $signed(lo1_q[axis]) >>> first[axis];
      high_cell[axis] = $signed(hi1_q[axis]) >>> first[axis];
      span[axis]      = (high_cell[axis] - low_cell[axis]) >> bits;
      coarse[axis]    = first[axis] + ((span[axis] != '0) ? 5'd1 : 5'd0);
      scale[axis]     = (coarse[axis] >= 5'(MinScale) + margin)
          ? coarse[axis] - margin : 5'(MinScale);
    end
  end

  logic [2:0][C-1:0] lo2_q, hi2_q;
  logic [2:0][4:0]   scale2_q;
  logic              ok2_q;

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      lo2_q    <= lo1_q;
      hi2_q    <= hi1_q;
      scale2_q <= scale;
      ok2_q    <= ok1_q;
    end
  end

  // --- Stage 3: the place ---

  logic [2:0][C-1:0]             low2, high2, lower;
  logic [2:0][xy_pkg::MaxQuant:0] cells;

  always_comb begin
    for (int unsigned axis = 0; axis < 3; axis++) begin
      low2[axis]  = $signed(lo2_q[axis]) >>> scale2_q[axis];
      high2[axis] = $signed(hi2_q[axis]) >>> scale2_q[axis];
      cells[axis] = (xy_pkg::MaxQuant + 1)'(high2[axis] - low2[axis]) + 1'b1;
      lower[axis] = low2[axis] << scale2_q[axis];
    end
  end

  always_ff @(posedge clk_i) begin
    if (enable_i) begin
      place_o.lower <= lower;
      place_o.cells <= cells;
      place_o.scale <= scale2_q;
      ok_o          <= ok2_q;
    end
  end

  logic unused_bits;
  assign unused_bits = ^{any, rst_ni};

`ifndef SYNTHESIS
  initial begin
    if (Bits < 4 || Bits > xy_pkg::MaxQuant) begin
      $fatal(1, "xy_context: Bits is %0d, must be 4 to %0d", Bits, xy_pkg::MaxQuant);
    end
    if (Margin > 3) $fatal(1, "xy_context: Margin is %0d, must be 0 to 3", Margin);
    if (MinScale > 15) $fatal(1, "xy_context: MinScale is %0d, must be 0 to 15", MinScale);
  end
`endif

endmodule
