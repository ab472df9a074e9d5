// xy_port lets nothing out that was not asked for inside its region, keeps the rules of AXI4, and gives
// nothing back that was not asked for.
//
// A read of a line is not taken while a write of it is under way: one such write, any, is watched.
// The regions are any, and stay; requests come as they like, also outside their regions, and so does
// what the slave says, also what AXI4 forbids it.
module fv_port #(
    parameter int unsigned DataWidth = 512
) (
    input logic                         clk_i,
    input logic                         rd_valid_i,
    input logic [31:0]                  rd_addr_i,
    input logic [1:0]                   rd_tag_i,
    input logic                         rd_region_i,
    input logic                         wr_valid_i,
    input logic [31:0]                  wr_addr_i,
    input logic [xy_pkg::LineBits-1:0]  wr_data_i,
    input logic [xy_pkg::LineBytes-1:0] wr_strb_i,
    input logic                         wr_region_i,
    input logic                         arready_i,
    input logic                         rvalid_i,
    input logic [1:0]                   rid_i,
    input logic [DataWidth-1:0]         rdata_i,
    input logic [1:0]                   rresp_i,
    input logic                         rlast_i,
    input logic                         awready_i,
    input logic                         wready_i,
    input logic                         bvalid_i,
    input logic [1:0]                   bresp_i
);

  localparam int unsigned LineBits  = xy_pkg::LineBits;
  localparam int unsigned LineBytes = xy_pkg::LineBytes;
  localparam int unsigned Beats     = LineBits / DataWidth;
  localparam int unsigned Reads     = 4;   // lines that may be under way
  localparam int unsigned Writes    = 4;

  (* anyconst *) logic [1:0][25:0] base, lines;

  logic                   rst_ni = 1'b0;
  logic                   rd_ready, rsp_valid, rsp_error, wr_ready;
  logic [31:0]            rsp_addr;
  logic [1:0]             rsp_tag;
  logic [LineBits-1:0]    rsp_data;
  logic                   violation, idle, quiet;
  logic                   arvalid, rready, awvalid, wvalid, wlast, bready;
  logic [1:0]             arid, awid, arburst, awburst;
  logic [31:0]            araddr, awaddr;
  logic [7:0]             arlen, awlen;
  logic [2:0]             arsize, awsize;
  logic [DataWidth-1:0]   wdata;
  logic [DataWidth/8-1:0] wstrb;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_port #(
      .DataWidth(DataWidth),
      .IdWidth  (2),
      .LogWrites(2),
      .TagWidth (2),
      .Regions  (2)
  ) u_port (
      .clk_i,
      .rst_ni,
      .base_i     (base),
      .lines_i    (lines),
      .rd_valid_i,
      .rd_ready_o (rd_ready),
      .rd_addr_i,
      .rd_tag_i,
      .rd_region_i,
      .rsp_valid_o(rsp_valid),
      .rsp_error_o(rsp_error),
      .rsp_addr_o (rsp_addr),
      .rsp_tag_o  (rsp_tag),
      .rsp_data_o (rsp_data),
      .wr_valid_i,
      .wr_ready_o (wr_ready),
      .wr_addr_i,
      .wr_data_i,
      .wr_strb_i,
      .wr_region_i,
      .violation_o(violation),
      .idle_o     (idle),
      .quiet_o    (quiet),
      .arvalid_o  (arvalid),
      .arready_i,
      .arid_o     (arid),
      .araddr_o   (araddr),
      .arlen_o    (arlen),
      .arsize_o   (arsize),
      .arburst_o  (arburst),
      .rvalid_i,
      .rready_o   (rready),
      .rid_i,
      .rdata_i,
      .rresp_i,
      .rlast_i,
      .awvalid_o  (awvalid),
      .awready_i,
      .awid_o     (awid),
      .awaddr_o   (awaddr),
      .awlen_o    (awlen),
      .awsize_o   (awsize),
      .awburst_o  (awburst),
      .wvalid_o   (wvalid),
      .wready_i,
      .wdata_o    (wdata),
      .wstrb_o    (wstrb),
      .wlast_o    (wlast),
      .bvalid_i,
      .bready_o   (bready),
      .bid_i      (2'd0),
      .bresp_i
  );

  // --- Requests ---

  // Whether a line is in a region, said with ends where the guard says it with lengths.
  logic rd_inside, wr_inside, rd_taken, wr_taken;
  assign rd_inside = rd_addr_i[31:6] >= base[rd_region_i]
      && {1'b0, rd_addr_i[31:6]} < {1'b0, base[rd_region_i]} + {1'b0, lines[rd_region_i]};
  assign wr_inside = wr_addr_i[31:6] >= base[wr_region_i]
      && {1'b0, wr_addr_i[31:6]} < {1'b0, base[wr_region_i]} + {1'b0, lines[wr_region_i]};
  assign rd_taken  = rst_ni && rd_valid_i && rd_ready;
  assign wr_taken  = rst_ni && wr_valid_i && wr_ready;

  // What was taken and is not yet on its way.
  logic                 read_waits = 1'b0, write_waits = 1'b0, data_waits = 1'b0;
  logic [25:0]          read_line, write_line;
  logic                 read_region, write_region;
  logic [LineBits-1:0]  data;   // what is left of it
  logic [LineBytes-1:0] strb;
  logic [3:0]           sent;   // beats
  logic [2:0]           unanswered = '0;

  always_ff @(posedge clk_i) begin
    if (rd_taken) begin
      read_line   <= rd_addr_i[31:6];
      read_region <= rd_region_i;
    end
    read_waits <= rst_ni && (rd_taken || (read_waits && !arready_i));
    if (wr_taken) begin
      write_line   <= wr_addr_i[31:6];
      write_region <= wr_region_i;
      data         <= wr_data_i;
      strb         <= wr_strb_i;
      sent         <= '0;
    end else if (data_waits && wready_i) begin
      data <= data >> DataWidth;
      strb <= strb >> (DataWidth / 8);
      sent <= sent + 1'b1;
    end
    write_waits <= rst_ni && (wr_taken || (write_waits && !awready_i));
    data_waits  <= rst_ni && (wr_taken || (data_waits && !(wready_i && sent == 4'(Beats - 1))));
    unanswered  <= rst_ni ? unanswered + 3'(wr_taken) - 3'(bvalid_i && unanswered != '0) : '0;
  end

  // --- A line that is written, and how many before it have had no response ---

  (* anyconst *) logic [25:0] watched;
  (* anyseq *)   logic        watch;
  logic       watching = 1'b0;
  logic [2:0] ahead;
  logic       responded;
  assign responded = bvalid_i && unanswered != '0;
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      watching <= 1'b0;
    end else if (!watching) begin
      watching <= wr_taken && watch && wr_addr_i[31:6] == watched;
      ahead    <= unanswered - 3'(responded);
    end else if (responded) begin
      watching <= ahead != '0;
      ahead    <= ahead - 1'b1;
    end
  end

  // --- Lines that were asked for: one a row of the table, rows in turn ---

  logic [Reads-1:0]       asked = '0;
  logic [Reads-1:0][27:0] rows;
  logic [1:0]             next = '0, oldest = '0, row;
  logic                   answered;
  assign row      = Beats > 1 ? oldest : rid_i;
  assign answered = rst_ni && rvalid_i && rlast_i && asked[row];

  // The beats of a line so far; a line of the wrong number of beats is the slave's fault.
  logic [3:0]          beats = '0;
  logic                faulty;
  logic [LineBits-1:0] came;

  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      asked  <= '0;
      next   <= '0;
      oldest <= '0;
      beats  <= '0;
    end else begin
      if (answered) begin
        asked[row] <= 1'b0;
        oldest     <= oldest + 1'b1;
      end
      if (rd_taken) begin
        asked[next] <= 1'b1;
        rows[next]  <= {rd_tag_i, rd_addr_i[31:6]};
        next        <= next + 1'b1;
      end
      if (rvalid_i && asked[row]) begin
        beats  <= rlast_i ? '0 : beats == 4'd15 ? beats : beats + 1'b1;
        faulty <= rresp_i[1] || (beats != '0 && faulty);
        came   <= {rdata_i, came} >> DataWidth;
      end
    end
  end

  logic [LineBits-1:0] line;
  assign line = {rdata_i, came} >> DataWidth;

  // --- What was offered and not taken in the cycle before ---

  logic                               ar_held = 1'b0, aw_held = 1'b0, w_held = 1'b0;
  logic [46:0]                        ar, aw, ar_was, aw_was;
  logic [DataWidth+DataWidth/8:0]     w, w_was;
  assign ar = {arid, araddr, arlen, arsize, arburst};
  assign aw = {awid, awaddr, awlen, awsize, awburst};
  assign w  = {wdata, wstrb, wlast};

  always_ff @(posedge clk_i) begin
    ar_held <= rst_ni && arvalid && !arready_i;
    aw_held <= rst_ni && awvalid && !awready_i;
    w_held  <= rst_ni && wvalid && !wready_i;
    ar_was  <= ar;
    aw_was  <= aw;
    w_was   <= w;
  end

  always_comb begin
    if (rst_ni) begin
      // Regions.
      a_violation : assert (violation == (rd_valid_i && !rd_inside || wr_valid_i && !wr_inside));
      if (rd_taken) a_read_inside : assert (rd_inside);
      if (wr_taken) a_write_inside : assert (wr_inside);
      a_read_out : assert (arvalid == read_waits);
      a_write_out : assert (awvalid == write_waits);
      if (arvalid) begin
        a_read_address : assert (araddr == {read_line, 6'd0});
        a_read_in_region :
        assert (read_line >= base[read_region]
            && {1'b0, read_line} < {1'b0, base[read_region]} + {1'b0, lines[read_region]});
      end
      if (awvalid) begin
        a_write_address : assert (awaddr == {write_line, 6'd0});
        a_write_in_region :
        assert (write_line >= base[write_region]
            && {1'b0, write_line} < {1'b0, base[write_region]} + {1'b0, lines[write_region]});
      end
      a_whole_lines :
      assert (arlen == 8'(Beats - 1) && awlen == arlen && arburst == 2'd1 && awburst == 2'd1
          && 32'd1 << arsize == DataWidth / 8 && awsize == arsize);

      // Channels.
      if (ar_held) a_ar_stable : assert (arvalid && ar == ar_was);
      if (aw_held) a_aw_stable : assert (awvalid && aw == aw_was);
      if (w_held) a_w_stable : assert (wvalid && w == w_was);
      a_data_out : assert (wvalid == data_waits);
      if (wvalid) begin
        a_data : assert (wdata == data[DataWidth-1:0] && wstrb == strb[DataWidth/8-1:0]);
        a_last : assert (wlast == (sent == 4'(Beats - 1)));
      end

      // Answers.
      a_answer_was_asked_for : assert (rsp_valid == (rvalid_i && rlast_i && asked[row]));
      if (rsp_valid) begin
        a_answer : assert (rsp_addr == {rows[row][25:0], 6'd0} && rsp_tag == rows[row][27:26]);
        if (beats == 4'(Beats - 1)) begin
          a_answer_data : assert (rsp_data == line);
          a_answer_error : assert (rsp_error == (rresp_i[1] || (beats != '0 && faulty)));
        end
      end
      if (rd_taken) a_room : assert (!asked[next]);
      a_writes_bounded : assert (unanswered <= 3'(Writes) && quiet == (unanswered == '0));
      if (rd_taken && watching) a_read_after_write : assert (rd_addr_i[31:6] != watched);
      a_idle : assert (idle == (asked == '0 && unanswered == '0));

      c_table_full : cover (asked == '1 && !arvalid);
      c_waits : cover (watching && ahead == 3'd2 && rd_valid_i && rd_inside && !rd_ready);
      c_answer : cover (rsp_valid && beats == 4'(Beats - 1) && !rsp_error);
      c_line_written : cover (wvalid && wlast && wready_i && quiet == 1'b0 && !awvalid);
    end
  end

  // --- What the solver needs to know ---

  localparam int unsigned BeatWidth = Beats > 1 ? $clog2(Beats) : 1;
  localparam int unsigned Held      = Beats > 1 ? LineBits - DataWidth : DataWidth;

  (* hierconn *) logic [3:0]           \u_port.u_read.busy_q ;
  (* hierconn *) logic [1:0]           \u_port.u_read.next_q , \u_port.u_read.ar_row_q ;
  (* hierconn *) logic [27:0]          \u_port.u_read.table_q[0] , \u_port.u_read.table_q[1] ;
  (* hierconn *) logic [27:0]          \u_port.u_read.table_q[2] , \u_port.u_read.table_q[3] ;
  (* hierconn *) logic [LineBits-1:0]  \u_port.u_write.data_q ;
  (* hierconn *) logic [LineBytes-1:0] \u_port.u_write.strb_q ;
  (* hierconn *) logic [2:0]           \u_port.u_write.count_q ;
  (* hierconn *) logic [BeatWidth-1:0] \u_port.u_write.beat_q ;
  (* hierconn *) logic [3:0]           \u_port.u_write.sent_q ;
  (* hierconn *) logic [3:0][25:0]     \u_port.u_write.waiting_q ;
  (* hierconn *) logic [1:0]           \u_port.u_write.first_q , \u_port.u_write.free_q ;

  (* hierconn *) logic [1:0][26:0] \u_port.end_q ;

  logic [1:0] place;  // of the line that is watched
  assign place = \u_port.u_write.first_q + ahead[1:0];

  // These are there on a narrow bus.
  (* hierconn *) logic [1:0]      \u_port.u_read.gen_ordered.row_q ;
  (* hierconn *) logic [Held-1:0] \u_port.u_read.gen_ordered.held_q ;
  (* hierconn *) logic            \u_port.u_read.gen_ordered.error_q ;

  logic [Reads-1:0][27:0] table_rows;
  assign table_rows = {
    \u_port.u_read.table_q[3] ,
    \u_port.u_read.table_q[2] ,
    \u_port.u_read.table_q[1] ,
    \u_port.u_read.table_q[0]
  };

  always_comb begin
    if (rst_ni) begin
      for (int unsigned i = 0; i < 2; i++) begin
        assert (\u_port.end_q [i] == {1'b0, base[i]} + {1'b0, lines[i]});
      end
      h_rows : assert (\u_port.u_read.busy_q == asked && \u_port.u_read.next_q == next);
      for (int unsigned i = 0; i < Reads; i++) assert (!asked[i] || table_rows[i] == rows[i]);
      h_count : assert (\u_port.u_write.count_q == unanswered);
      if (data_waits) begin
        h_data : assert (\u_port.u_write.data_q == data && \u_port.u_write.strb_q == strb);
        h_sent : assert (sent < 4'(Beats));
      end
      h_turn : assert (\u_port.u_write.free_q == \u_port.u_write.first_q + unanswered[1:0]);
      if (watching) begin
        h_watched :
        assert (ahead < unanswered && \u_port.u_write.sent_q [place]
            && \u_port.u_write.waiting_q [place] == watched);
      end
      h_beat : assert (4'(\u_port.u_write.beat_q ) == (data_waits ? sent : 4'd0));
    end
  end

  if (Beats > 1) begin : gen_ordered
    // Rows are asked for in turn and answered in turn.
    logic [2:0] under_way;
    assign under_way = 3'(asked[0]) + 3'(asked[1]) + 3'(asked[2]) + 3'(asked[3]);
    always_comb begin
      if (rst_ni) begin
        assert (\u_port.u_read.gen_ordered.row_q == oldest);
        assert (\u_port.u_read.gen_ordered.error_q == (beats != '0 && faulty));
        for (int unsigned i = 1; i < Beats; i++) begin
          assert (32'(beats) < i || \u_port.u_read.gen_ordered.held_q [(Beats-1-i)*DataWidth+:DataWidth]
              == came[(Beats-i)*DataWidth+:DataWidth]);
        end
        assert (next == 2'(3'(oldest) + under_way));
        for (int unsigned i = 0; i < Reads; i++) begin
          assert (asked[i] == (3'(2'(2'(i) - oldest)) < under_way));
        end
      end
    end
  end

endmodule
