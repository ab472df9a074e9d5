// Writer of quantized pairs: 16 bytes each, in order, to a region, a line at a time.
//
//   in ──► open line │ line being sent ──► wr
//
// A line leaves when it is full and the other place is free; or, while flush_i is high, with the pairs that
// it has. The pairs that follow then go to the rest of the same line, in a write of their own.
//
// Handshake   start_i takes the region (its base a multiple of a line); nothing may be held, and pairs come
//             from the next cycle on. in, wr: valid/ready.
//             flush_i is a level. open_o: the open line has pairs, and its address is open_addr_o.
//             sending_o: a line waits at wr, or is on its way there.
//             error_o: a pair would have left the region; stays, and nothing more is taken in.
//             clear_i: the state after reset, in the next cycle.
// Latency     1 cycle from the pair that fills a line to the line.
// Throughput  one pair a cycle, and a line a cycle.
// Cut paths   all but wr_data_o, which is read from distributed memory in its cycle.
module xy_pair_writer (
    input  logic         clk_i,
    input  logic         rst_ni,
    input  logic         clear_i,

    input  logic         start_i,
    input  logic [31:0]  region_base_i,
    input  logic [31:0]  region_size_i,

    input  logic         in_valid_i,
    output logic         in_ready_o,
    input  logic [127:0] in_pair_i,

    input  logic         flush_i,
    output logic         open_o,
    output logic [31:0]  open_addr_o,
    output logic         sending_o,
    output logic         error_o,

    output logic         wr_valid_o,
    input  logic         wr_ready_i,
    output logic [31:0]  wr_addr_o,
    output logic [511:0] wr_data_o,
    output logic [63:0]  wr_strb_o
);

  localparam int unsigned PairBytes = 16;
  localparam int unsigned Places    = xy_pkg::LineBytes / PairBytes;

  // --- The open line: pairs from place first_q up to place next_q ---

  logic        half_q;  // where it is; the other one is being sent
  logic [1:0]  first_q;
  logic [2:0]  next_d, next_q;
  logic [31:0] addr_q, left_q;
  logic        error_q;

  logic full, fits, store;
  assign full       = next_q == 3'(Places);
  assign fits       = left_q >= 32'(PairBytes);
  assign in_ready_o = !full && !error_q;
  assign store      = in_valid_i && in_ready_o && fits;
  assign next_d     = next_q + 3'(store);

  // --- The line being sent ---

  logic              sending_q;
  logic [31:0]       send_addr_q;
  logic [Places-1:0] send_places_q;

  logic full_d, has_d, hand_over;
  assign full_d    = next_d == 3'(Places);
  assign has_d     = next_d != {1'b0, first_q};
  assign hand_over = (!sending_q || wr_ready_i) && has_d && (full_d || flush_i);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      half_q        <= 1'b0;
      first_q       <= '0;
      next_q        <= '0;
      addr_q        <= '0;
      left_q        <= '0;
      error_q       <= 1'b0;
      sending_q     <= 1'b0;
      send_addr_q   <= '0;
      send_places_q <= '0;
    end else if (clear_i) begin
      half_q        <= 1'b0;
      first_q       <= '0;
      next_q        <= '0;
      addr_q        <= '0;
      left_q        <= '0;
      error_q       <= 1'b0;
      sending_q     <= 1'b0;
      send_addr_q   <= '0;
      send_places_q <= '0;
    end else begin
      next_q <= next_d;
      if (store) left_q <= left_q - 32'(PairBytes);
      if (in_valid_i && in_ready_o && !fits) error_q <= 1'b1;
      if (wr_ready_i) sending_q <= 1'b0;
      if (hand_over) begin
        half_q      <= !half_q;
        sending_q   <= 1'b1;
        send_addr_q <= addr_q;
        for (int unsigned i = 0; i < Places; i++) begin
          send_places_q[i] <= (3'(i) >= {1'b0, first_q}) && (3'(i) < next_d);
        end
        first_q <= full_d ? 2'd0 : next_d[1:0];
        if (full_d) begin
          next_q <= '0;
          addr_q <= addr_q + 32'(xy_pkg::LineBytes);
        end
      end
      if (start_i) begin
        addr_q <= region_base_i;
        left_q <= region_size_i;
      end
    end
  end

  // --- Memory: a bank for each place ---

  for (genvar i = 0; i < Places; i++) begin : gen_bank
    xy_ram #(
        .Width    (8 * PairBytes),
        .AddrWidth(1),
        .Block    (1'b0)
    ) u_ram (
        .clk_i,
        .write_i     (store && (next_q[1:0] == 2'(i))),
        .write_addr_i(half_q),
        .write_data_i(in_pair_i),
        .read_addr_i (!half_q),
        .read_data_o (wr_data_o[8*PairBytes*i+:8*PairBytes])
    );

    assign wr_strb_o[PairBytes*i+:PairBytes] = {PairBytes{send_places_q[i]}};
  end

  assign open_o      = next_q != {1'b0, first_q};
  assign open_addr_o = addr_q;
  assign sending_o   = sending_q;
  assign error_o     = error_q;
  assign wr_valid_o  = sending_q;
  assign wr_addr_o   = send_addr_q;

`ifndef SYNTHESIS
  // A start moves the address under way.
  a_start_when_empty :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      start_i |-> !open_o && !sending_q && !in_valid_i);

  // A line offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      wr_valid_o && !wr_ready_i
      |=> wr_valid_o && $stable(wr_addr_o) && $stable(wr_data_o) && $stable(wr_strb_o));
`endif

endmodule
