// Merge sort: primitives from memory in any order, the same in the order of their Morton codes (P1 §4.1 to
// 4.4, P2 §5). The front half of the builder, and the control that alternates its units.
//
//            ┌────────┐   ┌─────────┐   ┌─────────────┐          item
//   rd ─────►│ reader ├──►│ sorters ├──►│ multi-merge ├──┬─────────────►
//     └──────└────────┘───└─────────┘──►│             │  │  ┌────────┐
//                     runs              └─────────────┘  └─►│ writer ├──► wr
//                                                           └────────┘
//
//   Fill    a block of up to Capacity records comes through the sorters into the scratchpad, in pieces
//   Pieces  the pieces are merged into a run, which is written; the sorters go on with the next block
//   Flush   the rest of the runs leaves
//   Runs    while there are more runs than slots: groups of runs are merged into longer ones, from one
//           region to the other; then Flush again
//   Last    the runs are merged into item
// A change of state, and the start of a further group of runs, take a cycle in which nothing is merged.
//
// Handshake   start_i takes all configuration, which must stay; ready_o must be high. Regions start on a
//             line.
//             rd, rsp, wr: the line ports. Runs are read again, once quiet_i says that what was written is
//             there.
//             item: valid/ready, item_split_o as in xy_multimerge; end_o rises when the last record has left, and stays until the next start.
//             primitive_error_o: input record error_index_o is none; no more come.
//             region_error_o: a run would have left its region; nothing was written outside.
//             clear_i: the state after reset. No line may be under way.
// Latency     see the units. A change of state takes a cycle.
// Throughput  one record every 2 cycles in Pieces, Runs and Last.
// Cut paths   item_ready_i, rd_ready_i, wr_ready_i and rsp to all outputs.
module xy_mergesort #(
    parameter int unsigned Capacity   = 128,  // records of the scratchpad, and of a run; a power of two
    parameter int unsigned Burst      = 4,    // records; a power of two, 4 or more, at most Capacity / 4
    parameter int unsigned Sorters    = 2,    // a power of two, 2 or more
    parameter int unsigned Fifo       = 4,    // records; a power of two, 2 or more
    parameter int unsigned ReadAhead  = 8,    // lines; a power of two, 2 or more
    parameter int unsigned CodeWidth  = 63,   // 63 or 30
    localparam int unsigned MergeTag  = $clog2(Capacity) + $clog2(Burst) - 2,
    localparam int unsigned ReaderTag = $clog2(ReadAhead),
    localparam int unsigned TagWidth  = 1 + ((MergeTag > ReaderTag) ? MergeTag : ReaderTag)
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 clear_i,

    input  logic                 start_i,
    output logic                 ready_o,
    input  logic                 wide_i,   // codes of 21 bits an axis instead of 10
    input  logic [31:0]          count_i,  // primitives, below 2^27
    input  logic                 triangles_i,  // of 40 bytes, instead of boxes
    input  logic [31:0]          primitives_base_i,
    input  logic [31:0]          runs_a_base_i,
    input  logic [31:0]          runs_a_size_i,
    input  logic [31:0]          runs_b_base_i,
    input  logic [31:0]          runs_b_size_i,
    input  logic                 quiet_i,     // every line written can be read back
    output logic [1:0]           stage_o,     // 0: runs are made, 1: merged, 2: the last merge
    output logic                 source_b_o,  // runs are read from region B, not A
    output logic                 target_b_o,  // runs are written to region B, not A
    output logic                 replace_o,   // an operation of the merge's heap

    output logic                 rd_input_o,  // with rd: a line of primitives, not of runs
    output logic                 rd_valid_o,
    input  logic                 rd_ready_i,
    output logic [31:0]          rd_addr_o,
    output logic [TagWidth-1:0]  rd_tag_o,
    input  logic                 rsp_valid_i,
    input  logic [TagWidth-1:0]  rsp_tag_i,
    input  logic [511:0]         rsp_data_i,

    output logic                 wr_valid_o,
    input  logic                 wr_ready_i,
    output logic [31:0]          wr_addr_o,
    output logic [511:0]         wr_data_o,
    output logic [63:0]          wr_strb_o,
    output logic                 wr_last_o,

    output logic                 item_valid_o,
    input  logic                 item_ready_i,
    output xy_pkg::record_t      item_o,
    output xy_pkg::split_t       item_split_o,
    output logic                 end_o,

    output logic                 primitive_error_o,
    output logic                 region_error_o,
    output logic [31:0]          error_index_o
);

  localparam int unsigned IndexWidth = 27;
  localparam int unsigned RowWidth   = $clog2(Capacity) - 1;
  localparam int unsigned SlotLog    = $clog2(Capacity / (2 * Burst));

  typedef enum logic [2:0] {
    Idle   = 3'd0,
    Fill   = 3'd1,
    Pieces = 3'd2,
    Flush  = 3'd3,
    Runs   = 3'd4,
    Last   = 3'd5
  } state_e;

  state_e                state_d, state_q;
  logic [IndexWidth-1:0] first_d, first_q;        // first record of the block or the group of runs
  logic [IndexWidth-1:0] left_d, left_q;          // records from there to the end
  logic [RowWidth:0]     fill_left_d, fill_left_q;  // pairs that the block still lacks
  logic [RowWidth-1:0]   fill_row_d, fill_row_q;
  logic [IndexWidth-1:0] run_d, run_q;            // records of a run: a power of two
  logic [IndexWidth-1:0] rest_d, rest_q;          // groups of runs behind the first one
  logic                  last_d, last_q;          // there are none
  logic                  source_b_d, source_b_q;  // runs are read from region B

  logic [IndexWidth-1:0] count;
  assign count = count_i[IndexWidth-1:0];
  logic unused_count;
  assign unused_count = ^count_i[31:IndexWidth];

  // --- Units ---

  logic [1:0][xy_pkg::RecordWidth-1:0] in_pair, sorted_pair;
  logic in_valid, in_ready, in_two, in_last, sorted_valid, sorted_two, store;
  logic reader_rd_valid, merge_rd_valid, reader_done;
  logic [31:0] reader_rd_addr, merge_rd_addr;
  logic [ReaderTag-1:0] reader_rd_tag;
  logic [MergeTag-1:0] merge_rd_tag;

  xy_reader #(.Room(ReadAhead)) u_reader (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .base_i       (primitives_base_i),
      .count_i,
      .triangles_i,
      .rd_valid_o   (reader_rd_valid),
      .rd_ready_i,
      .rd_addr_o    (reader_rd_addr),
      .rd_tag_o     (reader_rd_tag),
      .rsp_valid_i  (rsp_valid_i && rsp_tag_i[TagWidth-1]),
      .rsp_tag_i    (rsp_tag_i[ReaderTag-1:0]),
      .rsp_data_i,
      .pair_valid_o (in_valid),
      .pair_ready_i (in_ready),
      .pair_two_o   (in_two),
      .pair_last_o  (in_last),
      .pair_o       (in_pair),
      .done_o       (reader_done),
      .error_o      (primitive_error_o),
      .error_index_o
  );

  xy_sorters #(
      .Sorters  (Sorters),
      .Piece    (2 * Burst),
      .CodeWidth(CodeWidth)
  ) u_sorters (
      .clk_i,
      .rst_ni,
      .clear_i,
      .wide_i,
      .in_valid_i (in_valid),
      .in_ready_o (in_ready),
      .in_two_i   (in_two),
      .in_last_i  (in_last),
      .in_pair_i  (in_pair),
      .out_valid_o(sorted_valid),
      .out_ready_i(store),
      .out_two_o  (sorted_two),
      .out_pair_o (sorted_pair)
  );
  // What stands beside a single record is never read.
  logic unused_two;
  assign unused_two = ^{sorted_two, reader_done};

  assign store = (state_q == Fill) && (fill_left_q != '0);

  logic                  merge_start, merge_idle, merge_done, merge_valid, merge_ready, merge_runs;
  logic [IndexWidth-1:0] merge_first, merge_count, merge_run;
  xy_multimerge #(
      .Capacity (Capacity),
      .Burst    (Burst),
      .Fifo     (Fifo),
      .CodeWidth(CodeWidth)
  ) u_merge (
      .clk_i,
      .rst_ni,
      .clear_i,
      .wide_i,
      .start_i      (merge_start),
      .start_runs_i (merge_runs),
      .source_base_i(source_b_d ? runs_b_base_i : runs_a_base_i),
      .first_i      (merge_first),
      .count_i      (merge_count),
      .run_i        (merge_run),
      .idle_o       (merge_idle),
      .done_o       (merge_done),
      .store_i      (store && sorted_valid),
      .store_row_i  (fill_row_q),
      .store_pair_i (sorted_pair),
      .rd_valid_o   (merge_rd_valid),
      .rd_ready_i,
      .rd_addr_o    (merge_rd_addr),
      .rd_tag_o     (merge_rd_tag),
      .rsp_valid_i  (rsp_valid_i && !rsp_tag_i[TagWidth-1]),
      .rsp_tag_i    (rsp_tag_i[MergeTag-1:0]),
      .rsp_data_i,
      .item_valid_o (merge_valid),
      .item_ready_i (merge_ready),
      .item_o,
      .item_split_o,
      .replace_o
  );

  // The input has been read before runs are.
  assign rd_input_o = reader_rd_valid;
  assign rd_valid_o = reader_rd_valid || merge_rd_valid;
  assign rd_addr_o  = reader_rd_valid ? reader_rd_addr : merge_rd_addr;
  assign rd_tag_o   = reader_rd_valid
      ? {1'b1, (TagWidth - 1)'(reader_rd_tag)} : {1'b0, (TagWidth - 1)'(merge_rd_tag)};

  logic [xy_pkg::RecordBits-1:0] item_bytes;
  xy_pack u_pack (.record_i(item_o), .bytes_o(item_bytes));

  logic writer_start, writer_ready, writer_empty;
  xy_burst_writer #(
      .RecordBits(xy_pkg::RecordBits),
      .BurstLines(Burst / 2)
  ) u_writer (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i      (writer_start),
      .region_base_i(source_b_d ? runs_a_base_i : runs_b_base_i),
      .region_size_i(source_b_d ? runs_a_size_i : runs_b_size_i),
      .in_valid_i   (merge_valid && (state_q != Last)),
      .in_ready_o   (writer_ready),
      .in_record_i  (item_bytes),
      .flush_i      (state_q == Flush),
      .empty_o      (writer_empty),
      .error_o      (region_error_o),
      .wr_valid_o,
      .wr_ready_i,
      .wr_addr_o,
      .wr_data_o,
      .wr_strb_o,
      .wr_last_o
  );

  assign merge_ready  = (state_q == Last) ? item_ready_i : writer_ready;
  assign item_valid_o = merge_valid && (state_q == Last);
  assign end_o        = (state_q == Last) && merge_done;
  assign ready_o      = (state_q == Idle || state_q == Last) && merge_idle;

  // The target stays until the writer is started anew, while the source changes with what was written.
  logic target_b_q;
  always_ff @(posedge clk_i) if (writer_start) target_b_q <= !source_b_d;

  assign target_b_o = target_b_q;
  assign source_b_o = source_b_q;

  always_comb begin
    unique case (state_q)
      Runs: stage_o = 2'd1;
      Last: stage_o = 2'd2;
      default: stage_o = 2'd0;
    endcase
  end

  // --- Control ---

  localparam logic [IndexWidth-1:0] Block = IndexWidth'(Capacity);

  localparam int unsigned GroupLog = $clog2(Capacity) + SlotLog;  // of the first merge of runs

  logic [IndexWidth-1:0] group, part;
  logic                  more;
  // The shift drops bits only where there is a single group.
  assign group = run_q << SlotLog;
  assign part  = (state_q == Fill || state_q == Pieces) ? Block : group;
  assign more  = left_q > part;

  // Pairs of the block whose records are the next so many.
  function automatic logic [RowWidth:0] block_pairs(input logic [IndexWidth-1:0] records);
    block_pairs = (records < Block) ? records[RowWidth+1:1] + (RowWidth + 1)'(records[0])
                                    : (RowWidth + 1)'(Capacity / 2);
  endfunction

  // What follows the block or the group at first_q. Additions of this width are done while a merge is under
  // way: the second of these is right three cycles after left_q changes, and no merge is that short.
  logic [IndexWidth-1:0] part_q, after_q, next_first_q, next_part_q;
  logic                  more_q;
  logic [RowWidth:0]     next_pairs_q;
  always_ff @(posedge clk_i) begin
    more_q       <= more;
    part_q       <= more ? part : left_q;
    after_q      <= left_q - part;
    next_first_q <= first_q + part;
    next_part_q  <= (after_q < group) ? after_q : group;
    next_pairs_q <= block_pairs(after_q);
  end

  always_comb begin
    state_d      = state_q;
    first_d      = first_q;
    left_d       = left_q;
    fill_left_d  = fill_left_q;
    fill_row_d   = fill_row_q;
    run_d        = run_q;
    rest_d       = rest_q;
    last_d       = last_q;
    source_b_d   = source_b_q;
    writer_start = 1'b0;
    merge_start  = 1'b0;
    merge_runs   = 1'b1;
    merge_first  = '0;
    merge_count  = count;
    merge_run    = run_q;

    unique case (state_q)
      Fill: begin
        if (store && sorted_valid) begin
          fill_left_d = fill_left_q - 1'b1;
          fill_row_d  = fill_row_q + 1'b1;
        end
        if (fill_left_q == '0) begin
          merge_start = 1'b1;
          merge_runs  = 1'b0;
          merge_count = part_q;
          merge_run   = IndexWidth'(2 * Burst);
          state_d     = Pieces;
        end
      end
      Pieces: begin
        if (merge_idle) begin
          left_d      = after_q;
          fill_left_d = next_pairs_q;
          fill_row_d  = '0;
          state_d     = more_q ? Fill : Flush;
          // What was written is read from now on.
          if (!more_q) source_b_d = 1'b0;
        end
      end
      Flush: begin
        if (writer_empty && quiet_i) begin
          merge_start = 1'b1;
          first_d     = '0;
          left_d      = count;
          if (last_q) begin
            state_d = Last;
          end else begin
            writer_start = 1'b1;
            merge_count  = group;
            state_d      = Runs;
          end
        end
      end
      Runs: begin
        if (merge_idle) begin
          if (!more_q) begin
            source_b_d = !source_b_q;
            run_d      = group;
            rest_d     = rest_q >> SlotLog;
            last_d     = (rest_q >> SlotLog) == '0;
            state_d    = Flush;
          end else begin
            first_d     = next_first_q;
            left_d      = after_q;
            merge_start = 1'b1;
            merge_first = next_first_q;
            merge_count = next_part_q;
          end
        end
      end
      default: ;
    endcase

    if (start_i) begin
      left_d       = count;
      fill_left_d  = block_pairs(count);
      fill_row_d   = '0;
      run_d        = Block;
      rest_d       = (count - 1'b1) >> GroupLog;
      last_d       = (count == '0) || (((count - 1'b1) >> GroupLog) == '0);
      // The first runs are written to region A, as if B were the source.
      source_b_d   = 1'b1;
      writer_start = 1'b1;
      state_d      = (count == '0) ? Flush : Fill;
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q <= Idle;
    end else if (clear_i) begin
      state_q <= Idle;
    end else begin
      state_q <= state_d;
    end
  end

  always_ff @(posedge clk_i) begin
    first_q     <= first_d;
    left_q      <= left_d;
    fill_left_q <= fill_left_d;
    fill_row_q  <= fill_row_d;
    run_q       <= run_d;
    rest_q      <= rest_d;
    last_q      <= last_d;
    source_b_q  <= source_b_d;
  end

`ifndef SYNTHESIS
  // The units' own state says when a start is possible.
  a_start_when_ready :
  assert property (@(posedge clk_i) disable iff (!rst_ni) start_i |-> ready_o && count_i[31:27] == '0);

  // One road to memory: if both wanted it, one would lose its request.
  a_one_reads :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !(reader_rd_valid && merge_rd_valid));
`endif

endmodule
