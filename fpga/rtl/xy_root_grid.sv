// The local grid of a quantized tree's root: the core's Placement::root for 6 bits and minimum scale 0.
//
// The finest grid on which the root's exact box, rounded outward, spans at most 64 cells, per axis; and the
// rounded box' planes in grid units. Of a box that ends before it begins, inverted_o; the rest means nothing then.
//
// Handshake   start_i takes box_i, which must stay; done_o stays until the next start.
// Latency     2 cycles and the largest of the axes' scales, at most 18, from start_i to done_o.
// Cut paths   done_o and grid_o are registers; planes are an addition behind registers.
module xy_root_grid (
    input  logic                      clk_i,
    input  logic                      rst_ni,
    input  logic                      start_i,
    input  xy_pkg::box_t              box_i,
    output logic                      done_o,
    output logic                      inverted_o,
    output logic [2:0][17:0]          grid_o,        // three grid_t
    output logic [2:0][24:0]          low_plane_o,
    output logic [2:0][24:0]          high_plane_o
);

  localparam int unsigned Bits = xy_pkg::CoordWidth;

  logic       busy_q;
  logic [2:0] coarse, inverted;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) busy_q <= 1'b0;
    else if (start_i) busy_q <= 1'b1;
    else if (coarse == '0) busy_q <= 1'b0;
  end

  assign done_o     = !busy_q;
  assign inverted_o = inverted != '0;

  for (genvar i = 0; i < 3; i++) begin : gen_axis
    logic [Bits-1:0] lo, hi;
    assign lo = box_i.lo[Bits*i+:Bits];
    assign hi = box_i.hi[Bits*i+:Bits];

    assign inverted[i] = $signed(hi) < $signed(lo);

    // Numbers of the lowest and the highest cell, the scale, and 2^scale - 1.
    logic [Bits-1:0] low_q, high_q, mask_q, span;
    logic [4:0]      scale_q;
    assign span      = high_q - low_q;
    assign coarse[i] = |span[Bits-1:6] && scale_q != 5'd18;

    always_ff @(posedge clk_i) begin
      if (start_i) begin
        low_q   <= lo;
        high_q  <= hi;
        mask_q  <= '0;
        scale_q <= '0;
      end else if (busy_q && coarse[i]) begin
        low_q   <= {low_q[Bits-1], low_q[Bits-1:1]};
        high_q  <= {high_q[Bits-1], high_q[Bits-1:1]};
        mask_q  <= {mask_q[Bits-2:0], 1'b1};
        scale_q <= scale_q + 5'd1;
      end
    end

    logic [24:0] low_plane, last;
    assign low_plane       = {lo[Bits-1], lo & ~mask_q};
    assign last            = {hi[Bits-1], hi | mask_q};
    assign low_plane_o[i]  = low_plane;
    assign high_plane_o[i] = last + 25'd1;

    logic [6:0] cells;
    assign cells     = {1'b0, span[5:0]} + 7'd1;
    assign grid_o[i] = {scale_q, cells, low_q[5:0]};
  end

endmodule
