// What xy_stack promises, for proofs about its users: the entries side by side, the top first, and of
// each only the bits that a proof is about, the uppermost 7. The others are any.
module xy_stack #(
    parameter int unsigned Width = 32,
    parameter int unsigned Depth = 95
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

  logic [Depth-1:0][6:0] entries_q;
  logic [6:0]            count_q;

  (* anyseq *) logic [Width-8:0] rest;
  assign top_o   = {entries_q[0], rest};
  assign empty_o = count_q == '0;
  assign full_o  = count_q == 7'(Depth);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) count_q <= '0;
    else if (clear_i) count_q <= '0;
    else if (push_i) count_q <= count_q + 1'b1;
    else if (pop_i) count_q <= count_q - 1'b1;
  end

  always_ff @(posedge clk_i) begin
    if (push_i) entries_q <= {entries_q[Depth-2:0], data_i[Width-1-:7]};
    else if (pop_i) entries_q <= {7'd0, entries_q[Depth-1:1]};
  end

endmodule
