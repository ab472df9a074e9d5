// Burst writer: collects records of one size, in order, and sends them to a region in bursts of lines.
//
//   in ──► open burst │ burst being sent ──► wr
//
// Two bursts have a place: one is filled while the other is sent. A burst leaves when it is full and the
// other place is free, or, with flush_i, as soon as the other place is free. A record that would leave the
// region is dropped and error_o rises; what came before it is sent, and nothing comes after it.
//
// Handshake   start_i takes region_base_i (a multiple of a line) and region_size_i (bytes); empty_o must
//             be high, and records come from the next cycle on.
//             in, wr: valid/ready; wr_last_o with the last line of a burst.
//             flush_i is a level: hold it until empty_o. After a burst that was not full, nothing may
//             follow until the next start.
//             error_o stays until start_i or clear_i. clear_i: the state after reset, in which a record is
//             an error.
// Latency     1 cycle from the record that fills a burst to its first line.
// Throughput  one record a cycle and one line a cycle.
// Cut paths   all but wr_data_o, which is read from distributed memory in its cycle. in_valid_i and wr_ready_i
//             come late in theirs: what depends on registers only is found beside them or the cycle before.
module xy_burst_writer #(
    parameter int unsigned RecordBits = 256,  // 8 to 512, a power of two
    parameter int unsigned BurstLines = 2
) (
    input  logic                  clk_i,
    input  logic                  rst_ni,
    input  logic                  clear_i,

    input  logic                  start_i,
    input  logic [31:0]           region_base_i,
    input  logic [31:0]           region_size_i,

    input  logic                  in_valid_i,
    output logic                  in_ready_o,
    input  logic [RecordBits-1:0] in_record_i,

    input  logic                  flush_i,
    output logic                  empty_o,
    output logic                  error_o,

    output logic                  wr_valid_o,
    input  logic                  wr_ready_i,
    output logic [31:0]           wr_addr_o,
    output logic [511:0]          wr_data_o,
    output logic [63:0]           wr_strb_o,
    output logic                  wr_last_o
);

  localparam int unsigned RecordBytes  = RecordBits / 8;
  localparam int unsigned LineRecords  = xy_pkg::LineBits / RecordBits;
  localparam int unsigned BurstRecords = LineRecords * BurstLines;
  localparam int unsigned CountWidth   = $clog2(BurstRecords + 1);
  localparam int unsigned LineWidth    = (BurstLines > 1) ? $clog2(BurstLines) : 1;
  localparam int unsigned PosWidth     = $clog2(LineRecords);  // 0 if a record is a line

  localparam logic [CountWidth-1:0] Full     = CountWidth'(BurstRecords);
  localparam logic [CountWidth-1:0] PerLine  = CountWidth'(LineRecords);
  localparam logic [31:0]           Bytes    = 32'(RecordBytes);
  localparam logic [31:0]           BytesTwo = 2 * Bytes;

  // --- The open burst ---

  logic                  half_q;  // which of the two places is open; the other one is sent
  logic [CountWidth-1:0] open_q, open_next;
  logic                  full_q;
  logic [31:0]           left_q;  // bytes of the region that no record has yet
  logic                  fits_q;  // a further record does: it has Bytes or more
  logic                  error_q;

  logic push, can_store, store, last_place;
  assign in_ready_o = !full_q;
  assign push       = in_valid_i && !full_q;
  assign can_store  = !full_q && fits_q && !error_q;
  assign store      = in_valid_i && can_store;
  assign open_next  = open_q + 1'b1;
  assign last_place = open_q == Full - 1'b1;

  // --- The burst being sent ---

  logic                  sending_q;
  logic [CountWidth-1:0] records_q;  // of it, still to be sent
  logic [LineWidth-1:0]  line_q;
  logic [31:0]           addr_q;

  // There are records, and they leave as soon as they may; a record that comes now is the last one of its burst.
  logic waits, ends;
  assign waits = full_q || ((flush_i || error_q) && (open_q != '0));
  assign ends  = can_store && (last_place || flush_i);

  logic sent, hand_over;
  assign wr_valid_o = sending_q;
  assign wr_addr_o  = addr_q;
  assign wr_last_o  = records_q <= PerLine;
  assign sent       = sending_q && wr_ready_i && wr_last_o;
  assign hand_over  = (!sending_q || sent) && (waits || (in_valid_i && ends));

  assign empty_o = (open_q == '0) && !sending_q;
  assign error_o = error_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      half_q    <= 1'b0;
      open_q    <= '0;
      full_q    <= 1'b0;
      left_q    <= '0;
      fits_q    <= 1'b0;
      error_q   <= 1'b0;
      sending_q <= 1'b0;
      records_q <= '0;
      line_q    <= '0;
      addr_q    <= '0;
    end else if (clear_i) begin
      half_q    <= 1'b0;
      open_q    <= '0;
      full_q    <= 1'b0;
      left_q    <= '0;
      fits_q    <= 1'b0;
      error_q   <= 1'b0;
      sending_q <= 1'b0;
      records_q <= '0;
      line_q    <= '0;
      addr_q    <= '0;
    end else begin
      if (store) begin
        open_q <= open_next;
        full_q <= last_place;
        left_q <= left_q - Bytes;
        fits_q <= left_q >= BytesTwo;
      end
      if (push && !fits_q) error_q <= 1'b1;
      if (sending_q && wr_ready_i) begin
        records_q <= records_q - PerLine;
        line_q    <= line_q + 1'b1;
        addr_q    <= addr_q + 32'(xy_pkg::LineBytes);
        sending_q <= !wr_last_o;
      end
      if (hand_over) begin
        half_q    <= !half_q;
        open_q    <= '0;
        full_q    <= 1'b0;
        sending_q <= 1'b1;
        records_q <= store ? open_next : open_q;
        line_q    <= '0;
      end
      if (start_i) begin
        addr_q  <= region_base_i;
        left_q  <= region_size_i;
        fits_q  <= region_size_i >= Bytes;
        error_q <= 1'b0;
      end
    end
  end

  // --- Memory: a bank for each place of a record in a line ---

  // The next place may be written at any time: what is there counts once open_q has passed it. So in_valid_i, which
  // comes late, need not reach the memory.

  logic [LineWidth-1:0] open_line;
  assign open_line = LineWidth'(open_q >> PosWidth);

  for (genvar i = 0; i < LineRecords; i++) begin : gen_bank
    localparam logic [CountWidth-1:0] Place = CountWidth'(i);

    xy_ram #(
        .Width    (RecordBits),
        .AddrWidth(LineWidth + 1),
        .Block    (1'b0)
    ) u_ram (
        .clk_i,
        .write_i     (!full_q && ((open_q & (PerLine - 1'b1)) == Place)),
        .write_addr_i({half_q, open_line}),
        .write_data_i(in_record_i),
        .read_addr_i ({!half_q, line_q}),
        .read_data_o (wr_data_o[i*RecordBits+:RecordBits])
    );

    assign wr_strb_o[i*RecordBytes+:RecordBytes] = {RecordBytes{records_q > Place}};
  end

`ifndef SYNTHESIS
  initial begin
    if (RecordBits < 8 || RecordBits > 512 || (RecordBits & (RecordBits - 1)) != 0) begin
      $fatal(1, "xy_burst_writer: RecordBits is %0d, must be a power of two, 8 to 512", RecordBits);
    end
    if (BurstLines < 1) $fatal(1, "xy_burst_writer: BurstLines is 0, must be 1 or more");
  end

  // The bits are what they stand for.
  a_bits :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      full_q == (open_q == Full) && fits_q == (left_q >= Bytes));

  // A burst that was not full ends inside a line: what followed would start there.
  logic short_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) short_q <= 1'b0;
    else if (clear_i || start_i) short_q <= 1'b0;
    else if (hand_over && !full_q && !(store && last_place)) short_q <= 1'b1;
  end
  a_nothing_after_a_short_burst :
  assert property (@(posedge clk_i) disable iff (!rst_ni) short_q |-> !store);

  // A start moves the address under way.
  a_start_when_empty :
  assert property (@(posedge clk_i) disable iff (!rst_ni) start_i |-> empty_o && !in_valid_i);

  // A line offered stays offered, unchanged.
  a_stable :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      wr_valid_o && !wr_ready_i
      |=> wr_valid_o && $stable(wr_addr_o) && $stable(wr_data_o) && $stable(wr_strb_o));
`endif

endmodule
