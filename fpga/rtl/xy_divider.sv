// Long division, one quotient bit a cycle.
//
// Divides a dividend of 87 bits times a power of two by a divisor of 81 bits. The first step looks at the
// dividend without its lowest 7 bits; they and then zeros follow. So `steps_i` = 8 + s gives the quotient
// of dividend · 2^s rounded down, if that has at most 8 + s bits and steps_i is at most 38. Its highest bit is
// right even if it has more: a caller who knows how many bits there may be learns whether there are.
//
// Handshake   start_i takes dividend and steps; divisor_i must stay. done_o is high in the last step's next cycle.
// Latency     steps_i + 1 cycles from start_i to done_o.
// Cut paths   outputs are registers; divisor_i is subtracted.
module xy_divider (
    input  logic        clk_i,
    input  logic        rst_ni,
    input  logic        start_i,
    input  logic [5:0]  steps_i,
    input  logic [86:0] dividend_i,
    input  logic [80:0] divisor_i,
    output logic        done_o,
    output logic [37:0] quotient_o,
    output logic        inexact_o
);

  logic [5:0]  left_q;
  logic [80:0] rest_q;
  logic [7:0]  low_q;
  logic [37:0] quotient_q;
  logic        done_q;

  logic [81:0] shifted, difference;
  logic        bit_value;
  assign shifted    = {rest_q, low_q[7]};
  assign difference = shifted - {1'b0, divisor_i};
  assign bit_value  = !difference[81];

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      left_q <= '0;
      done_q <= 1'b0;
    end else begin
      done_q <= left_q == 6'd1;
      if (start_i) left_q <= steps_i;
      else if (left_q != '0) left_q <= left_q - 6'd1;
    end
  end

  always_ff @(posedge clk_i) begin
    if (start_i) begin
      rest_q     <= {2'b0, dividend_i[86:8]};
      low_q      <= dividend_i[7:0];
      quotient_q <= '0;
    end else if (left_q != '0) begin
      rest_q     <= bit_value ? difference[80:0] : shifted[80:0];
      low_q      <= {low_q[6:0], 1'b0};
      quotient_q <= {quotient_q[36:0], bit_value};
    end
  end

  assign done_o     = done_q;
  assign quotient_o = quotient_q;
  assign inexact_o  = rest_q != '0;

endmodule
