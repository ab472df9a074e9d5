// Pipelined min-heap (Ioannou & Katevenis; the heap unit of the multi-merge sorter).
//
//            op ──► top register ──► stage 0 ──► stage 1 ──► ... ──► stage Levels-1
//                        │              │           │                     │
//   top_key_o ◄──────────┘           level 0     level 1               level Levels-1
//   top_slot_o                       1 entry     2 entries             2^(Levels-1) entries
//
// Holds 2^Levels entries: the top register and a binary tree of Levels levels below it, each level
// with a memory of its own. Entries are ordered by {key, slot}, lowest first, so entries of equal
// keys come out by slot. An entry carries one more bit above the key, set for infinity: no key is
// reserved. Infinity fills vacant places and takes the place of a removed entry.
//
// Handshake   op_valid_i and op_ready_o both high: the operation is taken. op_ready_o is a register.
//             An operation taken in cycle T:
//               T+1    top_*_o show the result (they are right whenever top_valid_o is high);
//                      op_ready_o is low;
//                      op_error_o is high if it could not be done, and then nothing changed:
//                        insert while full_o, replace or remove while top_valid_o is low;
//               T+2    op_ready_o is high again.
// Operations  insert, replace (top out, entry in), remove (top out), clear. A removed entry's place
//             is given back by clear only: full_o counts inserts since the last clear.
// Latency     1 cycle from operation to top; Levels further cycles, unseen, to the last level.
// Throughput  one operation of any kind every 2 cycles.
// Cut paths   all outputs are registers. Not cut: op_i, op_key_i and op_slot_i are compared with the
//             top and with its child before they meet a register, so that whoever looks at the top
//             in one cycle can feed its successor in the next.
//
// The order in which inserts fill a level is that of the bit-reversed positions, where the authors
// fill from left to right: the number of entries is then the path, without a normalising shift.
module xy_heap #(
    parameter int unsigned Levels     = 8,   // 3 or more
    parameter int unsigned KeyWidth   = 30,
    parameter int unsigned SlotWidth  = 8,
    parameter int unsigned BlockLevel = 7    // first level in block memory
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,

    input  logic                 op_valid_i,
    output logic                 op_ready_o,
    input  xy_pkg::heap_op_e     op_i,
    input  logic [KeyWidth-1:0]  op_key_i,
    input  logic [SlotWidth-1:0] op_slot_i,
    output logic                 op_error_o,

    output logic                 top_valid_o,
    output logic [KeyWidth-1:0]  top_key_o,
    output logic [SlotWidth-1:0] top_slot_o,
    output logic                 full_o
);

  // An entry is {infinite, key, slot}.
  localparam int unsigned EntryWidth = 1 + KeyWidth + SlotWidth;

  // Operation into stage k (k = Levels: out of the last stage).
  logic [Levels:0]                 stage_insert, stage_replace, stage_clear;
  logic [Levels:0][Levels-1:0]     stage_path;
  logic [Levels:0][EntryWidth-1:0] stage_entry;
  logic [Levels:0][EntryWidth-1:0] stage_own;

  // Children that level k offers to the stage above; none below the last level.
  logic [Levels:0][EntryWidth-1:0] left, right;

  // Path of the operation in stage k.
  logic [Levels-1:0][Levels-1:0] pos;

  // --- Top ---

  logic                  ready_q, error_q;
  logic [EntryWidth-1:0] top_d, top_q;
  logic [Levels:0]       size_d, size_q;

  logic taken;
  assign taken = op_valid_i && ready_q;

  // A remove is a replace by infinity; a clear writes it everywhere.
  logic [EntryWidth-1:0] entry;
  assign entry = (op_i == xy_pkg::HeapRemove) || (op_i == xy_pkg::HeapClear)
      ? '1 : {1'b0, op_key_i, op_slot_i};

  logic empty, full, vacant;
  assign empty  = size_q == '0;
  assign full   = size_q[Levels];
  assign vacant = top_q[EntryWidth-1];

  logic child_lower, top_stays;
  xy_less #(.Width(EntryWidth)) u_child_lower (.a_i(left[0]), .b_i(entry), .less_o(child_lower));
  xy_less #(.Width(EntryWidth)) u_top_stays (.a_i(top_q), .b_i(entry), .less_o(top_stays));

  logic                  error, insert, replace, clear;
  logic [EntryWidth-1:0] below_entry;

  always_comb begin
    error       = 1'b0;
    insert      = 1'b0;
    replace     = 1'b0;
    clear       = 1'b0;
    top_d       = top_q;
    size_d      = size_q;
    below_entry = entry;
    unique case (op_i)
      xy_pkg::HeapInsert: begin
        error = taken && full;
        if (taken && !full) begin
          size_d = size_q + 1'b1;
          insert = !empty;
          if (!top_stays) top_d = entry;
        end
        if (!top_stays) below_entry = top_q;
      end
      xy_pkg::HeapReplace, xy_pkg::HeapRemove: begin
        error = taken && vacant;
        if (taken && !vacant) begin
          replace = child_lower;
          top_d   = child_lower ? left[0] : entry;
        end
      end
      xy_pkg::HeapClear: begin
        if (taken) begin
          clear  = 1'b1;
          size_d = '0;
          top_d  = entry;
        end
      end
      default: ;
    endcase
  end

  assign stage_insert[0]  = insert;
  assign stage_replace[0] = replace;
  assign stage_clear[0]   = clear;
  assign stage_path[0]    = size_q[Levels-1:0];
  assign stage_entry[0]   = below_entry;
  assign stage_own[0]     = left[0];

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      ready_q <= 1'b1;
      error_q <= 1'b0;
      top_q   <= '1;
      size_q  <= '0;
    end else begin
      ready_q <= !taken;
      error_q <= error;
      top_q   <= top_d;
      size_q  <= size_d;
    end
  end

  assign op_ready_o               = ready_q;
  assign op_error_o               = error_q;
  assign top_valid_o              = !vacant;
  assign {top_key_o, top_slot_o}  = top_q[EntryWidth-2:0];
  assign full_o                   = full;

  // --- Levels ---

  for (genvar k = 0; k < Levels; k++) begin : gen_level
    logic level_clear, write, grow;
    logic [EntryWidth-1:0] write_entry;

    xy_heap_stage #(
        .Level     (k),
        .Levels    (Levels),
        .EntryWidth(EntryWidth)
    ) u_stage (
        .clk_i,
        .rst_ni,
        .insert_i     (stage_insert[k]),
        .replace_i    (stage_replace[k]),
        .clear_i      (stage_clear[k]),
        .path_i       (stage_path[k]),
        .entry_i      (stage_entry[k]),
        .own_i        (stage_own[k]),
        .left_i       (left[k+1]),
        .right_i      (right[k+1]),
        .clear_o      (level_clear),
        .write_o      (write),
        .grow_o       (grow),
        .pos_o        (pos[k]),
        .write_entry_o(write_entry),
        .insert_o     (stage_insert[k+1]),
        .replace_o    (stage_replace[k+1]),
        .clear_below_o(stage_clear[k+1]),
        .path_o       (stage_path[k+1]),
        .entry_o      (stage_entry[k+1]),
        .own_o        (stage_own[k+1])
    );

    if (k < 3) begin : gen_flops
      logic parent;
      if (k == 2) begin : gen_parent
        assign parent = pos[1][0];
      end else begin : gen_no_parent
        assign parent = 1'b0;
      end

      xy_heap_flops #(
          .Level     (k),
          .EntryWidth(EntryWidth)
      ) u_store (
          .clk_i,
          .rst_ni,
          .clear_i (level_clear),
          .write_i (write),
          .pos_i   (pos[k][1:0] & 2'(2 ** k - 1)),
          .entry_i (write_entry),
          .parent_i(parent),
          .left_o  (left[k]),
          .right_o (right[k])
      );

      logic unused_grow;
      assign unused_grow = grow;
    end else begin : gen_ram
      xy_heap_ram #(
          .Level     (k),
          .EntryWidth(EntryWidth),
          .Block     (k >= BlockLevel)
      ) u_store (
          .clk_i,
          .rst_ni,
          .clear_i   (level_clear),
          .write_i   (write),
          .grow_i    (grow),
          .pos_i     (pos[k][k-1:0]),
          .entry_i   (write_entry),
          .row_next_i(stage_path[k-2][k-3:0]),
          .row_i     (pos[k-2][k-3:0]),
          .pair_i    (stage_path[k-1][k-2]),
          .left_o    (left[k]),
          .right_o   (right[k])
      );
    end
  end

  assign left[Levels]  = '1;
  assign right[Levels] = '1;

  logic unused_below_last;
  assign unused_below_last = ^{stage_insert[Levels], stage_replace[Levels], stage_clear[Levels],
                               stage_path[Levels], stage_entry[Levels], stage_own[Levels],
                               right[0]};

`ifndef SYNTHESIS
  initial begin
    if (Levels < 3) $fatal(1, "xy_heap: Levels is %0d, must be 3 or more", Levels);
    if (BlockLevel < 3) $fatal(1, "xy_heap: BlockLevel is %0d, must be 3 or more", BlockLevel);
  end

  // The top is the least of all: nothing below it may be lower once an operation has settled.
  a_top_is_least :
  assert property (@(posedge clk_i) disable iff (!rst_ni) ready_q |-> top_q <= left[0]);

  // Nothing may leave the last level: the entry would be lost.
  a_nothing_lost :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      !stage_insert[Levels] && !stage_replace[Levels]);

  // The count of inserts never passes the capacity.
  a_no_overflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      full |-> size_q[Levels-1:0] == '0);
`endif

endmodule
