// The registers in the words of the units: what the generated block xy_regs holds, bundled.
//
// All that this module adds are names and the memory of a finished job's results, which the register
// block shows but does not store.
module xy_csr #(
    parameter xy_pkg::caps_t Caps = '0
) (
    input  logic                            clk_i,
    input  logic                            rst_ni,

    // AXI4-Lite.
    input  logic                            awvalid_i,
    output logic                            awready_o,
    input  logic [8:0]                      awaddr_i,
    input  logic                            wvalid_i,
    output logic                            wready_o,
    input  logic [31:0]                     wdata_i,
    input  logic [3:0]                      wstrb_i,
    output logic                            bvalid_o,
    input  logic                            bready_i,
    output logic [1:0]                      bresp_o,
    input  logic                            arvalid_i,
    output logic                            arready_o,
    input  logic [8:0]                      araddr_i,
    output logic                            rvalid_o,
    input  logic                            rready_i,
    output logic [31:0]                     rdata_o,
    output logic [1:0]                      rresp_o,
    output logic                            irq_o,

    // Control.
    output logic                            start_o,
    output logic                            abort_o,
    output logic                            soft_reset_o,
    output xy_pkg::job_t                    job_o,
    output logic [xy_pkg::Regions-1:0][25:0] base_o,
    output logic [xy_pkg::Regions-1:0][25:0] lines_o,
    input  xy_pkg::status_t                 status_i,
    input  logic                            ended_well_i,
    input  logic                            ended_badly_i,

    // Results, taken when result_valid_i is high.
    input  logic                            forget_i,
    input  logic                            result_valid_i,
    input  logic                            root_valid_i,
    input  xy_pkg::subtree_t                  root_i,
    input  xy_pkg::result_t                 result_i,
    input  logic [xy_pkg::Events-1:0][63:0] count_i
);

  xy_regs_pkg::xylem__in_t  hwif_in;
  xy_regs_pkg::xylem__out_t hwif_out;

  xy_regs u_regs (
      .clk           (clk_i),
      .arst_n        (rst_ni),
      .s_axil_awready(awready_o),
      .s_axil_awvalid(awvalid_i),
      .s_axil_awaddr (awaddr_i),
      .s_axil_awprot ('0),
      .s_axil_wready (wready_o),
      .s_axil_wvalid (wvalid_i),
      .s_axil_wdata  (wdata_i),
      .s_axil_wstrb  (wstrb_i),
      .s_axil_bready (bready_i),
      .s_axil_bvalid (bvalid_o),
      .s_axil_bresp  (bresp_o),
      .s_axil_arready(arready_o),
      .s_axil_arvalid(arvalid_i),
      .s_axil_araddr (araddr_i),
      .s_axil_arprot ('0),
      .s_axil_rready (rready_i),
      .s_axil_rvalid (rvalid_o),
      .s_axil_rdata  (rdata_o),
      .s_axil_rresp  (rresp_o),
      .hwif_in       (hwif_in),
      .hwif_out      (hwif_out)
  );

  assign irq_o = hwif_out.int_status.intr;

  // --- Commands and parameters ---

  assign start_o      = hwif_out.ctrl.start.value;
  assign abort_o      = hwif_out.ctrl.abort_job.value;
  assign soft_reset_o = hwif_out.ctrl.soft_reset.value;

  assign job_o.kind          = hwif_out.ctrl.job.value;
  assign job_o.primitives    = hwif_out.job.primitives.value.value;
  assign job_o.rays          = hwif_out.job.rays.value.value;
  assign job_o.nodes         = hwif_out.job.nodes.value.value;
  assign job_o.entries       = hwif_out.job.entries.value.value;
  assign job_o.input_format  = hwif_out.job.format.input_.value;
  assign job_o.record_format = hwif_out.job.format.record.value;
  assign job_o.node_format   = hwif_out.job.format.node.value;
  assign job_o.modulo        = hwif_out.job.format.coords.value;
  assign job_o.any_hit       = hwif_out.job.format.query.value;
  assign job_o.morton_bits   = hwif_out.job.limits.morton_bits.value;
  assign job_o.leaf_size     = hwif_out.job.limits.leaf_size.value;
  assign job_o.treelet_depth = hwif_out.job.limits.treelet_depth.value;

  assign job_o.root.box.lo.x  = hwif_out.root.lo_x.value.value[23:0];
  assign job_o.root.box.lo.y  = hwif_out.root.lo_y.value.value[23:0];
  assign job_o.root.box.lo.z  = hwif_out.root.lo_z.value.value[23:0];
  assign job_o.root.box.hi.x  = hwif_out.root.hi_x.value.value[23:0];
  assign job_o.root.box.hi.y  = hwif_out.root.hi_y.value.value[23:0];
  assign job_o.root.box.hi.z  = hwif_out.root.hi_z.value.value[23:0];
  assign job_o.root.index    = hwif_out.root.pointer.index.value;
  assign job_o.root.count    = hwif_out.root.leaf_size.count.value;

  assign base_o = {
    hwif_out.region.hits.base.line.value,       hwif_out.region.rays.base.line.value,
    hwif_out.region.quantized.base.line.value,  hwif_out.region.leaf_table.base.line.value,
    hwif_out.region.nodes.base.line.value,      hwif_out.region.runs_b.base.line.value,
    hwif_out.region.runs_a.base.line.value,     hwif_out.region.primitives.base.line.value
  };
  assign lines_o = {
    hwif_out.region.hits.size.lines.value,      hwif_out.region.rays.size.lines.value,
    hwif_out.region.quantized.size.lines.value, hwif_out.region.leaf_table.size.lines.value,
    hwif_out.region.nodes.size.lines.value,     hwif_out.region.runs_b.size.lines.value,
    hwif_out.region.runs_a.size.lines.value,    hwif_out.region.primitives.size.lines.value
  };

  // --- Status ---

  assign hwif_in.status.busy.next             = status_i.busy;
  assign hwif_in.status.done.next             = status_i.done;
  assign hwif_in.status.failed.next           = status_i.failed;
  assign hwif_in.status.stage.next            = status_i.stage;
  assign hwif_in.error_info.code.next         = {4'd0, status_i.error_code};
  assign hwif_in.error_info.stage.next        = status_i.error_stage;
  assign hwif_in.error_info.region_valid.next = status_i.error_region_valid;
  assign hwif_in.error_info.region.next       = {1'b0, status_i.error_region};
  assign hwif_in.error_addr.addr.next         = status_i.error_addr;
  assign hwif_in.int_status.done.next         = ended_well_i;
  assign hwif_in.int_status.failed.next       = ended_badly_i;

  // --- Results ---

  xy_pkg::result_t result_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) result_q <= '0;
    else if (forget_i) result_q <= '0;
    else if (result_valid_i) result_q <= result_i;
  end

  assign hwif_in.result.nodes.value.next     = result_q.nodes;
  assign hwif_in.result.leaves.value.next    = result_q.leaves;
  assign hwif_in.result.quantized.value.next = result_q.quantized;
  assign hwif_in.result.hits.value.next      = result_q.hits;

  function automatic logic [31:0] extend(logic [xy_pkg::CoordWidth-1:0] c);
    extend = {{(32 - xy_pkg::CoordWidth){c[xy_pkg::CoordWidth-1]}}, c};
  endfunction

  assign hwif_in.root.lo_x.value.next      = extend(root_i.box.lo.x);
  assign hwif_in.root.lo_y.value.next      = extend(root_i.box.lo.y);
  assign hwif_in.root.lo_z.value.next      = extend(root_i.box.lo.z);
  assign hwif_in.root.hi_x.value.next      = extend(root_i.box.hi.x);
  assign hwif_in.root.hi_y.value.next      = extend(root_i.box.hi.y);
  assign hwif_in.root.hi_z.value.next      = extend(root_i.box.hi.z);
  assign hwif_in.root.pointer.index.next   = root_i.index;
  assign hwif_in.root.leaf_size.count.next = root_i.count;
  assign hwif_in.root.lo_x.value.we        = root_valid_i;
  assign hwif_in.root.lo_y.value.we        = root_valid_i;
  assign hwif_in.root.lo_z.value.we        = root_valid_i;
  assign hwif_in.root.hi_x.value.we        = root_valid_i;
  assign hwif_in.root.hi_y.value.we        = root_valid_i;
  assign hwif_in.root.hi_z.value.we        = root_valid_i;
  assign hwif_in.root.pointer.index.we     = root_valid_i;
  assign hwif_in.root.leaf_size.count.we   = root_valid_i;

  // --- Counters ---

  assign {hwif_in.counters.cycles.hi.value.next, hwif_in.counters.cycles.lo.value.next} = count_i[0];
  assign {hwif_in.counters.bytes_read.hi.value.next, hwif_in.counters.bytes_read.lo.value.next} =
      count_i[1];
  assign {hwif_in.counters.bytes_written.hi.value.next,
          hwif_in.counters.bytes_written.lo.value.next} = count_i[2];
  assign {hwif_in.counters.nodes.hi.value.next, hwif_in.counters.nodes.lo.value.next} = count_i[3];
  assign {hwif_in.counters.leaves.hi.value.next, hwif_in.counters.leaves.lo.value.next} = count_i[4];
  assign {hwif_in.counters.heap_replaces.hi.value.next,
          hwif_in.counters.heap_replaces.lo.value.next} = count_i[5];
  assign {hwif_in.counters.backtracks.hi.value.next, hwif_in.counters.backtracks.lo.value.next} =
      count_i[6];
  assign {hwif_in.counters.node_fetches.hi.value.next,
          hwif_in.counters.node_fetches.lo.value.next} = count_i[7];
  assign {hwif_in.counters.box_tests.hi.value.next, hwif_in.counters.box_tests.lo.value.next} =
      count_i[8];
  assign {hwif_in.counters.triangle_tests.hi.value.next,
          hwif_in.counters.triangle_tests.lo.value.next} = count_i[9];

  // --- Capabilities ---

  assign hwif_in.cap.sort.scratch_records.next     = Caps.scratch_records;
  assign hwif_in.cap.sort.burst_records.next       = Caps.burst_records;
  assign hwif_in.cap.merge.width.next              = Caps.merge_width;
  assign hwif_in.cap.merge.leaf_size.next          = Caps.leaf_size;
  assign hwif_in.cap.geometry.grid_bits.next       = 6'(xy_pkg::CoordWidth);
  assign hwif_in.cap.geometry.morton_bits.next     = Caps.morton_bits;
  assign hwif_in.cap.geometry.plane_bits.next      = Caps.plane_bits;
  assign hwif_in.cap.geometry.treelet_depth.next   = Caps.treelet_depth;
  assign hwif_in.cap.features.build.next           = Caps.build;
  assign hwif_in.cap.features.compress.next        = 1'b0;  // no unit goes top-down
  assign hwif_in.cap.features.trace.next           = Caps.trace;
  assign hwif_in.cap.features.build_compressed.next = Caps.build_compressed;
  assign hwif_in.cap.features.input_aabb.next      = Caps.build;
  assign hwif_in.cap.features.input_triangle.next  = Caps.input_triangle;
  assign hwif_in.cap.features.record_box32.next    = Caps.build;
  assign hwif_in.cap.features.record_pair8.next    = 1'b0;
  assign hwif_in.cap.features.record_packed22.next = 1'b0;
  assign hwif_in.cap.features.node_bvh2.next       = Caps.trace_bvh2;
  assign hwif_in.cap.features.node_cbvh.next       = Caps.trace;
  assign hwif_in.cap.features.coords_relative.next = Caps.build_compressed || Caps.trace;
  assign hwif_in.cap.features.coords_modulo.next   = Caps.build_compressed || Caps.trace;
  assign hwif_in.cap.features.counters.next        = 1'b1;
  assign hwif_in.cap.trace.ray_bytes.next          = Caps.ray_bytes;
  assign hwif_in.cap.trace.hit_bytes.next          = Caps.hit_bytes;
  assign hwif_in.cap.trace.stack_entries.next      = Caps.stack_entries;

endmodule
