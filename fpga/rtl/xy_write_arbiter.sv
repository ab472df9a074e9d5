// Lets several write ports share one: in turn, a burst at a time.
//
// Handshake   as in every line port. The port that is being served keeps its turn until the last line of
//             its burst has been taken; then it is the next one's that has something, counted from it.
// Latency     0 cycles.
// Throughput  one line a cycle.
// Cut paths   none.
module xy_write_arbiter #(
    parameter int unsigned Ports = 3
) (
    input  logic                                      clk_i,
    input  logic                                      rst_ni,
    input  logic                                      clear_i,

    input  logic [Ports-1:0]                          valid_i,
    output logic [Ports-1:0]                          ready_o,
    input  logic [Ports-1:0]                          last_i,
    input  logic [Ports-1:0][31:0]                    addr_i,
    input  logic [Ports-1:0][xy_pkg::LineBits-1:0]    data_i,
    input  logic [Ports-1:0][xy_pkg::LineBytes-1:0]   strb_i,
    input  logic [Ports-1:0][xy_pkg::RegionWidth-1:0] region_i,

    output logic                                      valid_o,
    input  logic                                      ready_i,
    output logic [31:0]                               addr_o,
    output logic [xy_pkg::LineBits-1:0]               data_o,
    output logic [xy_pkg::LineBytes-1:0]              strb_o,
    output logic [xy_pkg::RegionWidth-1:0]            region_o
);

  localparam int unsigned TurnWidth = $clog2(Ports);

  logic [TurnWidth-1:0] turn_q, next, turn;
  logic                 kept_q;  // the turn is not over

  always_comb begin
    next = turn_q;
    // The farthest first, so that the nearest stays. Remainders are of constants.
    for (int unsigned from = 0; from < Ports; from++) begin
      for (int unsigned i = Ports; i > 0; i--) begin
        if ((turn_q == TurnWidth'(from)) && valid_i[TurnWidth'((from + i) % Ports)]) begin
          next = TurnWidth'((from + i) % Ports);
        end
      end
    end
  end

  assign turn     = kept_q ? turn_q : next;
  assign valid_o  = kept_q ? valid_i[turn_q] : (|valid_i);
  assign addr_o   = addr_i[turn];
  assign data_o   = data_i[turn];
  assign strb_o   = strb_i[turn];
  assign region_o = region_i[turn];

  always_comb begin
    ready_o       = '0;
    ready_o[turn] = ready_i;
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      turn_q <= '0;
      kept_q <= 1'b0;
    end else if (clear_i) begin
      turn_q <= '0;
      kept_q <= 1'b0;
    end else if (valid_o) begin
      turn_q <= turn;
      kept_q <= !(ready_i && last_i[turn]);
    end
  end

`ifndef SYNTHESIS
  // What is offered stays until it is taken.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      valid_o && !ready_i && !clear_i |=> clear_i || (valid_o && $stable({addr_o, data_o, strb_o})));
`endif

endmodule
