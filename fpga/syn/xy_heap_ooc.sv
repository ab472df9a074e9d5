// Out-of-context harness for xy_heap: surrounds the unit with registers so that nextpnr times every
// path into and out of it, and needs six pins however wide the entries are. Inputs come from a shift
// register; outputs are loaded into another and shifted out. Not part of the design.
module xy_heap_ooc #(
    parameter int unsigned Levels     = 8,
    parameter int unsigned KeyWidth   = 30,
    parameter int unsigned SlotWidth  = 8,
    parameter int unsigned BlockLevel = 7
) (
    input  logic clk_i,
    input  logic rst_ni,
    input  logic shift_i,
    input  logic data_i,
    input  logic load_i,
    output logic data_o
);

  localparam int unsigned InWidth  = 1 + 2 + KeyWidth + SlotWidth;
  localparam int unsigned OutWidth = 4 + KeyWidth + SlotWidth;

  logic [InWidth-1:0]  in_q;
  logic [OutWidth-1:0] out, out_q;

  always_ff @(posedge clk_i) begin
    if (shift_i) in_q <= {in_q[InWidth-2:0], data_i};
    if (load_i) out_q <= out;
    else out_q <= {out_q[OutWidth-2:0], 1'b0};
  end
  assign data_o = out_q[OutWidth-1];

  xy_heap #(
      .Levels    (Levels),
      .KeyWidth  (KeyWidth),
      .SlotWidth (SlotWidth),
      .BlockLevel(BlockLevel)
  ) u_heap (
      .clk_i,
      .rst_ni,
      .op_valid_i (in_q[InWidth-1]),
      .op_ready_o (out[OutWidth-1]),
      .op_i       (xy_pkg::heap_op_e'(in_q[InWidth-2-:2])),
      .op_key_i   (in_q[SlotWidth+:KeyWidth]),
      .op_slot_i  (in_q[SlotWidth-1:0]),
      .op_error_o (out[OutWidth-2]),
      .top_valid_o(out[OutWidth-3]),
      .full_o     (out[OutWidth-4]),
      .top_key_o  (out[SlotWidth+:KeyWidth]),
      .top_slot_o (out[SlotWidth-1:0])
  );

endmodule
