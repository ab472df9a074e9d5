// VexRiscv (FullCfu of the PyPI package `pythondata-cpu-vexriscv`: RV32IM, caches of 4 KiB) with xy_cfu at its
// custom function port. Outside are the core's two Wishbone buses, word addresses, read and write data.
module xy_vexriscv (
    input  logic        clk_i,
    input  logic        rst_ni,
    input  logic [31:0] boot_i,  // where it starts

    output logic        fetch_o,
    output logic [29:0] fetch_addr_o,
    input  logic        fetch_ack_i,
    input  logic [31:0] fetch_data_i,

    output logic        access_o,
    output logic [29:0] access_addr_o,
    output logic        access_write_o,
    output logic [3:0]  access_strb_o,
    output logic [31:0] access_data_o,
    input  logic        access_ack_i,
    input  logic        access_error_i,
    input  logic [31:0] access_data_i
);

  logic        cmd_valid, cmd_ready, rsp_valid, rsp_ready;
  logic [9:0]  function_id;
  logic [31:0] a, b, output_word;
  logic        fetch_cyc, fetch_stb, access_cyc, access_stb;
  assign fetch_o  = fetch_cyc && fetch_stb;
  assign access_o = access_cyc && access_stb;

  VexRiscv u_core (
      .clk                                  (clk_i),
      .reset                                (!rst_ni),
      .externalResetVector                  (boot_i),
      .timerInterrupt                       (1'b0),
      .softwareInterrupt                    (1'b0),
      .externalInterruptArray               ('0),
      .CfuPlugin_bus_cmd_valid              (cmd_valid),
      .CfuPlugin_bus_cmd_ready              (cmd_ready),
      .CfuPlugin_bus_cmd_payload_function_id(function_id),
      .CfuPlugin_bus_cmd_payload_inputs_0   (a),
      .CfuPlugin_bus_cmd_payload_inputs_1   (b),
      .CfuPlugin_bus_rsp_valid              (rsp_valid),
      .CfuPlugin_bus_rsp_ready              (rsp_ready),
      .CfuPlugin_bus_rsp_payload_outputs_0  (output_word),
      .iBusWishbone_CYC                     (fetch_cyc),
      .iBusWishbone_STB                     (fetch_stb),
      .iBusWishbone_ACK                     (fetch_ack_i),
      .iBusWishbone_WE                      (),
      .iBusWishbone_ADR                     (fetch_addr_o),
      .iBusWishbone_DAT_MISO                (fetch_data_i),
      .iBusWishbone_DAT_MOSI                (),
      .iBusWishbone_SEL                     (),
      .iBusWishbone_ERR                     (1'b0),
      .iBusWishbone_CTI                     (),
      .iBusWishbone_BTE                     (),
      .dBusWishbone_CYC                     (access_cyc),
      .dBusWishbone_STB                     (access_stb),
      .dBusWishbone_ACK                     (access_ack_i),
      .dBusWishbone_WE                      (access_write_o),
      .dBusWishbone_ADR                     (access_addr_o),
      .dBusWishbone_DAT_MISO                (access_data_i),
      .dBusWishbone_DAT_MOSI                (access_data_o),
      .dBusWishbone_SEL                     (access_strb_o),
      .dBusWishbone_ERR                     (access_error_i),
      .dBusWishbone_CTI                     (),
      .dBusWishbone_BTE                     ()
  );

  xy_cfu u_cfu (
      .clk_i,
      .rst_ni,
      .cmd_valid_i   (cmd_valid),
      .cmd_ready_o   (cmd_ready),
      .cmd_function_i(function_id),
      .cmd_a_i       (a),
      .cmd_b_i       (b),
      .rsp_valid_o   (rsp_valid),
      .rsp_ready_i   (rsp_ready),
      .rsp_output_o  (output_word)
  );

endmodule
