// Stack whose top is a register and whose rest is a block memory.
//
//        data_i ──► top ──► held ─┐
//                    ▲  └─► mem ──┴─► the entry under the top
//                    └───────────────────────┘
//
// The memory is read at the address of the entry that will be under the top; an entry that was pushed
// down at that very edge is taken from `held`, because the memory does not return it yet.
//
// Handshake   push_i or pop_i high, never both: done at the next edge. push_i with full_o or pop_i
//             with empty_o high must not be. clear_i forgets everything.
// Latency     1 cycle from push to top_o; after a pop top_o is the one below in the next cycle.
// Throughput  one operation a cycle, in any order.
// Cut paths   all outputs are registers. Not cut: pop_i and push_i to the memory's read address.
module xy_stack #(
    parameter int unsigned Width = 32,
    parameter int unsigned Depth = 95  // 3 or more
) (
    input  logic             clk_i,
    input  logic             rst_ni,
    input  logic             clear_i,

    input  logic             push_i,
    input  logic             pop_i,
    input  logic [Width-1:0] data_i,

    output logic [Width-1:0] top_o,
    output logic             empty_o,
    output logic             full_o
);

  localparam int unsigned CountWidth = $clog2(Depth + 1);

  logic [CountWidth-1:0] count_d, count_q;
  logic [Width-1:0]      top_d, top_q, held_q, below, read_data;
  logic                  held_valid_q;

  assign below = held_valid_q ? held_q : read_data;

  // Adders first: push_i and pop_i come late.
  logic [CountWidth-1:0] read_addr;
  always_comb begin
    read_addr = count_q - 1'b1;
    if (pop_i) read_addr = count_q - CountWidth'(2);
    if (push_i) read_addr = count_q;
  end

  always_comb begin
    count_d = count_q;
    top_d   = top_q;
    if (push_i) begin
      count_d = count_q + 1'b1;
      top_d   = data_i;
    end else if (pop_i) begin
      count_d = count_q - 1'b1;
      top_d   = below;
    end
    if (clear_i) count_d = '0;
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      count_q      <= '0;
      held_valid_q <= 1'b0;
    end else begin
      count_q      <= count_d;
      held_valid_q <= push_i;
    end
  end

  always_ff @(posedge clk_i) begin
    top_q <= top_d;
    if (push_i) held_q <= top_q;
  end

  // Entry i of those under the top is word i+1: the word under an empty stack is never looked at.
  xy_ram #(
      .Width    (Width),
      .AddrWidth(CountWidth)
  ) u_mem (
      .clk_i,
      .write_i     (push_i),
      .write_addr_i(count_q),
      .write_data_i(top_q),
      .read_addr_i (read_addr),
      .read_data_o (read_data)
  );

  assign top_o   = top_q;
  assign empty_o = count_q == '0;
  assign full_o  = count_q == CountWidth'(Depth);

`ifndef SYNTHESIS
  initial begin
    if (Depth < 3) $fatal(1, "xy_stack: Depth is %0d, must be 3 or more", Depth);
  end

  // An entry pushed on a full stack, or popped from an empty one, would be another's.
  a_no_overflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni) push_i |-> !full_o);
  a_no_underflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni) pop_i |-> !empty_o);

  // One port, one operation.
  a_one_operation :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !(push_i && pop_i));
`endif

endmodule
