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
    // Operation from above, at most one of three: one register each, so that no decoding stands
    // between a comparison and what it decides
    input  logic                  insert_i,
    input  logic                  replace_i,
    input  logic                  clear_i,
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
    output logic                  insert_o,
    output logic                  replace_o,
    output logic                  clear_below_o,
    output logic [Levels-1:0]     path_o,
    output logic [EntryWidth-1:0] entry_o,
    output logic [EntryWidth-1:0] own_o
);

  logic                  insert_q, replace_q, clear_q;
  logic [Levels-1:0]     path_q;
  logic [EntryWidth-1:0] entry_q, own_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      insert_q  <= 1'b0;
      replace_q <= 1'b0;
      clear_q   <= 1'b0;
    end else begin
      insert_q  <= insert_i;
      replace_q <= replace_i;
      clear_q   <= clear_i;
    end
  end

  always_ff @(posedge clk_i) begin
    path_q  <= path_i;
    entry_q <= entry_i;
    own_q   <= own_i;
  end

  // Four comparisons side by side; no comparison waits for another.
  logic right_wins, left_lower, right_lower, own_stays;
  xy_less #(.Width(EntryWidth)) u_right_wins (.a_i(right_i), .b_i(left_i), .less_o(right_wins));
  xy_less #(.Width(EntryWidth)) u_left_lower (.a_i(left_i), .b_i(entry_q), .less_o(left_lower));
  xy_less #(.Width(EntryWidth)) u_right_lower (.a_i(right_i), .b_i(entry_q), .less_o(right_lower));
  xy_less #(.Width(EntryWidth)) u_own_stays (.a_i(own_q), .b_i(entry_q), .less_o(own_stays));

  logic at_end;
  assign at_end = (path_q >> (Level + 1)) == '0;

  logic descend, take_own;
  assign descend  = replace_q && (right_wins ? right_lower : left_lower);
  assign take_own = insert_q && !at_end && own_stays;

  // This level. The last decision selects between what the earlier ones have prepared.
  assign clear_o       = clear_q;
  assign write_o       = insert_q || replace_q;
  assign grow_o        = insert_q && at_end;
  assign pos_o         = path_q;
  assign write_entry_o = descend ? (right_wins ? right_i : left_i) : (take_own ? own_q : entry_q);

  // The levels below.
  assign insert_o      = insert_q && !at_end;
  assign replace_o     = descend;
  assign clear_below_o = clear_q;
  assign entry_o       = (insert_q && !own_stays) ? own_q : entry_q;
  assign own_o         = path_q[Level] ? right_i : left_i;

  always_comb begin
    path_o = path_q;
    if (replace_q) path_o[Level] = right_wins;
  end

`ifndef SYNTHESIS
  initial begin
    if (Level >= Levels) $fatal(1, "xy_heap_stage: Level is %0d of %0d", Level, Levels);
  end

  a_one_operation :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      $onehot0({insert_q, replace_q, clear_q}));

  // The children of a hole are settled only if the operation before has left the level below.
  a_spacing :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      insert_q || replace_q || clear_q |-> !(insert_i || replace_i || clear_i));

  // What goes down is never below what stays, or the order is lost.
  a_order :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      insert_o || replace_o |-> write_entry_o <= entry_o);
`endif

endmodule
