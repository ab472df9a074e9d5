// The Morton code of a box's centre, which is floor((lo + hi) / 2): of each coordinate, counted from the
// grid's lowest corner, the top 21 bits (wide_i) or the top 10, interleaved with x highest and z lowest.
//
// Latency     none. Throughput  one code a cycle. Cut paths  none: three additions, then wires.
module xy_morton #(
    parameter int unsigned CodeWidth = 63  // 63, or 30: then wide_i must be low
) (
    input  xy_pkg::box_t         box_i,
    input  logic                 wide_i,
    output logic [CodeWidth-1:0] code_o
);

  localparam int unsigned W        = xy_pkg::CoordWidth;
  localparam int unsigned WideBits = CodeWidth / 3;
  localparam int unsigned Bits     = 10;

  // x is axis 2: it has the highest bit of each triple.
  logic [2:0][W-1:0] lo, hi, cell_of;
  assign lo = {box_i.lo.x, box_i.lo.y, box_i.lo.z};
  assign hi = {box_i.hi.x, box_i.hi.y, box_i.hi.z};

  for (genvar axis = 0; axis < 3; axis++) begin : gen_axis
    logic [W:0] sum;
    assign sum = {lo[axis][W-1], lo[axis]} + {hi[axis][W-1], hi[axis]};
    // Counting from the lowest corner, -2^(W-1), turns the sign around.
    assign cell_of[axis] = {!sum[W], sum[W-1:1]};
    logic unused_half;
    assign unused_half = ^{sum[0], cell_of[axis][W-WideBits-1:0]};

    for (genvar i = 0; i < WideBits; i++) begin : gen_bit
      if (i < Bits) begin : gen_both
        assign code_o[3*i+axis] = wide_i ? cell_of[axis][W-WideBits+i] : cell_of[axis][W-Bits+i];
      end else begin : gen_wide
        assign code_o[3*i+axis] = wide_i && cell_of[axis][W-WideBits+i];
      end
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (CodeWidth != 63 && CodeWidth != 30) begin
      $fatal(1, "xy_morton: CodeWidth is %0d, must be 63 or 30", CodeWidth);
    end
  end
`endif

endmodule
