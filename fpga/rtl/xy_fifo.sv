// First in, first out, in distributed memory, the first word in a register if so asked for.
//
// Handshake   valid/ready on both sides. in_ready_o and out_valid_o depend on registers only.
//             clear_i empties it.
// Latency     1 cycle from in to out.
// Throughput  one word a cycle.
// Cut paths   in to out; out_ready_i to in_ready_o. out_data_o is read from memory in its cycle, or comes from
//             a register: the earlier it is needed, the less late may in_data_i and out_ready_i come.
module xy_fifo #(
    parameter int unsigned Width      = 32,
    parameter int unsigned Depth      = 4,    // a power of two, 2 or more
    parameter int unsigned Registered = 0     // whether out_valid_o and out_data_o are
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
  logic [AddrWidth:0] write_q, read_q, second;
  logic               push, pop;

  assign in_ready_o = (write_q - read_q) != (AddrWidth + 1)'(Depth);
  assign push       = in_valid_i && in_ready_o;
  assign pop        = out_valid_o && out_ready_i;
  assign second     = read_q + 1'b1;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      write_q <= '0;
      read_q  <= '0;
    end else if (clear_i) begin
      write_q <= '0;
      read_q  <= '0;
    end else begin
      if (push) write_q <= write_q + 1'b1;
      if (pop) read_q <= second;
    end
  end

  // A free place may be written at any time: what is there counts once write_q has passed it. So in_valid_i, which
  // comes late, need not reach the memory.
  logic [AddrWidth-1:0] read_addr;
  logic [Width-1:0]     read_data;
  xy_ram #(
      .Width    (Width),
      .AddrWidth(AddrWidth),
      .Block    (1'b0)
  ) u_ram (
      .clk_i,
      .write_i     (in_ready_o),
      .write_addr_i(write_q[AddrWidth-1:0]),
      .write_data_i(in_data_i),
      .read_addr_i (read_addr),
      .read_data_o (read_data)
  );

  if (Registered != 0) begin : gen_registered
    // The word behind the first one is in memory, unless it comes now.
    logic             valid_q, more;
    logic [Width-1:0] first_q;
    assign more        = valid_q && (write_q != second);
    assign read_addr   = second[AddrWidth-1:0];
    assign out_valid_o = valid_q;
    assign out_data_o  = first_q;
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) valid_q <= 1'b0;
      else valid_q <= !clear_i && (push || (pop ? more : valid_q));
    end
    always_ff @(posedge clk_i) begin
      if (pop || !valid_q) first_q <= more ? read_data : in_data_i;
    end
  end else begin : gen_read
    assign read_addr   = read_q[AddrWidth-1:0];
    assign out_valid_o = write_q != read_q;
    assign out_data_o  = read_data;
  end

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
