// xy_fifo never drops, invents, repeats or reorders a word, and never blocks for longer than it must.
//
// One word, picked at any moment, is followed: it must come out unchanged after exactly the words that
// were inside before it. As the pick is free, this holds for every word.
module fv_fifo (
    input logic       clk_i,
    input logic       clear_i,
    input logic       in_valid_i,
    input logic [1:0] in_data_i,
    input logic       out_ready_i,
    input logic       pick_i
);

  localparam int unsigned Depth = 4;

  logic       rst_ni = 1'b0;
  logic       in_ready, out_valid;
  logic [1:0] out_data;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_fifo #(
      .Width(2),
      .Depth(Depth)
  ) u_fifo (
      .clk_i,
      .rst_ni,
      .clear_i,
      .in_valid_i,
      .in_ready_o (in_ready),
      .in_data_i,
      .out_valid_o(out_valid),
      .out_ready_i,
      .out_data_o (out_data)
  );

  // The same with its first word in a register.
  logic       first_ready, first_valid;
  logic [1:0] first_data;
  xy_fifo #(
      .Width     (2),
      .Depth     (Depth),
      .Registered(1)
  ) u_registered (
      .clk_i,
      .rst_ni,
      .clear_i,
      .in_valid_i,
      .in_ready_o (first_ready),
      .in_data_i,
      .out_valid_o(first_valid),
      .out_ready_i,
      .out_data_o (first_data)
  );

  logic       push, pop;
  logic [2:0] count = '0;   // words inside
  logic       picked = 1'b0;
  logic [2:0] ahead;        // words inside that came before the picked one
  logic [1:0] word;

  logic [2:0] pops = '0;    // counts words out

  assign push = in_valid_i && in_ready && rst_ni;
  assign pop  = out_valid && out_ready_i && rst_ni;

  always_ff @(posedge clk_i) begin
    if (!rst_ni || clear_i) begin
      count  <= '0;
      picked <= 1'b0;
    end else begin
      count <= count + 3'(push) - 3'(pop);
      pops  <= pops + 3'(pop);
      if (picked && pop) begin
        ahead <= ahead - 1'b1;
        if (ahead == '0) picked <= 1'b0;
      end
      if (push && pick_i && !picked) begin
        picked <= 1'b1;
        ahead  <= count - 3'(pop);
        word   <= in_data_i;
      end
    end
  end

  always_comb begin
    if (rst_ni) begin
      a_takes_while_there_is_room : assert (in_ready == (count < 3'(Depth)));
      a_offers_what_there_is : assert (out_valid == (count != '0));
      if (picked && ahead == '0) a_word_comes_out : assert (out_valid && out_data == word);
      a_registered_is_the_same :
      assert (first_ready == in_ready && first_valid == out_valid && (!out_valid || first_data == out_data));
      if (picked) a_word_is_inside : assert (ahead < count);
      c_full : cover (count == 3'(Depth) && picked && ahead == 3'(Depth - 1));
      c_wraps : cover (pops == 3'(Depth + 1) && count == 3'(Depth));
      c_both : cover (push && pop);
    end
  end

endmodule
