// Hierarchy emitter and streaming compressor between the merge and memory.
//
//   item ──► emitter ──┬─► nodes ──► compressor ──► wr, rd
//                      └─► leaf table entries ──► burst writer ──► leaf_wr
//
// Handshake   start_i takes the regions, which stay; nothing may be under way, and items come from the next
//             cycle on. item: valid/ready, end_i as in xy_emitter. rd, rsp, wr, leaf_wr: line ports; a line
//             at wr is a burst of its own, and a read must show what was written before.
//             done_o is high once all is sent and stays, with the root and the counts, until clear_i, which
//             must come before the next start.
//             error_o[2:0] as in xy_compressor, error_o[3]: the leaf table's region is full.
//             clear_i: the state after reset, in the next cycle; a response under way must be kept away.
// Latency     7 cycles from the last item to the flush of what is open, with Depth 1 and without a repair.
// Throughput  as the emitter's, while nothing is to be repaired.
// Cut paths   as in xy_emitter, xy_compressor and xy_burst_writer.
module xy_compress #(
    parameter int unsigned CodeWidth  = 63,
    parameter int unsigned BurstLines = 8,  // of the leaf table
    parameter int unsigned Depth      = 2,  // of treelets, 1 to 4
    parameter int unsigned Bits       = 6,
    parameter int unsigned Margin     = 1,
    parameter int unsigned MinScale   = 0
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
    input  logic                 modulo_i,

    input  logic                 item_valid_i,
    output logic                 item_ready_o,
    input  xy_pkg::record_t      item_i,
    input  logic [CodeWidth-1:0] item_code_i,
    input  logic                 end_i,

    output logic                 rd_valid_o,
    input  logic                 rd_ready_i,
    output logic [31:0]          rd_addr_o,
    input  logic                 rsp_valid_i,
    input  logic [511:0]         rsp_data_i,

    output logic                 wr_valid_o,
    input  logic                 wr_ready_i,
    output logic [31:0]          wr_addr_o,
    output logic [511:0]         wr_data_o,
    output logic [63:0]          wr_strb_o,

    output logic                 leaf_wr_valid_o,
    input  logic                 leaf_wr_ready_i,
    output logic [31:0]          leaf_wr_addr_o,
    output logic [511:0]         leaf_wr_data_o,
    output logic [63:0]          leaf_wr_strb_o,
    output logic                 leaf_wr_last_o,

    output logic                 repaired_o,  // a node was encoded again
    output logic                 done_o,
    output logic [3:0]           error_o,
    output logic                 root_valid_o,
    output xy_pkg::subtree_t     root_o,
    output logic [31:0]          node_count_o,
    output logic [31:0]          leaf_count_o,
    output logic [31:0]          entry_count_o
);

  logic         node_valid, node_ready, entry_valid, entry_ready;
  logic [511:0] node;
  logic [31:0]  entry;
  logic         emitted, compressed, leaf_empty;

  xy_pkg::subtree_t left, right;

  xy_emitter #(.CodeWidth(CodeWidth)) u_emitter (
      .clk_i,
      .rst_ni,
      .clear_i,
      .max_leaf_i,
      .item_valid_i,
      .item_ready_o,
      .item_i,
      .item_code_i,
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
      .node_valid_i (node_valid),
      .node_ready_o (node_ready),
      .left_i       (left),
      .right_i      (right),
      .end_i        (emitted),
      .root_valid_i (root_valid_o),
      .root_i       (root_o),
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rsp_valid_i,
      .rsp_data_i,
      .wr_valid_o,
      .wr_ready_i,
      .wr_addr_o,
      .wr_data_o,
      .wr_strb_o,
      .repaired_o,
      .done_o       (compressed),
      .error_o      (error_o[2:0])
  );

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
      .error_o      (error_o[3]),
      .wr_valid_o   (leaf_wr_valid_o),
      .wr_ready_i   (leaf_wr_ready_i),
      .wr_addr_o    (leaf_wr_addr_o),
      .wr_data_o    (leaf_wr_data_o),
      .wr_strb_o    (leaf_wr_strb_o),
      .wr_last_o    (leaf_wr_last_o)
  );

  assign done_o = emitted && compressed && leaf_empty;

  logic unused_node;
  assign unused_node = ^node;

endmodule
