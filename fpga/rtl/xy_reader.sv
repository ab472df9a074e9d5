// Primitive reader: the input as one stream of lines, two records a line, asked for ahead of their use.
//
// Handshake   start_i takes base_i (a multiple of a line) and count_i (records, of 32 bytes).
//             rd, rsp: the line port; the tag says where the line has its place. Lines may come in any
//             order.
//             pair: valid/ready. pair_two_o: both records count, else pair_o[0] only; pair_last_o: none
//             follow.
//             error_o rises when a record is next that is none (xy_unpack) and stays until start_i or
//             clear_i, with the record's index; its pair is not offered.
//             done_o: all records have left.
// Latency     1 cycle from a line's arrival to its pair.
// Throughput  one line asked for and one pair a cycle.
// Cut paths   all but pair_o, which is read from distributed memory in its cycle.
module xy_reader #(
    parameter int unsigned Room = 8  // lines; a power of two, 2 or more
) (
    input  logic                    clk_i,
    input  logic                    rst_ni,
    input  logic                    clear_i,

    input  logic                    start_i,
    input  logic [31:0]             base_i,
    input  logic [31:0]             count_i,

    output logic                    rd_valid_o,
    input  logic                    rd_ready_i,
    output logic [31:0]             rd_addr_o,
    output logic [$clog2(Room)-1:0] rd_tag_o,
    input  logic                    rsp_valid_i,
    input  logic [$clog2(Room)-1:0] rsp_tag_i,
    input  logic [511:0]            rsp_data_i,

    output logic                    pair_valid_o,
    input  logic                    pair_ready_i,
    output logic                    pair_two_o,
    output logic                    pair_last_o,
    output logic [1:0][xy_pkg::RecordWidth-1:0] pair_o,  // of record_t

    output logic                    done_o,
    output logic                    error_o,
    output logic [31:0]             error_index_o
);

  localparam int unsigned TagWidth = $clog2(Room);

  // --- Asking ---

  logic [31:0]       ask_left_q;  // records whose line has not been asked for
  logic [31:0]       addr_q;
  logic [TagWidth:0] ask_q, next_q;  // lines asked for and delivered; one bit more tells full from empty

  logic asked, delivered;
  assign rd_valid_o = (ask_left_q != '0) && ((ask_q - next_q) != (TagWidth + 1)'(Room));
  assign rd_addr_o  = addr_q;
  assign rd_tag_o   = ask_q[TagWidth-1:0];
  assign asked      = rd_valid_o && rd_ready_i;

  // --- Lines that have come, their records checked on the way in ---

  logic [1:0][xy_pkg::RecordWidth-1:0] come;
  logic [1:0]                          come_valid;

  for (genvar i = 0; i < 2; i++) begin : gen_unpack
    xy_unpack u_unpack (
        .bytes_i (rsp_data_i[i*xy_pkg::RecordBits+:xy_pkg::RecordBits]),
        .record_o(come[i]),
        .valid_o (come_valid[i])
    );
  end

  logic [Room-1:0]     here_q;
  logic [1:0]          head_valid;
  logic [TagWidth-1:0] head;
  assign head = next_q[TagWidth-1:0];

  xy_ram #(
      .Width    (2 * xy_pkg::RecordWidth + 2),
      .AddrWidth(TagWidth),
      .Block    (1'b0)
  ) u_lines (
      .clk_i,
      .write_i     (rsp_valid_i),
      .write_addr_i(rsp_tag_i),
      .write_data_i({come_valid, come}),
      .read_addr_i (head),
      .read_data_o ({head_valid, pair_o})
  );

  // --- Delivering ---

  logic [31:0] left_q, index_q;  // records that have not left; position of the first of them
  logic        error_q;

  logic head_here, good;
  assign head_here = here_q[head] && (left_q != '0);
  assign good      = head_valid[0] && (head_valid[1] || !pair_two_o);

  assign pair_valid_o = head_here && good;
  assign pair_two_o   = left_q != 32'd1;
  assign pair_last_o  = left_q <= 32'd2;
  assign delivered    = pair_valid_o && pair_ready_i;

  assign done_o        = left_q == '0;
  assign error_o       = error_q;
  assign error_index_o = index_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      ask_left_q <= '0;
      addr_q     <= '0;
      ask_q      <= '0;
      next_q     <= '0;
      here_q     <= '0;
      left_q     <= '0;
      index_q    <= '0;
      error_q    <= 1'b0;
    end else if (clear_i) begin
      ask_left_q <= '0;
      addr_q     <= '0;
      ask_q      <= '0;
      next_q     <= '0;
      here_q     <= '0;
      left_q     <= '0;
      index_q    <= '0;
      error_q    <= 1'b0;
    end else begin
      if (asked) begin
        ask_q      <= ask_q + 1'b1;
        addr_q     <= addr_q + 32'(xy_pkg::LineBytes);
        ask_left_q <= (ask_left_q <= 32'd2) ? '0 : ask_left_q - 32'd2;
      end
      if (delivered) begin
        next_q       <= next_q + 1'b1;
        here_q[head] <= 1'b0;
        left_q       <= pair_last_o ? '0 : left_q - 32'd2;
        index_q      <= index_q + 32'd2;
      end
      if (rsp_valid_i) here_q[rsp_tag_i] <= 1'b1;
      if (head_here && !good && !error_q) begin
        error_q <= 1'b1;
        index_q <= index_q + 32'(head_valid[0]);
      end
      if (start_i) begin
        ask_left_q <= count_i;
        addr_q     <= base_i;
        left_q     <= count_i;
        index_q    <= '0;
        error_q    <= 1'b0;
      end
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (Room < 2 || (Room & (Room - 1)) != 0) begin
      $fatal(1, "xy_reader: Room is %0d, must be a power of two, 2 or more", Room);
    end
  end

  // A line that nobody asked for would take another's place.
  logic [TagWidth-1:0] rsp_place;
  assign rsp_place = rsp_tag_i - head;
  a_asked_for :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      rsp_valid_i |-> !here_q[rsp_tag_i] && {1'b0, rsp_place} < (ask_q - next_q));

  // A start forgets where lines under way belong.
  a_start_when_done :
  assert property (@(posedge clk_i) disable iff (!rst_ni) start_i |-> (ask_q == next_q));

  // Requests and pairs offered stay offered, unchanged.
  a_stable_request :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      rd_valid_o && !rd_ready_i |=> rd_valid_o && $stable(rd_addr_o) && $stable(rd_tag_o));
  a_stable_pair :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      pair_valid_o && !pair_ready_i |=> pair_valid_o && $stable(pair_o) && $stable(pair_two_o));
`endif

endmodule
