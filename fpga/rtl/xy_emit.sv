// Hierarchy emitter between the merge and memory: xy_emitter, a burst writer for nodes and one for the leaf
// table; and beside the former, with a Depth above 0, the streaming compressor.
//
//                    ┌─► 64 bytes each ──► burst writer ─┐
//   item ──► emitter ┤   or compressor ◄─► rd           ─┴─► node_wr
//                    └─► leaf table entries ──► burst writer ──► leaf_wr
//
// Handshake   start_i takes the regions and what becomes of nodes, which stay; nothing may be under way, and
//             items come from the next cycle on. item: valid/ready, end_i as in xy_emitter. rd, rsp, node_wr,
//             leaf_wr: line ports; a line of the compressor's is a burst of its own, and a read must show
//             what was written before. Without a compressor nothing is read.
//             done_o is high once all is sent and stays, with the root and the counts, until clear_i, which
//             must come before the next start.
//             error_o[0]: the node region is full, error_o[1]: the leaf table's is, error_o[2]: the compressor
//             read what it has not written, or an index has more than 27 bits; then nothing more comes.
//             clear_i: the state after reset, in the next cycle; a response under way must be kept away.
// Latency     1 cycle from the last item to the flush of both writers; with the compressor at Depth 1 and
//             without a repair 7.
// Throughput  as the emitter's, while the writers have room and nothing is to be repaired.
// Cut paths   done_o, error_o, root_*_o and *_count_o come from registers; as in xy_burst_writer, all of
//             the line ports but the data; otherwise as in xy_emitter and xy_compressor.
module xy_emit #(
    parameter int unsigned BurstLines = 8,  // of both writers
    parameter int unsigned Depth      = 0,  // of the compressor's treelets, 1 to 4; 0 without compressor
    parameter int unsigned Bits       = 6,  // of a quantized coordinate, 4 to 6
    parameter int unsigned Margin     = 1,  // of the compressor's estimates, 0 to 3
    parameter int unsigned MinScale   = 0   // no grid is finer, 0 to 15
) (
    input  logic                 clk_i,
    input  logic                 rst_ni,
    input  logic                 clear_i,

    input  logic                 start_i,
    input  logic [31:0]          node_base_i,
    input  logic [31:0]          node_size_i,
    input  logic [31:0]          leaf_base_i,
    input  logic [31:0]          leaf_size_i,
    input  logic [7:0]           max_leaf_i,
    input  logic                 compress_i,
    input  logic                 modulo_i,   // coordinates, if compressed

    input  logic                 item_valid_i,
    output logic                 item_ready_o,
    input  xy_pkg::record_t      item_i,
    input  xy_pkg::split_t       item_split_i,
    input  logic                 end_i,

    output logic                 node_o,      // a node leaves the emitter
    output logic                 leaf_o,      // the last entry of a leaf does
    output logic                 repaired_o,  // a node was compressed again

    output logic                 rd_valid_o,
    input  logic                 rd_ready_i,
    output logic [31:0]          rd_addr_o,
    input  logic                 rsp_valid_i,
    input  logic [511:0]         rsp_data_i,

    output logic                 node_wr_valid_o,
    input  logic                 node_wr_ready_i,
    output logic [31:0]          node_wr_addr_o,
    output logic [511:0]         node_wr_data_o,
    output logic [63:0]          node_wr_strb_o,
    output logic                 node_wr_last_o,

    output logic                 leaf_wr_valid_o,
    input  logic                 leaf_wr_ready_i,
    output logic [31:0]          leaf_wr_addr_o,
    output logic [511:0]         leaf_wr_data_o,
    output logic [63:0]          leaf_wr_strb_o,
    output logic                 leaf_wr_last_o,

    output logic                 done_o,
    output logic [2:0]           error_o,
    output logic                 root_valid_o,
    output xy_pkg::subtree_t     root_o,
    output logic [31:0]          node_count_o,
    output logic [31:0]          leaf_count_o,
    output logic [31:0]          entry_count_o
);

  logic         node_valid, node_ready, entry_valid, entry_ready;
  logic [511:0] node;
  logic [31:0]  entry;
  logic         emitted, compresses, node_empty, leaf_empty;

  xy_pkg::subtree_t left, right;

  xy_emitter u_emitter (
      .clk_i,
      .rst_ni,
      .clear_i,
      .max_leaf_i,
      .item_valid_i,
      .item_ready_o,
      .item_i,
      .item_split_i,
      .end_i,
      .node_valid_o (node_valid),
      .node_ready_i (node_ready),
      .node_o       (node),
      .left_o       (left),
      .right_o      (right),
      .entry_valid_o(entry_valid),
      .entry_ready_i(entry_ready),
      .entry_o      (entry),
      .done_o       (emitted),
      .root_valid_o,
      .root_o,
      .node_count_o,
      .leaf_count_o,
      .entry_count_o
  );

  assign node_o = node_valid && node_ready;
  assign leaf_o = entry_valid && entry_ready && entry[31];

  // --- Nodes as they are ---

  logic         plain_ready, plain_empty, plain_full, plain_valid, plain_last;
  logic [31:0]  plain_addr;
  logic [511:0] plain_data;
  logic [63:0]  plain_strb;

  xy_burst_writer #(
      .RecordBits(512),
      .BurstLines(BurstLines)
  ) u_nodes (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .region_base_i(node_base_i),
      .region_size_i(node_size_i),
      .in_valid_i   (node_valid && !compresses),
      .in_ready_o   (plain_ready),
      .in_record_i  (node),
      .flush_i      (emitted),
      .empty_o      (plain_empty),
      .error_o      (plain_full),
      .wr_valid_o   (plain_valid),
      .wr_ready_i   (node_wr_ready_i && !compresses),
      .wr_addr_o    (plain_addr),
      .wr_data_o    (plain_data),
      .wr_strb_o    (plain_strb),
      .wr_last_o    (plain_last)
  );

  // --- Nodes compressed ---

  logic         pair_ready, pair_done, pair_valid;
  logic [31:0]  pair_addr;
  logic [511:0] pair_data;
  logic [63:0]  pair_strb;
  logic [2:0]   pair_error;

  if (Depth > 0) begin : gen_compressor
    assign compresses = compress_i;

    xy_compressor #(
        .Depth   (Depth),
        .Bits    (Bits),
        .Margin  (Margin),
        .MinScale(MinScale)
    ) u_compressor (
        .clk_i,
        .rst_ni,
        .clear_i,
        .start_i,
        .region_base_i(node_base_i),
        .region_size_i(node_size_i),
        .modulo_i,
        .node_valid_i (node_valid && compresses),
        .node_ready_o (pair_ready),
        .left_i       (left),
        .right_i      (right),
        .end_i        (emitted),
        .root_valid_i (root_valid_o && compresses),
        .root_i       (root_o),
        .rd_valid_o,
        .rd_ready_i,
        .rd_addr_o,
        .rsp_valid_i,
        .rsp_data_i,
        .wr_valid_o   (pair_valid),
        .wr_ready_i   (node_wr_ready_i && compresses),
        .wr_addr_o    (pair_addr),
        .wr_data_o    (pair_data),
        .wr_strb_o    (pair_strb),
        .repaired_o,
        .done_o       (pair_done),
        .error_o      (pair_error)
    );
  end else begin : gen_no_compressor
    assign compresses = 1'b0;
    assign pair_ready = 1'b0;
    assign pair_done  = 1'b0;
    assign pair_valid = 1'b0;
    assign pair_addr  = '0;
    assign pair_data  = '0;
    assign pair_strb  = '0;
    assign pair_error = '0;
    assign rd_valid_o = 1'b0;
    assign rd_addr_o  = '0;
    assign repaired_o = 1'b0;

    logic unused;
    assign unused = ^{compress_i, modulo_i, rd_ready_i, rsp_valid_i, rsp_data_i, left, right};
  end

  assign node_ready      = compresses ? pair_ready : plain_ready;
  assign node_empty      = compresses ? pair_done : plain_empty;
  assign node_wr_valid_o = compresses ? pair_valid : plain_valid;
  assign node_wr_addr_o  = compresses ? pair_addr : plain_addr;
  assign node_wr_data_o  = compresses ? pair_data : plain_data;
  assign node_wr_strb_o  = compresses ? pair_strb : plain_strb;
  assign node_wr_last_o  = compresses || plain_last;
  assign error_o[0]      = compresses ? pair_error[1] : plain_full;
  assign error_o[2]      = compresses && (pair_error[0] || pair_error[2]);

  // --- Leaf table ---

  xy_burst_writer #(
      .RecordBits(32),
      .BurstLines(BurstLines)
  ) u_leaf_table (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .region_base_i(leaf_base_i),
      .region_size_i(leaf_size_i),
      .in_valid_i   (entry_valid),
      .in_ready_o   (entry_ready),
      .in_record_i  (entry),
      .flush_i      (emitted),
      .empty_o      (leaf_empty),
      .error_o      (error_o[1]),
      .wr_valid_o   (leaf_wr_valid_o),
      .wr_ready_i   (leaf_wr_ready_i),
      .wr_addr_o    (leaf_wr_addr_o),
      .wr_data_o    (leaf_wr_data_o),
      .wr_strb_o    (leaf_wr_strb_o),
      .wr_last_o    (leaf_wr_last_o)
  );

  assign done_o = emitted && node_empty && leaf_empty;

endmodule
