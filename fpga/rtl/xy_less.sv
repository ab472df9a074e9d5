// Whether a is less than b, unsigned.
//
// The carry chains of the ECP5 give their result to the fabric after an even number of bits only; an
// odd width would cost a look-up table and its wires in every path that hangs on a comparison. So an
// odd width is made even by one bit below, the same on both sides, which decides nothing; it is not a
// constant, because synthesis would take that away again.
//
// Latency     none. Throughput  one comparison a cycle. Cut paths  none.
module xy_less #(
    parameter int unsigned Width = 39
) (
    input  logic [Width-1:0] a_i,
    input  logic [Width-1:0] b_i,
    output logic             less_o
);

  if (Width % 2 == 0) begin : gen_even
    assign less_o = a_i < b_i;
  end else begin : gen_odd
    assign less_o = {a_i, b_i[0]} < {b_i, b_i[0]};
  end

endmodule
