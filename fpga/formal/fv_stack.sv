// xy_stack gives back what was pushed, the last one first, and counts right.
//
// Its user keeps to its side: nothing is pushed on a full stack or popped from an empty one. That the
// emitter does so is what fv_emitter proves.
module fv_stack (
    input logic       clk_i,
    input logic       clear_i,
    input logic       push_i,
    input logic       pop_i,
    input logic [1:0] data_i
);

  localparam int unsigned Depth = 5;

  logic       rst_ni = 1'b0;
  logic       empty, full, push, pop;
  logic [1:0] top;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  assign push = push_i && !full;
  assign pop  = pop_i && !push && !empty;

  xy_stack #(
      .Width(2),
      .Depth(Depth)
  ) u_stack (
      .clk_i,
      .rst_ni,
      .clear_i,
      .push_i (push),
      .pop_i  (pop),
      .data_i,
      .top_o  (top),
      .empty_o(empty),
      .full_o (full)
  );

  logic [Depth-1:0][1:0] entries;  // the top first
  logic [2:0]            count = '0;
  logic                  was_full = 1'b0;

  always_ff @(posedge clk_i) begin
    if (push) entries <= {entries[Depth-2:0], data_i};
    else if (pop) entries <= {2'd0, entries[Depth-1:1]};
    if (!rst_ni || clear_i) count <= '0;
    else count <= count + 3'(push) - 3'(pop);
    was_full <= rst_ni && !clear_i && (was_full || full);
  end

  always_comb begin
    if (rst_ni) begin
      a_empty : assert (empty == (count == '0));
      a_full : assert (full == (count == 3'(Depth)));
      if (count != '0) a_last_is_on_top : assert (top == entries[0]);
      c_drained : cover (was_full && empty);
    end
  end

endmodule
