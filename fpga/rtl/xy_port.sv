// The road to external memory: line port of the units on one side, AXI4 master on the other, and
// between them the check of every address against the region that the request names.
//
//   rd_*, wr_* ──► queues of xy_axi_read, xy_axi_write ──► xy_guard (one each) ──► AXI4
//   rsp_*      ◄─────────────────────┘
//
// Handshake   as in xy_axi_read and xy_axi_write; a request outside its region is dropped, and a read of a
//             line that is being written waits until it is: every read shows what was written before.
// Regions     base and length in lines, as the registers hold them; requests come a cycle after both or later.
//             The check is right for every base and length, also where their sum is past the end of memory.
// Latency     1 cycle to AXI, 0 cycles back.
//             violation_o, read_error_o, write_error_o, read_line_o and wrote_bytes_o are a cycle behind AXI.
// Bytes       reads count whole lines, writes the bytes that are written.
module xy_port #(
    parameter int unsigned DataWidth = 512,
    parameter int unsigned IdWidth   = 4,   // 2^IdWidth reads may be under way
    parameter int unsigned LogWrites = 4,   // 2^LogWrites writes may be under way
    parameter int unsigned TagWidth  = 16,
    parameter int unsigned Regions   = 8
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,

    input  logic [Regions-1:0][25:0]      base_i,
    input  logic [Regions-1:0][25:0]      lines_i,

    // Units.
    input  logic                          rd_valid_i,
    output logic                          rd_ready_o,
    input  logic [31:0]                   rd_addr_i,
    input  logic [TagWidth-1:0]           rd_tag_i,
    input  logic [$clog2(Regions)-1:0]    rd_region_i,
    output logic                          rsp_valid_o,
    output logic                          rsp_error_o,
    output logic [31:0]                   rsp_addr_o,
    output logic [TagWidth-1:0]           rsp_tag_o,
    output logic [xy_pkg::LineBits-1:0]   rsp_data_o,
    input  logic                          wr_valid_i,
    output logic                          wr_ready_o,
    input  logic [31:0]                   wr_addr_i,
    input  logic [xy_pkg::LineBits-1:0]   wr_data_i,
    input  logic [xy_pkg::LineBytes-1:0]  wr_strb_i,
    input  logic [$clog2(Regions)-1:0]    wr_region_i,

    // Control.
    output logic                          violation_o,
    output logic [$clog2(Regions)-1:0]    violation_region_o,
    output logic [31:0]                   violation_addr_o,
    output logic                          read_error_o,
    output logic [31:0]                   read_addr_o,
    output logic                          write_error_o,
    output logic [31:0]                   write_addr_o,
    output logic                          moved_o,
    output logic                          idle_o,         // nothing held, nothing under way
    output logic                          quiet_o,        // all lines written can be read back
    output logic [31:0]                   waiting_addr_o,
    output logic                          read_line_o,    // a line was asked for
    output logic [6:0]                    wrote_bytes_o,  // 0 if none were taken

    // AXI4.
    output logic                          arvalid_o,
    input  logic                          arready_i,
    output logic [IdWidth-1:0]            arid_o,
    output logic [31:0]                   araddr_o,
    output logic [7:0]                    arlen_o,
    output logic [2:0]                    arsize_o,
    output logic [1:0]                    arburst_o,
    input  logic                          rvalid_i,
    output logic                          rready_o,
    input  logic [IdWidth-1:0]            rid_i,
    input  logic [DataWidth-1:0]          rdata_i,
    input  logic [1:0]                    rresp_i,
    input  logic                          rlast_i,
    output logic                          awvalid_o,
    input  logic                          awready_i,
    output logic [IdWidth-1:0]            awid_o,
    output logic [31:0]                   awaddr_o,
    output logic [7:0]                    awlen_o,
    output logic [2:0]                    awsize_o,
    output logic [1:0]                    awburst_o,
    output logic                          wvalid_o,
    input  logic                          wready_i,
    output logic [DataWidth-1:0]          wdata_o,
    output logic [DataWidth/8-1:0]        wstrb_o,
    output logic                          wlast_o,
    input  logic                          bvalid_i,
    output logic                          bready_o,
    input  logic [IdWidth-1:0]            bid_i,
    input  logic [1:0]                    bresp_i
);

  localparam int unsigned RegionWidth = $clog2(Regions);

  logic rd_allowed, rd_violation, rd_idle, rd_waiting;
  logic wr_allowed, wr_violation, wr_idle, wr_held, wr_error, pending;
  logic [25:0] rd_line, wr_line;
  logic [RegionWidth-1:0] rd_region, wr_region;
  logic [31:0] rd_oldest, wr_oldest;

  // Regions stay while a job runs: their ends are not computed anew for every address.
  logic [Regions-1:0][26:0] end_q;
  always_ff @(posedge clk_i) begin
    for (int unsigned i = 0; i < Regions; i++) end_q[i] <= {1'b0, base_i[i]} + {1'b0, lines_i[i]};
  end

  xy_guard #(.Regions(Regions)) u_read_guard (
      .base_i,
      .end_i    (end_q),
      .line_i   (rd_line),
      .region_i (rd_region),
      .allowed_o(rd_allowed)
  );

  xy_guard #(.Regions(Regions)) u_write_guard (
      .base_i,
      .end_i    (end_q),
      .line_i   (wr_line),
      .region_i (wr_region),
      .allowed_o(wr_allowed)
  );

  xy_axi_read #(
      .DataWidth  (DataWidth),
      .IdWidth    (IdWidth),
      .TagWidth   (TagWidth),
      .RegionWidth(RegionWidth)
  ) u_read (
      .clk_i,
      .rst_ni,
      .rd_valid_i,
      .rd_ready_o,
      .rd_addr_i,
      .rd_tag_i,
      .rd_region_i,
      .rsp_valid_o,
      .rsp_error_o,
      .rsp_addr_o,
      .rsp_tag_o,
      .rsp_data_o,
      .line_o        (rd_line),
      .region_o      (rd_region),
      .allowed_i     (rd_allowed),
      .pending_i     (pending),
      .dropped_o     (rd_violation),
      .idle_o        (rd_idle),
      .oldest_valid_o(rd_waiting),
      .oldest_o      (rd_oldest),
      .arvalid_o,
      .arready_i,
      .arid_o,
      .araddr_o,
      .arlen_o,
      .arsize_o,
      .arburst_o,
      .rvalid_i,
      .rready_o,
      .rid_i,
      .rdata_i,
      .rresp_i,
      .rlast_i
  );

  xy_axi_write #(
      .DataWidth  (DataWidth),
      .IdWidth    (IdWidth),
      .LogLines   (LogWrites),
      .RegionWidth(RegionWidth)
  ) u_write (
      .clk_i,
      .rst_ni,
      .wr_valid_i,
      .wr_ready_o,
      .wr_addr_i,
      .wr_data_i,
      .wr_strb_i,
      .wr_region_i,
      .line_o     (wr_line),
      .region_o   (wr_region),
      .allowed_i  (wr_allowed),
      .forbidden_o(wr_violation),
      .probe_i    (rd_line),
      .pending_o  (pending),
      .error_o    (wr_error),
      .oldest_o   (wr_oldest),
      .idle_o     (wr_idle),
      .held_o     (wr_held),
      .awvalid_o,
      .awready_i,
      .awid_o,
      .awaddr_o,
      .awlen_o,
      .awsize_o,
      .awburst_o,
      .wvalid_o,
      .wready_i,
      .wdata_o,
      .wstrb_o,
      .wlast_o,
      .bvalid_i,
      .bready_o,
      .bid_i,
      .bresp_i
  );

  // What is still queued was answered too early, which AXI4 forbids; it holds up what comes behind it.
  assign idle_o         = rd_idle && wr_idle && !wr_held;
  assign quiet_o        = wr_idle;
  assign waiting_addr_o = rd_waiting ? rd_oldest : wr_oldest;
  assign moved_o        = (arvalid_o && arready_i) || rvalid_i
      || (awvalid_o && awready_i) || (wvalid_o && wready_i) || bvalid_i;

  // What the control and the counters hear of comes from registers: it has no place in a unit's cycle.
  logic [DataWidth/8-1:0] wrote_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      violation_o   <= 1'b0;
      read_error_o  <= 1'b0;
      write_error_o <= 1'b0;
      read_line_o   <= 1'b0;
      wrote_q       <= '0;
    end else begin
      violation_o   <= rd_violation || wr_violation;
      read_error_o  <= rsp_valid_o && rsp_error_o;
      write_error_o <= wr_error;
      read_line_o   <= arvalid_o && arready_i;
      wrote_q       <= (wvalid_o && wready_i) ? wstrb_o : '0;
    end
  end

  always_ff @(posedge clk_i) begin
    violation_region_o <= rd_violation ? rd_region : wr_region;
    violation_addr_o   <= {rd_violation ? rd_line : wr_line, 6'd0};
    read_addr_o        <= rsp_addr_o;
    write_addr_o       <= wr_oldest;
  end

  always_comb begin
    wrote_bytes_o = '0;
    for (int unsigned i = 0; i < DataWidth / 8; i++) wrote_bytes_o = wrote_bytes_o + 7'(wrote_q[i]);
  end

endmodule
