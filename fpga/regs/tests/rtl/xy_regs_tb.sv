// The register block with the few hardware signals that its test drives and watches; the rest of
// the hardware side is 0. Every signal has the block's own timing.
module xy_regs_tb (
    input  logic        clk_i,
    input  logic        rst_ni,

    // One access at a time: held until ack_o, which is high for one cycle with its answer.
    input  logic        req_i,
    input  logic        write_i,
    input  logic [8:0]  addr_i,
    input  logic [31:0] wdata_i,
    output logic        ack_o,
    output logic        error_o,
    output logic [31:0] rdata_o,

    input  logic        busy_i,
    input  logic        done_i,
    output logic        irq_o,
    output logic        start_o
);
    xy_regs_pkg::xylem__in_t  hwif_in;
    xy_regs_pkg::xylem__out_t hwif_out;

    logic awready, wready, arready, bvalid, rvalid;
    logic aw_sent_q, w_sent_q, ar_sent_q;
    logic [1:0] bresp, rresp;

    always_comb begin
        hwif_in = '0;
        hwif_in.status.busy.next = busy_i;
        hwif_in.int_status.done.next = done_i;
    end

    always_ff @(posedge clk_i or negedge rst_ni) begin
        if (!rst_ni) begin
            aw_sent_q <= 1'b0;
            w_sent_q  <= 1'b0;
            ar_sent_q <= 1'b0;
        end else begin
            aw_sent_q <= (aw_sent_q || (req_i && write_i && awready)) && !ack_o;
            w_sent_q  <= (w_sent_q || (req_i && write_i && wready)) && !ack_o;
            ar_sent_q <= (ar_sent_q || (req_i && !write_i && arready)) && !ack_o;
        end
    end

    xy_regs u_regs (
        .clk(clk_i),
        .arst_n(rst_ni),
        .s_axil_awready(awready),
        .s_axil_awvalid(req_i && write_i && !aw_sent_q),
        .s_axil_awaddr(addr_i),
        .s_axil_awprot('0),
        .s_axil_wready(wready),
        .s_axil_wvalid(req_i && write_i && !w_sent_q),
        .s_axil_wdata(wdata_i),
        .s_axil_wstrb('1),
        .s_axil_bready(1'b1),
        .s_axil_bvalid(bvalid),
        .s_axil_bresp(bresp),
        .s_axil_arready(arready),
        .s_axil_arvalid(req_i && !write_i && !ar_sent_q),
        .s_axil_araddr(addr_i),
        .s_axil_arprot('0),
        .s_axil_rready(1'b1),
        .s_axil_rvalid(rvalid),
        .s_axil_rdata(rdata_o),
        .s_axil_rresp(rresp),
        .hwif_in,
        .hwif_out
    );

    assign ack_o   = bvalid || rvalid;
    assign error_o = bvalid ? bresp != '0 : rresp != '0;
    assign irq_o   = hwif_out.int_status.intr;
    assign start_o = hwif_out.ctrl.start.value;
endmodule
