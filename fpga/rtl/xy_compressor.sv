// Streaming compressor: exact nodes in, children before parents; quantized pairs out as they come (P3 §4),
// treelets of depth 1.
//
//   node ──► contexts of the node and of both children ──► encoders ──► last ──► pair writer ──► wr
//                (3 stages)                               (2 stages)      │                      ▲
//                                                                         └─► backtrack ─────────┘ ◄─ rd
//
// A node is encoded in the context that its own box suggests. A child was, too, when it came; if the context
// that its parent gives it differs, it is encoded again in memory before the parent's pair follows. All is
// found from boxes; of nodes that were written nothing is kept.
//
// Handshake   start_i takes the region; nothing may be under way, and nodes come from the next cycle on.
//             node: valid/ready; while a node is repaired, node_ready_o is low.
//             end_i is a level: no node follows. Then root_i, if root_valid_i; both stay.
//             rd, rsp, wr: line ports; one read is under way at most, and must show what was written before.
//             done_o: the last line is sent; stays until clear_i, which must come before the next start.
//             error_o: [0] a box turned inside out or outside its parent's, or a line that no compressor
//             wrote; [1] the region is full; [2] an index has more than 27 bits. Nothing more happens then.
//             clear_i: the state after reset, in the next cycle; a response under way must be kept away.
// Latency     6 cycles from a node to its pair.
// Throughput  one node a cycle, while none is to be repaired.
// Cut paths   all but wr_data_o and node_ready_o, which comes from few gates behind registers.
module xy_compressor #(
    parameter int unsigned Bits     = 6,  // of a coordinate, 4 to 6
    parameter int unsigned Margin   = 1,  // of estimates, 0 to 3
    parameter int unsigned MinScale = 0   // no grid is finer, 0 to 15
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic             clear_i,

    input  logic             start_i,
    input  logic [31:0]      region_base_i,  // stays during a build
    input  logic [31:0]      region_size_i,  // likewise
    input  logic             modulo_i,       // stays during a build

    input  logic             node_valid_i,
    output logic             node_ready_o,
    input  xy_pkg::subtree_t left_i,
    input  xy_pkg::subtree_t right_i,

    input  logic             end_i,
    input  logic             root_valid_i,
    input  xy_pkg::subtree_t root_i,

    output logic             rd_valid_o,
    input  logic             rd_ready_i,
    output logic [31:0]      rd_addr_o,
    input  logic             rsp_valid_i,
    input  logic [511:0]     rsp_data_i,

    output logic             wr_valid_o,
    input  logic             wr_ready_i,
    output logic [31:0]      wr_addr_o,
    output logic [511:0]     wr_data_o,
    output logic [63:0]      wr_strb_o,

    output logic             repaired_o,  // a node was encoded again
    output logic             done_o,
    output logic [2:0]       error_o
);

  localparam int unsigned CodeBits = 6 * Bits;
  localparam int unsigned Stages   = 6;  // registers from a node to its encoded pair

  // What goes beside a node through the stages. The root comes last, as the left child of a node that is not
  // one: its context is exact, and there is nothing to write.
  typedef struct packed {
    xy_pkg::subtree_t right;
    xy_pkg::subtree_t left;
    logic             is_root;
  } node_t;

  logic              enable;
  logic [Stages-1:0] valid_q;

  // --- In ---

  logic             ended_q, root_comes, valid_d;
  node_t            node_d, node0_q, node1_q, node2_q, node3_q;
  xy_pkg::box_t     box, box_d, box0_q;

  xy_union u_box (.a_i(left_i.box), .b_i(right_i.box), .box_o(box));

  assign root_comes   = end_i && !ended_q && root_valid_i && (root_i.count == '0);
  assign node_ready_o = enable && !end_i;
  assign valid_d      = root_comes || (node_valid_i && !end_i);
  assign node_d       = root_comes ? {root_i, root_i, 1'b1} : {right_i, left_i, 1'b0};
  assign box_d        = root_comes ? root_i.box : box;

  always_ff @(posedge clk_i) begin
    if (enable) begin
      node0_q <= node_d;
      box0_q  <= box_d;
      node1_q <= node0_q;
      node2_q <= node1_q;
      node3_q <= node2_q;
    end
  end

  // --- Contexts ---

  xy_pkg::place_t place, left_old, right_old;
  logic [2:0]     boxes_ok;

  xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_context (
      .clk_i, .rst_ni, .enable_i(enable),
      .box_i(box0_q), .exact_i(node0_q.is_root), .place_o(place), .ok_o(boxes_ok[0])
  );
  xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_left_old (
      .clk_i, .rst_ni, .enable_i(enable),
      .box_i(node0_q.left.box), .exact_i(1'b0), .place_o(left_old), .ok_o(boxes_ok[1])
  );
  xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_right_old (
      .clk_i, .rst_ni, .enable_i(enable),
      .box_i(node0_q.right.box), .exact_i(1'b0), .place_o(right_old), .ok_o(boxes_ok[2])
  );

  // --- Codes ---

  logic [1:0][CodeBits-1:0] code;
  logic [1:0]               needed, codes_ok;
  xy_pkg::place_t           old0, old1, new0, new1;

  xy_encoder #(.Bits(Bits), .MinScale(MinScale)) u_left (
      .clk_i, .rst_ni, .enable_i(enable), .modulo_i,
      .place_i(place), .box_i(node3_q.left.box), .old_i(left_old),
      .code_o(code[0]), .old_o(old0), .new_o(new0), .needed_o(needed[0]), .ok_o(codes_ok[0])
  );
  xy_encoder #(.Bits(Bits), .MinScale(MinScale)) u_right (
      .clk_i, .rst_ni, .enable_i(enable), .modulo_i,
      .place_i(place), .box_i(node3_q.right.box), .old_i(right_old),
      .code_o(code[1]), .old_o(old1), .new_o(new1), .needed_o(needed[1]), .ok_o(codes_ok[1])
  );

  // Of the node, from here on only pointers.
  typedef struct packed {
    logic             ok;
    logic             is_root;
    logic [1:0]       leaf;
    logic [1:0][31:0] index;
  } tail_t;

  tail_t tail4_q, last_q;

  always_ff @(posedge clk_i) begin
    if (enable) begin
      tail4_q.ok      <= boxes_ok == '1;
      tail4_q.is_root <= node3_q.is_root;
      tail4_q.leaf    <= {node3_q.right.count != '0, node3_q.left.count != '0};
      tail4_q.index   <= {node3_q.right.index, node3_q.left.index};
      last_q          <= tail4_q;
    end
  end

  // --- The last stage: repairs, child 0 first, then the pair ---

  logic       last_valid, sound, fits, repairs_ready, start_repair, passes;
  logic [1:0] repaired_q, wanted;
  assign last_valid = valid_q[Stages-1];
  assign sound      = last_q.ok && (codes_ok == '1);
  assign fits      = (last_q.index[0][31:27] == '0) && (last_q.index[1][31:27] == '0);
  assign wanted     = needed & ~last_q.leaf & ~repaired_q & {!last_q.is_root, 1'b1};
  assign start_repair = last_valid && sound && fits && (wanted != '0) && repairs_ready;

  logic [127:0] pair;
  logic         pair_valid, pair_ready;
  for (genvar i = 0; i < 2; i++) begin : gen_word
    assign pair[64*i+:64] = 64'({last_q.index[i][26:0], last_q.leaf[i], code[i]});
  end

  assign pair_valid = last_valid && sound && fits && (wanted == '0) && repairs_ready
      && !last_q.is_root;
  assign passes     = last_valid && sound && fits && (wanted == '0) && repairs_ready
      && (last_q.is_root || pair_ready);
  assign enable     = !last_valid || passes;

  logic         flush, open, sending, writer_error;
  logic [31:0]  open_addr;
  logic         pair_wr_valid, line_wr_valid, repair_error;
  logic [31:0]  pair_wr_addr, line_wr_addr;
  logic [511:0] pair_wr_data, line_wr_data;
  logic [63:0]  pair_wr_strb, line_wr_strb;
  logic         final_q;

  xy_pair_writer u_writer (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .region_base_i,
      .region_size_i,
      .in_valid_i (pair_valid),
      .in_ready_o (pair_ready),
      .in_pair_i  (pair),
      .flush_i    (flush || final_q),
      .open_o     (open),
      .open_addr_o(open_addr),
      .sending_o  (sending),
      .error_o    (writer_error),
      .wr_valid_o (pair_wr_valid),
      .wr_ready_i,
      .wr_addr_o  (pair_wr_addr),
      .wr_data_o  (pair_wr_data),
      .wr_strb_o  (pair_wr_strb)
  );

  xy_backtrack #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_backtrack (
      .clk_i,
      .rst_ni,
      .clear_i,
      .modulo_i,
      .region_base_i,
      .region_size_i,
      .start_i    (start_repair),
      .ready_o    (repairs_ready),
      .index_i    (wanted[0] ? last_q.index[0][26:0] : last_q.index[1][26:0]),
      .old_i      (wanted[0] ? old0 : old1),
      .new_i      (wanted[0] ? new0 : new1),
      .flush_o    (flush),
      .open_i     (open),
      .open_addr_i(open_addr),
      .sending_i  (sending),
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rsp_valid_i,
      .rsp_data_i,
      .wr_valid_o (line_wr_valid),
      .wr_ready_i,
      .wr_addr_o  (line_wr_addr),
      .wr_data_o  (line_wr_data),
      .wr_strb_o  (line_wr_strb),
      .repaired_o,
      .error_o    (repair_error)
  );

  // Only one of them has a line: a repair waits until the pair writer has sent its own.
  assign wr_valid_o = pair_wr_valid || line_wr_valid;
  assign wr_addr_o  = pair_wr_valid ? pair_wr_addr : line_wr_addr;
  assign wr_data_o  = pair_wr_valid ? pair_wr_data : line_wr_data;
  assign wr_strb_o  = pair_wr_valid ? pair_wr_strb : line_wr_strb;

  // --- State ---

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      valid_q    <= '0;
      ended_q    <= 1'b0;
      repaired_q <= '0;
      final_q    <= 1'b0;
    end else if (clear_i) begin
      valid_q    <= '0;
      ended_q    <= 1'b0;
      repaired_q <= '0;
      final_q    <= 1'b0;
    end else begin
      if (enable) begin
        valid_q    <= {valid_q[Stages-2:0], valid_d};
        repaired_q <= '0;
      end
      if (start_repair) repaired_q <= repaired_q | (wanted[0] ? 2'b01 : 2'b10);
      if (end_i && (enable || !root_comes)) ended_q <= 1'b1;
      // A tree without a node has no root in the stream.
      if (passes && last_q.is_root) final_q <= 1'b1;
      if (end_i && !ended_q && !root_comes) final_q <= 1'b1;
    end
  end

  assign done_o  = final_q && !open && !sending;
  assign error_o = {last_valid && !fits, writer_error, repair_error || (last_valid && !sound)};

`ifndef SYNTHESIS
  // Their lines would be mixed.
  a_one_line :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !(pair_wr_valid && line_wr_valid));

  // A node's pair goes where its index says, so the repairs of one that was just written find it.
  a_no_pair_while_repairing :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !repairs_ready |-> !pair_valid);
`endif

endmodule
