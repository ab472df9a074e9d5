// Stack of treelets: an entry takes the place of the treelets of its children, which are the last two, the
// last one, or none. As xy_stack, but its operations keep the top or the entry under it within reach.
//
// Handshake   put_i: data_i becomes the top. take_i both low: on top of what there is; one high: in the
//             top's place; both high: in the place of the top and the entry under it.
// Latency     1 cycle to top_o and under_o.
// Throughput  one operation a cycle.
// Cut paths   all outputs but under_o, which is chosen from two registers; not cut: put_i and take_i to the
//             memory's read address.
module xy_treelet_stack #(
    parameter int unsigned Width = 32,
    parameter int unsigned Depth = 95
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic             clear_i,

    input  logic             put_i,
    input  logic [1:0]       take_i,
    input  logic [Width-1:0] data_i,

    output logic [Width-1:0] top_o,
    output logic [Width-1:0] under_o
);

  localparam int unsigned CountWidth = $clog2(Depth + 1);

  logic [CountWidth-1:0] count_d, count_q;
  logic [Width-1:0]      top_q, held_q, read_data;
  logic                  push, pop, held_valid_q;

  assign push    = put_i && (take_i == 2'b00);
  assign pop     = put_i && (take_i == 2'b11);
  assign under_o = held_valid_q ? held_q : read_data;

  always_comb begin
    count_d = count_q;
    if (push) count_d = count_q + 1'b1;
    if (pop) count_d = count_q - 1'b1;
    if (clear_i) count_d = '0;
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      count_q      <= '0;
      held_valid_q <= 1'b0;
    end else begin
      count_q      <= count_d;
      held_valid_q <= push;
    end
  end

  always_ff @(posedge clk_i) begin
    if (put_i) top_q <= data_i;
    if (push) held_q <= top_q;
  end

  // Entry i of those under the top is word i+1: the word under an empty stack is never looked at.
  xy_ram #(
      .Width    (Width),
      .AddrWidth(CountWidth)
  ) u_mem (
      .clk_i,
      .write_i     (push),
      .write_addr_i(count_q),
      .write_data_i(top_q),
      .read_addr_i (count_d - 1'b1),
      .read_data_o (read_data)
  );

  assign top_o = top_q;

`ifndef SYNTHESIS
  // As many treelets are taken as there are.
  a_no_underflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      put_i |-> count_q >= CountWidth'(take_i[0]) + CountWidth'(take_i[1]));
  a_no_overflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni) push |-> count_q != CountWidth'(Depth));
`endif

endmodule
