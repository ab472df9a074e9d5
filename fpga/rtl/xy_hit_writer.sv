// Writes hit records of 24 bytes one after another: the core's Hit::to_bytes.
//
// Collects three words of 64 bits a record in a line and writes the line when it is full. base_i is where
// the first record goes, taken by start_i.
//
// Handshake   valid_i gives a record, which must stay until ready_o. flush_i, with valid_i low, writes what is
//             left; empty_o says that nothing is.
// Latency     a record takes 3 cycles; a full line is offered from the next cycle on, and nothing is taken meanwhile.
// Cut paths   the write port's outputs are registers.
module xy_hit_writer (
    input  logic                               clk_i,
    input  logic                               rst_ni,
    input  logic                               clear_i,
    input  logic                               start_i,
    input  logic [31:0]                        base_i,

    input  logic                               valid_i,
    output logic                               ready_o,
    input  logic                               hit_i,
    input  logic [xy_trace_pkg::TimeWidth-1:0] t_i,
    input  logic [31:0]                        prim_i,
    input  logic [30:0]                        u_i,
    input  logic [30:0]                        v_i,
    input  logic                               flush_i,
    output logic                               empty_o,

    output logic                               wr_valid_o,
    input  logic                               wr_ready_i,
    output logic [31:0]                        wr_addr_o,
    output logic [511:0]                       wr_data_o,
    output logic [63:0]                        wr_strb_o,
    output logic                               wr_last_o
);

  logic [25:0]      line_q;   // address, in lines
  logic [7:0][63:0] data_q;
  logic [7:0]       held_q;   // words of the line that are there
  logic [2:0]       lane_q;   // of the line
  logic [1:0]       word_q;   // of the record
  logic             full_q;   // the line is to be written

  logic [63:0] word;
  always_comb begin
    unique case (word_q)
      2'd0:    word = 64'(signed'(t_i));
      2'd1:    word = {1'b0, u_i, prim_i};
      default: word = {33'b0, v_i};
    endcase
    if (!hit_i) word = word_q == 2'd1 ? 64'h0000_0000_ffff_ffff : '0;
  end

  logic take;
  assign take    = valid_i && !full_q;
  assign ready_o = !full_q && word_q == 2'd2;
  assign empty_o = held_q == '0;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      full_q <= 1'b0;
      held_q <= '0;
      lane_q <= '0;
      word_q <= '0;
      line_q <= '0;
    end else if (clear_i) begin
      full_q <= 1'b0;
      held_q <= '0;
      lane_q <= '0;
      word_q <= '0;
    end else begin
      if (start_i) begin
        line_q <= base_i[31:6];
        lane_q <= '0;
      end
      if (full_q) begin
        if (wr_ready_i) begin
          full_q <= 1'b0;
          held_q <= '0;
          line_q <= line_q + 26'd1;
        end
      end else if (valid_i) begin
        held_q[lane_q] <= 1'b1;
        lane_q         <= lane_q + 3'd1;
        word_q         <= word_q == 2'd2 ? 2'd0 : word_q + 2'd1;
        full_q         <= lane_q == 3'd7;
      end else if (flush_i) begin
        full_q <= held_q != '0;
      end
    end
  end

  for (genvar i = 0; i < 8; i++) begin : gen_lane
    always_ff @(posedge clk_i) begin
      if (take && lane_q == 3'(i)) data_q[i] <= word;
    end
  end

  assign wr_valid_o = full_q;
  assign wr_addr_o  = {line_q, 6'b0};
  assign wr_data_o  = data_q;
  assign wr_last_o  = 1'b1;
  for (genvar i = 0; i < 8; i++) begin : gen_strobe
    assign wr_strb_o[8*i+:8] = {8{held_q[i]}};
  end

  logic unused_base;
  assign unused_base = ^base_i[5:0];

endmodule
