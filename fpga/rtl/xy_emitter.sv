// Hierarchy emitter: sorted primitives in, nodes of a binary tree out, children before parents (P2 §5.4,
// Algorithm 1).
//
//        item ──► open leaf ──► current subtree ──┬─► node under the two ──► node_o
//                                 ▲     │         │
//                              pending  └─ push ► stack: top in registers, the rest in memory
//                                 └──── node ─────┘ pop
//
// Primitives of equal codes share a leaf of up to max_leaf_i. Of codes all that is needed is the split between
// a primitive's and that of the one before it. The split behind each subtree has a level:
// the highest bit in which the codes beside it differ, above 32; or, between two leaves of one code, the
// highest bit in which the numbers of leaves before them differ. A subtree is joined to the top of the
// stack while that one's level is not higher than its own, then pushed; so levels fall from the bottom of
// the stack to its top, and 95 places are enough for every input, sorted or not.
//
// Handshake   item: valid/ready; end_i says that no item follows the one offered, or, with
//             item_valid_i low, that none does, and stays. A primitive is taken in the cycle of the first
//             operation that it causes. item_split_i of the first primitive is not looked at.
//             node, entry: valid/ready. A node and an entry that one primitive causes leave in one cycle,
//             or neither does: node_valid_o and entry_valid_o look at the other channel's ready. entry_ready_i
//             must not fall while something is offered; with node_ready_i, entry_valid_o falls too.
//             left_o and right_o are the node's children, valid with node_o.
//             done_o is high from the cycle after the last node on, with the root and the counts.
//             clear_i: the state after reset, in the next cycle.
// Latency     0 from item to entry and node.
// Throughput  one stack operation, or one primitive into the open leaf, a cycle; while there is no room
//             for a node, nothing.
// Cut paths   done_o, root_*_o, *_count_o, left_o, right_o and node_o come from registers. Not cut: item_valid_i,
//             item_split_i and end_i to node_valid_o, entry_valid_o and entry_o, the ready inputs to
//             item_ready_o and to the other channel's valid output. The split comes late in its cycle: what
//             does not need it is found in registers beforehand, or beside it.
module xy_emitter (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 clear_i,

    input  logic [7:0]           max_leaf_i,  // 0 counts as 1; stays during a build

    input  logic                 item_valid_i,
    output logic                 item_ready_o,
    input  xy_pkg::record_t      item_i,
    input  xy_pkg::split_t       item_split_i,
    input  logic                 end_i,

    output logic                 node_valid_o,
    input  logic                 node_ready_i,
    output logic [511:0]         node_o,      // the bytes of the 64-byte node
    output xy_pkg::subtree_t     left_o,
    output xy_pkg::subtree_t     right_o,

    output logic                 entry_valid_o,
    input  logic                 entry_ready_i,
    output logic [31:0]          entry_o,     // bit 31: the last one of its leaf

    output logic                 done_o,
    output logic                 root_valid_o,  // low for the tree of no primitives
    output xy_pkg::subtree_t     root_o,
    output logic [31:0]          node_count_o,
    output logic [31:0]          leaf_count_o,
    output logic [31:0]          entry_count_o
);

  localparam int unsigned MaxDepth   = 63 + 32;
  localparam int unsigned LevelWidth = 7;

  // Above the level of every bit: there is nothing behind the subtree.
  localparam logic [LevelWidth-1:0] LevelEnd = '1;

  typedef struct packed {
    logic [LevelWidth-1:0] level;  // of the split behind the subtree
    xy_pkg::subtree_t      subtree;
  } cell_t;

  // --- The open leaf: the last primitive is in it ---

  logic         open_valid_q;
  xy_pkg::box_t open_box_q;
  logic [31:0]  open_first_q;
  logic [7:0]   open_size_q;
  logic         open_room_q;  // for a further primitive: its size is less than max_leaf_i
  logic [30:0]  open_prim_q;

  logic        done_q, root_valid_q;
  logic [31:0] nodes_q, leaves_q, leaves_next, entries_q;

  // The highest bit in which leaves_q and the next number differ.
  logic       leaves_differ;
  logic [4:0] leaf_bit_next, leaf_bit_q;

  assign leaves_next = leaves_q + 32'd1;
  xy_msb #(.Width(32)) u_leaf_bit (
      .bits_i (leaves_next ^ (leaves_q + 32'd2)),
      .any_o  (leaves_differ),
      .index_o(leaf_bit_next)
  );

  // The level of a split behind the open leaf. A bit of a code ranks 32 higher than one of a number.
  logic [LevelWidth-1:0] code_level, leaf_level, level;
  assign code_level = {item_split_i.index[5], !item_split_i.index[5], item_split_i.index[4:0]};
  assign leaf_level = LevelWidth'(leaf_bit_q);

  always_comb begin
    level = item_split_i.differs ? code_level : leaf_level;
    if (!item_valid_i) level = LevelEnd;
  end

  logic grows;
  assign grows = item_valid_i && open_valid_q && !item_split_i.differs && open_room_q;

  // --- The current subtree: the pending one, or the open leaf as it closes ---

  logic  pending_valid_q;
  cell_t pending_q, current, top;
  logic  listens, input_given, closes, current_valid, current_last, joins, works, takes, finishes;
  logic  stack_empty, stack_full;

  assign listens       = !pending_valid_q && !done_q;
  assign input_given   = item_valid_i || end_i;
  assign closes        = listens && open_valid_q && input_given && !grows;
  assign current_valid = pending_valid_q || (closes && entry_ready_i);
  assign works         = current_valid && node_ready_i;
  assign item_ready_o  = listens && node_ready_i && entry_ready_i;
  assign takes         = item_ready_o && item_valid_i;
  assign finishes      = item_ready_o && !item_valid_i && end_i;

  assign entry_valid_o = listens && node_ready_i && open_valid_q && input_given;
  assign entry_o       = {!grows, open_prim_q};

  assign current = pending_valid_q ? pending_q
      : {level, open_first_q, open_size_q, open_box_q};

  // Whether top.level <= current.level: each level that may be the current one is compared before it is
  // known which one is. Nothing is above the level of an end.
  assign current_last = pending_valid_q ? (pending_q.level == LevelEnd) : !item_valid_i;
  always_comb begin
    joins = item_split_i.differs ? !(code_level < top.level) : !(leaf_level < top.level);
    if (!item_valid_i) joins = 1'b1;
    if (pending_valid_q) joins = !(pending_q.level < top.level);
    if (stack_empty) joins = 1'b0;
  end

  // --- The stack ---

  logic push, pop, is_root;
  assign is_root = stack_empty && current_last;
  assign push    = works && !joins && !is_root;
  assign pop     = works && joins;

  xy_stack #(
      .Width(LevelWidth + xy_pkg::SubtreeBits),
      .Depth(MaxDepth)
  ) u_stack (
      .clk_i,
      .rst_ni,
      .clear_i,
      .push_i (push),
      .pop_i  (pop),
      .data_i (current),
      .top_o  (top),
      .empty_o(stack_empty),
      .full_o (stack_full)
  );

  // --- The node over the top of the stack and the current subtree ---

  xy_pkg::box_t joined_box, grown_box;

  xy_union u_joined (.a_i(top.subtree.box), .b_i(current.subtree.box), .box_o(joined_box));
  xy_union u_grown (.a_i(open_box_q), .b_i(item_i.box), .box_o(grown_box));

  assign node_valid_o = current_valid && joins;
  assign left_o       = top.subtree;
  assign right_o      = current.subtree;

  xy_bvh2_pack u_pack (.left_i(left_o), .right_i(right_o), .node_o);

  // --- State ---

  logic pending_valid_d, open_valid_d, done_d, root_valid_d;

  always_comb begin
    pending_valid_d = pending_valid_q;
    open_valid_d    = open_valid_q;
    done_d          = done_q;
    root_valid_d    = root_valid_q;
    if (works) begin
      pending_valid_d = joins;
      done_d          = is_root;
      root_valid_d    = is_root;
    end
    if (takes) open_valid_d = 1'b1;
    if (finishes) begin
      open_valid_d = 1'b0;
      if (!open_valid_q) done_d = 1'b1;  // there was no primitive
    end
    if (clear_i) begin
      pending_valid_d = 1'b0;
      open_valid_d    = 1'b0;
      done_d          = 1'b0;
      root_valid_d    = 1'b0;
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      pending_valid_q <= 1'b0;
      open_valid_q    <= 1'b0;
      done_q          <= 1'b0;
      root_valid_q    <= 1'b0;
      nodes_q         <= '0;
      leaves_q        <= '0;
      leaf_bit_q      <= '0;
      entries_q       <= '0;
    end else begin
      pending_valid_q <= pending_valid_d;
      open_valid_q    <= open_valid_d;
      done_q          <= done_d;
      root_valid_q    <= root_valid_d;
      if (clear_i) begin
        nodes_q    <= '0;
        leaves_q   <= '0;
        leaf_bit_q <= '0;
        entries_q  <= '0;
      end else begin
        if (pop) nodes_q <= nodes_q + 32'd1;
        if (closes && item_ready_o) begin
          leaves_q   <= leaves_next;
          leaf_bit_q <= leaf_bit_next;
        end
        if (takes) entries_q <= entries_q + 32'd1;
      end
    end
  end

  // What needs no reset: it is looked at only while something above says that it is valid.
  always_ff @(posedge clk_i) begin
    if (works) begin
      pending_q.level   <= current.level;
      pending_q.subtree <= joins ? {nodes_q, 8'd0, joined_box} : current.subtree;
    end
    if (takes) begin
      open_prim_q <= item_i.prim[30:0];
      if (grows) begin
        open_box_q  <= grown_box;
        open_size_q <= open_size_q + 8'd1;
        open_room_q <= open_size_q + 8'd1 < max_leaf_i;
      end else begin
        open_box_q   <= item_i.box;
        open_size_q  <= 8'd1;
        open_room_q  <= max_leaf_i > 8'd1;
        open_first_q <= entries_q;
      end
    end
  end

  // The root is the last current subtree, which pending_q keeps.
  assign done_o        = done_q;
  assign root_valid_o  = root_valid_q;
  assign root_o        = pending_q.subtree;
  assign node_count_o  = nodes_q;
  assign leaf_count_o  = leaves_q;
  assign entry_count_o = entries_q;

  logic unused_bits;
  assign unused_bits = leaves_differ ^ stack_full ^ item_i.prim[31];

`ifndef SYNTHESIS
  // Levels fall from the bottom of the stack to its top, which bounds its depth.
  a_levels_fall :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      push && !stack_empty |-> top.level > current.level);

  // Whether a leaf has room is known since its last primitive: the limit must not change in between.
  a_limit_stays :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      listens && open_valid_q |-> open_room_q == (open_size_q < max_leaf_i));

  // All subtrees are joined into the root.
  a_root_is_last :
  assert property (@(posedge clk_i) disable iff (!rst_ni) done_q |-> stack_empty);

  // What was offered stays until it is taken.
  a_node_stays :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      node_valid_o && !node_ready_i |=> node_valid_o && $stable(node_o));
  a_entry_stays :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      entry_valid_o && !entry_ready_i
      |=> !node_ready_i || (entry_valid_o && $stable(entry_o)));
`endif

endmodule
