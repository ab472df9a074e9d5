// Bank of insertion sorters: pieces go to them in turn, and leave in the same order.
//
// Handshake   in, out: valid/ready, as of xy_sorter; the sorter whose turn it is answers. Pieces of Piece
//             records are cut from the input; in_last_i ends the last one.
// Latency     that of xy_sorter.
// Throughput  two records a cycle in and out; one comparison a cycle in each sorter.
// Cut paths   as in xy_sorter.
module xy_sorters #(
    parameter int unsigned Sorters   = 2,  // a power of two, 2 or more
    parameter int unsigned Piece     = 8,
    parameter int unsigned CodeWidth = 63
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  clear_i,
    input  logic                  wide_i,

    input  logic                  in_valid_i,
    output logic                  in_ready_o,
    input  logic                  in_two_i,
    input  logic                  in_last_i,
    input  logic [1:0][xy_pkg::RecordWidth-1:0] in_pair_i,  // of record_t

    output logic                  out_valid_o,
    input  logic                  out_ready_i,
    output logic                  out_two_o,
    output logic [1:0][xy_pkg::RecordWidth-1:0] out_pair_o
);

  localparam int unsigned TurnWidth = $clog2(Sorters);
  localparam int unsigned RowWidth  = $clog2(Piece) - 1;

  logic [TurnWidth-1:0] in_turn_q, out_turn_q;
  logic [RowWidth-1:0]  in_row_q;  // pairs of the piece that have come

  logic [Sorters-1:0]                            in_ready, out_valid, out_two, out_last;
  logic [Sorters-1:0][2*xy_pkg::RecordWidth-1:0] out_pair;

  assign in_ready_o  = in_ready[in_turn_q];
  assign out_valid_o = out_valid[out_turn_q];
  assign out_two_o   = out_two[out_turn_q];
  assign out_pair_o  = out_pair[out_turn_q];

  logic [1:0][CodeWidth-1:0] in_code;
  for (genvar i = 0; i < 2; i++) begin : gen_code
    xy_pkg::record_t record;
    assign record = in_pair_i[i];
    xy_morton #(.CodeWidth(CodeWidth)) u_morton (
        .box_i (record.box),
        .wide_i,
        .code_o(in_code[i])
    );
    logic unused_prim;
    assign unused_prim = ^record.prim;
  end

  for (genvar i = 0; i < Sorters; i++) begin : gen_sorter
    localparam logic [TurnWidth-1:0] Turn = TurnWidth'(i);

    xy_sorter #(
        .Piece    (Piece),
        .CodeWidth(CodeWidth)
    ) u_sorter (
        .clk_i,
        .rst_ni,
        .clear_i,
        .in_valid_i (in_valid_i && (in_turn_q == Turn)),
        .in_ready_o (in_ready[i]),
        .in_two_i,
        .in_last_i,
        .in_pair_i,
        .in_code_i  (in_code),
        .out_valid_o(out_valid[i]),
        .out_ready_i(out_ready_i && (out_turn_q == Turn)),
        .out_two_o  (out_two[i]),
        .out_last_o (out_last[i]),
        .out_pair_o (out_pair[i])
    );
  end

  logic accept, deliver;
  assign accept  = in_valid_i && in_ready_o;
  assign deliver = out_valid_o && out_ready_i;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      in_turn_q  <= '0;
      out_turn_q <= '0;
      in_row_q   <= '0;
    end else if (clear_i) begin
      in_turn_q  <= '0;
      out_turn_q <= '0;
      in_row_q   <= '0;
    end else begin
      if (accept) begin
        in_row_q <= in_row_q + 1'b1;
        if (in_last_i || (in_row_q == '1)) begin
          in_row_q  <= '0;
          in_turn_q <= in_turn_q + 1'b1;
        end
      end
      if (deliver && out_last[out_turn_q]) out_turn_q <= out_turn_q + 1'b1;
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (Sorters < 2 || (Sorters & (Sorters - 1)) != 0) begin
      $fatal(1, "xy_sorters: Sorters is %0d, must be a power of two, 2 or more", Sorters);
    end
  end
`endif

endmodule
