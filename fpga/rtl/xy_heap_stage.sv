// One level's stage of the heap: compares, writes its level, hands the rest of the work down.
//
// An operation stays for one cycle. In it the stage has, all from registers,
//   replace  the value that wants the hole at position path[Level-1:0] of this level, and the hole's
//            two children. The least of the three fills the hole; if that is a child, the value goes
//            down to the hole the child leaves.
//   insert   the value on its way to the place that `path` names, and this level's entry on that way
//            (`own`). The lesser stays, the greater goes on. At the place itself the value stays.
//   clear    goes on, clearing level by level behind the operations before it; its value is infinity.
//
// Bit l of `path` is the step from level l to level l+1: 0 left, 1 right. An insert's path is the
// number of entries before it, whose leading one marks the level where it ends.
//
// Latency     1 cycle (operation in at the edge, write and operation out during the cycle after).
// Throughput  one operation every 2 cycles, because the children must have been settled by the
//             operation before.
// Cut paths   from the operation inputs: all. From `left_i` and `right_i`: none.
module xy_heap_stage #(
    parameter int unsigned Level      = 0,
    parameter int unsigned Levels     = 8,
    parameter int unsigned EntryWidth = 39
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    // Operation from above
    input  logic                  valid_i,
    input  xy_pkg::heap_op_e      op_i,     // insert, replace or clear
    input  logic [Levels-1:0]     path_i,
    input  logic [EntryWidth-1:0] entry_i,
    input  logic [EntryWidth-1:0] own_i,
    // Children of the entry at path[Level-1:0], during the operation's cycle
    input  logic [EntryWidth-1:0] left_i,
    input  logic [EntryWidth-1:0] right_i,
    // This level's storage
    output logic                  clear_o,
    output logic                  write_o,
    output logic                  grow_o,
    output logic [Levels-1:0]     pos_o,    // path of the operation here; position in its low bits
    output logic [EntryWidth-1:0] write_entry_o,
    // Operation to below
    output logic                  valid_o,
    output xy_pkg::heap_op_e      op_o,
    output logic [Levels-1:0]     path_o,
    output logic [EntryWidth-1:0] entry_o,
    output logic [EntryWidth-1:0] own_o
);

  logic                  valid_q;
  xy_pkg::heap_op_e      op_q;
  logic [Levels-1:0]     path_q;
  logic [EntryWidth-1:0] entry_q, own_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) valid_q <= 1'b0;
    else valid_q <= valid_i;
  end

  always_ff @(posedge clk_i) begin
    op_q    <= op_i;
    path_q  <= path_i;
    entry_q <= entry_i;
    own_q   <= own_i;
  end

  // Four comparisons side by side; no comparison waits for another.
  logic right_wins, left_lower, right_lower, own_stays;
  assign right_wins  = right_i < left_i;
  assign left_lower  = left_i < entry_q;
  assign right_lower = right_i < entry_q;
  assign own_stays   = own_q < entry_q;

  logic at_end;
  assign at_end = (path_q >> (Level + 1)) == '0;

  logic descend, take_child, take_own;
  assign descend    = right_wins ? right_lower : left_lower;
  assign take_child = descend && (op_q == xy_pkg::HeapReplace);
  assign take_own   = own_stays && !at_end && (op_q == xy_pkg::HeapInsert);

  assign op_o  = op_q;
  assign pos_o = path_q;
  assign own_o = path_q[Level] ? right_i : left_i;

  // The last decision selects between what the earlier ones have prepared.
  assign write_entry_o = take_child ? (right_wins ? right_i : left_i) : (take_own ? own_q : entry_q);

  always_comb begin
    clear_o       = 1'b0;
    write_o       = 1'b0;
    grow_o        = 1'b0;
    valid_o       = 1'b0;
    path_o        = path_q;
    entry_o       = entry_q;
    unique case (op_q)
      xy_pkg::HeapInsert: begin
        write_o = valid_q;
        grow_o  = valid_q && at_end;
        valid_o = valid_q && !at_end;
        if (!own_stays) entry_o = own_q;
      end
      xy_pkg::HeapReplace: begin
        write_o       = valid_q;
        valid_o       = valid_q && descend;
        path_o[Level] = right_wins;
      end
      xy_pkg::HeapClear: begin
        clear_o = valid_q;
        valid_o = valid_q;
      end
      default: ;
    endcase
  end

`ifndef SYNTHESIS
  initial begin
    if (Level >= Levels) $fatal(1, "xy_heap_stage: Level is %0d of %0d", Level, Levels);
  end

  // The top turns a remove into a replace.
  a_known_op :
  assert property (@(posedge clk_i) disable iff (!rst_ni) valid_q |-> op_q != xy_pkg::HeapRemove);

  // The children of a hole are settled only if the operation before has left the level below.
  a_spacing :
  assert property (@(posedge clk_i) disable iff (!rst_ni) valid_q |-> !valid_i);

  // What goes down is never below what stays, or the order is lost.
  a_order :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      valid_o && (op_q != xy_pkg::HeapClear) |-> write_entry_o <= entry_o);
`endif

endmodule
