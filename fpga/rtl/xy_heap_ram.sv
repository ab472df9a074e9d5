// The storage of one of the heap's levels from the fourth on, in memory.
//
// Position p of the level lies in bank p[Level-1:Level-2], row p[Level-3:0]. The top bit tells the
// left child from the right one, the next bit tells which of the two parents in question they
// belong to, and the row is the grandparent's position. So a row of the four banks holds all four
// grandchildren of one entry, and they are read while it is still being decided which of the two
// children the operation goes to (Ioannou & Katevenis' overlap of memory and comparison).
//
// In cycle u the grandparent's stage shows `row_i` and, late in the cycle, `pair_i`; the children
// are at `left_o` and `right_o` in cycle u+1, for the parent's stage. Block memory takes the row one
// cycle ahead, from `row_next_i`.
//
// The last write is held in registers, and the memory is written from them one cycle later, which
// keeps the comparison out of the memory's input path. The held entry is the truth about its
// position for as long as it is held, so it may stand in for what the memory says at any time, and
// must where the memory does not know yet. Of writes by older operations, which never come in two
// cycles running, the children in cycle u+1 see
//   cycle u, u-1     as the held entry, in cycle u+1,
//   cycle u-2        distributed memory: in the memory;
//                    block memory: as the held entry, in cycle u (in u+1 it may have been replaced),
//                    since this write meets the read at the edge,
//   before           in the memory.
// Positions that no insert has reached yet read as infinity, so the memory needs no clearing.
//
// Latency     1 cycle from `pair_i` to the children.
// Throughput  one write every 2 cycles and one read a cycle.
// Cut paths   all.
module xy_heap_ram #(
    parameter int unsigned Level      = 3,  // 3 or more: holds 2^Level entries
    parameter int unsigned EntryWidth = 39,
    parameter bit          Block      = 1'b1
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    // From this level's stage
    input  logic                  clear_i,
    input  logic                  write_i,
    input  logic                  grow_i,      // the write fills a vacant position
    input  logic [Level-1:0]      pos_i,
    input  logic [EntryWidth-1:0] entry_i,
    // From the stage two levels up
    input  logic [Level-3:0]      row_next_i,
    input  logic [Level-3:0]      row_i,
    input  logic                  pair_i,
    // To the stage above
    output logic [EntryWidth-1:0] left_o,
    output logic [EntryWidth-1:0] right_o
);

  // Inserts fill the level in the order of its positions.
  logic [Level:0] fill_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) fill_q <= '0;
    else if (clear_i) fill_q <= '0;
    else if (grow_i) fill_q <= fill_q + 1'b1;
  end

  // The last write. Needs no valid flag: a position counts only once it has been written since the
  // last clear, and then what is held for it is of that write or a later one.
  logic                  write_q;
  logic [Level-1:0]      held_pos_q;
  logic [EntryWidth-1:0] held_entry_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) write_q <= 1'b0;
    else write_q <= write_i;
  end

  always_ff @(posedge clk_i) begin
    if (write_i) begin
      held_pos_q   <= pos_i;
      held_entry_q <= entry_i;
    end
  end

  // The four banks at the row: what the memory says, and whether vacancy or the entry that will be
  // held in the next cycle is to stand in for it. All this is early; which pair is wanted comes
  // late, and must meet no logic but the selection.
  logic [3:0][EntryWidth-1:0] bank_data;
  logic [3:0]                 bank_vacant, bank_held;

  for (genvar b = 0; b < 4; b++) begin : gen_bank
    localparam logic [1:0] Bank = 2'(b);
    logic [EntryWidth-1:0] read_data;
    logic                  here, unfilled;

    // One memory a bank, so that a bank that is not written cannot collide.
    xy_ram #(
        .Width    (EntryWidth),
        .AddrWidth(Level - 2),
        .Block    (Block)
    ) u_ram (
        .clk_i,
        .write_i     (write_q && (held_pos_q[Level-1-:2] == Bank)),
        .write_addr_i(held_pos_q[Level-3:0]),
        .write_data_i(held_entry_q),
        .read_addr_i (Block ? row_next_i : row_i),
        .read_data_o (read_data)
    );

    if (Block) begin : gen_collision
      assign bank_data[b] = (held_pos_q == {Bank, row_i}) ? held_entry_q : read_data;
    end else begin : gen_no_collision
      assign bank_data[b] = read_data;
    end

    assign here           = pos_i == {Bank, row_i};
    assign unfilled       = {1'b0, Bank, row_i} >= fill_q;
    assign bank_vacant[b] = unfilled && !(write_i && here);
    assign bank_held[b]   = write_i ? here : (held_pos_q == {Bank, row_i});
  end

  if (!Block) begin : gen_unused
    logic unused_block_only;
    assign unused_block_only = ^row_next_i;
  end

  logic [EntryWidth-1:0] left_q, right_q;
  logic left_vacant_q, right_vacant_q;
  logic left_held_q, right_held_q;

  always_ff @(posedge clk_i) begin
    left_q         <= pair_i ? bank_data[1] : bank_data[0];
    right_q        <= pair_i ? bank_data[3] : bank_data[2];
    left_vacant_q  <= pair_i ? bank_vacant[1] : bank_vacant[0];
    right_vacant_q <= pair_i ? bank_vacant[3] : bank_vacant[2];
    left_held_q    <= pair_i ? bank_held[1] : bank_held[0];
    right_held_q   <= pair_i ? bank_held[3] : bank_held[2];
  end

  // Vacancy comes first: what is held for a vacant position is from before a clear.
  assign left_o  = left_vacant_q ? '1 : (left_held_q ? held_entry_q : left_q);
  assign right_o = right_vacant_q ? '1 : (right_held_q ? held_entry_q : right_q);

`ifndef SYNTHESIS
  initial begin
    if (Level < 3) $fatal(1, "xy_heap_ram: Level is %0d, must be 3 or more", Level);
  end

  // An insert must land where the count of filled positions says, or vacant places would be taken
  // for entries.
  a_grow_in_order :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      grow_i |-> write_i && ({1'b0, pos_i} == fill_q));

  // The bypass holds one write; a second in the next cycle would push the first out unseen.
  a_write_spacing :
  assert property (@(posedge clk_i) disable iff (!rst_ni) write_q |-> !write_i);
`endif

endmodule
