// The storage of one of the heap's first three levels, in registers.
//
// Gives the stage above the two children of the entry it works on; vacant places read as infinity
// (all ones), to which reset and clear set them.
//
// Latency     none for reads; a write is visible from the next cycle on.
// Throughput  one write and one read a cycle.
// Cut paths   all inputs are cut but `parent_i`, which selects the children.
module xy_heap_flops #(
    parameter int unsigned Level      = 0,  // 0, 1 or 2: holds 2^Level entries
    parameter int unsigned EntryWidth = 39
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    // From this level's stage
    input  logic                  clear_i,   // writes `entry_i`, infinity, everywhere
    input  logic                  write_i,
    input  logic [1:0]            pos_i,
    input  logic [EntryWidth-1:0] entry_i,
    // To the stage above
    input  logic                  parent_i,
    output logic [EntryWidth-1:0] left_o,
    output logic [EntryWidth-1:0] right_o
);

  localparam int unsigned Entries = 2 ** Level;

  logic [Entries-1:0][EntryWidth-1:0] entries_q;

  for (genvar i = 0; i < Entries; i++) begin : gen_entry
    localparam logic [1:0] Pos = 2'(i);
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) entries_q[i] <= '1;
      else if (clear_i || (write_i && (pos_i == Pos))) entries_q[i] <= entry_i;
    end
  end

  if (Level == 0) begin : gen_single
    // The top register's only child.
    assign left_o  = entries_q[0];
    assign right_o = '1;
    logic unused_parent;
    assign unused_parent = parent_i;
  end else if (Level == 1) begin : gen_pair
    assign left_o  = entries_q[0];
    assign right_o = entries_q[1];
    logic unused_parent;
    assign unused_parent = parent_i;
  end else begin : gen_two_pairs
    assign left_o  = parent_i ? entries_q[1] : entries_q[0];
    assign right_o = parent_i ? entries_q[3] : entries_q[2];
  end

`ifndef SYNTHESIS
  initial begin
    if (Level > 2) $fatal(1, "xy_heap_flops: Level is %0d, must be 0 to 2", Level);
  end

  // A clear carries infinity down, so that the registers need no second input.
  a_clear_is_infinity :
  assert property (@(posedge clk_i) disable iff (!rst_ni) clear_i |-> entry_i == '1);
`endif

endmodule
