// First in, first out, in distributed memory.
//
// Handshake   valid/ready on both sides. in_ready_o and out_valid_o depend on registers only.
//             clear_i empties it.
// Latency     1 cycle from in to out.
// Throughput  one word a cycle.
// Cut paths   in to out; out_ready_i to in_ready_o. out_data_o is read from memory in its cycle.
module xy_fifo #(
    parameter int unsigned Width = 32,
    parameter int unsigned Depth = 4    // a power of two, 2 or more
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic             clear_i,

    input  logic             in_valid_i,
    output logic             in_ready_o,
    input  logic [Width-1:0] in_data_i,

    output logic             out_valid_o,
    input  logic             out_ready_i,
    output logic [Width-1:0] out_data_o
);

  localparam int unsigned AddrWidth = $clog2(Depth);

  // One bit more than an address tells full from empty.
  logic [AddrWidth:0] write_q, read_q;
  logic               push, pop;

  assign in_ready_o  = (write_q - read_q) != (AddrWidth + 1)'(Depth);
  assign out_valid_o = write_q != read_q;
  assign push        = in_valid_i && in_ready_o;
  assign pop         = out_valid_o && out_ready_i;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      write_q <= '0;
      read_q  <= '0;
    end else if (clear_i) begin
      write_q <= '0;
      read_q  <= '0;
    end else begin
      if (push) write_q <= write_q + 1'b1;
      if (pop) read_q <= read_q + 1'b1;
    end
  end

  xy_ram #(
      .Width    (Width),
      .AddrWidth(AddrWidth),
      .Block    (1'b0)
  ) u_ram (
      .clk_i,
      .write_i     (push),
      .write_addr_i(write_q[AddrWidth-1:0]),
      .write_data_i(in_data_i),
      .read_addr_i (read_q[AddrWidth-1:0]),
      .read_data_o (out_data_o)
  );

`ifndef SYNTHESIS
  initial begin
    if (Depth < 2 || (Depth & (Depth - 1)) != 0) begin
      $fatal(1, "xy_fifo: Depth is %0d, must be a power of two, 2 or more", Depth);
    end
  end

  // More words than places would mean that one was overwritten.
  a_no_overflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      (write_q - read_q) <= (AddrWidth + 1)'(Depth));

  // A word offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      out_valid_o && !out_ready_i |=> out_valid_o && $stable(out_data_o));
`endif

endmodule
