// The tracer: xy_traverser in the words of the registers. What a job and its regions say goes in, an error code and
// an address come out.
//
// Handshake   start_i takes the job, which stays, like the regions; busy_o must be low. done_o is high in the job's
//             last cycle; with it error_o, if it ended early: hits before that are written all the same.
//             rd, rsp, wr: line ports; each read names the region that it may touch, writes go to hits.
//             clear_i gives a job up; no access may be under way.
// Errors      bad_ray: a record, in rays. corrupt_node: a node, or an entry of the leaf table; the region tells.
//             bad_primitive: a triangle that a leaf names. The address is that of its first byte.
// Latency, throughput, cut paths: those of xy_traverser.
module xy_tracer #(
    parameter int unsigned CacheWidth = 4,  // 2^CacheWidth lines
    parameter int unsigned CacheBlock = 0   // whether those are in block memory
) (
    input  logic                             clk_i,
    input  logic                             rst_ni,
    input  logic                             clear_i,

    input  logic                             start_i,
    output logic                             busy_o,
    input  xy_pkg::job_t                     job_i,
    input  logic [xy_pkg::Regions-1:0][25:0] base_i,

    output logic                             done_o,
    output logic                             error_o,
    output logic [3:0]                       error_code_o,
    output xy_pkg::region_t                  error_region_o,
    output logic [31:0]                      error_addr_o,
    output logic [31:0]                      hits_o,

    // Events, for the counters.
    output logic                             node_fetch_o,
    output logic                             box_test_o,
    output logic                             triangle_test_o,

    output logic                             rd_valid_o,
    input  logic                             rd_ready_i,
    output logic [31:0]                      rd_addr_o,
    output xy_pkg::region_t                  rd_region_o,
    input  logic                             rsp_valid_i,
    input  logic [xy_pkg::LineBits-1:0]      rsp_data_i,

    output logic                             wr_valid_o,
    input  logic                             wr_ready_i,
    output logic [31:0]                      wr_addr_o,
    output logic [xy_pkg::LineBits-1:0]      wr_data_o,
    output logic [xy_pkg::LineBytes-1:0]     wr_strb_o
);

  localparam int unsigned Primitives = 32'(xy_regs_pkg::region_id__primitives);
  localparam int unsigned Nodes      = 32'(xy_regs_pkg::region_id__nodes);
  localparam int unsigned LeafTable  = 32'(xy_regs_pkg::region_id__leaf_table);
  localparam int unsigned Quantized  = 32'(xy_regs_pkg::region_id__quantized);
  localparam int unsigned Rays       = 32'(xy_regs_pkg::region_id__rays);
  localparam int unsigned Hits       = 32'(xy_regs_pkg::region_id__hits);

  logic        quantized, last;
  logic [31:0] nodes_base, index, fortieth;
  assign quantized  = job_i.node_format == 1'(xy_regs_pkg::node_format__cbvh);
  assign nodes_base = {quantized ? base_i[Quantized] : base_i[Nodes], 6'd0};

  xy_trace_pkg::trace_error_e error;
  xy_regs_pkg::region_id_e    rd_region;

  xy_traverser #(
      .CacheWidth(CacheWidth),
      .CacheBlock(CacheBlock)
  ) u_traverser (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .busy_o,
      .done_o,
      .quantized_i     (quantized),
      .modulo_i        (job_i.modulo),
      .any_i           (job_i.any_hit),
      .ray_count_i     (job_i.rays),
      .node_count_i    (job_i.nodes),
      .entry_count_i   (job_i.entries),
      .triangle_count_i(job_i.primitives),
      .rays_base_i     ({base_i[Rays], 6'd0}),
      .nodes_base_i    (nodes_base),
      .entries_base_i  ({base_i[LeafTable], 6'd0}),
      .triangles_base_i({base_i[Primitives], 6'd0}),
      .hits_base_i     ({base_i[Hits], 6'd0}),
      .root_box_i      (job_i.root.box),
      .root_index_i    (job_i.root.index),
      .root_count_i    (job_i.root.count),
      .hits_o,
      .error_o         (error),
      .error_index_o   (index),
      .node_fetch_o,
      .box_test_o,
      .triangle_test_o,
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rd_region_o     (rd_region),
      .rsp_valid_i,
      .rsp_data_i,
      .wr_valid_o,
      .wr_ready_i,
      .wr_addr_o,
      .wr_data_o,
      .wr_strb_o,
      .wr_last_o       (last)
  );

  assign rd_region_o = rd_region;
  assign error_o     = done_o && (error != xy_trace_pkg::TraceGood);
  // Rays and triangles have 40 bytes.
  assign fortieth    = {index[26:0], 5'd0} + {index[28:0], 3'd0};

  always_comb begin
    unique case (error)
      xy_trace_pkg::TraceBadRay: begin
        error_code_o   = 4'(xy_regs_pkg::error_code__bad_ray);
        error_region_o = xy_regs_pkg::region_id__rays;
        error_addr_o   = {base_i[Rays], 6'd0} + fortieth;
      end
      xy_trace_pkg::TraceCorruptLeaf: begin
        error_code_o   = 4'(xy_regs_pkg::error_code__corrupt_node);
        error_region_o = xy_regs_pkg::region_id__leaf_table;
        error_addr_o   = {base_i[LeafTable], 6'd0} + {index[29:0], 2'd0};
      end
      xy_trace_pkg::TraceCorruptTriangle: begin
        error_code_o   = 4'(xy_regs_pkg::error_code__bad_primitive);
        error_region_o = xy_regs_pkg::region_id__primitives;
        error_addr_o   = {base_i[Primitives], 6'd0} + fortieth;
      end
      default: begin
        error_code_o   = 4'(xy_regs_pkg::error_code__corrupt_node);
        error_region_o = quantized ? xy_regs_pkg::region_id__quantized : xy_regs_pkg::region_id__nodes;
        error_addr_o   = nodes_base + (quantized ? {index[27:0], 4'd0} : {index[25:0], 6'd0});
      end
    endcase
  end

  logic unused;
  assign unused = ^{last, base_i, job_i, index[31:30]};

endmodule
