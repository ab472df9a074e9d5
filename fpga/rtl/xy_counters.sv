// The event counters: 64 bits each, cleared together.
//
// Latency     an event of one cycle is in the count in the next.
// Throughput  each counter grows by up to 2^StepWidth - 1 a cycle.
module xy_counters #(
    parameter int unsigned Counters  = 10,
    parameter int unsigned StepWidth = 7
) (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               clear_i,
    input  logic [Counters-1:0][StepWidth-1:0] step_i,
    output logic [Counters-1:0][63:0]          count_o
);

  logic [Counters-1:0][63:0] count_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      count_q <= '0;
    end else if (clear_i) begin
      count_q <= '0;
    end else begin
      for (int unsigned i = 0; i < Counters; i++) begin
        count_q[i] <= count_q[i] + 64'(step_i[i]);
      end
    end
  end

  assign count_o = count_q;

endmodule
