// The builder: primitives in memory in, a tree in memory out (P2 §5).
//
//   rd ──► xy_mergesort ──► item ──► xy_emit
//               │ runs                 │ nodes, leaf table
//               └──► xy_write_arbiter ◄┘──► wr
//
// Handshake   start_i takes the job; ready_o must be high, which it is some cycles after clear_i. done_o rises when the tree is
//             written, as far as the write port is concerned, and stays until clear_i.
//             rd, rsp, wr: line ports; each request names the region that it may touch.
//             quiet_i says that every line written so far can be read back: runs are read only then.
//             error_o: primitive, runs A, runs B, nodes or leaf table; it stays until clear_i, and nothing
//             more is asked for or written.
// Latency, throughput, cut paths: those of the units.
module xy_builder #(
    parameter int unsigned Capacity   = 128,
    parameter int unsigned Burst      = 4,
    parameter int unsigned Sorters    = 2,
    parameter int unsigned Fifo       = 4,
    parameter int unsigned ReadAhead  = 8,
    parameter int unsigned CodeWidth  = 63,
    parameter int unsigned WriteLines = 8,   // of the bursts of nodes and leaf table
    parameter int unsigned TagWidth   = 16
) (
    input  logic                                  clk_i,
    input  logic                                  rst_ni,
    input  logic                                  clear_i,

    input  logic                                  start_i,
    output logic                                  ready_o,
    input  xy_pkg::job_t                          job_i,
    input  logic [xy_pkg::Regions-1:0][25:0]      base_i,
    input  logic [xy_pkg::Regions-1:0][25:0]      lines_i,

    output logic [3:0]                            stage_o,
    output logic                                  done_o,
    output logic                                  error_o,
    output logic [3:0]                            error_code_o,
    output logic                                  error_region_valid_o,
    output logic [xy_pkg::RegionWidth-1:0]        error_region_o,
    output logic [31:0]                           error_addr_o,

    output logic                                  root_valid_o,
    output xy_pkg::subtree_t                      root_o,
    output logic [31:0]                           nodes_o,
    output logic [31:0]                           leaves_o,

    // Events, for the counters.
    output logic                                  node_o,
    output logic                                  leaf_o,
    output logic                                  replace_o,

    output logic                                  rd_valid_o,
    input  logic                                  rd_ready_i,
    output logic [31:0]                           rd_addr_o,
    output logic [TagWidth-1:0]                   rd_tag_o,
    output logic [xy_pkg::RegionWidth-1:0]        rd_region_o,
    input  logic                                  rsp_valid_i,
    input  logic [TagWidth-1:0]                   rsp_tag_i,
    input  logic [xy_pkg::LineBits-1:0]           rsp_data_i,

    output logic                                  wr_valid_o,
    input  logic                                  wr_ready_i,
    output logic [31:0]                           wr_addr_o,
    output logic [xy_pkg::LineBits-1:0]           wr_data_o,
    output logic [xy_pkg::LineBytes-1:0]          wr_strb_o,
    output logic [xy_pkg::RegionWidth-1:0]        wr_region_o,
    input  logic                                  quiet_i
);

  localparam int unsigned MergeTag  = $clog2(Capacity) + $clog2(Burst) - 2;
  localparam int unsigned ReaderTag = $clog2(ReadAhead);
  localparam int unsigned SortTag   = 1 + ((MergeTag > ReaderTag) ? MergeTag : ReaderTag);

  // A region in bytes. One of 4 GiB less a line is as large as fits.
  logic [xy_pkg::Regions-1:0][31:0] base, size;
  for (genvar i = 0; i < xy_pkg::Regions; i++) begin : gen_bytes
    assign base[i] = {base_i[i], 6'd0};
    assign size[i] = {lines_i[i], 6'd0};
  end

  localparam int unsigned Primitives = 32'(xy_regs_pkg::region_id__primitives);
  localparam int unsigned RunsA      = 32'(xy_regs_pkg::region_id__runs_a);
  localparam int unsigned RunsB      = 32'(xy_regs_pkg::region_id__runs_b);
  localparam int unsigned Nodes      = 32'(xy_regs_pkg::region_id__nodes);
  localparam int unsigned LeafTable  = 32'(xy_regs_pkg::region_id__leaf_table);

  logic wide;
  assign wide = job_i.morton_bits == 7'd63;

  // --- Sort ---

  logic                                     item_valid, item_ready, item_end;
  xy_pkg::record_t                          item;
  logic [CodeWidth-1:0]                     item_code;
  logic                                     primitive_error, run_error;
  logic [31:0]                              error_index;
  logic [SortTag-1:0]                       sort_tag;
  logic [1:0]                               sort_stage;
  logic                                     source_b, target_b;
  logic                                     from_input;
  logic [2:0]                               valid, ready, last;
  logic [2:0][31:0]                         addr;
  logic [2:0][xy_pkg::LineBits-1:0]         data;
  logic [2:0][xy_pkg::LineBytes-1:0]        strb;
  logic [2:0][xy_pkg::RegionWidth-1:0]      region;

  xy_mergesort #(
      .Capacity (Capacity),
      .Burst    (Burst),
      .Sorters  (Sorters),
      .Fifo     (Fifo),
      .ReadAhead(ReadAhead),
      .CodeWidth(CodeWidth)
  ) u_sort (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .ready_o,
      .wide_i           (wide),
      .count_i          (job_i.primitives),
      .primitives_base_i(base[Primitives]),
      .runs_a_base_i    (base[RunsA]),
      .runs_a_size_i    (size[RunsA]),
      .runs_b_base_i    (base[RunsB]),
      .runs_b_size_i    (size[RunsB]),
      .quiet_i,
      .stage_o          (sort_stage),
      .source_b_o       (source_b),
      .target_b_o       (target_b),
      .replace_o,
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rd_tag_o         (sort_tag),
      .rd_input_o       (from_input),
      .rsp_valid_i,
      .rsp_tag_i        (rsp_tag_i[SortTag-1:0]),
      .rsp_data_i,
      .wr_valid_o       (valid[0]),
      .wr_ready_i       (ready[0]),
      .wr_addr_o        (addr[0]),
      .wr_data_o        (data[0]),
      .wr_strb_o        (strb[0]),
      .wr_last_o        (last[0]),
      .item_valid_o     (item_valid),
      .item_ready_i     (item_ready),
      .item_o           (item),
      .item_code_o      (item_code),
      .end_o            (item_end),
      .primitive_error_o(primitive_error),
      .region_error_o   (run_error),
      .error_index_o    (error_index)
  );
  logic unused_tag;
  assign unused_tag = ^rsp_tag_i;

  assign rd_tag_o    = TagWidth'(sort_tag);
  assign rd_region_o = from_input ? xy_regs_pkg::region_id__primitives
      : (source_b ? xy_regs_pkg::region_id__runs_b : xy_regs_pkg::region_id__runs_a);
  assign region[0]   = target_b ? xy_regs_pkg::region_id__runs_b : xy_regs_pkg::region_id__runs_a;

  // --- Emit ---

  logic [1:0]  emit_error;
  logic [31:0] entries;

  xy_emit #(
      .CodeWidth (CodeWidth),
      .BurstLines(WriteLines)
  ) u_emit (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .node_base_i    (base[Nodes]),
      .node_size_i    (size[Nodes]),
      .leaf_base_i    (base[LeafTable]),
      .leaf_size_i    (size[LeafTable]),
      .max_leaf_i     (job_i.leaf_size),
      .item_valid_i   (item_valid),
      .item_ready_o   (item_ready),
      .item_i         (item),
      .item_code_i    (item_code),
      .end_i          (item_end),
      .node_o,
      .leaf_o,
      .node_wr_valid_o(valid[1]),
      .node_wr_ready_i(ready[1]),
      .node_wr_addr_o (addr[1]),
      .node_wr_data_o (data[1]),
      .node_wr_strb_o (strb[1]),
      .node_wr_last_o (last[1]),
      .leaf_wr_valid_o(valid[2]),
      .leaf_wr_ready_i(ready[2]),
      .leaf_wr_addr_o (addr[2]),
      .leaf_wr_data_o (data[2]),
      .leaf_wr_strb_o (strb[2]),
      .leaf_wr_last_o (last[2]),
      .done_o,
      .error_o        (emit_error),
      .root_valid_o,
      .root_o,
      .node_count_o   (nodes_o),
      .leaf_count_o   (leaves_o),
      .entry_count_o  (entries)
  );
  logic unused_entries;
  assign unused_entries = ^entries;

  assign region[1] = xy_regs_pkg::region_id__nodes;
  assign region[2] = xy_regs_pkg::region_id__leaf_table;

  xy_write_arbiter u_arbiter (
      .clk_i,
      .rst_ni,
      .clear_i,
      .valid_i (valid),
      .ready_o (ready),
      .last_i  (last),
      .addr_i  (addr),
      .data_i  (data),
      .strb_i  (strb),
      .region_i(region),
      .valid_o (wr_valid_o),
      .ready_i (wr_ready_i),
      .addr_o  (wr_addr_o),
      .data_o  (wr_data_o),
      .strb_o  (wr_strb_o),
      .region_o(wr_region_o)
  );

  // --- Stage and errors ---

  always_comb begin
    unique case (sort_stage)
      2'd0: stage_o = 4'(xy_regs_pkg::stage__sort);
      2'd1: stage_o = 4'(xy_regs_pkg::stage__merge);
      default: stage_o = 4'(xy_regs_pkg::stage__emit);
    endcase
  end

  assign error_o = primitive_error || run_error || (|emit_error);

  always_comb begin
    error_code_o         = 4'(xy_regs_pkg::error_code__region_full);
    error_region_valid_o = 1'b1;
    error_addr_o         = '0;
    if (primitive_error) begin
      error_code_o   = 4'(xy_regs_pkg::error_code__bad_primitive);
      error_region_o = xy_regs_pkg::region_id__primitives;
      // Its first byte.
      error_addr_o   = base[Primitives] + {error_index[26:0], 5'd0};
    end else if (run_error) begin
      error_region_o = region[0];
    end else begin
      error_region_o = emit_error[0] ? xy_regs_pkg::region_id__nodes
                                     : xy_regs_pkg::region_id__leaf_table;
    end
  end

  logic unused_index;
  assign unused_index = ^error_index[31:27];

endmodule
