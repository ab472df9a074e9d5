// Insertion sorter of one piece of records by Morton code, in place; records of equal codes keep their
// order (P2 §5.5).
//
// Records come in pairs, as fast as they may, and wait in memory for their turn. Each is loaded into a
// register and then compared with those before it, from the highest down: if one is higher the two change
// places, else the record is where it belongs. The memory has two banks, of even and odd places: neighbours
// lie in different ones, so a change of places writes each bank once. The next record is read beside a
// comparison that reads the other bank; only if there is none, in a cycle of its own.
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
    input  logic                  wide_i,  // codes of 21 bits an axis

    input  logic                  in_valid_i,
    output logic                  in_ready_o,
    input  logic                  in_two_i,
    input  logic                  in_last_i,
    input  logic [1:0][xy_pkg::RecordWidth-1:0] in_pair_i,  // of record_t

    output logic                  out_valid_o,
    input  logic                  out_ready_i,
    output logic                  out_two_o,
    output logic                  out_last_o,
    output logic [1:0][xy_pkg::RecordWidth-1:0] out_pair_o
);

  localparam int unsigned PlaceWidth = $clog2(Piece);
  localparam int unsigned RowWidth   = PlaceWidth - 1;

  // The piece that comes in or is sorted.
  logic [PlaceWidth:0]   taken_q;     // records that came
  logic [PlaceWidth:0]   begun_q;     // of those, the ones in order or on their way there; the first one is
  logic                  complete_q;  // no more come
  logic                  compare_q;   // a record is on its way, at the place after below_q
  logic [PlaceWidth-1:0] below_q;
  xy_pkg::record_t       record_q;
  logic [CodeWidth-1:0]  code_q;
  logic                  next_valid_q;  // the record after it has been read
  xy_pkg::record_t       next_record_q;
  logic [CodeWidth-1:0]  next_code_q;

  // The piece that leaves, from its second pair on.
  logic                  giving_q;
  logic [PlaceWidth:0]   out_count_q;
  logic [RowWidth-1:0]   out_row_q;

  logic accept, deliver, in_order;
  assign in_ready_o  = !complete_q && (!giving_q || (taken_q[PlaceWidth-1:1] < out_row_q));
  assign accept      = in_valid_i && in_ready_o;
  assign in_order    = complete_q && !compare_q && (begun_q == taken_q);
  assign out_valid_o = giving_q || in_order;
  assign deliver     = out_valid_o && out_ready_i;

  // --- Memory ---

  logic [1:0]                          write;
  logic [1:0][RowWidth-1:0]            write_row, read_row;
  logic [1:0][xy_pkg::RecordWidth-1:0] write_record;
  logic [1:0][CodeWidth-1:0]           read_code;

  for (genvar b = 0; b < 2; b++) begin : gen_bank
    xy_ram #(
        .Width    (xy_pkg::RecordWidth),
        .AddrWidth(RowWidth),
        .Block    (1'b0)
    ) u_ram (
        .clk_i,
        .write_i     (write[b]),
        .write_addr_i(write_row[b]),
        .write_data_i(write_record[b]),
        .read_addr_i (read_row[b]),
        .read_data_o (out_pair_o[b])
    );

    xy_pkg::record_t read;
    assign read = out_pair_o[b];
    xy_morton #(.CodeWidth(CodeWidth)) u_morton (
        .box_i (read.box),
        .wide_i,
        .code_o(read_code[b])
    );
    logic unused_prim;
    assign unused_prim = ^read.prim;
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

  // The memory is read for the output while a piece leaves, and written while one comes in.
  logic works, swap, ends, beside, load;
  assign works  = !accept && !giving_q;
  assign swap   = works && compare_q && (read_code[below_odd] > code_q);
  assign ends   = works && compare_q && (!swap || (below_q == '0));
  assign beside = works && compare_q && (begun_q < taken_q) && (next_odd != below_odd);
  assign load   = works && (begun_q < taken_q)
      && (!compare_q || (ends && (beside || next_valid_q)));

  for (genvar b = 0; b < 2; b++) begin : gen_access
    localparam bit Odd = (b == 1);
    // Of the two that change places, the one below goes up.
    assign write[b]        = swap || (accept && (!Odd || in_two_i));
    assign write_row[b]    = accept ? taken_q[PlaceWidth-1:1]
        : ((below_odd == Odd) ? below_row : above_row);
    assign write_record[b] = accept ? in_pair_i[b]
        : ((below_odd == Odd) ? record_q : out_pair_o[below_odd]);
    assign read_row[b]     = out_valid_o ? out_row_q
        : ((compare_q && (below_odd == Odd)) ? below_row : next_row);
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
      compare_q    <= 1'b0;
      next_valid_q <= 1'b0;
      giving_q     <= 1'b0;
      out_count_q  <= '0;
      out_row_q    <= '0;
    end else if (clear_i) begin
      taken_q      <= '0;
      begun_q      <= (PlaceWidth + 1)'(1);
      complete_q   <= 1'b0;
      compare_q    <= 1'b0;
      next_valid_q <= 1'b0;
      giving_q     <= 1'b0;
      out_count_q  <= '0;
      out_row_q    <= '0;
    end else begin
      if (accept) begin
        taken_q    <= taken_q + (in_two_i ? (PlaceWidth + 1)'(2) : (PlaceWidth + 1)'(1));
        complete_q <= in_last_i || (taken_q == (PlaceWidth + 1)'(Piece - 2));
      end
      if (load) begin
        begun_q   <= begun_q + 1'b1;
        compare_q <= 1'b1;
      end else if (ends) begin
        compare_q <= 1'b0;
      end
      if (load) next_valid_q <= 1'b0;
      else if (beside) next_valid_q <= 1'b1;
      if (deliver) begin
        out_row_q <= out_last_o ? '0 : out_row_q + 1'b1;
        giving_q  <= !out_last_o;
        if (!giving_q) begin
          out_count_q <= taken_q;
          taken_q     <= '0;
          begun_q     <= (PlaceWidth + 1)'(1);
          complete_q  <= 1'b0;
        end
      end
    end
  end

  always_ff @(posedge clk_i) begin
    if (load) begin
      record_q <= next_valid_q ? next_record_q : out_pair_o[next_odd];
      code_q   <= next_valid_q ? next_code_q : read_code[next_odd];
      below_q  <= begun_q[PlaceWidth-1:0] - 1'b1;
    end else if (swap) begin
      below_q <= below_q - 1'b1;
    end
    if (beside) begin
      next_record_q <= out_pair_o[next_odd];
      next_code_q   <= read_code[next_odd];
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (Piece < 4 || (Piece & (Piece - 1)) != 0) begin
      $fatal(1, "xy_sorter: Piece is %0d, must be a power of two, 4 or more", Piece);
    end
  end

  // A single record before the last pair would leave a hole.
  a_single_is_last :
  assert property (@(posedge clk_i) disable iff (!rst_ni) accept && !in_two_i |-> in_last_i);

  // A pair offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      out_valid_o && !out_ready_i |=> out_valid_o && $stable(out_pair_o));
`endif

endmodule
