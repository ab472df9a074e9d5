// The reciprocal of a ray's direction component, one quotient bit a cycle.
//
// Computes the core's Reciprocal::new: for 2^(k-1) < |component| <= 2^k the mantissa is
// 2^(k+23) / |component| rounded down, which has 24 bits, and the shift is 31 - k.
//
// A power of two is doubled and divided as in long division; the quotient's first 1 falls into the
// step in which the power reaches the component, 2^k, and the mantissa is complete 23 steps later. So no
// component needs to be normalised. Steps that can only give zeros are left out, in eights.
//
// Handshake   start_i takes component_i, which must stay until done_o. done_o stays until the next start.
// Latency     1 cycle for zero, else k + 23 - s steps and one cycle, where s is the largest of 28, 20,
//             12, 4 and -1 such that |component| >= 2^(s+1).
// Cut paths   outputs are registers; component_i is negated and subtracted from.
module xy_reciprocal (
    input  logic                      clk_i,
    input  logic                      rst_ni,
    input  logic                      start_i,
    input  logic [31:0]               component_i,
    output logic                      done_o,
    output xy_trace_pkg::reciprocal_t reciprocal_o
);

  logic        negative, zero;
  logic [30:0] magnitude;
  assign negative  = component_i[31];
  assign zero      = component_i == '0;
  assign magnitude = (component_i[30:0] ^ {31{negative}}) + {30'b0, negative};

  logic        busy_q, first_q;     // first_q: the power is still below 1
  logic [30:0] rest_q;
  logic [23:0] mantissa_q;
  logic [4:0]  k_q;                 // of the step under way, until the first 1 has come

  // Where to begin: the power 2^s as a rest, and the next step's k.
  logic [30:0] begin_rest;
  logic [4:0]  begin_k;
  always_comb begin
    begin_rest = '0;
    begin_k    = 5'd0;
    if (|magnitude[30:29]) begin
      begin_rest[28] = 1'b1;
      begin_k        = 5'd29;
    end else if (|magnitude[28:21]) begin
      begin_rest[20] = 1'b1;
      begin_k        = 5'd21;
    end else if (|magnitude[20:13]) begin
      begin_rest[12] = 1'b1;
      begin_k        = 5'd13;
    end else if (|magnitude[12:5]) begin
      begin_rest[4] = 1'b1;
      begin_k       = 5'd5;
    end
  end

  logic [31:0] doubled, difference;
  logic        bit_value;
  assign doubled    = {rest_q, first_q};
  assign difference = doubled - {1'b0, magnitude};
  assign bit_value  = !difference[31];

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      busy_q <= 1'b0;
    end else if (start_i) begin
      busy_q <= !zero;
    end else if (mantissa_q[22]) begin
      busy_q <= 1'b0;
    end
  end

  always_ff @(posedge clk_i) begin
    if (start_i) begin
      rest_q     <= begin_rest;
      first_q    <= begin_k == 5'd0;
      k_q        <= begin_k;
      mantissa_q <= '0;
    end else if (busy_q) begin
      rest_q     <= bit_value ? difference[30:0] : doubled[30:0];
      first_q    <= 1'b0;
      mantissa_q <= {mantissa_q[22:0], bit_value};
      if (mantissa_q == '0 && !bit_value) k_q <= k_q + 5'd1;
    end
  end

  assign done_o                = !busy_q;
  assign reciprocal_o.negative = negative;
  assign reciprocal_o.zero     = zero;
  assign reciprocal_o.inexact  = rest_q != '0;
  assign reciprocal_o.shift    = 5'd31 - k_q;
  assign reciprocal_o.mantissa = mantissa_q;

`ifndef SYNTHESIS
  // What was taken; a user who gives it up may change it.
  logic [31:0] component_q;
  always_ff @(posedge clk_i) if (start_i) component_q <= component_i;

  // A rest is below the divisor: else a quotient digit would not be a bit. The valid range makes it so.
  a_rest_is_small :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      busy_q && component_i == component_q && magnitude != '0 && magnitude <= 31'h4000_0000
      |-> rest_q < magnitude);
`endif

endmodule
