// Backtracking: encodes a node that is in memory, and all below it whose contexts change with it, again (P3
// Algorithm 1, `Backtrack`), one at a time.
//
//   start ──► index, old, new ──► read line ──► recode both children ──► write line ──┐
//                 ▲                                                                   │
//                 └──────────── child 0, child 1, or the top of the stack ◄───────────┘
//
// A line that the pair writer still has is sent first, and nothing is read while it sends: the memory must
// show a read what was written before it. A child has a lower index than its parent, and no node is below
// two others: whatever memory holds, there is no more to do than there are nodes below the first one.
//
// Handshake   start_i with ready_o high: taken. ready_o is high again when all is done.
//             flush_o asks the pair writer to send its open line.
//             rd, wr: line ports; one read is under way at most. A line is a burst of its own.
//             repaired_o: a node was written again.
//             error_o: a node that no compressor wrote; stays, and nothing more happens, until clear_i.
//             clear_i: the state after reset, in the next cycle; a response under way must be kept away.
// Latency     4 cycles from a line's arrival to its write; the next node's read follows that.
// Throughput  one node at a time.
// Cut paths   all but those of stack and recoder to wr_data_o: an insertion into the line.
module xy_backtrack #(
    parameter int unsigned Bits     = 6,  // 4 to 6
    parameter int unsigned MinScale = 0
) (
    input  logic           clk_i,
    input  logic           rst_ni,
    input  logic           clear_i,
    input  logic           modulo_i,
    input  logic [31:0]    region_base_i,
    input  logic [31:0]    region_size_i,

    input  logic           start_i,
    output logic           ready_o,
    input  logic [26:0]    index_i,
    input  xy_pkg::place_t old_i,
    input  xy_pkg::place_t new_i,

    output logic           flush_o,
    input  logic           open_i,
    input  logic [31:0]    open_addr_i,
    input  logic           sending_i,

    output logic           rd_valid_o,
    input  logic           rd_ready_i,
    output logic [31:0]    rd_addr_o,
    input  logic           rsp_valid_i,
    input  logic [511:0]   rsp_data_i,

    output logic           wr_valid_o,
    input  logic           wr_ready_i,
    output logic [31:0]    wr_addr_o,
    output logic [511:0]   wr_data_o,
    output logic [63:0]    wr_strb_o,

    output logic           repaired_o,
    output logic           error_o
);

  localparam int unsigned MaxDepth  = 63 + 32;
  localparam int unsigned PlaceBits = 3 * (xy_pkg::CoordWidth + xy_pkg::MaxQuant + 1 + 5);
  localparam int unsigned CodeBits  = 6 * Bits;

  typedef enum logic [2:0] {
    Idle,
    Request,  // of the line
    Wait,     // for the line
    Decode,   // the recoder's first stage
    Encode,   // its second
    Check,    // its third
    Write,    // of the line
    Failed
  } state_e;

  typedef struct packed {
    xy_pkg::place_t place;
    xy_pkg::place_t stale;
    logic [26:0]    index;
  } repair_t;

  state_e       state_d, state_q;
  repair_t      repair_q, top;
  logic [511:0] line_q;
  logic [26:0]  left_q;  // repairs that there may still be

  // --- The line ---

  logic [31:0] offset, addr, rest;
  logic        held;
  assign offset = {1'b0, repair_q.index[26:2], 6'd0};
  assign addr   = region_base_i + offset;
  assign held   = open_i && (open_addr_i == addr);

  // What lies behind the region is not ours to write.
  assign rest      = region_size_i - offset;
  assign wr_strb_o = (rest < 32'd64) ? ~({64{1'b1}} << rest[5:0]) : '1;

  assign flush_o    = (state_q == Request) && held;
  assign rd_valid_o = (state_q == Request) && !held && !sending_i;
  assign rd_addr_o  = addr;

  logic [127:0] pair, recoded;

  always_comb begin
    pair      = '0;
    wr_data_o = line_q;
    for (int unsigned i = 0; i < 4; i++) begin
      if (repair_q.index[1:0] == 2'(i)) begin
        pair = line_q[128*i+:128];
        wr_data_o[128*i+:128] = recoded;
      end
    end
  end

  // --- Both children ---

  logic [1:0][63:0]         child;
  logic [1:0][CodeBits-1:0] code;
  logic [1:0][26:0]         pointer;
  logic [1:0]               leaf, needed, ok, below;
  xy_pkg::place_t           old0, old1, new0, new1;
  assign child = pair;

  for (genvar i = 0; i < 2; i++) begin : gen_child
    assign leaf[i]    = child[i][CodeBits];
    assign pointer[i] = child[i][CodeBits+1+:27];
    assign below[i]   = needed[i] && !leaf[i];
    assign recoded[64*i+:64] = 64'({pointer[i], leaf[i], code[i]});
  end

  xy_recoder #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_child0 (
      .clk_i,
      .rst_ni,
      .enable_i(1'b1),
      .modulo_i,
      .old_i   (repair_q.stale),
      .new_i   (repair_q.place),
      .code_i  (child[0][CodeBits-1:0]),
      .code_o  (code[0]),
      .old_o   (old0),
      .new_o   (new0),
      .needed_o(needed[0]),
      .ok_o    (ok[0])
  );

  xy_recoder #(
      .Bits    (Bits),
      .MinScale(MinScale)
  ) u_child1 (
      .clk_i,
      .rst_ni,
      .enable_i(1'b1),
      .modulo_i,
      .old_i   (repair_q.stale),
      .new_i   (repair_q.place),
      .code_i  (child[1][CodeBits-1:0]),
      .code_o  (code[1]),
      .old_o   (old1),
      .new_o   (new1),
      .needed_o(needed[1]),
      .ok_o    (ok[1])
  );

  logic sound, written, exhausted;
  assign sound = (ok == '1) && (leaf[0] || (pointer[0] < repair_q.index))
      && (leaf[1] || (pointer[1] < repair_q.index));
  assign wr_valid_o = (state_q == Write) && sound;
  assign wr_addr_o  = addr;
  assign written    = wr_valid_o && wr_ready_i;
  assign repaired_o = written;
  assign exhausted  = 27'(below[0]) + 27'(below[1]) > left_q;

  // --- What comes next ---

  logic    stack_empty, stack_full, push, pop;
  repair_t repair0, repair1;
  assign repair0 = {new0, old0, pointer[0]};
  assign repair1 = {new1, old1, pointer[1]};
  assign push    = written && !exhausted && (below == '1);
  assign pop     = written && (below == '0) && !stack_empty;

  xy_stack #(
      .Width(27 + 2 * PlaceBits),
      .Depth(MaxDepth)
  ) u_stack (
      .clk_i,
      .rst_ni,
      .clear_i,
      .push_i (push && !stack_full),
      .pop_i  (pop),
      .data_i (repair1),
      .top_o  (top),
      .empty_o(stack_empty),
      .full_o (stack_full)
  );

  always_comb begin
    state_d = state_q;
    unique case (state_q)
      Idle:    if (start_i) state_d = Request;
      Request: if (rd_valid_o && rd_ready_i) state_d = Wait;
      Wait:    if (rsp_valid_i) state_d = Decode;
      Decode:  state_d = Encode;
      Encode:  state_d = Check;
      Check:   state_d = Write;
      Write: begin
        if (!sound) state_d = Failed;
        else if (wr_ready_i) begin
          if (exhausted || (push && stack_full)) state_d = Failed;
          else state_d = (below == '0) && stack_empty ? Idle : Request;
        end
      end
      default: state_d = Failed;
    endcase
    if (clear_i) state_d = Idle;
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) state_q <= Idle;
    else state_q <= state_d;
  end

  always_ff @(posedge clk_i) begin
    if ((state_q == Idle) && start_i) begin
      repair_q <= {new_i, old_i, index_i};
      left_q   <= index_i;
    end
    if (written) begin
      left_q <= left_q - 27'(below[0]) - 27'(below[1]);
      if (below[0]) repair_q <= repair0;
      else if (below[1]) repair_q <= repair1;
      else repair_q <= top;
    end
    if ((state_q == Wait) && rsp_valid_i) line_q <= rsp_data_i;
  end

  assign ready_o = state_q == Idle;
  assign error_o = state_q == Failed;

  logic unused_bits;
  assign unused_bits = ^child;

`ifndef SYNTHESIS
  initial begin
    if (Bits < 4 || Bits > 6) $fatal(1, "xy_backtrack: Bits is %0d, must be 4 to 6", Bits);
  end

  // A response that nothing asked for would be lost.
  a_expected :
  assert property (@(posedge clk_i) disable iff (!rst_ni) rsp_valid_i |-> state_q == Wait);

  // The stack has room for a tree as deep as the emitter makes.
  a_no_overflow :
  assert property (@(posedge clk_i) disable iff (!rst_ni) push |-> !stack_full);
`endif

endmodule
