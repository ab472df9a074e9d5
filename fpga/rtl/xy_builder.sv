// The builder: primitives in memory in, a tree in memory out (P2 §5), compressed as it comes if the job says
// so and there is a compressor (P3 §4).
//
//   rd ──► xy_mergesort ──► item ──► xy_emit ◄── rd, to repair nodes
//               │ runs                 │ nodes, leaf table
//               └──► xy_write_arbiter ◄┘──► wr
//
// Handshake   start_i takes the job; ready_o must be high, which it is some cycles after clear_i. done_o rises when the tree is
//             written, as far as the write port is concerned, and stays until clear_i.
//             rd, rsp, wr: line ports; each request names the region that it may touch.
//             quiet_i says that every line written so far can be read back: runs are read only then. A read
//             of one node's line must show what was written before.
//             error_o: primitive, runs A, runs B, nodes, leaf table, or a node in memory that is not what was
//             written; it stays until clear_i, and nothing more is asked for or written.
// Order       a read for a repair goes before those of runs, as the emitter waits for it.
// Latency, throughput, cut paths: those of the units.
module xy_builder #(
    parameter int unsigned Capacity   = 128,
    parameter int unsigned Burst      = 4,
    parameter int unsigned Sorters    = 2,
    parameter int unsigned Fifo       = 4,
    parameter int unsigned ReadAhead  = 8,
    parameter int unsigned CodeWidth  = 63,
    parameter int unsigned WriteLines = 8,   // of the bursts of nodes and leaf table
    parameter int unsigned Depth      = 0,   // of the compressor's treelets; 0 without compressor
    parameter int unsigned TagWidth   = 18
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
    output xy_pkg::region_t                       error_region_o,
    output logic [31:0]                           error_addr_o,

    output logic                                  root_valid_o,
    output xy_pkg::subtree_t                      root_o,
    output logic [31:0]                           nodes_o,
    output logic [31:0]                           leaves_o,

    // Events, for the counters.
    output logic                                  node_o,
    output logic                                  leaf_o,
    output logic                                  replace_o,
    output logic                                  repaired_o,

    output logic                                  rd_valid_o,
    input  logic                                  rd_ready_i,
    output logic [31:0]                           rd_addr_o,
    output logic [TagWidth-1:0]                   rd_tag_o,
    output xy_pkg::region_t                       rd_region_o,
    input  logic                                  rsp_valid_i,
    input  logic [TagWidth-1:0]                   rsp_tag_i,
    input  logic [xy_pkg::LineBits-1:0]           rsp_data_i,

    output logic                                  wr_valid_o,
    input  logic                                  wr_ready_i,
    output logic [31:0]                           wr_addr_o,
    output logic [xy_pkg::LineBits-1:0]           wr_data_o,
    output logic [xy_pkg::LineBytes-1:0]          wr_strb_o,
    output xy_pkg::region_t                       wr_region_o,
    input  logic                                  quiet_i
);

  localparam int unsigned MergeTag  = $clog2(Capacity) + $clog2(Burst) - 2;
  localparam int unsigned ReaderTag = $clog2(ReadAhead);
  localparam int unsigned SortTag   = 1 + ((MergeTag > ReaderTag) ? MergeTag : ReaderTag);
  localparam int unsigned RepairTag = TagWidth - 1;  // bit of a tag that says: for the compressor

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
  localparam int unsigned Quantized  = 32'(xy_regs_pkg::region_id__quantized);

  logic wide, triangles, compress;
  assign wide      = job_i.morton_bits == 7'd63;
  assign triangles = job_i.input_format == 2'(xy_regs_pkg::input_format__triangle);
  assign compress  = job_i.kind == xy_regs_pkg::job_kind__build_compressed;

  // --- Sort ---

  logic                                     item_valid, item_ready, item_end;
  xy_pkg::record_t                          item;
  xy_pkg::split_t                           item_split;
  logic                                     primitive_error, run_error;
  logic [31:0]                              error_index;
  logic [SortTag-1:0]                       sort_tag;
  logic [1:0]                               sort_stage;
  logic                                     source_b, target_b;
  logic                                     from_input, sort_rd_valid, sort_rd_ready;
  logic [31:0]                              sort_rd_addr;
  logic [2:0]                               valid, ready, last;
  logic [2:0][31:0]                         addr;
  logic [2:0][xy_pkg::LineBits-1:0]         data;
  logic [2:0][xy_pkg::LineBytes-1:0]        strb;
  xy_pkg::region_t [2:0]                    region;

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
      .triangles_i      (triangles),
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
      .rd_valid_o       (sort_rd_valid),
      .rd_ready_i       (sort_rd_ready),
      .rd_addr_o        (sort_rd_addr),
      .rd_tag_o         (sort_tag),
      .rd_input_o       (from_input),
      .rsp_valid_i      (rsp_valid_i && !rsp_tag_i[RepairTag]),
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
      .item_split_o     (item_split),
      .end_o            (item_end),
      .primitive_error_o(primitive_error),
      .region_error_o   (run_error),
      .error_index_o    (error_index)
  );
  logic unused_tag;
  assign unused_tag = ^rsp_tag_i;

  xy_regs_pkg::region_id_e sort_region;
  assign sort_region = from_input ? xy_regs_pkg::region_id__primitives
      : (source_b ? xy_regs_pkg::region_id__runs_b : xy_regs_pkg::region_id__runs_a);
  assign region[0]   = target_b ? xy_regs_pkg::region_id__runs_b : xy_regs_pkg::region_id__runs_a;

  // --- Emit ---

  logic [2:0]  emit_error;
  logic [31:0] entries, repair_addr, node_base, node_size;
  logic        repair_valid, repair_ready;
  assign node_base = compress ? base[Quantized] : base[Nodes];
  assign node_size = compress ? size[Quantized] : size[Nodes];

  xy_emit #(
      .BurstLines(WriteLines),
      .Depth     (Depth)
  ) u_emit (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .node_base_i    (node_base),
      .node_size_i    (node_size),
      .leaf_base_i    (base[LeafTable]),
      .leaf_size_i    (size[LeafTable]),
      .max_leaf_i     (job_i.leaf_size),
      .compress_i     (compress),
      .modulo_i       (job_i.modulo),
      .item_valid_i   (item_valid),
      .item_ready_o   (item_ready),
      .item_i         (item),
      .item_split_i   (item_split),
      .end_i          (item_end),
      .node_o,
      .leaf_o,
      .repaired_o,
      .rd_valid_o     (repair_valid),
      .rd_ready_i     (repair_ready),
      .rd_addr_o      (repair_addr),
      .rsp_valid_i    (rsp_valid_i && rsp_tag_i[RepairTag]),
      .rsp_data_i,
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

  assign region[1] = compress ? xy_regs_pkg::region_id__quantized : xy_regs_pkg::region_id__nodes;
  assign region[2] = xy_regs_pkg::region_id__leaf_table;

  // --- Reads ---

  assign rd_valid_o    = repair_valid || sort_rd_valid;
  assign rd_addr_o     = repair_valid ? repair_addr : sort_rd_addr;
  assign rd_region_o   = repair_valid ? xy_regs_pkg::region_id__quantized : sort_region;
  assign rd_tag_o      = repair_valid ? TagWidth'(1) << RepairTag : TagWidth'(sort_tag);
  assign repair_ready  = rd_ready_i;
  assign sort_rd_ready = rd_ready_i && !repair_valid;

  // --- Writes ---

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
      error_addr_o   = base[Primitives] + {error_index[26:0], 5'd0}
          + (triangles ? 32'({error_index[26:0], 3'd0}) : 32'd0);
    end else if (run_error) begin
      error_region_o = region[0];
    end else if (emit_error[2]) begin
      error_code_o   = 4'(xy_regs_pkg::error_code__corrupt_node);
      error_region_o = region[1];
    end else begin
      error_region_o = emit_error[0] ? region[1] : xy_regs_pkg::region_id__leaf_table;
    end
  end

`ifndef SYNTHESIS
  // The tags of the sorter leave the bit to the compressor.
  if (SortTag >= TagWidth) $error("TagWidth is too small");
`endif

  logic unused_index;
  assign unused_index = ^error_index[31:27];

endmodule
