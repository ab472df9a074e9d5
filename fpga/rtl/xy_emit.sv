// Hierarchy emitter between the merge and memory: xy_emitter with a burst writer for nodes and one for the
// leaf table.
//
//   item ──► emitter ──┬─► nodes, 64 bytes each ──► burst writer ──► node_wr
//                      └─► leaf table entries ────► burst writer ──► leaf_wr
//
// Handshake   start_i takes the regions; nothing may be under way, and items come from the next cycle on.
//             item: valid/ready, end_i as in xy_emitter. node_wr, leaf_wr: line ports.
//             done_o is high once all is sent and stays, with the root and the counts, until clear_i, which
//             must come before the next start.
//             error_o[0]: the node region is full, error_o[1]: the leaf table's is; then nothing more comes.
//             clear_i: the state after reset, in the next cycle.
// Latency     1 cycle from the last item to the flush of both writers.
// Throughput  as the emitter's, while the writers have room.
// Cut paths   done_o, error_o, root_*_o and *_count_o come from registers; as in xy_burst_writer, all of
//             the line ports but the data.
module xy_emit #(
    parameter int unsigned CodeWidth  = 63,
    parameter int unsigned BurstLines = 8  // of both writers
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

    input  logic                 item_valid_i,
    output logic                 item_ready_o,
    input  xy_pkg::record_t      item_i,
    input  logic [CodeWidth-1:0] item_code_i,
    input  logic                 end_i,

    output logic                 node_o,   // a node leaves the emitter
    output logic                 leaf_o,   // the last entry of a leaf does

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
    output logic [1:0]           error_o,
    output logic                 root_valid_o,
    output xy_pkg::subtree_t     root_o,
    output logic [31:0]          node_count_o,
    output logic [31:0]          leaf_count_o,
    output logic [31:0]          entry_count_o
);

  logic         node_valid, node_ready, entry_valid, entry_ready;
  logic [511:0] node;
  logic [31:0]  entry;
  logic         emitted, node_empty, leaf_empty;

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

  assign node_o = node_valid && node_ready;
  assign leaf_o = entry_valid && entry_ready && entry[31];

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
      .in_valid_i   (node_valid),
      .in_ready_o   (node_ready),
      .in_record_i  (node),
      .flush_i      (emitted),
      .empty_o      (node_empty),
      .error_o      (error_o[0]),
      .wr_valid_o   (node_wr_valid_o),
      .wr_ready_i   (node_wr_ready_i),
      .wr_addr_o    (node_wr_addr_o),
      .wr_data_o    (node_wr_data_o),
      .wr_strb_o    (node_wr_strb_o),
      .wr_last_o    (node_wr_last_o)
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
      .error_o      (error_o[1]),
      .wr_valid_o   (leaf_wr_valid_o),
      .wr_ready_i   (leaf_wr_ready_i),
      .wr_addr_o    (leaf_wr_addr_o),
      .wr_data_o    (leaf_wr_data_o),
      .wr_strb_o    (leaf_wr_strb_o),
      .wr_last_o    (leaf_wr_last_o)
  );

  assign done_o = emitted && node_empty && leaf_empty;

  logic unused_children;
  assign unused_children = ^{left, right};

endmodule
