// Primitive reader: the input as one stream of lines, asked for ahead of their use, out of which come pairs of
// records: two boxes of 32 bytes in each line, or triangles of 40 bytes, eight in five lines.
//
//   rsp ──► lines ──► head ──┬────────────► two records ──► pair
//                            └─► line held ─────┘
//
// A pair of triangles lies in two lines that follow each other: the one held and the head. Of the five lines of
// eight triangles the first is only held, and each of the others brings a pair.
//
// Handshake   start_i takes base_i (a multiple of a line) and count_i (records, below 2^27); triangles_i must
//             stay.
//             rd, rsp: the line port; the tag says where the line has its place. Lines may come in any
//             order.
//             pair: valid/ready. pair_two_o: both records count, else pair_o[0] only; pair_last_o: none
//             follow.
//             error_o rises when a record is next that is none (xy_unpack, xy_unpack_triangle) and stays until
//             start_i or clear_i, with the record's index; its pair is not offered.
//             done_o: all records have left.
// Latency     2 cycles from a line's arrival to its pair.
// Throughput  one line asked for and one line taken apart a cycle.
// Cut paths   all: what comes out depends on registers only.
module xy_reader #(
    parameter int unsigned Room = 8  // lines; a power of two, 2 or more
) (
    input  logic                    clk_i,
    input  logic                    rst_ni,
    input  logic                    clear_i,

    input  logic                    start_i,
    input  logic [31:0]             base_i,
    input  logic [31:0]             count_i,
    input  logic                    triangles_i,

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

  logic [31:0]       ask_left_q;  // lines that have not been asked for
  logic              some_q;      // there are
  logic              no_room_q;   // Room lines have been asked for and not taken
  logic [31:0]       addr_q;
  logic [TagWidth:0] ask_q, next_q;  // lines asked for and taken; one bit more tells full from empty

  logic              asked;
  logic [TagWidth:0] away;
  assign away       = ask_q - next_q;
  assign rd_valid_o = some_q && !no_room_q;
  assign rd_addr_o  = addr_q;
  assign rd_tag_o   = ask_q[TagWidth-1:0];
  assign asked      = rd_valid_o && rd_ready_i;

  // Half a line a box; five eighths of a line a triangle.
  logic [31:0] lines, eighths;
  assign eighths = {count_i[29:0], 2'd0} + count_i;
  assign lines   = triangles_i ? 32'((eighths + 32'd7) >> 3) : 32'((count_i + 32'd1) >> 1);

  // --- Lines that have come ---

  logic [Room-1:0]             here_q;
  logic [TagWidth-1:0]         head;
  logic [xy_pkg::LineBits-1:0] head_line, held_q;
  assign head = next_q[TagWidth-1:0];

  logic taken;  // the first line is not needed any more

  // In parts, each beside its own copy of the place of the first line: there is no time to take that far.
  localparam int unsigned Parts    = 4;
  localparam int unsigned PartBits = xy_pkg::LineBits / Parts;
  for (genvar i = 0; i < Parts; i++) begin : gen_lines
    (* keep *) logic [TagWidth-1:0] head_q;
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) head_q <= '0;
      else if (clear_i) head_q <= '0;
      else if (taken) head_q <= head_q + 1'b1;
    end

    xy_ram #(
        .Width    (PartBits),
        .AddrWidth(TagWidth),
        .Block    (1'b0)
    ) u_lines (
        .clk_i,
        .write_i     (rsp_valid_i),
        .write_addr_i(rsp_tag_i),
        .write_data_i(rsp_data_i[i*PartBits+:PartBits]),
        .read_addr_i (head_q),
        .read_data_o (head_line[i*PartBits+:PartBits])
    );
`ifndef SYNTHESIS
    a_copy :
    assert property (@(posedge clk_i) disable iff (!rst_ni) head_q == head);
`endif
  end

  // --- The next two records ---

  logic [31:0] left_q, index_q;  // records that have not been taken from their lines; the first's position
  logic        any_left_q, one_left_q;
  logic        held_valid_q;
  logic [1:0]  phase_q;          // where in the line held the next triangle starts: at 16 bytes times this

  logic [1023:0]                          both;
  logic [1:0][xy_pkg::TriangleBits-1:0]   window;
  logic [1:0]                             come_valid;
  logic [1:0][xy_pkg::RecordWidth-1:0]    come;
  assign both = {head_line, held_q};

  logic unused_identifier;  // of the last triangle
  assign unused_identifier = ^both[1023:992];

  // An axis of the three vertices of a triangle, beside its own copy of the phase, as the first line is.
  for (genvar i = 0; i < 6; i++) begin : gen_axis
    localparam int unsigned Record = i / 3, Axis = i % 3;

    (* keep *) logic [1:0] axis_phase_q;
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) axis_phase_q <= '0;
      else if (clear_i || start_i) axis_phase_q <= '0;
      else if (enter) axis_phase_q <= axis_phase_q + 2'd1;
    end

    for (genvar v = 0; v < 3; v++) begin : gen_vertex
      localparam int unsigned Word = 32 * (3 * v + Axis), From = Record * xy_pkg::TriangleBits + Word;
      logic [31:0] word;
      always_comb begin
        unique case (axis_phase_q)
          2'd0: word = both[From+:32];
          2'd1: word = both[128+From+:32];
          2'd2: word = both[256+From+:32];
          default: word = both[384+From+:32];
        endcase
      end
      assign window[Record][Word+:32] = word;
    end
`ifndef SYNTHESIS
    a_copy :
    assert property (@(posedge clk_i) disable iff (!rst_ni) axis_phase_q == phase_q);
`endif
  end

  logic come_two, head_here, needs_head, load, enter, delivered;

  for (genvar i = 0; i < 2; i++) begin : gen_unpack
    assign window[i][xy_pkg::TriangleBits-1-:32] = '0;  // the identifier is not looked at

    xy_pkg::record_t box_record;
    logic            box_valid;

    xy_unpack u_box (
        .bytes_i (head_line[i*xy_pkg::RecordBits+:xy_pkg::RecordBits]),
        .record_o(box_record),
        .valid_o (box_valid)
    );
    xy_unpack_triangle u_triangle (
        .triangle_i(triangles_i),
        .bytes_i   (window[i]),
        .index_i   (index_q + 32'(i)),
        .record_i  (box_record),
        .valid_i   (box_valid),
        .record_o  (come[i]),
        .valid_o   (come_valid[i])
    );
  end

  // --- Taking lines apart ---

  logic full_q;
  assign come_two   = !one_left_q;
  assign head_here  = here_q[head] && any_left_q;
  // The last triangle of an odd number may end in the line held.
  assign needs_head = !triangles_i || come_two || phase_q[1];
  assign load       = triangles_i && !held_valid_q && head_here;
  assign enter      = any_left_q && (held_valid_q || !triangles_i) && (head_here || !needs_head)
      && (!full_q || delivered);
  assign taken      = load || (enter && needs_head);

  // --- Delivering ---

  logic                                two_q, last_q, error_q;
  logic                                good_q, first_good_q;  // all of it is records, the first one is
  logic [1:0][xy_pkg::RecordWidth-1:0] pair_q;

  assign pair_valid_o = full_q && good_q;
  assign pair_two_o   = two_q;
  assign pair_last_o  = last_q;
  assign pair_o       = pair_q;
  assign delivered    = pair_valid_o && pair_ready_i;

  assign done_o        = !any_left_q && !full_q;
  assign error_o       = error_q;
  assign error_index_o = index_q;

  always_ff @(posedge clk_i) begin
    if (taken) held_q <= head_line;
    if (enter) begin
      pair_q       <= come;
      good_q       <= come_valid[0] && (come_valid[1] || !come_two);
      first_good_q <= come_valid[0];
      two_q        <= come_two;
      last_q       <= left_q <= 32'd2;
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      ask_left_q   <= '0;
      some_q       <= 1'b0;
      no_room_q    <= 1'b0;
      addr_q       <= '0;
      ask_q        <= '0;
      next_q       <= '0;
      here_q       <= '0;
      left_q       <= '0;
      any_left_q   <= 1'b0;
      one_left_q   <= 1'b0;
      index_q      <= '0;
      held_valid_q <= 1'b0;
      phase_q      <= '0;
      full_q       <= 1'b0;
      error_q      <= 1'b0;
    end else if (clear_i) begin
      ask_left_q   <= '0;
      some_q       <= 1'b0;
      no_room_q    <= 1'b0;
      addr_q       <= '0;
      ask_q        <= '0;
      next_q       <= '0;
      here_q       <= '0;
      left_q       <= '0;
      any_left_q   <= 1'b0;
      one_left_q   <= 1'b0;
      index_q      <= '0;
      held_valid_q <= 1'b0;
      phase_q      <= '0;
      full_q       <= 1'b0;
      error_q      <= 1'b0;
    end else begin
      if (asked) begin
        ask_q      <= ask_q + 1'b1;
        addr_q     <= addr_q + 32'(xy_pkg::LineBytes);
        ask_left_q <= ask_left_q - 32'd1;
        some_q     <= ask_left_q != 32'd1;
      end
      no_room_q <= !taken && (asked ? (away == (TagWidth + 1)'(Room - 1)) : no_room_q);
      if (taken) begin
        next_q       <= next_q + 1'b1;
        here_q[head] <= 1'b0;
      end
      if (rsp_valid_i) here_q[rsp_tag_i] <= 1'b1;
      if (load) held_valid_q <= 1'b1;
      if (enter) begin
        left_q     <= (left_q <= 32'd2) ? '0 : left_q - 32'd2;
        any_left_q <= left_q > 32'd2;
        one_left_q <= left_q == 32'd3;
        index_q    <= index_q + 32'd2;
        phase_q    <= phase_q + 2'd1;
        if (phase_q == 2'd3) held_valid_q <= 1'b0;
      end
      full_q <= enter || (full_q && !delivered);
      if (full_q && !good_q && !error_q) begin
        error_q <= 1'b1;
        index_q <= index_q - 32'd2 + 32'(first_good_q);
      end
      if (start_i) begin
        ask_left_q   <= lines;
        some_q       <= count_i != '0;
        addr_q       <= base_i;
        left_q       <= count_i;
        any_left_q   <= count_i != '0;
        one_left_q   <= count_i == 32'd1;
        index_q      <= '0;
        held_valid_q <= 1'b0;
        phase_q      <= '0;
        full_q       <= 1'b0;
        error_q      <= 1'b0;
      end
    end
  end

`ifndef SYNTHESIS
  initial begin
    if (Room < 2 || (Room & (Room - 1)) != 0) begin
      $fatal(1, "xy_reader: Room is %0d, must be a power of two, 2 or more", Room);
    end
  end

  // The bits are what they stand for.
  a_bits :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      some_q == (ask_left_q != '0) && no_room_q == (away == (TagWidth + 1)'(Room))
      && any_left_q == (left_q != '0) && one_left_q == (left_q == 32'd1));

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
