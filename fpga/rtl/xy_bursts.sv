// Which bursts the multi-merge reads, and when: the read side of its double buffers.
//
//   start ──► first and second burst of every run ──┐
//                                                    ├──► burst under way ──► rd, a line a cycle
//   refill ─► queue, or past it ─────────────────────┘
//   rsp ────► lines come, for each buffer ──► full_o
//
// After a start it asks for the first burst of every run, in order, then for the second of every run that
// has one, then for those that refill_* names. A burst of fewer lines than a buffer's counts for a whole
// one: its first line counts for those that there are not.
//
// Handshake   start_i takes source_base_i, first_i, count_i and run_i (records, all but count_i multiples
//             of two bursts); ready_o must be high. After reset and clear_i ready_o stays low while the
//             counts of lines are set to 0, a cycle for each buffer.
//             refill_i: ask for the burst of refill_count_i records (at most Burst) from record
//             refill_first_i on, for buffer refill_buffer_i. There is room: a buffer is refilled when it
//             has been emptied, so no more bursts wait than there are slots.
//             rd, rsp: the line port. The tag is {line of the scratchpad, lines that it counts for, less 1}.
//             full_o: the buffer's burst is here; take_i empties buffer take_buffer_i.
// Latency     2 cycles from a start to the first line asked for, 1 from a refill while nothing else waits;
//             1 from the last line to full_o.
// Throughput  one line a cycle asked for and one that comes.
// Cut paths   all.
module xy_bursts #(
    parameter int unsigned Slots      = 16,  // a power of two, 2 or more; a slot has two buffers
    parameter int unsigned Burst      = 4,   // records of a buffer; a power of two, 4 or more
    parameter int unsigned IndexWidth = 27,
    localparam int unsigned SlotWidth = $clog2(Slots),
    localparam int unsigned LineWidth = $clog2(Burst) - 1,
    localparam int unsigned TagWidth  = SlotWidth + 1 + 2 * LineWidth
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  clear_i,
    output logic                  ready_o,

    input  logic                  start_i,
    input  logic [31:0]           source_base_i,
    input  logic [IndexWidth-1:0] first_i,
    input  logic [IndexWidth-1:0] count_i,
    input  logic [IndexWidth-1:0] run_i,

    input  logic                  refill_i,
    input  logic [SlotWidth:0]    refill_buffer_i,
    input  logic [IndexWidth-1:0] refill_first_i,
    input  logic [$clog2(Burst):0] refill_count_i,

    output logic                  rd_valid_o,
    input  logic                  rd_ready_i,
    output logic [31:0]           rd_addr_o,
    output logic [TagWidth-1:0]   rd_tag_o,
    input  logic                  rsp_valid_i,
    input  logic [TagWidth-1:0]   rsp_tag_i,

    output logic [2*Slots-1:0]    full_o,
    input  logic                  take_i,
    input  logic [SlotWidth:0]    take_buffer_i
);

  localparam int unsigned CountWidth = $clog2(Burst) + 1;

  // --- First and second bursts ---

  logic                  gen_q, gen_second_q;
  logic [SlotWidth-1:0]  gen_slot_q;
  logic [IndexWidth-1:0] gen_first_q;  // first record of the run
  logic [IndexWidth-1:0] gen_left_q;   // records from there to the last run's end
  logic [IndexWidth-1:0] first_q, count_q, run_q;
  logic [31:0]           base_q;

  logic [IndexWidth-1:0] gen_next_left, gen_in_run;
  logic [IndexWidth:0]   past_q;  // run_q and a burst; second bursts begin two cycles after the start or later
  logic                  gen_more;
  always_ff @(posedge clk_i) past_q <= {1'b0, run_q} + (IndexWidth + 1)'(Burst);
  assign gen_in_run    = (gen_left_q < run_q) ? gen_left_q : run_q;
  assign gen_next_left = gen_left_q - gen_in_run;
  assign gen_more      = gen_second_q ? (past_q < {1'b0, gen_left_q}) : (run_q < gen_left_q);

  logic [IndexWidth-1:0] gen_burst_first, gen_burst_left;
  logic [CountWidth-1:0] gen_burst_count;
  assign gen_burst_first = gen_second_q ? gen_first_q + IndexWidth'(Burst) : gen_first_q;
  assign gen_burst_left  = gen_second_q ? gen_in_run - IndexWidth'(Burst) : gen_in_run;
  assign gen_burst_count = (gen_burst_left < IndexWidth'(Burst))
      ? gen_burst_left[CountWidth-1:0] : CountWidth'(Burst);

  // --- Later bursts ---

  localparam int unsigned QueueWidth = SlotWidth + 1 + IndexWidth + CountWidth;

  logic [QueueWidth-1:0] queue_data;
  logic                  queue_valid, queue_ready, queue_room, bypass;

  xy_fifo #(
      .Width(QueueWidth),
      .Depth(Slots)
  ) u_queue (
      .clk_i,
      .rst_ni,
      .clear_i,
      .in_valid_i (refill_i && !bypass),
      .in_ready_o (queue_room),
      .in_data_i  ({refill_buffer_i, refill_first_i, refill_count_i}),
      .out_valid_o(queue_valid),
      .out_ready_i(queue_ready),
      .out_data_o (queue_data)
  );

  // --- The burst under way ---

  logic                  valid_q;
  logic [SlotWidth:0]    buffer_q;
  logic [31:0]           addr_q;
  logic [LineWidth-1:0]  line_q, last_q;  // last_q: number of the last line

  logic taken, next, load;
  assign taken = valid_q && rd_ready_i;
  assign next  = !valid_q || (taken && (line_q == last_q));
  assign load  = next && (gen_q || queue_valid || refill_i);

  logic [SlotWidth:0]    load_buffer;
  logic [IndexWidth-1:0] load_first;
  logic [CountWidth-1:0] load_count, load_last;
  always_comb begin
    if (gen_q) begin
      load_buffer = {gen_slot_q, gen_second_q};
      load_first  = gen_burst_first;
      load_count  = gen_burst_count;
    end else if (queue_valid) begin
      {load_buffer, load_first, load_count} = queue_data;
    end else begin
      load_buffer = refill_buffer_i;
      load_first  = refill_first_i;
      load_count  = refill_count_i;
    end
  end
  // Two records a line.
  assign load_last   = (load_count - 1'b1) >> 1;
  assign queue_ready = next && !gen_q;
  assign bypass      = queue_ready && !queue_valid;

  // The lines that the first one stands for beside itself.
  logic [LineWidth-1:0] extra;
  assign extra      = (line_q == '0) ? ~last_q : '0;
  assign rd_valid_o = valid_q;
  assign rd_addr_o  = addr_q;
  assign rd_tag_o   = {buffer_q, line_q, extra};

  // --- Lines that have come ---

  logic [SlotWidth+1:0] sweep_q;  // the buffer whose count is being set to 0; then stays
  logic                 sweeping;
  assign sweeping = !sweep_q[SlotWidth+1];
  assign ready_o  = !sweeping;

  logic                 complete;
  logic [SlotWidth:0]   rsp_buffer;
  logic [LineWidth-1:0] rsp_line, rsp_extra, come, come_now;
  assign {rsp_buffer, rsp_line, rsp_extra} = rsp_tag_i;
  assign come_now = come + rsp_extra + 1'b1;
  assign complete = come == ~rsp_extra;  // come_now is 0

  xy_ram #(
      .Width    (LineWidth),
      .AddrWidth(SlotWidth + 1),
      .Block    (1'b0)
  ) u_come (
      .clk_i,
      .write_i     (sweeping || rsp_valid_i),
      .write_addr_i(sweeping ? sweep_q[SlotWidth:0] : rsp_buffer),
      .write_data_i(sweeping ? '0 : come_now),
      .read_addr_i (rsp_buffer),
      .read_data_o (come)
  );

  logic unused_line;
  assign unused_line = ^{rsp_line, queue_room, load_last[CountWidth-1:LineWidth]};

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      gen_q   <= 1'b0;
      valid_q <= 1'b0;
      full_o  <= '0;
      sweep_q <= '0;
    end else if (clear_i) begin
      gen_q   <= 1'b0;
      valid_q <= 1'b0;
      full_o  <= '0;
      sweep_q <= '0;
    end else begin
      if (sweeping) sweep_q <= sweep_q + 1'b1;
      if (start_i) gen_q <= count_i != '0;
      else if (load && gen_q && !gen_more) gen_q <= !gen_second_q && (count_q > IndexWidth'(Burst));
      if (next) valid_q <= load;
      for (int unsigned i = 0; i < 2 * Slots; i++) begin
        if (rsp_buffer == (SlotWidth + 1)'(i) && rsp_valid_i && complete) full_o[i] <= 1'b1;
        if (take_buffer_i == (SlotWidth + 1)'(i) && take_i) full_o[i] <= 1'b0;
      end
    end
  end

  always_ff @(posedge clk_i) begin
    if (start_i) begin
      base_q       <= source_base_i;
      first_q      <= first_i;
      count_q      <= count_i;
      run_q        <= run_i;
      gen_second_q <= 1'b0;
      gen_slot_q   <= '0;
      gen_first_q  <= first_i;
      gen_left_q   <= count_i;
    end else if (load && gen_q) begin
      if (gen_more) begin
        gen_slot_q  <= gen_slot_q + 1'b1;
        gen_first_q <= gen_first_q + run_q;
        gen_left_q  <= gen_next_left;
      end else begin
        gen_second_q <= 1'b1;
        gen_slot_q   <= '0;
        gen_first_q  <= first_q;
        gen_left_q   <= count_q;
      end
    end
    if (load) begin
      buffer_q <= load_buffer;
      addr_q   <= base_q + {load_first, 5'd0};
      line_q   <= '0;
      last_q   <= load_last[LineWidth-1:0];
    end else if (taken) begin
      addr_q <= addr_q + 32'(xy_pkg::LineBytes);
      line_q <= line_q + 1'b1;
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (Burst < 4 || (Burst & (Burst - 1)) != 0) begin
      $fatal(1, "xy_bursts: Burst is %0d, must be a power of two, 4 or more", Burst);
    end
    if (IndexWidth != 27) $fatal(1, "xy_bursts: IndexWidth is %0d, addresses have 27 + 5 bits", IndexWidth);
  end

  // A start finds no burst of the merge before, or its lines would go into the wrong buffers.
  a_start_when_ready :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      start_i |-> ready_o && !gen_q && !valid_q && !queue_valid && (full_o == '0));

  // The queue has room for a burst of every slot.
  a_queue_has_room :
  assert property (@(posedge clk_i) disable iff (!rst_ni) refill_i |-> queue_room);

  // A line for a buffer that is full would overwrite what waits there.
  a_room_for_line :
  assert property (@(posedge clk_i) disable iff (!rst_ni) rsp_valid_i |-> !full_o[rsp_buffer]);

  // Only what is here can be taken.
  a_take_full :
  assert property (@(posedge clk_i) disable iff (!rst_ni) take_i |-> full_o[take_buffer_i]);

  // A request offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      rd_valid_o && !rd_ready_i |=> rd_valid_o && $stable(rd_addr_o) && $stable(rd_tag_o));
`endif

endmodule
