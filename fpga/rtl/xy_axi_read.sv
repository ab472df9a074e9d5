// Read half of the AXI4 master: one line of 64 bytes a request, one INCR burst a line.
//
//   rd_* ──► queue ──┬──► AR                R ──► line assembled ──► rsp_*
//                    │                                 ▲
//                    └──► table of lines under way ────┘  tag and address
//
// With a bus as wide as a line (DataWidth = 512) every line has an ID of its own and may come back in
// any order; on a narrower one all lines have ID 0, which AXI keeps in order, so that beats of two
// lines never mix.
//
// Handshake   rd_valid_i and rd_ready_o both high: the request is taken, and made whatever becomes of the
//             unit that asked. Once on AR it stays until the slave takes it: AXI's rule for VALID.
//             line_o of region_o is the next one to go to AR. allowed_i: it may be read at all, else it
//             is dropped, with dropped_o for a cycle. pending_i: it must not be read yet.
//             rsp_valid_o is high for one cycle a line and cannot be refused: ask for what there is
//             room for.
// Latency     1 cycle from rd_valid_i to arvalid_o; 0 from the last beat to rsp_valid_o.
// Throughput  one request a cycle while the slave takes them; one beat a cycle.
// Errors      rsp_error_o with the line, once its last beat has come, if any beat was not OKAY.
// Cut paths   none from R to rsp_*; rd_ready_o is a matter of registers.
module xy_axi_read #(
    parameter int unsigned DataWidth   = 512,  // 32, 64, 128, 256 or 512
    parameter int unsigned IdWidth     = 4,    // 2^IdWidth lines may be under way
    parameter int unsigned TagWidth    = 16,
    parameter int unsigned RegionWidth = 3
) (
    input  logic                          clk_i,
    input  logic                          rst_ni,

    input  logic                          rd_valid_i,
    output logic                          rd_ready_o,
    input  logic [31:0]                   rd_addr_i,
    input  logic [TagWidth-1:0]           rd_tag_i,
    input  logic [RegionWidth-1:0]        rd_region_i,

    output logic                          rsp_valid_o,
    output logic                          rsp_error_o,
    output logic [31:0]                   rsp_addr_o,
    output logic [TagWidth-1:0]           rsp_tag_o,
    output logic [xy_pkg::LineBits-1:0]   rsp_data_o,

    output logic [25:0]                   line_o,
    output logic [RegionWidth-1:0]        region_o,
    input  logic                          allowed_i,
    input  logic                          pending_i,
    output logic                          dropped_o,

    output logic                          idle_o,       // nothing queued, nothing under way
    output logic                          oldest_valid_o,
    output logic [31:0]                   oldest_o,     // address of a line under way or queued

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
    input  logic                          rlast_i
);

  localparam int unsigned Lines    = 2 ** IdWidth;
  localparam int unsigned Beats    = xy_pkg::LineBits / DataWidth;
  localparam bit          Ordered  = Beats > 1;
  localparam int unsigned RowWidth = 26 + TagWidth;

  // --- Requests ---

  logic                head_valid, sent, row_free, go, leaves;
  logic [RowWidth-1:0] head;
  xy_fifo #(
      .Width     (RegionWidth + RowWidth),
      .Depth     (2),
      .Registered(1)
  ) u_queue (
      .clk_i,
      .rst_ni,
      .clear_i    (1'b0),
      .in_valid_i (rd_valid_i),
      .in_ready_o (rd_ready_o),
      .in_data_i  ({rd_region_i, rd_tag_i, rd_addr_i[31:6]}),
      .out_valid_o(head_valid),
      .out_ready_i(leaves),
      .out_data_o ({region_o, head})
  );
  assign line_o = head[25:0];

  // Rows of the table are given out in turn. Where lines overtake each other a row may still be busy
  // when its turn comes; then the next request waits for it.
  logic [Lines-1:0]   busy_q;
  logic [IdWidth-1:0] next_q;
  logic               offered_q;  // on AR and not yet taken: a later write of the line does not matter

  assign row_free  = !busy_q[next_q];
  assign arvalid_o = head_valid && row_free && (offered_q || (allowed_i && !pending_i));
  assign sent      = arvalid_o && arready_i;
  assign dropped_o = head_valid && !offered_q && !allowed_i;
  // Sent or dropped, in one step from the last of these to come.
  assign go        = row_free && arready_i;
  assign leaves    = allowed_i ? go && (offered_q || !pending_i) : go || !offered_q;

  // --- Responses ---

  logic               last, expected;
  logic [IdWidth-1:0] row;
  assign rready_o = 1'b1;
  // A line that is not under way did not come, whatever the slave says.
  assign last     = rvalid_i && expected && rlast_i;

  if (Ordered) begin : gen_ordered
    // The oldest line, and what has come of it.
    localparam int unsigned Held = xy_pkg::LineBits - DataWidth;
    logic [IdWidth-1:0] row_q, after;
    logic               some_q;  // a line is under way
    logic               beat;
    logic [Held-1:0]    held_q;
    logic               error_q;
    assign after = row_q + 1'b1;
    assign beat  = rvalid_i && some_q;

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) begin
        row_q   <= '0;
        some_q  <= 1'b0;
        error_q <= 1'b0;
      end else begin
        some_q <= sent || (some_q && !(last && (next_q == after)));
        if (beat) begin
          if (rlast_i) row_q <= after;
          error_q <= !rlast_i && (error_q || rresp_i[1]);
        end
      end
    end
    // Beats come lowest first, so each enters at the top.
    if (Beats > 2) begin : gen_shift
      always_ff @(posedge clk_i) if (beat) held_q <= {rdata_i, held_q[Held-1:DataWidth]};
    end else begin : gen_hold
      always_ff @(posedge clk_i) if (beat) held_q <= rdata_i;
    end

    assign row         = row_q;
    assign expected    = some_q;
    assign rsp_data_o  = {rdata_i, held_q};
    assign rsp_error_o = rresp_i[1] || error_q;

    logic unused_id;
    assign unused_id = ^rid_i;
  end else begin : gen_any_order
    assign row         = rid_i;
    assign expected    = busy_q[rid_i];
    assign rsp_data_o  = rdata_i;
    assign rsp_error_o = rresp_i[1];
  end

  logic unused_resp;
  assign unused_resp = rresp_i[0];

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      busy_q    <= '0;
      next_q    <= '0;
      offered_q <= 1'b0;
    end else begin
      offered_q <= arvalid_o && !arready_i;
      if (sent) begin
        busy_q[next_q] <= 1'b1;
        next_q         <= next_q + 1'b1;
      end
      // A row that a line leaves is not the one that a request takes in this cycle: that was free.
      if (last) busy_q[row] <= 1'b0;
    end
  end

  // --- The table ---

  (* ram_style = "distributed" *)
  logic [RowWidth-1:0] table_q[Lines];
  logic [RowWidth-1:0] entry;
  always_ff @(posedge clk_i) if (sent) table_q[next_q] <= head;
  assign entry       = table_q[row];
  assign rsp_valid_o = last;
  assign rsp_tag_o   = entry[26+:TagWidth];
  assign rsp_addr_o  = {entry[25:0], 6'd0};

  logic [25:0] sent_line_q;
  always_ff @(posedge clk_i) if (sent) sent_line_q <= head[25:0];

  logic waits;
  assign waits          = busy_q != '0;
  assign idle_o         = !waits && !head_valid;
  assign oldest_valid_o = !idle_o;
  // In order, the row that waits; else the last request, which is as good a hint.
  assign oldest_o       = {!waits ? head[25:0] : Ordered ? entry[25:0] : sent_line_q, 6'd0};

  assign arid_o    = Ordered ? '0 : next_q;
  assign araddr_o  = {head[25:0], 6'd0};
  assign arlen_o   = 8'(Beats - 1);
  assign arsize_o  = 3'($clog2(DataWidth / 8));
  assign arburst_o = 2'b01;

  logic unused_addr;
  assign unused_addr = ^rd_addr_i[5:0];

`ifndef SYNTHESIS
  // VALID stays until READY, with what it announced (AXI4 A3.2.1).
  a_ar_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      arvalid_o && !arready_i |=> arvalid_o && $stable({arid_o, araddr_o}));

  // A line is as long as it was asked to be; a slave that ends it elsewhere is not AXI.
  if (Ordered) begin : gen_check
    logic [7:0] beats_q;
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) beats_q <= '0;
      else if (rvalid_i && expected) beats_q <= rlast_i ? '0 : beats_q + 1'b1;
    end
    a_expected :
    assert property (@(posedge clk_i) disable iff (!rst_ni) expected == busy_q[row]);
    a_beats :
    assert property (@(posedge clk_i) disable iff (!rst_ni)
        rvalid_i && expected |-> rlast_i == (beats_q == 8'(Beats - 1)));
  end else begin : gen_check
    a_row_was_asked_for :
    assert property (@(posedge clk_i) disable iff (!rst_ni) rvalid_i |-> busy_q[rid_i]);
  end

  // Lines are asked for whole.
  a_aligned :
  assert property (@(posedge clk_i) disable iff (!rst_ni) rd_valid_i |-> rd_addr_i[5:0] == '0);
`endif

endmodule
