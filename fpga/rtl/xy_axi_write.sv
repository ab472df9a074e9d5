// Write half of the AXI4 master: one line of 64 bytes a request, one INCR burst a line.
//
//   wr_* ──┬──► queue ──► AW, W
//          └──► addresses of lines without response ──► pending_o     B ──► the first one leaves
//
// Handshake   wr_valid_i and wr_ready_o both high: the line is taken, and written whatever becomes of the
//             unit that wrote. Address and data are on AW and W until the slave has taken each: AXI's
//             rule for VALID. Writes are posted; lines are written in order (one ID).
//             line_o of region_o is the next one to go to AW and W. forbidden_o: allowed_i says that it may not
//             be written; it is dropped as soon as all lines before it have had their responses.
// Latency     1 cycle from wr_valid_i to awvalid_o and wvalid_o.
// Throughput  one line in LineBits / DataWidth cycles while the slave takes them.
// Errors      error_o for one cycle, with the line's address, when its response was not OKAY.
// Order       pending_o: the line probe_i is queued or under way. AXI4 does not order reads after writes,
//             so such a line must not be read yet.
// Cut paths   wr_ready_o is a matter of registers; error_o depends on bvalid_i, pending_o on probe_i.
module xy_axi_write #(
    parameter int unsigned DataWidth   = 512,  // 32, 64, 128, 256 or 512
    parameter int unsigned IdWidth     = 4,
    parameter int unsigned LogLines    = 4,    // 2^LogLines lines may wait for their responses
    parameter int unsigned RegionWidth = 3
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,

    input  logic                          wr_valid_i,
    output logic                          wr_ready_o,
    input  logic [31:0]                   wr_addr_i,
    input  logic [xy_pkg::LineBits-1:0]   wr_data_i,
    input  logic [xy_pkg::LineBytes-1:0]  wr_strb_i,
    input  logic [RegionWidth-1:0]        wr_region_i,

    output logic [25:0]                   line_o,
    output logic [RegionWidth-1:0]        region_o,
    input  logic                          allowed_i,
    output logic                          forbidden_o,

    input  logic [25:0]                   probe_i,
    output logic                          pending_o,

    output logic                          error_o,
    output logic [31:0]                   oldest_o,  // address of the oldest line without response
    output logic                          idle_o,    // all lines have had their responses
    output logic                          held_o,    // a line has not been sent

    output logic                          awvalid_o,
    input  logic                          awready_i,
    output logic [IdWidth-1:0]            awid_o,
    output logic [31:0]                   awaddr_o,
    output logic [7:0]                    awlen_o,
    output logic [2:0]                    awsize_o,
    output logic [1:0]                    awburst_o,
    output logic                          wvalid_o,
    input  logic                          wready_i,
    output logic [DataWidth-1:0]          wdata_o,
    output logic [DataWidth/8-1:0]        wstrb_o,
    output logic                          wlast_o,
    input  logic                          bvalid_i,
    output logic                          bready_o,
    input  logic [IdWidth-1:0]            bid_i,
    input  logic [1:0]                    bresp_i
);

  localparam int unsigned Lines     = 2 ** LogLines;
  localparam int unsigned Beats     = xy_pkg::LineBits / DataWidth;
  localparam int unsigned BeatWidth = Beats > 1 ? $clog2(Beats) : 1;

  logic                              queue_ready, head_valid, may_go, drop, leaves;
  logic [Beats-1:0][DataWidth-1:0]   data;
  logic [Beats-1:0][DataWidth/8-1:0] strb;

  // Addresses of lines that wait for their responses, oldest first.
  logic [Lines-1:0][25:0] waiting_q;
  logic [Lines-1:0]    sent_q;  // of these, the ones that do
  logic [LogLines:0]   count_q;
  logic [1:0]          queued_q;  // the youngest of them, which have not been sent
  logic [LogLines-1:0] first_q, free_q;

  logic take, respond;
  assign wr_ready_o = queue_ready && !count_q[LogLines];
  assign take       = wr_valid_i && wr_ready_o;
  assign respond    = (drop || bvalid_i) && (count_q != '0);

  // Two queues in step: addresses are looked at as soon as they are out.
  logic unused_ready, unused_valid;
  xy_fifo #(
      .Width     (RegionWidth + 26),
      .Depth     (2),
      .Registered(1)
  ) u_queue (
      .clk_i,
      .rst_ni,
      .clear_i    (1'b0),
      .in_valid_i (take),
      .in_ready_o (queue_ready),
      .in_data_i  ({wr_region_i, wr_addr_i[31:6]}),
      .out_valid_o(head_valid),
      .out_ready_i(leaves),
      .out_data_o ({region_o, line_o})
  );
  xy_fifo #(
      .Width(xy_pkg::LineBytes + xy_pkg::LineBits),
      .Depth(2)
  ) u_data (
      .clk_i,
      .rst_ni,
      .clear_i    (1'b0),
      .in_valid_i (take),
      .in_ready_o (unused_ready),
      .in_data_i  ({wr_strb_i, wr_data_i}),
      .out_valid_o(unused_valid),
      .out_ready_i(leaves),
      .out_data_o ({strb, data})
  );

  // What of the line at the head has been taken: its address, so many beats, all beats.
  logic                 aw_done_q, w_done_q;
  logic [BeatWidth-1:0] beat_q;
  logic                 begun_q;  // it was offered, and that stays
  logic                 last_beat, aw_ends, w_ends;
  assign forbidden_o = head_valid && !begun_q && !allowed_i;
  assign drop        = forbidden_o && (count_q <= (LogLines+1)'(queued_q));
  assign may_go      = head_valid && (begun_q || allowed_i);
  assign last_beat   = beat_q == BeatWidth'(Beats - 1);
  assign aw_ends     = aw_done_q || awready_i;
  assign w_ends      = w_done_q || (wready_i && last_beat);
  assign leaves      = drop || (may_go && aw_ends && w_ends);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      aw_done_q <= 1'b0;
      w_done_q  <= 1'b0;
      begun_q   <= 1'b0;
      beat_q    <= '0;
      count_q   <= '0;
      queued_q  <= '0;
      first_q   <= '0;
      free_q    <= '0;
      sent_q    <= '0;
    end else begin
      begun_q <= may_go && !leaves;
      if (may_go) aw_done_q <= aw_ends && !w_ends;
      if (may_go) w_done_q <= w_ends && !aw_ends;
      if (wvalid_o && wready_i) beat_q <= last_beat ? '0 : beat_q + 1'b1;
      if (take) free_q <= free_q + 1'b1;
      if (take) sent_q[free_q] <= 1'b1;
      if (respond) first_q <= first_q + 1'b1;
      if (respond) sent_q[first_q] <= 1'b0;
      count_q  <= count_q + (LogLines+1)'(take) - (LogLines+1)'(respond);
      queued_q <= queued_q + 2'(take) - 2'(leaves);
    end
  end

  // Without an index, which synthesis makes a product of.
  always_ff @(posedge clk_i) begin
    for (int unsigned i = 0; i < Lines; i++) begin
      if (take && (free_q == LogLines'(i))) waiting_q[i] <= wr_addr_i[31:6];
    end
  end

  assign error_o  = bvalid_i && (count_q != '0) && bresp_i[1];
  assign oldest_o = {waiting_q[first_q], 6'd0};
  assign idle_o   = count_q == '0;
  assign held_o   = head_valid;

  always_comb begin
    pending_o = 1'b0;
    for (int unsigned i = 0; i < Lines; i++) begin
      if (sent_q[i] && (waiting_q[i] == probe_i)) pending_o = 1'b1;
    end
  end

  assign awvalid_o = may_go && !aw_done_q;
  assign awid_o    = '0;
  assign awaddr_o  = {line_o, 6'd0};
  assign awlen_o   = 8'(Beats - 1);
  assign awsize_o  = 3'($clog2(DataWidth / 8));
  assign awburst_o = 2'b01;
  assign wvalid_o  = may_go && !w_done_q;
  assign wlast_o   = last_beat;
  if (Beats > 1) begin : gen_beat
    assign wdata_o = data[beat_q];
    assign wstrb_o = strb[beat_q];
  end else begin : gen_whole
    assign wdata_o = data;
    assign wstrb_o = strb;
  end
  assign bready_o  = 1'b1;

  logic unused;
  assign unused = ^{bid_i, bresp_i[0], wr_addr_i[5:0]};

`ifndef SYNTHESIS
  // VALID stays until READY, with what it announced (AXI4 A3.2.1).
  a_aw_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      awvalid_o && !awready_i |=> awvalid_o && $stable(awaddr_o));
  a_w_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      wvalid_o && !wready_i |=> wvalid_o && $stable({wdata_o, wstrb_o, wlast_o}));

  a_in_step :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      unused_ready == queue_ready && unused_valid == head_valid && (queued_q != '0) == head_valid);

  // A response answers a line that was sent whole; any other is not AXI.
  a_responses_answer :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      bvalid_i |-> count_q > (LogLines+1)'(queued_q));

  a_aligned :
  assert property (@(posedge clk_i) disable iff (!rst_ni) wr_valid_i |-> wr_addr_i[5:0] == '0);
`endif

endmodule
