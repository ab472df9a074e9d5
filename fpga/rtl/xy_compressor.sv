// Streaming compressor: exact nodes in, children before parents; quantized pairs out as they come (P3 §4).
//
//   node ──► treelet ──► path of boxes ──► contexts down the path ──► encoders ──► last ──► pair writer ──► wr
//                                                                                   │                      ▲
//                                                                                   └─► backtrack ─────────┘ ◄─ rd
//
// A node waits in a treelet until its context can be found from the boxes of Depth - 1 nodes above it; with
// Depth 1 it passes at once, in the context that its own box suggests. Its children in memory were encoded
// in the context that the boxes above them gave then: those of the same path, without the first one. If that
// differs from the context that they have now, they are encoded again before the node's pair follows. All is
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
// Latency     6 cycles from a node to its pair, and 2 more for each layer of treelets above the first.
// Throughput  one node a cycle while none is to be repaired; in treelets, as many cycles as nodes leave for it.
// Cut paths   all but wr_data_o and node_ready_o, which comes from few gates behind registers.
module xy_compressor #(
    parameter int unsigned Depth    = 2,  // of treelets, 1 to 4
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

  localparam int unsigned CodeBits  = 6 * Bits;
  localparam int unsigned S         = xy_pkg::SubtreeBits;
  localparam int unsigned BoxBits   = 6 * xy_pkg::CoordWidth;
  localparam int unsigned PlaceBits = 3 * (xy_pkg::CoordWidth + xy_pkg::MaxQuant + 1 + 5);
  localparam int unsigned Encode    = 3 + 2 * (Depth - 1);  // stage whose contexts the encoders take
  localparam int unsigned Last      = Encode + 2;

  // --- In: what leaves for the stages, with the boxes on the way down to it ---

  logic enable;  // everything moves a stage on

  xy_pkg::box_t box;
  logic         root_comes;
  xy_union u_box (.a_i(left_i.box), .b_i(right_i.box), .box_o(box));
  assign root_comes = end_i && root_valid_i && (root_i.count == '0);

  // Nodes in the stages. An item that is no node, with Depth 1, is the root as a left child: its context is
  // exact, and there is nothing to write.
  logic                                item_valid;
  logic [Depth-1:0][BoxBits-1:0] item_path;
  logic [1:0][S-1:0]             item_node;
  logic                          item_exact, item_settled, item_last, item_is_node;

  if (Depth == 1) begin : gen_node
    logic                in_valid_q, ended_q, is_root_q, takes;
    logic [2*S-1:0]      in_q;
    logic [BoxBits-1:0]  in_box_q;

    assign takes = (!in_valid_q || enable) && (end_i ? root_comes && !ended_q : node_valid_i);

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) begin
        in_valid_q <= 1'b0;
        ended_q    <= 1'b0;
      end else if (clear_i) begin
        in_valid_q <= 1'b0;
        ended_q    <= 1'b0;
      end else begin
        if (takes || enable) in_valid_q <= takes;
        if (takes) ended_q <= end_i;
      end
    end

    always_ff @(posedge clk_i) begin
      if (takes) begin
        in_q      <= end_i ? {root_i, root_i} : {right_i, left_i};
        in_box_q  <= end_i ? root_i.box : box;
        is_root_q <= end_i;
      end
    end

    assign node_ready_o = (!in_valid_q || enable) && !end_i;
    assign item_valid   = in_valid_q;
    assign item_node    = in_q;
    assign item_path    = in_box_q;
    assign item_exact   = is_root_q;
    assign item_settled = 1'b0;
    assign item_last    = is_root_q;
    assign item_is_node = !is_root_q;
  end else begin : gen_treelet
    logic treelet_ready;

    xy_treelet #(.Depth(Depth)) u_treelet (
        .clk_i,
        .rst_ni,
        .clear_i,
        .enable_i      (enable),
        .node_valid_i  (node_valid_i && !end_i),
        .node_ready_o  (treelet_ready),
        .left_i,
        .right_i,
        .box_i         (end_i ? root_i.box : box),
        .root_valid_i  (root_comes),
        .item_valid_o  (item_valid),
        .item_root_o   (item_exact),
        .item_settled_o(item_settled),
        .item_last_o   (item_last),
        .path_o        (item_path),
        .left_o        (item_node[0]),
        .right_o       (item_node[1])
    );

    assign node_ready_o = treelet_ready && !end_i;
    assign item_is_node = 1'b1;
  end

  logic [Last:1]                         valid_q, settled_q, last_q, is_node_q;
  logic [Last:1][Depth-1:0][BoxBits-1:0] path_q;
  logic [Last:1][1:0][S-1:0]             node_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) valid_q <= '0;
    else if (clear_i) valid_q <= '0;
    else if (enable) valid_q <= {valid_q[Last-1:1], item_valid};
  end

  always_ff @(posedge clk_i) begin
    if (enable) begin
      path_q    <= {path_q[Last-1:1], item_path};
      node_q    <= {node_q[Last-1:1], item_node};
      settled_q <= {settled_q[Last-1:1], item_settled};
      last_q    <= {last_q[Last-1:1], item_last};
      is_node_q <= {is_node_q[Last-1:1], item_is_node};
    end
  end

  // --- Contexts: down the path, and down the path without its first box to the children ---

  logic [Depth-1:0][PlaceBits-1:0] place;
  logic [Depth-1:0]                place_ok;
  logic [1:0][PlaceBits-1:0]       stale;  // of the children, in which theirs were encoded
  logic [1:0]                      stale_ok;

  xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_context (
      .clk_i, .rst_ni, .enable_i(enable),
      .box_i(item_path[0]), .exact_i(item_exact), .place_o(place[0]), .ok_o(place_ok[0])
  );

  for (genvar j = 1; j < Depth; j++) begin : gen_descend
    xy_descend #(.Bits(Bits), .MinScale(MinScale)) u_descend (
        .clk_i, .rst_ni, .enable_i(enable),
        .place_i(place[j-1]), .box_i(path_q[2*j+1][j]), .ok_i(place_ok[j-1]),
        .place_o(place[j]), .ok_o(place_ok[j])
    );
  end

  if (Depth == 1) begin : gen_stale
    for (genvar i = 0; i < 2; i++) begin : gen_child
      xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_context (
          .clk_i, .rst_ni, .enable_i(enable),
          .box_i(item_node[i][BoxBits-1:0]), .exact_i(1'b0), .place_o(stale[i]), .ok_o(stale_ok[i])
      );
    end
  end else begin : gen_stale_path
    logic [Depth-1:1][PlaceBits-1:0] above;
    logic [Depth-1:1]                above_ok;

    xy_context #(.Bits(Bits), .Margin(Margin), .MinScale(MinScale)) u_context (
        .clk_i, .rst_ni, .enable_i(enable),
        .box_i(item_path[1]), .exact_i(1'b0), .place_o(above[1]), .ok_o(above_ok[1])
    );
    for (genvar j = 2; j < Depth; j++) begin : gen_descend
      xy_descend #(.Bits(Bits), .MinScale(MinScale)) u_descend (
          .clk_i, .rst_ni, .enable_i(enable),
          .place_i(above[j-1]), .box_i(path_q[2*j-1][j]), .ok_i(above_ok[j-1]),
          .place_o(above[j]), .ok_o(above_ok[j])
      );
    end
    for (genvar i = 0; i < 2; i++) begin : gen_child
      xy_descend #(.Bits(Bits), .MinScale(MinScale)) u_descend (
          .clk_i, .rst_ni, .enable_i(enable),
          .place_i(above[Depth-1]), .box_i(node_q[Encode-2][i][BoxBits-1:0]),
          .ok_i(above_ok[Depth-1]), .place_o(stale[i]), .ok_o(stale_ok[i])
      );
    end
  end

  // --- Codes ---

  logic [1:0][CodeBits-1:0] code;
  logic [1:0]               needed, codes_ok;
  xy_pkg::place_t           old0, old1, new0, new1;

  xy_encoder #(.Bits(Bits), .MinScale(MinScale)) u_left (
      .clk_i, .rst_ni, .enable_i(enable), .modulo_i,
      .place_i(place[Depth-1]), .box_i(node_q[Encode][0][BoxBits-1:0]), .old_i(stale[0]),
      .code_o(code[0]), .old_o(old0), .new_o(new0), .needed_o(needed[0]), .ok_o(codes_ok[0])
  );
  xy_encoder #(.Bits(Bits), .MinScale(MinScale)) u_right (
      .clk_i, .rst_ni, .enable_i(enable), .modulo_i,
      .place_i(place[Depth-1]), .box_i(node_q[Encode][1][BoxBits-1:0]), .old_i(stale[1]),
      .code_o(code[1]), .old_o(old1), .new_o(new1), .needed_o(needed[1]), .ok_o(codes_ok[1])
  );

  logic ok1_q, ok2_q;

  always_ff @(posedge clk_i) begin
    if (enable) begin
      ok1_q <= place_ok[Depth-1] && (stale_ok == '1);
      ok2_q <= ok1_q;
    end
  end

  // --- The last stage: repairs, child 0 first, then the pair ---

  xy_pkg::subtree_t   child0, child1;
  logic [1:0][27:0]   tail;  // pointer and leaf bit
  logic               last_valid, sound, fits, repairs_ready, start_repair, passes;
  logic [1:0]         leaf, repaired_q, wanted;
  assign child0     = node_q[Last][0];
  assign child1     = node_q[Last][1];
  assign tail       = {child1.index[26:0], leaf[1], child0.index[26:0], leaf[0]};
  assign leaf       = {child1.count != '0, child0.count != '0};
  assign last_valid = valid_q[Last];
  assign sound      = ok2_q && (codes_ok == '1);
  assign fits       = (child0.index[31:27] == '0) && (child1.index[31:27] == '0);
  assign wanted     = (settled_q[Last] ? 2'b00 : needed) & ~leaf & ~repaired_q & {is_node_q[Last], 1'b1};
  assign start_repair = last_valid && sound && fits && (wanted != '0) && repairs_ready;

  logic [127:0] pair;
  logic         pair_valid, pair_ready;
  for (genvar i = 0; i < 2; i++) begin : gen_word
    assign pair[64*i+:64] = 64'({tail[i], code[i]});
  end

  assign pair_valid = last_valid && sound && fits && (wanted == '0) && repairs_ready
      && is_node_q[Last];
  assign passes     = last_valid && sound && fits && (wanted == '0) && repairs_ready
      && (!is_node_q[Last] || pair_ready);
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
      .index_i    (wanted[0] ? child0.index[26:0] : child1.index[26:0]),
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
      repaired_q <= '0;
      final_q    <= 1'b0;
    end else if (clear_i) begin
      repaired_q <= '0;
      final_q    <= 1'b0;
    end else begin
      if (enable) repaired_q <= '0;
      if (start_repair) repaired_q <= repaired_q | (wanted[0] ? 2'b01 : 2'b10);
      // A tree without a node has no root in the stream.
      if ((passes && last_q[Last]) || (end_i && !root_comes)) final_q <= 1'b1;
    end
  end

  logic unused_bits;
  assign unused_bits = ^{path_q, child0.box, child1.box, root_i.index};

  assign done_o  = final_q && !open && !sending;
  assign error_o = {last_valid && !fits, writer_error, repair_error || (last_valid && !sound)};

`ifndef SYNTHESIS
  initial begin
    if (Depth < 1 || Depth > 4) $fatal(1, "xy_compressor: Depth is %0d, must be 1 to 4", Depth);
  end

  // Their lines would be mixed.
  a_one_line :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !(pair_wr_valid && line_wr_valid));

  // A node's pair goes where its index says, so the repairs of one that was just written find it.
  a_no_pair_while_repairing :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !repairs_ready |-> !pair_valid);
`endif

endmodule
