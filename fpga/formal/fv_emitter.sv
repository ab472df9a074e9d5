// xy_emitter never pushes on a full stack nor pops from an empty one, whatever the input, sorted or not,
// and joins all leaves into one tree. In its full size: splits of 63-bit codes, 32 bits of leaves, 95 places.
//
// The stack is replaced by its model; fv_stack proves that xy_stack is like it.
module fv_emitter (
    input logic            clk_i,
    input logic            clear_i,
    input logic [7:0]      max_leaf_i,
    input logic            item_valid_i,
    input xy_pkg::record_t item_i,
    input xy_pkg::split_t  item_split_i,
    input logic            end_i,
    input logic            node_ready_i,
    input logic            entry_ready_i
);

  localparam int unsigned Depth    = 63 + 32;
  localparam logic [6:0]  LevelEnd = '1;

  logic             rst_ni = 1'b0;
  logic             item_ready, node_valid, entry_valid, done, root_valid;
  logic [511:0]     node;
  logic [31:0]      entry, nodes, leaves, entries;
  xy_pkg::subtree_t left, right, root;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_emitter u_emitter (
      .clk_i,
      .rst_ni,
      .clear_i,
      .max_leaf_i,
      .item_valid_i,
      .item_ready_o (item_ready),
      .item_i,
      .item_split_i,
      .end_i,
      .node_valid_o (node_valid),
      .node_ready_i,
      .node_o       (node),
      .left_o       (left),
      .right_o      (right),
      .entry_valid_o(entry_valid),
      .entry_ready_i,
      .entry_o      (entry),
      .done_o       (done),
      .root_valid_o (root_valid),
      .root_o       (root),
      .node_count_o (nodes),
      .leaf_count_o (leaves),
      .entry_count_o(entries)
  );

  // The highest bit in which the number of leaves and the next one differ.
  logic       leaves_differ;
  logic [4:0] leaf_bit;
  xy_msb #(
      .Width(32)
  ) u_leaf_bit (
      .bits_i (leaves ^ (leaves + 32'd1)),
      .any_o  (leaves_differ),
      .index_o(leaf_bit)
  );

  // Any split; xy_msb, which finds it, gives no index of 63 in codes of 63 bits.
  always_comb assume (item_split_i.index < 6'd63);

  (* hierconn *) logic                  \u_emitter.push , \u_emitter.pop , \u_emitter.joins , \u_emitter.is_root ;
  (* hierconn *) logic [4:0]            \u_emitter.leaf_bit_q ;
  (* hierconn *) logic                  \u_emitter.pending_valid_q , \u_emitter.open_valid_q ;
  (* hierconn *) logic [190:0]          \u_emitter.pending_q , \u_emitter.current ;
  (* hierconn *) logic [6:0]            \u_emitter.u_stack.count_q ;
  (* hierconn *) logic [Depth-1:0][6:0] \u_emitter.u_stack.entries_q ;

  logic       push, pop, pending, open;
  logic [6:0] count, pending_level;
  assign push          = \u_emitter.push ;
  assign pop           = \u_emitter.pop ;
  assign pending       = \u_emitter.pending_valid_q ;
  assign open          = \u_emitter.open_valid_q ;
  assign pending_level = \u_emitter.pending_q [190-:7];
  assign count         = \u_emitter.u_stack.count_q ;

  always_comb begin
    if (rst_ni) begin
      a_no_overflow : assert (!push || count < 7'(Depth));
      a_no_underflow : assert (!pop || count != '0);
      a_one_operation : assert (!push || !pop);
      if (push && count != '0) begin
        a_levels_fall :
        assert (\u_emitter.u_stack.entries_q [0] > \u_emitter.current [190-:7]);
      end
      // What is found beforehand, or case by case, is what it stands for.
      a_joins :
      assert (\u_emitter.joins == (count != '0
          && \u_emitter.u_stack.entries_q [0] <= \u_emitter.current [190-:7]));
      a_is_root : assert (\u_emitter.is_root
          == (!\u_emitter.joins && \u_emitter.current [190-:7] == LevelEnd));
      a_leaf_bit : assert (\u_emitter.leaf_bit_q == leaf_bit);
      // Every leaf and every node that has no parent yet is on the stack or under way.
      if (!done) a_nothing_left : assert (leaves - nodes == 32'(count) + 32'(pending));
      if (done) a_one_tree : assert (count == '0 && !pending && leaves - nodes == 32'(root_valid));

      if (pending) h_level : assert (pending_level < 7'(Depth) || pending_level == LevelEnd);
      if (root_valid) h_root : assert (done);
      // Without an open leaf there was no primitive yet, or no more will come.
      if (!open && pending) h_last : assert (pending_level == LevelEnd);
      if (!open && !pending && !done) h_first : assert (leaves == '0 && nodes == '0 && count == '0);
      c_deep : cover (count == 7'd4);
      c_tree : cover (done && nodes == 32'd3);
    end
  end

  // Levels fall strictly from the bottom of the stack to its top. So an entry's level and the number of
  // entries from the bottom to it are together at most the depth.
  for (genvar i = 0; i < Depth; i++) begin : gen_entry
    logic [6:0] level;
    assign level = \u_emitter.u_stack.entries_q [i];
    always_comb begin
      if (rst_ni && 7'(i) < count) assert (8'(level) + 8'(count) <= 8'(Depth + i));
      if (rst_ni && i > 0 && 7'(i) < count) begin
        assert (level > \u_emitter.u_stack.entries_q [i == 0 ? 0 : i-1]);
      end
    end
  end

endmodule
