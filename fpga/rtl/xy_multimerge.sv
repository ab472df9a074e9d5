// Multi-merge: the state machine around heap and scratchpad, and the FIFO behind them (P2 §5.3).
//
//   store ─┐    ┌────────────┐ records ┌──────┐
//          ├───►│ scratchpad ├────┬───►│ FIFO ├──► item
//   rsp ───┘    └────────────┘    │    └──────┘
//                     ▲           ▼ code of the successor
//      state of the slot ◄─── heap: lowest slot
//
// Merges slots, each a sorted sequence of records, into one. A slot owns two buffers of Burst records, a
// circular queue. It is a piece that was put there (store), at most two bursts long, or a run in memory
// (start_runs_i), whose bursts follow each other through the buffers.
//
// The scratchpad is two block memories, of even and odd records, so that a line or a pair is written in a
// cycle, and a record and its successor are read in one. The loop takes two cycles:
//   look  the lowest slot's state says where its next record and that one's successor are, and whether
//         the successor is here; both are read;
//   act   the successor's code replaces the top of the heap, and the record leaves; it is in the FIFO two
//         cycles later. While the successor is not here or the FIFO has no room, look and act are repeated.
// Before that every slot is put into the heap, in order, also two cycles each: look reads its first record.
//
// With a record comes the split between its code and that of the record before it: all that is needed of
// codes behind here, and found in front of the FIFO it is in no path behind it.
//
// Handshake   start_i takes count_i (records) and run_i (records of a slot, a multiple of two bursts; the
//             last slot may be shorter); with start_runs_i also source_base_i and first_i (first record; a
//             multiple of two bursts). idle_o must be high. done_o is high when all records have left
//             item; idle_o too, but not for some cycles after reset and clear_i.
//             store: two records into a row of the scratchpad; no store while a merge is not idle.
//             rd, rsp: the line port. item: valid/ready; item_split_o of the first record of a merge is that
//             between its code and 0.
// Latency     a start takes 2 cycles; 2 from act to item_valid_o; 2 from a line to the act that needs it.
// Throughput  one record every 2 cycles.
// Cut paths   item_ready_i, rd_ready_i and rsp to all outputs. Not cut: store and rsp through a Morton code
//             to the scratchpad; the scratchpad's codes and the heap's comparison are one path.
module xy_multimerge #(
    parameter int unsigned Capacity   = 128,  // records; a power of two
    parameter int unsigned Burst      = 4,    // records; a power of two, 4 or more, at most Capacity / 4
    parameter int unsigned Fifo       = 4,    // records; a power of two, 2 or more
    parameter int unsigned CodeWidth  = 63,
    localparam int unsigned IndexWidth = 27,
    localparam int unsigned RowWidth   = $clog2(Capacity) - 1,
    localparam int unsigned TagWidth   = RowWidth + $clog2(Burst) - 1
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  clear_i,
    input  logic                  wide_i,  // codes of 21 bits an axis

    input  logic                  start_i,
    input  logic                  start_runs_i,
    input  logic [31:0]           source_base_i,
    input  logic [IndexWidth-1:0] first_i,
    input  logic [IndexWidth-1:0] count_i,
    input  logic [IndexWidth-1:0] run_i,
    output logic                  idle_o,
    output logic                  done_o,

    input  logic                  store_i,
    input  logic [RowWidth-1:0]   store_row_i,
    input  logic [1:0][xy_pkg::RecordWidth-1:0] store_pair_i,  // of record_t

    output logic                  rd_valid_o,
    input  logic                  rd_ready_i,
    output logic [31:0]           rd_addr_o,
    output logic [TagWidth-1:0]   rd_tag_o,
    input  logic                  rsp_valid_i,
    input  logic [TagWidth-1:0]   rsp_tag_i,
    input  logic [511:0]          rsp_data_i,

    output logic                  item_valid_o,
    input  logic                  item_ready_i,
    output xy_pkg::record_t       item_o,
    output xy_pkg::split_t        item_split_o,

    output logic                  replace_o  // the heap's top is replaced
);

  localparam int unsigned RecordWidth = xy_pkg::RecordWidth;
  localparam int unsigned Slots       = Capacity / (2 * Burst);
  localparam int unsigned SlotWidth   = $clog2(Slots);
  localparam int unsigned PlaceWidth  = $clog2(2 * Burst);  // of a record in its slot
  localparam int unsigned Levels      = (SlotWidth < 3) ? 3 : SlotWidth;
  localparam int unsigned CountWidth  = $clog2(Burst) + 1;

  // --- Slots not yet in the heap ---

  logic                  inserting_q, runs_q;
  logic [SlotWidth-1:0]  insert_slot_q;
  logic [IndexWidth-1:0] insert_first_q;  // first record of the slot
  logic [IndexWidth-1:0] insert_left_q;   // records from there to the last slot's end
  logic [IndexWidth-1:0] run_q;
  logic [IndexWidth-1:0] left_q;          // records that have not left the scratchpad
  logic                  some_q, final_q; // there are some, there is one
  logic                  started_q;       // in this cycle nothing has been looked up yet

  logic [IndexWidth-1:0] insert_count;
  assign insert_count = (insert_left_q < run_q) ? insert_left_q : run_q;

  // --- Look ---

  logic                 ready, top_valid;
  logic [CodeWidth-1:0] top_code;
  logic [SlotWidth-1:0] top_slot, slot;
  assign slot = inserting_q ? insert_slot_q : top_slot;

  // The state of a slot: its next record, and how many are left.
  logic                  state_write;
  logic [IndexWidth-1:0] state_index, state_left, index, left;

  xy_ram #(
      .Width    (2 * IndexWidth),
      .AddrWidth(SlotWidth),
      .Block    (1'b0)
  ) u_slots (
      .clk_i,
      .write_i     (state_write),
      .write_addr_i(slot),
      .write_data_i({state_index, state_left}),
      .read_addr_i (slot),
      .read_data_o ({index, left})
  );

  logic [2*Slots-1:0]    full;
  logic [PlaceWidth-1:0] place, next_place;
  logic                  buffer_ends, here;
  assign place       = inserting_q ? '0 : index[PlaceWidth-1:0];
  assign next_place  = place + 1'b1;
  assign buffer_ends = next_place[PlaceWidth-2:0] == '0;

  // Both buffers of the heap's slot are looked up while its state is, and the one of the slot to be inserted.
  logic [1:0] slot_full;
  logic       insert_full;
  assign slot_full   = {full[{top_slot, 1'b1}], full[{top_slot, 1'b0}]};
  assign insert_full = full[{insert_slot_q, 1'b0}];

  always_comb begin
    here = 1'b1;
    if (runs_q) begin
      if (inserting_q) here = insert_full;
      else if (buffer_ends) here = slot_full[next_place[PlaceWidth-1]];
    end
  end

  // --- Scratchpad ---

  logic                                 pad_write;
  logic [RowWidth-1:0]                  pad_write_row;
  logic [1:0][RecordWidth-1:0]          pad_write_pair, come, pad;
  // A record's code lies beside it: there is no time for it between the memory and the heap.
  logic [1:0][CodeWidth-1:0]            pad_write_code, pad_code;
  logic [1:0]                           come_valid;
  logic [1:0][RowWidth-1:0]             pad_row;

  for (genvar i = 0; i < 2; i++) begin : gen_bank
    xy_unpack u_unpack (
        .bytes_i (rsp_data_i[i*xy_pkg::RecordBits+:xy_pkg::RecordBits]),
        .record_o(come[i]),
        .valid_o (come_valid[i])
    );

    // The record and its successor lie in different banks.
    localparam bit Odd = (i == 1);
    assign pad_row[i] = {slot, (place[0] == Odd) ? place[PlaceWidth-1:1] : next_place[PlaceWidth-1:1]};

    xy_pkg::record_t write_record;
    assign write_record = pad_write_pair[i];
    xy_morton #(.CodeWidth(CodeWidth)) u_morton (
        .box_i (write_record.box),
        .wide_i,
        .code_o(pad_write_code[i])
    );
    logic unused_prim;
    assign unused_prim = ^write_record.prim;

    xy_ram #(
        .Width    (CodeWidth + RecordWidth),
        .AddrWidth(RowWidth),
        .Block    (1'b1)
    ) u_ram (
        .clk_i,
        .write_i     (pad_write),
        .write_addr_i(pad_write_row),
        .write_data_i({pad_write_code[i], pad_write_pair[i]}),
        .read_addr_i (pad_row[i]),
        .read_data_o ({pad_code[i], pad[i]})
    );
  end

  assign pad_write      = store_i || rsp_valid_i;
  assign pad_write_row  = store_i ? store_row_i : rsp_tag_i[TagWidth-1-:RowWidth];
  assign pad_write_pair = store_i ? store_pair_i : come;

  // Runs are this machine's own writing; what memory made of them is not looked at.
  logic unused_come_valid;
  assign unused_come_valid = ^come_valid;

  // --- Act ---

  logic                  look_here_q, look_odd_q, look_ends_q, look_last_q;
  logic                  look_key_odd_q;  // the bank of the record that gives the code
  logic [IndexWidth-1:0] look_index_q, look_left_q;
  logic                  last;  // of its slot
  logic [RecordWidth-1:0] head;
  assign last = look_last_q;
  assign head = look_odd_q ? pad[1] : pad[0];

  logic room, may_act, act, insert, output_record;
  // After an operation the heap is not ready for a cycle; what was looked up in that one is fresh.
  assign may_act       = ready && some_q && !started_q;
  assign insert        = may_act && inserting_q && look_here_q;
  assign output_record = may_act && !inserting_q && room && (look_here_q || last);
  assign act           = insert || output_record;

  logic [CodeWidth-1:0] code;
  assign code = look_key_odd_q ? pad_code[1] : pad_code[0];

  // A merge leaves the heap empty and with all of its places; so does an end before that, which takes an
  // operation of its own. What starts a merge comes too late in its cycle to be an operation.
  logic wipe_q;
  xy_pkg::heap_op_e op;
  always_comb begin
    op = xy_pkg::HeapReplace;
    if (wipe_q || (final_q && !inserting_q)) op = xy_pkg::HeapClear;
    else if (inserting_q) op = xy_pkg::HeapInsert;
    else if (last) op = xy_pkg::HeapRemove;
  end

  assign replace_o = output_record && !last;

  logic heap_error, heap_full;
  xy_heap #(
      .Levels   (Levels),
      .KeyWidth (CodeWidth),
      .SlotWidth(SlotWidth)
  ) u_heap (
      .clk_i,
      .rst_ni,
      .op_valid_i (wipe_q || act),
      .op_ready_o (ready),
      .op_i       (op),
      .op_key_i   (code),
      .op_slot_i  (slot),
      .op_error_o (heap_error),
      .top_valid_o(top_valid),
      .top_key_o  (top_code),
      .top_slot_o (top_slot),
      .full_o     (heap_full)
  );
  logic unused_heap;
  assign unused_heap = ^{heap_error, heap_full, top_valid};

  assign state_write = act;
  assign state_index = insert ? insert_first_q : look_index_q + 1'b1;
  assign state_left  = insert ? insert_count : look_left_q - 1'b1;

  // A buffer that was emptied takes the burst after the one that waits in the other buffer.
  logic                  take, refill;
  logic [IndexWidth-1:0] after;  // records of the slot after those in the other buffer
  logic [CountWidth-1:0] refill_count;
  assign take         = output_record && runs_q && (look_ends_q || last);
  assign after        = look_left_q - IndexWidth'(Burst + 1);
  assign refill       = take && (look_left_q > IndexWidth'(Burst + 1));
  assign refill_count = (after < IndexWidth'(Burst)) ? after[CountWidth-1:0] : CountWidth'(Burst);

  logic bursts_ready;
  xy_bursts #(
      .Slots     (Slots),
      .Burst     (Burst),
      .IndexWidth(IndexWidth)
  ) u_bursts (
      .clk_i,
      .rst_ni,
      .clear_i,
      .ready_o        (bursts_ready),
      .start_i        (start_i && start_runs_i),
      .source_base_i,
      .first_i,
      .count_i,
      .run_i,
      .refill_i       (refill),
      .refill_buffer_i({slot, look_index_q[PlaceWidth-1]}),
      .refill_first_i (look_index_q + IndexWidth'(Burst + 1)),
      .refill_count_i (refill_count),
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rd_tag_o,
      .rsp_valid_i,
      .rsp_tag_i,
      .full_o         (full),
      .take_i         (take),
      .take_buffer_i  ({slot, look_index_q[PlaceWidth-1]})
  );

  // --- FIFO: a record is promised its place when it leaves the scratchpad ---

  localparam int unsigned RoomWidth = $clog2(Fifo) + 1;

  logic [RoomWidth-1:0]   room_q;
  logic                   done_q;  // no record is left, and all places are free
  logic                   out_valid_q, fifo_ready, pop;
  logic [RecordWidth-1:0] out_record_q;
  logic [CodeWidth-1:0]   out_code_q, before_q;  // of the record on its way to the FIFO, of the one before it
  assign room = room_q != '0;
  assign pop  = item_valid_o && item_ready_i;

  xy_pkg::split_t               out_split;
  logic                         differs;
  logic [$clog2(CodeWidth)-1:0] highest;
  xy_msb #(.Width(CodeWidth)) u_split (
      .bits_i (before_q ^ out_code_q),
      .any_o  (differs),
      .index_o(highest)
  );
  assign out_split = {differs, 6'(highest)};

  xy_fifo #(
      .Width     (xy_pkg::SplitWidth + RecordWidth),
      .Depth     (Fifo),
      .Registered(1)
  ) u_fifo (
      .clk_i,
      .rst_ni,
      .clear_i,
      .in_valid_i (out_valid_q),
      .in_ready_o (fifo_ready),
      .in_data_i  ({out_split, out_record_q}),
      .out_valid_o(item_valid_o),
      .out_ready_i(item_ready_i),
      .out_data_o ({item_split_o, item_o})
  );
  logic unused_fifo_ready;
  assign unused_fifo_ready = fifo_ready;

  assign done_o = done_q;
  assign idle_o = done_q && bursts_ready && ready && !wipe_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      inserting_q <= 1'b0;
      left_q      <= '0;
      some_q      <= 1'b0;
      final_q     <= 1'b0;
      started_q   <= 1'b0;
      wipe_q      <= 1'b1;
      out_valid_q <= 1'b0;
      room_q      <= RoomWidth'(Fifo);
      done_q      <= 1'b1;
    end else if (clear_i) begin
      inserting_q <= 1'b0;
      left_q      <= '0;
      some_q      <= 1'b0;
      final_q     <= 1'b0;
      started_q   <= 1'b0;
      wipe_q      <= 1'b1;
      out_valid_q <= 1'b0;
      room_q      <= RoomWidth'(Fifo);
      done_q      <= 1'b1;
    end else begin
      out_valid_q <= output_record;
      room_q      <= room_q - RoomWidth'(output_record) + RoomWidth'(pop);
      done_q      <= !start_i && !output_record && !some_q
          && ((room_q == RoomWidth'(Fifo)) || (pop && (room_q == RoomWidth'(Fifo - 1))));
      started_q   <= start_i;
      if (ready) wipe_q <= 1'b0;
      if (output_record) begin
        left_q  <= left_q - 1'b1;
        some_q  <= !final_q;
        final_q <= left_q == IndexWidth'(2);
      end
      if (insert && (insert_left_q == insert_count)) inserting_q <= 1'b0;
      if (start_i) begin
        inserting_q <= count_i != '0;
        left_q      <= count_i;
        some_q      <= count_i != '0;
        final_q     <= count_i == IndexWidth'(1);
      end
    end
  end

  always_ff @(posedge clk_i) begin
    look_here_q  <= here;
    look_odd_q   <= place[0];
    // To begin with, the first record; then the successor, in the other bank.
    look_key_odd_q <= inserting_q ? place[0] : !place[0];
    look_ends_q  <= buffer_ends;
    look_index_q <= index;
    look_left_q  <= left;
    look_last_q  <= left == IndexWidth'(1);
    out_record_q <= head;
    out_code_q   <= top_code;
    if (started_q) before_q <= '0;
    else if (out_valid_q) before_q <= out_code_q;
    if (insert) begin
      insert_slot_q  <= insert_slot_q + 1'b1;
      insert_first_q <= insert_first_q + run_q;
      insert_left_q  <= insert_left_q - insert_count;
    end
    if (start_i) begin
      runs_q         <= start_runs_i;
      run_q          <= run_i;
      insert_slot_q  <= '0;
      insert_first_q <= start_runs_i ? first_i : '0;
      insert_left_q  <= count_i;
    end
  end

`ifndef SYNTHESIS
  initial begin
    if ((Capacity & (Capacity - 1)) != 0 || Capacity < 4 * Burst) begin
      $fatal(1, "xy_multimerge: Capacity is %0d, must be a power of two, 4 bursts or more", Capacity);
    end
    if (CodeWidth < 2 || CodeWidth > 63) begin
      $fatal(1, "xy_multimerge: CodeWidth is %0d, must be 2 to 63", CodeWidth);
    end
  end

  // The heap holds a slot for each sequence: it never refuses.
  a_heap_takes_all :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !heap_error);

  // While records are left, their slots are in the heap.
  a_top_valid :
  assert property (@(posedge clk_i) disable iff (!rst_ni) output_record |-> top_valid);

  // A start or a store in the middle of a merge would destroy it.
  a_start_when_idle :
  assert property (@(posedge clk_i) disable iff (!rst_ni) start_i |-> idle_o);
  a_store_when_idle :
  assert property (@(posedge clk_i) disable iff (!rst_ni) store_i |-> left_q == '0 && !rsp_valid_i);

  // The bits are what they stand for.
  a_left :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      some_q == (left_q != '0) && final_q == (left_q == IndexWidth'(1))
      && done_q == (!some_q && !started_q && room_q == RoomWidth'(Fifo)));

  // A place was promised.
  a_fifo_has_room :
  assert property (@(posedge clk_i) disable iff (!rst_ni) out_valid_q |-> fifo_ready);
`endif

endmodule
