// Xylem: registers on an AXI4-Lite slave, memory on an AXI4 master, an interrupt line, and between them
// the units that do jobs.
//
//   s_axil ──► xy_csr ──► xy_control ──┬─► xy_builder ──┬─► xy_port ──► m_axi
//                │            ▲        └─► xy_tracer ───┘      │
//   irq ◄────────┘            └─ errors ──┴──────────┴─────────┘
//
// One job at a time, one unit at work. The parameters are those of a named configuration in configs.toml.
module xy_top #(
    parameter int unsigned Capacity   = 128,      // M: records of the scratchpad
    parameter int unsigned Burst      = 4,        // B: records of a burst
    parameter int unsigned Sorters    = 2,
    parameter int unsigned Fifo       = 4,        // records between merge and emitter
    parameter int unsigned ReadAhead  = 8,        // lines of input
    parameter int unsigned CodeWidth  = 63,       // 30 or 63
    parameter int unsigned WriteLines = 8,        // of a burst of nodes
    parameter int unsigned Depth      = 1,        // of the compressor's treelets, 1 to 4; 0 without compressor
    parameter int unsigned Tracer     = 1,        // whether there is a traversal unit
    parameter int unsigned CacheWidth = 4,        // that unit's cache holds 2^CacheWidth lines
    parameter int unsigned CacheBlock = 0,        // whether those are in block memory
    parameter int unsigned DataWidth  = 512,      // of the memory bus
    parameter int unsigned IdWidth    = 4,        // 2^IdWidth lines may be under way
    parameter int unsigned TimeOut    = 1 << 20   // cycles
) (
    input  logic                   clk_i,
    input  logic                   rst_ni,
    output logic                   irq_o,

    input  logic                   s_axil_awvalid_i,
    output logic                   s_axil_awready_o,
    input  logic [8:0]             s_axil_awaddr_i,
    input  logic                   s_axil_wvalid_i,
    output logic                   s_axil_wready_o,
    input  logic [31:0]            s_axil_wdata_i,
    input  logic [3:0]             s_axil_wstrb_i,
    output logic                   s_axil_bvalid_o,
    input  logic                   s_axil_bready_i,
    output logic [1:0]             s_axil_bresp_o,
    input  logic                   s_axil_arvalid_i,
    output logic                   s_axil_arready_o,
    input  logic [8:0]             s_axil_araddr_i,
    output logic                   s_axil_rvalid_o,
    input  logic                   s_axil_rready_i,
    output logic [31:0]            s_axil_rdata_o,
    output logic [1:0]             s_axil_rresp_o,

    output logic                   m_axi_arvalid_o,
    input  logic                   m_axi_arready_i,
    output logic [IdWidth-1:0]     m_axi_arid_o,
    output logic [31:0]            m_axi_araddr_o,
    output logic [7:0]             m_axi_arlen_o,
    output logic [2:0]             m_axi_arsize_o,
    output logic [1:0]             m_axi_arburst_o,
    input  logic                   m_axi_rvalid_i,
    output logic                   m_axi_rready_o,
    input  logic [IdWidth-1:0]     m_axi_rid_i,
    input  logic [DataWidth-1:0]   m_axi_rdata_i,
    input  logic [1:0]             m_axi_rresp_i,
    input  logic                   m_axi_rlast_i,
    output logic                   m_axi_awvalid_o,
    input  logic                   m_axi_awready_i,
    output logic [IdWidth-1:0]     m_axi_awid_o,
    output logic [31:0]            m_axi_awaddr_o,
    output logic [7:0]             m_axi_awlen_o,
    output logic [2:0]             m_axi_awsize_o,
    output logic [1:0]             m_axi_awburst_o,
    output logic                   m_axi_wvalid_o,
    input  logic                   m_axi_wready_i,
    output logic [DataWidth-1:0]   m_axi_wdata_o,
    output logic [DataWidth/8-1:0] m_axi_wstrb_o,
    output logic                   m_axi_wlast_o,
    input  logic                   m_axi_bvalid_i,
    output logic                   m_axi_bready_o,
    input  logic [IdWidth-1:0]     m_axi_bid_i,
    input  logic [1:0]             m_axi_bresp_i
);

  localparam int unsigned TagWidth  = 18;
  localparam bit          Quantized = (Depth > 0) || (Tracer > 0);

  // In the order of xy_pkg::caps_t, as yosys knows no assignment patterns.
  localparam xy_pkg::caps_t Caps = {
    24'(Capacity),                // scratch_records
    8'(Burst),                    // burst_records
    16'(Capacity / (2 * Burst)),  // merge_width
    8'd255,                       // leaf_size
    7'(CodeWidth),                // morton_bits
    Quantized ? 4'd6 : 4'd0,      // plane_bits
    3'(Depth),                    // treelet_depth
    1'b1,                         // build
    Depth > 0,                    // build_compressed
    Tracer > 0,                   // trace
    Tracer > 0,                   // trace_bvh2
    1'b1,                         // input_triangle
    Tracer > 0 ? 8'd40 : 8'd0,    // ray_bytes
    Tracer > 0 ? 8'd24 : 8'd0,    // hit_bytes
    Tracer > 0 ? 8'd95 : 8'd0     // stack_entries: one for each level that a tree may have
  };

  // --- Registers and control ---

  logic                                start, abort, soft_reset, ended_well, ended_badly;
  xy_pkg::job_t                        job;
  logic [xy_pkg::Regions-1:0][25:0]    base, lines;
  xy_pkg::status_t                     status;
  logic                                unit_start, unit_clear, unit_ready, running,
                                       clear_counters;
  logic                                config_ok_q;

  xy_pkg::subtree_t                    root;
  logic                                root_valid;
  xy_pkg::result_t                     result;
  logic [xy_pkg::Events-1:0][6:0]      events;
  logic [xy_pkg::Events-1:0][63:0]     count;

  logic                                unit_done, unit_error, unit_region_valid;
  logic [3:0]                          unit_stage, unit_code;
  logic [xy_pkg::RegionWidth-1:0]      unit_region;
  logic [31:0]                         unit_addr;

  logic                                violation, read_error, write_error, moved, idle;
  logic [xy_pkg::RegionWidth-1:0]      violation_region;
  logic [31:0]                         violation_addr, read_addr, write_addr, waiting_addr;

  logic done;
  assign done = running && unit_done && !unit_error;

  xy_csr #(.Caps(Caps)) u_csr (
      .clk_i,
      .rst_ni,
      .awvalid_i     (s_axil_awvalid_i),
      .awready_o     (s_axil_awready_o),
      .awaddr_i      (s_axil_awaddr_i),
      .wvalid_i      (s_axil_wvalid_i),
      .wready_o      (s_axil_wready_o),
      .wdata_i       (s_axil_wdata_i),
      .wstrb_i       (s_axil_wstrb_i),
      .bvalid_o      (s_axil_bvalid_o),
      .bready_i      (s_axil_bready_i),
      .bresp_o       (s_axil_bresp_o),
      .arvalid_i     (s_axil_arvalid_i),
      .arready_o     (s_axil_arready_o),
      .araddr_i      (s_axil_araddr_i),
      .rvalid_o      (s_axil_rvalid_o),
      .rready_i      (s_axil_rready_i),
      .rdata_o       (s_axil_rdata_o),
      .rresp_o       (s_axil_rresp_o),
      .irq_o,
      .start_o       (start),
      .abort_o       (abort),
      .soft_reset_o  (soft_reset),
      .job_o         (job),
      .base_o        (base),
      .lines_o       (lines),
      .status_i      (status),
      .ended_well_i  (ended_well),
      .ended_badly_i (ended_badly),
      .forget_i      (unit_start || soft_reset),
      .result_valid_i(done),
      .root_valid_i  (done && root_valid && !traces),
      .root_i        (root),
      .result_i      (result),
      .count_i       (count)
  );

  // What the capabilities rule out. The driver refuses the same; this is for any other software.
  logic compresses, traces, build_ok, trace_ok;
  assign compresses = job.kind == xy_regs_pkg::job_kind__build_compressed;
  assign traces     = job.kind == xy_regs_pkg::job_kind__trace;
  assign build_ok   = ((job.kind == xy_regs_pkg::job_kind__build)
          || (compresses && (job.treelet_depth == 3'(Depth)) && (Depth > 0)))
      && ((job.input_format == 2'(xy_regs_pkg::input_format__aabb))
          || (job.input_format == 2'(xy_regs_pkg::input_format__triangle)))
      && (job.record_format == xy_regs_pkg::record_format__box32)
      && ((job.morton_bits == 7'd30) || ((job.morton_bits == 7'd63) && (CodeWidth == 63)))
      && (job.leaf_size != '0);
  // Counts whose bytes cannot be addressed would wrap around.
  assign trace_ok   = traces && (job.rays != '0) && (Tracer > 0)
      && ({job.primitives[31:26], job.rays[31:26], job.nodes[31:26], job.entries[31:26]} == '0);
  // Registers do not change in the cycle in which a job starts.
  always_ff @(posedge clk_i) begin
    config_ok_q <= (job.primitives != '0) && (job.primitives[31:27] == '0) && (build_ok || trace_ok);
  end

  xy_control #(.TimeOut(TimeOut)) u_control (
      .clk_i,
      .rst_ni,
      .start_i             (start),
      .abort_i             (abort),
      .soft_reset_i        (soft_reset),
      .config_ok_i         (config_ok_q),
      .base_i              (base),
      .lines_i             (lines),
      .busy_o              (status.busy),
      .done_o              (status.done),
      .failed_o            (status.failed),
      .stage_o             (status.stage),
      .error_code_o        (status.error_code),
      .error_stage_o       (status.error_stage),
      .error_region_valid_o(status.error_region_valid),
      .error_region_o      (status.error_region),
      .error_addr_o        (status.error_addr),
      .ended_well_o        (ended_well),
      .ended_badly_o       (ended_badly),
      .clear_counters_o    (clear_counters),
      .start_o             (unit_start),
      .clear_o             (unit_clear),
      .running_o           (running),
      .unit_ready_i        (unit_ready),
      .unit_done_i         (unit_done),
      .unit_stage_i        (unit_stage),
      .unit_error_i        (unit_error),
      .unit_code_i         (unit_code),
      .unit_region_valid_i (unit_region_valid),
      .unit_region_i       (unit_region),
      .unit_addr_i         (unit_addr),
      .violation_i         (violation),
      .violation_region_i  (violation_region),
      .violation_addr_i    (violation_addr),
      .read_error_i        (read_error),
      .read_addr_i         (read_addr),
      .write_error_i       (write_error),
      .write_addr_i        (write_addr),
      .moved_i             (moved),
      .idle_i              (idle),
      .waiting_addr_i      (waiting_addr)
  );

  // --- Units ---

  logic                         rd_valid, rd_ready, rsp_valid, rsp_error, wr_valid, wr_ready, quiet;
  logic [31:0]                  rd_addr, rsp_addr, wr_addr;
  logic [TagWidth-1:0]          rd_tag, rsp_tag;
  xy_pkg::region_t              rd_region, wr_region;
  logic [xy_pkg::LineBits-1:0]  rsp_data, wr_data;
  logic [xy_pkg::LineBytes-1:0] wr_strb;

  logic                         build_ready, build_done, build_error, build_region_valid;
  logic [3:0]                   build_stage, build_code;
  xy_pkg::region_t              build_region;
  logic [31:0]                  build_addr, nodes;
  logic                         node, leaf, replace, repaired;
  logic                         build_rd_valid, build_wr_valid;
  logic [31:0]                  build_rd_addr, build_wr_addr;
  xy_pkg::region_t              build_rd_region, build_wr_region;
  logic [xy_pkg::LineBits-1:0]  build_wr_data;
  logic [xy_pkg::LineBytes-1:0] build_wr_strb;

  logic unused_rsp_addr;  // the control has it from read_addr
  assign unused_rsp_addr = ^rsp_addr;

  // A line that comes back, for the unit that works.
  logic                         arrives;
  assign arrives = rsp_valid && !rsp_error && running;

  xy_builder #(
      .Capacity  (Capacity),
      .Burst     (Burst),
      .Sorters   (Sorters),
      .Fifo      (Fifo),
      .ReadAhead (ReadAhead),
      .CodeWidth (CodeWidth),
      .WriteLines(WriteLines),
      .Depth     (Depth),
      .TagWidth  (TagWidth)
  ) u_builder (
      .clk_i,
      .rst_ni,
      .clear_i             (unit_clear),
      .start_i             (unit_start && !traces),
      .ready_o             (build_ready),
      .job_i               (job),
      .base_i              (base),
      .lines_i             (lines),
      .stage_o             (build_stage),
      .done_o              (build_done),
      .error_o             (build_error),
      .error_code_o        (build_code),
      .error_region_valid_o(build_region_valid),
      .error_region_o      (build_region),
      .error_addr_o        (build_addr),
      .root_valid_o        (root_valid),
      .root_o              (root),
      .nodes_o             (nodes),
      .leaves_o            (result.leaves),
      .node_o              (node),
      .leaf_o              (leaf),
      .replace_o           (replace),
      .repaired_o          (repaired),
      .rd_valid_o          (build_rd_valid),
      .rd_ready_i          (rd_ready && !traces),
      .rd_addr_o           (build_rd_addr),
      .rd_tag_o            (rd_tag),
      .rd_region_o         (build_rd_region),
      .rsp_valid_i         (arrives && !traces),
      .rsp_tag_i           (rsp_tag),
      .rsp_data_i          (rsp_data),
      .wr_valid_o          (build_wr_valid),
      .wr_ready_i          (wr_ready && !traces),
      .wr_addr_o           (build_wr_addr),
      .wr_data_o           (build_wr_data),
      .wr_strb_o           (build_wr_strb),
      .wr_region_o         (build_wr_region),
      .quiet_i             (quiet)
  );

  logic                         trace_busy, trace_done, trace_error;
  logic [3:0]                   trace_code;
  xy_pkg::region_t              trace_region, trace_rd_region;
  logic [31:0]                  trace_addr, hits;
  logic                         fetched, tested_box, tested_triangle;
  logic                         trace_rd_valid, trace_wr_valid;
  logic [31:0]                  trace_rd_addr, trace_wr_addr;
  logic [xy_pkg::LineBits-1:0]  trace_wr_data;
  logic [xy_pkg::LineBytes-1:0] trace_wr_strb;

  if (Tracer > 0) begin : gen_tracer
    xy_tracer #(
        .CacheWidth(CacheWidth),
        .CacheBlock(CacheBlock)
    ) u_tracer (
        .clk_i,
        .rst_ni,
        .clear_i          (unit_clear),
        .start_i          (unit_start && traces),
        .busy_o           (trace_busy),
        .job_i            (job),
        .base_i           (base),
        .done_o           (trace_done),
        .error_o          (trace_error),
        .error_code_o     (trace_code),
        .error_region_o   (trace_region),
        .error_addr_o     (trace_addr),
        .hits_o           (hits),
        .node_fetch_o     (fetched),
        .box_test_o       (tested_box),
        .triangle_test_o  (tested_triangle),
        .rd_valid_o       (trace_rd_valid),
        .rd_ready_i       (rd_ready && traces),
        .rd_addr_o        (trace_rd_addr),
        .rd_region_o      (trace_rd_region),
        .rsp_valid_i      (arrives && traces),
        .rsp_data_i       (rsp_data),
        .wr_valid_o       (trace_wr_valid),
        .wr_ready_i       (wr_ready && traces),
        .wr_addr_o        (trace_wr_addr),
        .wr_data_o        (trace_wr_data),
        .wr_strb_o        (trace_wr_strb)
    );
  end else begin : gen_no_tracer
    assign trace_busy      = 1'b0;
    assign trace_done      = 1'b0;
    assign trace_error     = 1'b0;
    assign trace_code      = '0;
    assign trace_region    = '0;
    assign trace_addr      = '0;
    assign hits            = '0;
    assign fetched         = 1'b0;
    assign tested_box      = 1'b0;
    assign tested_triangle = 1'b0;
    assign trace_rd_valid  = 1'b0;
    assign trace_rd_addr   = '0;
    assign trace_rd_region = '0;
    assign trace_wr_valid  = 1'b0;
    assign trace_wr_addr   = '0;
    assign trace_wr_data   = '0;
    assign trace_wr_strb   = '0;
    logic unused_job;
    assign unused_job = ^{job.rays, job.nodes, job.entries, job.node_format, job.any_hit, job.root};
  end

  // The unit of the job.
  assign unit_ready        = traces ? !trace_busy : build_ready;
  assign unit_done         = traces ? trace_done : build_done;
  assign unit_error        = traces ? trace_error : build_error;
  assign unit_stage        = traces ? 4'(xy_regs_pkg::stage__trace) : build_stage;
  assign unit_code         = traces ? trace_code : build_code;
  assign unit_region_valid = traces || build_region_valid;
  assign unit_region       = traces ? trace_region : build_region;
  assign unit_addr         = traces ? trace_addr : build_addr;

  assign rd_valid          = traces ? trace_rd_valid : build_rd_valid;
  assign rd_addr           = traces ? trace_rd_addr : build_rd_addr;
  assign rd_region         = traces ? trace_rd_region : build_rd_region;
  assign wr_valid          = traces ? trace_wr_valid : build_wr_valid;
  assign wr_addr           = traces ? trace_wr_addr : build_wr_addr;
  assign wr_data           = traces ? trace_wr_data : build_wr_data;
  assign wr_strb           = traces ? trace_wr_strb : build_wr_strb;
  assign wr_region         = traces ? 3'(xy_regs_pkg::region_id__hits) : build_wr_region;

  assign result.nodes      = compresses ? '0 : nodes;
  assign result.quantized  = compresses ? nodes : '0;
  assign result.hits       = traces ? hits : '0;

  // --- Memory ---

  logic       read_line;
  logic [6:0] wrote_bytes;

  // Once the control has taken a unit out of work, nobody listens to it, and it hears of no line.
  xy_port #(
      .DataWidth(DataWidth),
      .IdWidth  (IdWidth),
      .TagWidth (TagWidth)
  ) u_port (
      .clk_i,
      .rst_ni,
      .base_i            (base),
      .lines_i           (lines),
      .rd_valid_i        (rd_valid && running),
      .rd_ready_o        (rd_ready),
      .rd_addr_i         (rd_addr),
      .rd_tag_i          (rd_tag),
      .rd_region_i       (rd_region),
      .rsp_valid_o       (rsp_valid),
      .rsp_error_o       (rsp_error),
      .rsp_addr_o        (rsp_addr),
      .rsp_tag_o         (rsp_tag),
      .rsp_data_o        (rsp_data),
      .wr_valid_i        (wr_valid && running),
      .wr_ready_o        (wr_ready),
      .wr_addr_i         (wr_addr),
      .wr_data_i         (wr_data),
      .wr_strb_i         (wr_strb),
      .wr_region_i       (wr_region),
      .violation_o       (violation),
      .violation_region_o(violation_region),
      .violation_addr_o  (violation_addr),
      .read_error_o      (read_error),
      .read_addr_o       (read_addr),
      .write_error_o     (write_error),
      .write_addr_o      (write_addr),
      .moved_o           (moved),
      .idle_o            (idle),
      .quiet_o           (quiet),
      .waiting_addr_o    (waiting_addr),
      .read_line_o       (read_line),
      .wrote_bytes_o     (wrote_bytes),
      .arvalid_o         (m_axi_arvalid_o),
      .arready_i         (m_axi_arready_i),
      .arid_o            (m_axi_arid_o),
      .araddr_o          (m_axi_araddr_o),
      .arlen_o           (m_axi_arlen_o),
      .arsize_o          (m_axi_arsize_o),
      .arburst_o         (m_axi_arburst_o),
      .rvalid_i          (m_axi_rvalid_i),
      .rready_o          (m_axi_rready_o),
      .rid_i             (m_axi_rid_i),
      .rdata_i           (m_axi_rdata_i),
      .rresp_i           (m_axi_rresp_i),
      .rlast_i           (m_axi_rlast_i),
      .awvalid_o         (m_axi_awvalid_o),
      .awready_i         (m_axi_awready_i),
      .awid_o            (m_axi_awid_o),
      .awaddr_o          (m_axi_awaddr_o),
      .awlen_o           (m_axi_awlen_o),
      .awsize_o          (m_axi_awsize_o),
      .awburst_o         (m_axi_awburst_o),
      .wvalid_o          (m_axi_wvalid_o),
      .wready_i          (m_axi_wready_i),
      .wdata_o           (m_axi_wdata_o),
      .wstrb_o           (m_axi_wstrb_o),
      .wlast_o           (m_axi_wlast_o),
      .bvalid_i          (m_axi_bvalid_i),
      .bready_o          (m_axi_bready_o),
      .bid_i             (m_axi_bid_i),
      .bresp_i           (m_axi_bresp_i)
  );

  // --- Counters, in the order of the registers ---

  always_comb begin
    events    = '0;
    events[0] = 7'(status.busy);
    events[1] = read_line ? 7'(xy_pkg::LineBytes) : '0;
    events[2] = wrote_bytes;
    events[3] = 7'(node);
    events[4] = 7'(leaf);
    events[5] = 7'(replace);
    events[6] = 7'(repaired);
    events[7] = 7'(fetched);
    events[8] = 7'(tested_box);
    events[9] = 7'(tested_triangle);
  end

  xy_counters #(.Counters(xy_pkg::Events)) u_counters (
      .clk_i,
      .rst_ni,
      .clear_i(clear_counters),
      .step_i (events),
      .count_o(count)
  );

endmodule
