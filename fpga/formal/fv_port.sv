// xy_port lets nothing out that was not asked for inside its region, keeps the rules of AXI4, and gives
// nothing back that was not asked for.
//
// A read of a line does not leave while a write of it is under way: one such write, any, is watched. A read
// that is already on its channel when such a write comes was asked for before it.
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

  // Whether a line is in a region.
  logic [1:0][26:0] ends;
  assign ends = {{1'b0, base[1]} + {1'b0, lines[1]}, {1'b0, base[0]} + {1'b0, lines[0]}};

  logic rd_taken, wr_taken;
  assign rd_taken = rst_ni && rd_valid_i && rd_ready;
  assign wr_taken = rst_ni && wr_valid_i && wr_ready;

  // What was taken and is not yet on its way: two of each at most, in order.
  logic [1:0]                 rd_put = '0, rd_get = '0, wr_put = '0, wr_get = '0, rd_count, wr_count;
  logic [1:0][25:0]           rd_line, wr_line;
  logic [1:0]                 rd_region, wr_region;
  logic [1:0][1:0]            rd_tag;
  logic                       rd_sent, aw_sent, w_sent, wr_sent;
  logic                       address_done = 1'b0, data_done = 1'b0;
  logic [3:0]                 sent = '0;  // beats
  logic [2:0]                 unanswered = '0;
  logic                       responded;
  assign rd_count = rd_put - rd_get;
  assign wr_count = wr_put - wr_get;
  assign rd_sent  = arvalid && arready_i;
  assign aw_sent  = awvalid && awready_i;
  assign w_sent   = wvalid && wready_i && sent == 4'(Beats - 1);
  assign wr_sent  = wr_count != '0 && (aw_sent || address_done) && (w_sent || data_done);

  // Of the first of each, whether it is outside, and then dropped: a write when those before it are answered.
  logic rd_inside, wr_inside, rd_drop, wr_drop, outside = 1'b0;
  assign rd_inside = rd_line[rd_get[0]] >= base[rd_region[rd_get[0]]]
      && {1'b0, rd_line[rd_get[0]]} < ends[rd_region[rd_get[0]]];
  assign wr_inside = wr_line[wr_get[0]] >= base[wr_region[wr_get[0]]]
      && {1'b0, wr_line[wr_get[0]]} < ends[wr_region[wr_get[0]]];
  assign rd_drop   = rd_count != '0 && !rd_inside;
  assign wr_drop   = wr_count != '0 && !wr_inside && unanswered <= 3'(wr_count);
  always_ff @(posedge clk_i) begin
    outside <= rst_ni && (rd_drop || (wr_count != '0 && !wr_inside));
  end
  assign responded = (bvalid_i || wr_drop) && unanswered != '0;

  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      rd_put       <= '0;
      rd_get       <= '0;
      wr_put       <= '0;
      wr_get       <= '0;
      address_done <= 1'b0;
      data_done    <= 1'b0;
      sent         <= '0;
      unanswered   <= '0;
    end else begin
      if (rd_taken) begin
        rd_put               <= rd_put + 1'b1;
        rd_line[rd_put[0]]   <= rd_addr_i[31:6];
        rd_region[rd_put[0]] <= rd_region_i;
        rd_tag[rd_put[0]]    <= rd_tag_i;
      end
      if (rd_sent || rd_drop) rd_get <= rd_get + 1'b1;
      if (wr_taken) begin
        wr_put               <= wr_put + 1'b1;
        wr_line[wr_put[0]]   <= wr_addr_i[31:6];
        wr_region[wr_put[0]] <= wr_region_i;
      end
      if (wr_sent || wr_drop) wr_get <= wr_get + 1'b1;
      address_done <= !wr_sent && (address_done || aw_sent);
      data_done    <= !wr_sent && (data_done || w_sent);
      if (wvalid && wready_i) sent <= sent == 4'(Beats - 1) ? '0 : sent + 1'b1;
      unanswered <= unanswered + 3'(wr_taken) - 3'(responded);
    end
  end

  // --- The bytes of a write, any ---

  (* anyseq *) logic                 follow;
  logic                              followed = 1'b0, slot;
  logic [Beats-1:0][DataWidth-1:0]   data;
  logic [Beats-1:0][DataWidth/8-1:0] strb;
  logic [DataWidth-1:0]              beat_data;
  logic [DataWidth/8-1:0]            beat_strb;
  assign beat_data = data[Beats > 1 ? sent[1:0] : 2'd0];
  assign beat_strb = strb[Beats > 1 ? sent[1:0] : 2'd0];
  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      followed <= 1'b0;
    end else if (!followed) begin
      followed <= wr_taken && follow;
      slot     <= wr_put[0];
      data     <= wr_data_i;
      strb     <= wr_strb_i;
    end else if ((wr_sent || wr_drop) && wr_get[0] == slot) begin
      followed <= 1'b0;
    end
  end

  // --- A line that is written, and how many before it have had no response ---

  (* anyconst *) logic [25:0] watched;
  (* anyseq *)   logic        watch;
  logic       watching = 1'b0;
  logic [2:0] ahead;
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
      if (rd_sent) begin
        asked[next] <= 1'b1;
        rows[next]  <= {rd_tag[rd_get[0]], rd_line[rd_get[0]]};
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
      a_violation : assert (violation == outside);
      if (arvalid) begin
        a_read_was_asked_for : assert (rd_count != '0);
        a_read_address : assert (araddr == {rd_line[rd_get[0]], 6'd0});
        a_read_in_region : assert (rd_inside);
      end
      a_write_out : assert (awvalid == (wr_count != '0 && wr_inside && !address_done));
      if (awvalid) begin
        a_write_address : assert (awaddr == {wr_line[wr_get[0]], 6'd0});
        a_write_in_region : assert (wr_inside);
      end
      a_whole_lines :
      assert (arlen == 8'(Beats - 1) && awlen == arlen && arburst == 2'd1 && awburst == 2'd1
          && 32'd1 << arsize == DataWidth / 8 && awsize == arsize);

      // Channels.
      if (ar_held) a_ar_stable : assert (arvalid && ar == ar_was);
      if (aw_held) a_aw_stable : assert (awvalid && aw == aw_was);
      if (w_held) a_w_stable : assert (wvalid && w == w_was);
      a_data_out : assert (wvalid == (wr_count != '0 && wr_inside && !data_done));
      if (wvalid) begin
        a_data :
        assert (!(followed && slot == wr_get[0]) || (wdata == beat_data && wstrb == beat_strb));
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
      if (arvalid) a_room : assert (!asked[next]);
      a_writes_bounded : assert (unanswered <= 3'(Writes) && quiet == (unanswered == '0));
      if (arvalid && !ar_held && watching) a_read_after_write : assert (araddr[31:6] != watched);
      a_idle :
      assert (idle == (asked == '0 && rd_count == '0 && unanswered == '0 && wr_count == '0));
      // With a_comes_to_an_end of fv_control: who waits for memory has its time counted.
      if (idle) a_idle_takes : assert (rd_ready && wr_ready);

      c_table_full : cover (asked == '1 && rd_count == 2'd2);
      c_waits : cover (watching && ahead == 3'd2 && rd_count == 2'd1 && !arvalid && asked == '0);
      c_answer : cover (rsp_valid && beats == 4'(Beats - 1) && !rsp_error);
      c_dropped : cover (wr_drop && wr_count == 2'd2);
      c_line_written : cover (wvalid && wlast && wready_i && quiet == 1'b0 && !awvalid);
    end
  end

  // --- What the solver needs to know ---

  localparam int unsigned BeatWidth = Beats > 1 ? $clog2(Beats) : 1;
  localparam int unsigned Held      = Beats > 1 ? LineBits - DataWidth : DataWidth;

  (* hierconn *) logic [3:0]           \u_port.u_read.busy_q ;
  (* hierconn *) logic [1:0]           \u_port.u_read.next_q ;
  (* hierconn *) logic                 \u_port.u_read.offered_q ;
  (* hierconn *) logic [27:0]          \u_port.u_read.table_q[0] , \u_port.u_read.table_q[1] ;
  (* hierconn *) logic [27:0]          \u_port.u_read.table_q[2] , \u_port.u_read.table_q[3] ;
  (* hierconn *) logic [1:0]           \u_port.u_read.u_queue.write_q , \u_port.u_read.u_queue.read_q ;
  (* hierconn *) logic [28:0]          \u_port.u_read.u_queue.u_ram.gen_distributed.mem[0] ;
  (* hierconn *) logic [28:0]          \u_port.u_read.u_queue.u_ram.gen_distributed.mem[1] ;
  (* hierconn *) logic                 \u_port.u_read.u_queue.gen_registered.valid_q ;
  (* hierconn *) logic [28:0]          \u_port.u_read.u_queue.gen_registered.first_q ;
  (* hierconn *) logic [1:0]           \u_port.u_write.u_queue.write_q , \u_port.u_write.u_queue.read_q ;
  (* hierconn *) logic [26:0]          \u_port.u_write.u_queue.u_ram.gen_distributed.mem[0] ;
  (* hierconn *) logic [26:0]          \u_port.u_write.u_queue.u_ram.gen_distributed.mem[1] ;
  (* hierconn *) logic                 \u_port.u_write.u_queue.gen_registered.valid_q ;
  (* hierconn *) logic [26:0]          \u_port.u_write.u_queue.gen_registered.first_q ;
  (* hierconn *) logic [1:0]           \u_port.u_write.u_data.write_q , \u_port.u_write.u_data.read_q ;
  (* hierconn *) logic [575:0]         \u_port.u_write.u_data.u_ram.gen_distributed.mem[0] ;
  (* hierconn *) logic [575:0]         \u_port.u_write.u_data.u_ram.gen_distributed.mem[1] ;
  (* hierconn *) logic [1:0]           \u_port.u_write.queued_q ;
  (* hierconn *) logic                 \u_port.u_write.begun_q ;
  (* hierconn *) logic                 \u_port.u_write.aw_done_q , \u_port.u_write.w_done_q ;
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
  (* hierconn *) logic            \u_port.u_read.gen_ordered.some_q ;
  (* hierconn *) logic [Held-1:0] \u_port.u_read.gen_ordered.held_q ;
  (* hierconn *) logic            \u_port.u_read.gen_ordered.error_q ;

  logic [1:0][28:0]  rd_words;
  logic [1:0][26:0]  wr_words;
  logic [1:0][575:0] wr_lines;
  assign rd_words = {
    \u_port.u_read.u_queue.u_ram.gen_distributed.mem[1] ,
    \u_port.u_read.u_queue.u_ram.gen_distributed.mem[0]
  };
  assign wr_words = {
    \u_port.u_write.u_queue.u_ram.gen_distributed.mem[1] ,
    \u_port.u_write.u_queue.u_ram.gen_distributed.mem[0]
  };
  assign wr_lines = {
    \u_port.u_write.u_data.u_ram.gen_distributed.mem[1] ,
    \u_port.u_write.u_data.u_ram.gen_distributed.mem[0]
  };

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
        assert (\u_port.end_q [i] == ends[i]);
      end
      h_rows : assert (\u_port.u_read.busy_q == asked && \u_port.u_read.next_q == next);
      for (int unsigned i = 0; i < Reads; i++) assert (!asked[i] || table_rows[i] == rows[i]);
      h_count : assert (\u_port.u_write.count_q == unanswered);
      h_queues :
      assert (rd_count <= 2'd2 && wr_count <= 2'd2
          && \u_port.u_read.u_queue.write_q == rd_put && \u_port.u_read.u_queue.read_q == rd_get
          && \u_port.u_write.u_queue.write_q == wr_put && \u_port.u_write.u_queue.read_q == wr_get
          && \u_port.u_write.u_data.write_q == wr_put && \u_port.u_write.u_data.read_q == wr_get
          && \u_port.u_write.queued_q == wr_count);
      h_firsts :
      assert (\u_port.u_read.u_queue.gen_registered.valid_q == (rd_count != '0)
          && \u_port.u_write.u_queue.gen_registered.valid_q == (wr_count != '0)
          && (rd_count == '0 || \u_port.u_read.u_queue.gen_registered.first_q == rd_words[rd_get[0]])
          && (wr_count == '0 || \u_port.u_write.u_queue.gen_registered.first_q == wr_words[wr_get[0]]));
      for (int unsigned i = 0; i < 2; i++) begin
        if (rd_count == 2'd2 || (rd_count == 2'd1 && rd_get[0] == 1'(i))) begin
          assert (rd_words[i] == {rd_region[i], rd_tag[i], rd_line[i]});
        end
        if (wr_count == 2'd2 || (wr_count == 2'd1 && wr_get[0] == 1'(i))) begin
          assert (wr_words[i] == {wr_region[i], wr_line[i]});
        end
      end
      if (followed) begin
        assert (wr_count == 2'd2 || (wr_count == 2'd1 && wr_get[0] == slot));
        assert (wr_lines[slot] == {strb, data});
      end
      h_offered : assert (\u_port.u_read.offered_q == ar_held);
      if (ar_held) assert (rd_count != '0 && rd_inside && !asked[next] && ar_was == ar);
      h_begun :
      assert (!\u_port.u_write.begun_q || (wr_count != '0 && wr_inside));
      if (address_done || data_done || sent != '0) assert (\u_port.u_write.begun_q );
      h_done :
      assert (\u_port.u_write.aw_done_q == address_done && \u_port.u_write.w_done_q == data_done
          && !(address_done && data_done) && (wr_count != '0 || !address_done && !data_done)
          && sent < 4'(Beats) && ((wr_count != '0 && !data_done) || sent == '0));
      for (int unsigned i = 0; i < Writes; i++) begin
        assert (\u_port.u_write.sent_q [i] == (3'(2'(2'(i) - \u_port.u_write.first_q )) < unanswered));
      end
      h_turn : assert (\u_port.u_write.free_q == \u_port.u_write.first_q + unanswered[1:0]);
      if (watching) begin
        h_watched :
        assert (ahead < unanswered && \u_port.u_write.sent_q [place]
            && \u_port.u_write.waiting_q [place] == watched);
      end
      h_beat : assert (4'(\u_port.u_write.beat_q ) == sent);
    end
  end

  if (Beats > 1) begin : gen_ordered
    // Rows are asked for in turn and answered in turn.
    logic [2:0] under_way;
    assign under_way = 3'(asked[0]) + 3'(asked[1]) + 3'(asked[2]) + 3'(asked[3]);
    always_comb begin
      if (rst_ni) begin
        assert (\u_port.u_read.gen_ordered.row_q == oldest);
        assert (\u_port.u_read.gen_ordered.some_q == (asked != '0));
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
