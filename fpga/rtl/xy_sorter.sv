// Insertion sorter of one piece of records by Morton code, in place; records of equal codes keep their
// order (P2 §5.5).
//
// Records come in pairs, as fast as they may, and wait in memory for their turn. Each is loaded into a
// register and then compared with those before it, from the highest down: if one is higher the two change
// places, else the record is where it belongs. The memory has two banks, of even and odd places: neighbours
// lie in different ones, so a change of places writes each bank once. The next record is read beside a
// comparison that reads the other bank; only if there is none, in a cycle of its own.
//
// What a comparison says comes late in a cycle, so that little depends on it. Records have their codes beside
// them; two registers take turns, the next record is fetched into the one that is free, and only their turn,
// places and write enables wait for the comparison.
//
// Handshake   in: valid/ready; in_two_i: both records count. in_last_i: the piece is complete; a piece of
//             Piece records is complete without. In a cycle in which a pair comes in nothing is sorted.
//             out: valid/ready. Offers the piece, from its lowest pair on, once it is in order;
//             out_last_o: this is the last pair. The next piece may follow it a row behind.
// Latency     1 cycle for each comparison, and 1 for a record that could not be read beside one.
// Throughput  one comparison a cycle; two records a cycle in and out.
// Cut paths   in to out; ready to valid. Not cut inside: from the memory's output through a comparison of
//             codes to its write enables.
module xy_sorter #(
    parameter int unsigned Piece     = 8,  // records; a power of two, 4 or more
    parameter int unsigned CodeWidth = 63
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  clear_i,

    input  logic                  in_valid_i,
    output logic                  in_ready_o,
    input  logic                  in_two_i,
    input  logic                  in_last_i,
    input  logic [1:0][xy_pkg::RecordWidth-1:0] in_pair_i,  // of record_t
    input  logic [1:0][CodeWidth-1:0]           in_code_i,

    output logic                  out_valid_o,
    input  logic                  out_ready_i,
    output logic                  out_two_o,
    output logic                  out_last_o,
    output logic [1:0][xy_pkg::RecordWidth-1:0] out_pair_o
);

  localparam int unsigned PlaceWidth = $clog2(Piece);
  localparam int unsigned RowWidth   = PlaceWidth - 1;
  localparam int unsigned Width      = CodeWidth + xy_pkg::RecordWidth;

  // The piece that comes in or is sorted.
  logic [PlaceWidth:0]   taken_q;     // records that came
  logic [PlaceWidth:0]   begun_q;     // of those, the ones in order or on their way there; the first one is
  logic                  complete_q;  // no more come
  logic                  more_q;      // begun_q < taken_q
  logic                  compare_q;   // a record is on its way, at the place after below_q
  logic [PlaceWidth-1:0] below_q;
  logic                  next_valid_q;  // the record after it has been fetched
  (* keep *) logic       odd_q;         // below_q[0] once more, for what the comparison waits for
  logic                  turn_q;        // which of the two the record on its way is; the next one is the other
  logic [1:0][Width-1:0] fetched_q;

  // The piece that leaves, from its second pair on.
  logic                  giving_q;
  logic [PlaceWidth:0]   out_count_q;
  logic [RowWidth-1:0]   out_row_q;

  logic accept, deliver, in_order;
  assign in_ready_o  = !complete_q && (!giving_q || (taken_q[PlaceWidth-1:1] < out_row_q));
  assign accept      = in_valid_i && in_ready_o;
  assign in_order    = complete_q && !compare_q && !more_q;
  assign out_valid_o = giving_q || in_order;
  assign deliver     = out_valid_o && out_ready_i;

  // --- Memory ---

  logic [1:0]                write;
  logic [1:0][RowWidth-1:0]  write_row, read_row;
  logic [1:0][Width-1:0]     write_word, read;  // codes above records
  logic [1:0][CodeWidth-1:0] read_code;

  for (genvar b = 0; b < 2; b++) begin : gen_bank
    xy_ram #(
        .Width    (Width),
        .AddrWidth(RowWidth),
        .Block    (1'b0)
    ) u_ram (
        .clk_i,
        .write_i     (write[b]),
        .write_addr_i(write_row[b]),
        .write_data_i(write_word[b]),
        .read_addr_i (read_row[b]),
        .read_data_o (read[b])
    );
    assign {read_code[b], out_pair_o[b]} = read[b];
  end

  // --- Sorting ---

  // A record is compared with the one below it; the next one is in the bank that its place says.
  logic [RowWidth-1:0] below_row, above_row, next_row;
  logic                below_odd, next_odd;
  assign below_odd = below_q[0];
  assign below_row = below_q[PlaceWidth-1:1];
  assign above_row = below_row + RowWidth'(below_odd);
  assign next_odd  = begun_q[0];
  assign next_row  = begun_q[PlaceWidth-1:1];

  // The record on its way; both banks are compared with it, and then the one below it is chosen.
  logic [Width-1:0]     record;
  logic [CodeWidth-1:0] code;
  logic [1:0]           higher;
  assign record = fetched_q[turn_q];
  assign code   = record[Width-1-:CodeWidth];
  for (genvar b = 0; b < 2; b++) begin : gen_higher
    assign higher[b] = code < read_code[b];  // this way round it is a carry chain and no more
  end

  // The memory is read for the output while a piece leaves, and written while one comes in.
  // What hangs on the comparison is put together for both of its results.
  logic works, compares, changes, lowest, follows, swap, ends, fetch, load;
  assign works    = !accept && !giving_q;
  assign compares = works && compare_q;
  assign changes  = higher[odd_q];
  assign lowest   = below_q == '0;
  assign fetch    = works && more_q && (!compare_q || (next_odd != below_odd));
  assign follows  = more_q && (fetch || next_valid_q);
  assign swap     = compares && changes;
  assign ends     = compares && (lowest || !changes);
  assign load     = (works && more_q && !compare_q) || (changes ? compares && lowest && follows : compares && follows);

  for (genvar b = 0; b < 2; b++) begin : gen_access
    localparam bit Odd = (b == 1);
    // Of the two that change places, the one below goes up.
    assign write[b]        = swap || (accept && (!Odd || in_two_i));
    assign write_row[b]    = accept ? taken_q[PlaceWidth-1:1]
        : ((below_odd == Odd) ? below_row : above_row);
    assign write_word[b]   = accept ? {in_code_i[b], in_pair_i[b]}
        : ((below_odd == Odd) ? record : read[1-b]);
    assign read_row[b]     = (giving_q || in_order) ? out_row_q
        : ((compare_q && (odd_q == Odd)) ? below_row : next_row);
  end

  // --- Output ---

  logic [PlaceWidth:0] out_left;
  assign out_left   = (giving_q ? out_count_q : taken_q) - {1'b0, out_row_q, 1'b0};
  assign out_two_o  = out_left != (PlaceWidth + 1)'(1);
  assign out_last_o = out_left <= (PlaceWidth + 1)'(2);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      taken_q      <= '0;
      begun_q      <= (PlaceWidth + 1)'(1);
      complete_q   <= 1'b0;
      more_q       <= 1'b0;
      compare_q    <= 1'b0;
      next_valid_q <= 1'b0;
      turn_q       <= 1'b0;
      giving_q     <= 1'b0;
      out_count_q  <= '0;
      out_row_q    <= '0;
    end else if (clear_i) begin
      taken_q      <= '0;
      begun_q      <= (PlaceWidth + 1)'(1);
      complete_q   <= 1'b0;
      more_q       <= 1'b0;
      compare_q    <= 1'b0;
      next_valid_q <= 1'b0;
      turn_q       <= 1'b0;
      giving_q     <= 1'b0;
      out_count_q  <= '0;
      out_row_q    <= '0;
    end else begin
      if (accept) begin
        taken_q    <= taken_q + (in_two_i ? (PlaceWidth + 1)'(2) : (PlaceWidth + 1)'(1));
        complete_q <= in_last_i || (taken_q == (PlaceWidth + 1)'(Piece - 2));
        // The first record is begun as it comes.
        more_q     <= in_two_i || (taken_q != '0);
      end
      if (load) begin
        begun_q   <= begun_q + 1'b1;
        compare_q <= 1'b1;
        more_q    <= begun_q + 1'b1 < taken_q;
      end else if (ends) begin
        compare_q <= 1'b0;
      end
      if (load) next_valid_q <= 1'b0;
      else if (fetch) next_valid_q <= 1'b1;
      if (load) turn_q <= !turn_q;
      if (deliver) begin
        out_row_q <= out_last_o ? '0 : out_row_q + 1'b1;
        giving_q  <= !out_last_o;
        if (!giving_q) begin
          out_count_q <= taken_q;
          taken_q     <= '0;
          begun_q     <= (PlaceWidth + 1)'(1);
          complete_q  <= 1'b0;
          more_q      <= 1'b0;
        end
      end
    end
  end

  always_ff @(posedge clk_i) begin
    if (load) begin
      below_q <= begun_q[PlaceWidth-1:0] - 1'b1;
      odd_q   <= !begun_q[0];
    end else if (swap) begin
      below_q <= below_q - 1'b1;
      odd_q   <= !odd_q;
    end
    if (fetch) fetched_q[!turn_q] <= read[next_odd];
  end

`ifndef SYNTHESIS
  initial begin
    if (Piece < 4 || (Piece & (Piece - 1)) != 0) begin
      $fatal(1, "xy_sorter: Piece is %0d, must be a power of two, 4 or more", Piece);
    end
  end

  // The bits are what they stand for.
  a_odd :
  assert property (@(posedge clk_i) disable iff (!rst_ni) compare_q |-> odd_q == below_q[0]);
  a_more :
  assert property (@(posedge clk_i) disable iff (!rst_ni) more_q == (begun_q < taken_q));

  // A single record before the last pair would leave a hole.
  a_single_is_last :
  assert property (@(posedge clk_i) disable iff (!rst_ni) accept && !in_two_i |-> in_last_i);

  // A pair offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      out_valid_o && !out_ready_i |=> out_valid_o && $stable(out_pair_o));
`endif

endmodule
