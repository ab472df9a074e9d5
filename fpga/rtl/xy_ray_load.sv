// Takes a ray from the five words of its record: the core's Ray::from_bytes.
//
// Words come in order, at most one a cycle. Outputs are registers, but t_max_o, which is that of the word at
// hand and follows the fifth word in the same cycle. good_o holds from the cycle after the fifth word on.
module xy_ray_load (
    input  logic                               clk_i,
    input  logic                               word_valid_i,
    input  logic [2:0]                         word_index_i,
    input  logic [63:0]                        word_i,
    output logic                               good_o,
    output logic [2:0][31:0]                   origin_o,
    output logic [2:0][31:0]                   direction_o,
    output logic [xy_trace_pkg::TimeWidth-1:0] t_min_o,
    output logic [xy_trace_pkg::TimeWidth-1:0] t_max_o
);

  // Ray::ORIGIN_LIMIT in units of 2^-6, and 2^29 and 2^30 of the direction's units.
  localparam logic signed [31:0] OriginLimit = 32'sh5fff_ffc0;
  localparam logic signed [31:0] HalfUnit    = 32'sh2000_0000;
  localparam logic signed [31:0] Unit        = 32'sh4000_0000;

  // Half words, each as what it may be.
  logic [1:0]         is_direction, far_away, too_long, long_enough;
  for (genvar i = 0; i < 2; i++) begin : gen_half
    logic signed [31:0] half;
    assign half            = word_i[32*i+:32];
    assign is_direction[i] = word_index_i == 3'd2 || (word_index_i == 3'd1 && i == 1);
    assign far_away[i]     = half > OriginLimit || half < -OriginLimit;
    assign too_long[i]     = half > Unit || half < -Unit;
    assign long_enough[i]  = half > HalfUnit || half < -HalfUnit;
  end

  // A time from -2^33 to 2^33.
  logic narrow, time_good;
  assign narrow    = word_i[63:34] == {30{word_i[63]}};
  assign time_good = narrow && (word_i[63] ? word_i[33] : !(word_i[33] && word_i[32:0] != '0));

  logic       bad, bad_q, long_q, times;
  logic [1:0] halves_bad;
  assign times      = word_index_i == 3'd3 || word_index_i == 3'd4;
  assign halves_bad = (is_direction & too_long) | (~is_direction & far_away);
  assign bad        = times ? !time_good : halves_bad != '0;

  always_ff @(posedge clk_i) begin
    if (word_valid_i) begin
      bad_q  <= bad || (bad_q && word_index_i != 3'd0);
      long_q <= (!times && (is_direction & long_enough) != '0) || (long_q && word_index_i != 3'd0);
      unique case (word_index_i)
        3'd0: {origin_o[1], origin_o[0]} <= word_i;
        3'd1: {direction_o[0], origin_o[2]} <= word_i;
        3'd2: {direction_o[2], direction_o[1]} <= word_i;
        3'd3: t_min_o <= word_i[xy_trace_pkg::TimeWidth-1:0];
        default: ;
      endcase
    end
  end

  assign good_o  = !bad_q && long_q;
  assign t_max_o = word_i[xy_trace_pkg::TimeWidth-1:0];

endmodule
