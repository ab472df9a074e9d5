// Signed multiplier between registers.
//
// Latency     2 cycles: the product of what is given in cycle T is there in T+2.
// Throughput  one product a cycle.
// Cut paths   all.
module xy_multiplier (
    input  logic                                 clk_i,
    input  xy_trace_pkg::factors_t               factors_i,
    output logic [xy_trace_pkg::ProductWidth-1:0] product_o
);
  logic signed [31:0]             a_q;
  logic signed [29:0]             b_q;
  logic signed [xy_trace_pkg::ProductWidth-1:0] product_q;

  always_ff @(posedge clk_i) begin
    a_q       <= factors_i.a;
    b_q       <= factors_i.b;
    product_q <= xy_trace_pkg::ProductWidth'(a_q) * xy_trace_pkg::ProductWidth'(b_q);
  end

  assign product_o = product_q;

endmodule
