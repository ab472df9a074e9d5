// Treelets: nodes wait on chip until the tops of the subtrees around them are known (P3 §4.3).
//
//   node ──► root of a new treelet ◄── treelets of its inner children, from the stack
//                  │
//                  ├─► its lowest layer leaves, a node a cycle ──► item
//                  └─► what is above that goes to the stack, as the children's place is taken
//
// The treelet of a node is the upper part of its subtree: Depth nodes on the way from it to the lowest ones.
// Nodes come children before parents, as in a depth-first walk, so that the treelets of a node's children
// are the last ones on the stack. Two children's are taken, or one's, or none's, and one is put back: the
// stack's top is a register, and the entry under it is at hand. With the root, all that is left leaves, the
// lowest layer first.
//
// A node leaves with the boxes on the way down to it, from the treelet's root on: path_o[0] is the root's,
// path_o[Depth-1] its own. Where there are fewer nodes on that way, the root's comes more than once.
// Nodes are numbered as they leave; pointers to them are set as they become known.
//
// Handshake   node: valid/ready. enable_i moves an item out; with it low, everything stays.
//             root_valid_i: no node follows; stays. An item has item_valid_o; the last has item_last_o.
// Latency     1 cycle from a node to the first that leaves for it.
// Throughput  one item a cycle; a node for which none leaves takes a cycle too.
// Cut paths   node_ready_o, and from inputs to items: all. Not cut: stack to item.
module xy_treelet #(
    parameter int unsigned Depth = 2  // 2 to 4
) (
    input  logic                     clk_i,
    input  logic                     rst_ni,
    input  logic                     clear_i,
    input  logic                     enable_i,

    input  logic                     node_valid_i,
    output logic                     node_ready_o,
    input  xy_pkg::subtree_t         left_i,
    input  xy_pkg::subtree_t         right_i,
    input  xy_pkg::box_t             box_i,
    input  logic                     root_valid_i,

    output logic                     item_valid_o,
    output logic                     item_root_o,     // the root's context is exact
    output logic                     item_settled_o,  // nodes below are in the contexts that it gives them
    output logic                     item_last_o,
    output logic [Depth-1:0][143:0]  path_o,          // boxes
    output xy_pkg::subtree_t         left_o,
    output xy_pkg::subtree_t         right_o
);

  localparam int unsigned Lowest   = 2 ** (Depth - 1);  // nodes of the lowest layer
  localparam int unsigned Held     = Lowest - 1;        // those above it
  localparam int unsigned S        = xy_pkg::SubtreeBits;
  localparam int unsigned BoxBits  = 6 * xy_pkg::CoordWidth;
  localparam int unsigned CountLsb = BoxBits;
  localparam int unsigned IndexLsb = BoxBits + 8;
  localparam int unsigned MaxDepth = 63 + 32;

  // A node is {right, left}. The children of the node in place p, counted from 1, are in 2p and 2p+1. What
  // is held is in the element before.
  typedef logic [Held-1:0][1:0][S-1:0] entry_t;

  // --- The node that is the new root, or, after the last node, the whole tree's ---

  logic                valid_q, is_root_q, ended_q, leaves;
  logic [1:0][S-1:0]   node_q;
  logic [BoxBits-1:0]  box_q;
  logic [1:0]          inner;
  logic                takes;

  assign node_ready_o = (!valid_q || leaves) && !root_valid_i;
  assign takes        = (!valid_q || leaves)
      && ((node_valid_i && !root_valid_i) || (root_valid_i && !ended_q));

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      valid_q   <= 1'b0;
      is_root_q <= 1'b0;
      ended_q   <= 1'b0;
    end else if (clear_i) begin
      valid_q   <= 1'b0;
      is_root_q <= 1'b0;
      ended_q   <= 1'b0;
    end else begin
      if (takes || leaves) valid_q <= takes;
      if (takes) begin
        is_root_q <= root_valid_i;
        ended_q   <= root_valid_i;
      end
    end
  end

  always_ff @(posedge clk_i) begin
    if (takes) begin
      node_q <= {right_i, left_i};
      box_q  <= box_i;
    end
  end

  assign inner[0] = node_q[0][CountLsb+:8] == '0;
  assign inner[1] = node_q[1][CountLsb+:8] == '0;

  // --- The stack of treelets ---

  entry_t top, under, left_entry, right_entry, kept;
  assign left_entry  = inner[1] ? under : top;
  assign right_entry = top;

  xy_treelet_stack #(
      .Width(Held * 2 * S),
      .Depth(MaxDepth)
  ) u_stack (
      .clk_i,
      .rst_ni,
      .clear_i,
      .put_i  (leaves && !is_root_q),
      .take_i (inner),
      .data_i (kept),
      .top_o  (top),
      .under_o(under)
  );

  // --- The treelet: every place's node, whether there is one, and its box ---

  logic [2*Lowest-1:0][1:0][S-1:0]   tree;
  logic [2*Lowest-1:0]               there;
  logic [2*Lowest-1:0][BoxBits-1:0]  box;

  always_comb begin
    tree     = '0;
    there    = '0;
    box      = '0;
    there[1] = 1'b1;
    box[1]   = box_q;
    tree[1]  = is_root_q ? top[0] : node_q;
    for (int unsigned l = 1; l < Depth; l++) begin
      for (int unsigned k = 0; k < (1 << l); k++) begin
        // In the child's treelet, the same place in its layer, a layer up.
        if (k < (1 << (l - 1))) tree[(1<<l)+k] = left_entry[(1<<(l-1))+(k&((1<<(l-1))-1))-1];
        else tree[(1<<l)+k] = right_entry[(1<<(l-1))+(k&((1<<(l-1))-1))-1];
        // The root's is taken as it is, without a lowest layer.
        if (is_root_q) tree[(1<<l)+k] = (l + 1 < Depth) ? top[(((1<<l)+k)&Held)-((l+1<Depth)?1:0)] : '0;
        there[(1<<l)+k] = there[((1<<l)+k)>>1]
            && (tree[((1<<l)+k)>>1][k&1][CountLsb+:8] == '0) && !(is_root_q && (l + 1 == Depth));
        box[(1<<l)+k] = tree[((1<<l)+k)>>1][k&1][BoxBits-1:0];
      end
    end
  end

  // --- What leaves: the lowest layer; of the root's treelet all, from the lowest layer up ---

  logic [31:0]             written_q, count;
  logic [Lowest-1:0]       wanted, done_q, first;
  logic [Lowest-1:0][31:0] number;

  always_comb begin
    wanted = '0;
    if (is_root_q) begin
      for (int unsigned l = 0; l < Depth - 1; l++) begin
        for (int unsigned k = 0; k < (1 << l); k++) begin
          wanted[Lowest-(2<<l)+k] = there[(1<<l)+k];
        end
      end
    end else begin
      for (int unsigned k = 0; k < Lowest; k++) wanted[k] = there[Lowest+k];
    end
    count = written_q;
    for (int unsigned k = 0; k < Lowest; k++) begin
      number[k] = count;
      if (wanted[k]) count = count + 32'd1;
    end
    first = '0;
    for (int unsigned k = 0; k < Lowest; k++) begin
      if (wanted[k] && !done_q[k] && (first == '0)) first[k] = 1'b1;
    end
  end

  assign leaves = valid_q && enable_i && ((wanted & ~done_q & ~first) == '0);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      written_q <= '0;
      done_q    <= '0;
    end else if (clear_i) begin
      written_q <= '0;
      done_q    <= '0;
    end else if (leaves) begin
      written_q <= count;
      done_q    <= '0;
    end else if (valid_q && enable_i) begin
      done_q <= done_q | first;
    end
  end

  // --- The item ---

  always_comb begin
    path_o         = '0;
    left_o         = '0;
    right_o        = '0;
    item_settled_o = 1'b0;
    if (is_root_q) begin
      for (int unsigned l = 0; l < Depth - 1; l++) begin
        for (int unsigned k = 0; k < (1 << l); k++) begin
          if (first[Lowest-(2<<l)+k]) begin
            {right_o, left_o} = tree[(1<<l)+k];
            item_settled_o    = l + 2 < Depth;
            if (l + 2 < Depth) begin
              if (left_o.count == '0) left_o.index = number[Lowest-(4<<l)+2*k];
              if (right_o.count == '0) right_o.index = number[Lowest-(4<<l)+2*k+1];
            end
            for (int unsigned j = 0; j < Depth; j++) begin
              path_o[j] = box[((1<<l)+k)>>((Depth-1-j>l)?l:Depth-1-j)];
            end
          end
        end
      end
    end else begin
      for (int unsigned k = 0; k < Lowest; k++) begin
        if (first[k]) begin
          {right_o, left_o} = tree[Lowest+k];
          for (int unsigned j = 0; j < Depth; j++) path_o[j] = box[(Lowest+k)>>(Depth-1-j)];
        end
      end
    end
  end

  assign item_valid_o = valid_q && (first != '0);
  assign item_root_o  = is_root_q;
  assign item_last_o  = is_root_q && first[Lowest-2];

  // --- What stays: the nodes above the lowest layer, with pointers to it ---

  always_comb begin
    kept = '0;
    for (int unsigned p = 1; p <= Held; p++) kept[p-1] = tree[p];
    for (int unsigned k = 0; k < Lowest; k++) begin
      if (there[Lowest+k]) kept[((Lowest+k)>>1)-1][k&1][IndexLsb+:32] = number[k];
    end
  end

  logic unused_bits;
  assign unused_bits = ^{there[0], box[0], tree[0]};

`ifndef SYNTHESIS
  initial begin
    if (Depth < 2 || Depth > 4) $fatal(1, "xy_treelet: Depth is %0d, must be 2 to 4", Depth);
  end

  // The root is that of the last treelet: nodes came in the order of a depth-first walk.
  a_last_is_root :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      item_valid_o && is_root_q |-> wanted[Lowest-2]);
`endif

endmodule
