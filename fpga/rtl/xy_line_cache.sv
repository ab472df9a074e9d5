// Read-only cache of memory lines, read by words of 64 bits: direct mapped, one miss at a time.
//
// Handshake   word_valid_i asks for the word at word_addr_i (in words); both stay until word_ready_o. The word is
//             at data_o from the next cycle on, until another one is taken.
//             A word that is not there has its line read: rd_valid_o asks for it from the next cycle on until
//             rd_ready_i, rsp_valid_i brings it a cycle later or more, and the word is taken in the cycle after.
//             clear_i forgets all lines; no read may be under way.
// Latency     1 cycle, and for a miss 2 more than memory takes.
// Throughput  one word a cycle.
// Cut paths   reads of memory. Not cut: word_addr_i is compared with a tag for word_ready_o.
module xy_line_cache #(
    parameter int unsigned IndexWidth = 4,    // 2^IndexWidth lines
    parameter bit          Block      = 1'b0  // whether lines are kept in block memory
) (
    input  logic         clk_i,
    input  logic         rst_ni,
    input  logic         clear_i,

    input  logic         word_valid_i,
    output logic         word_ready_o,
    input  logic [28:0]  word_addr_i,
    output logic [63:0]  data_o,

    output logic         rd_valid_o,
    input  logic         rd_ready_i,
    output logic [31:0]  rd_addr_o,
    input  logic         rsp_valid_i,
    input  logic [511:0] rsp_data_i
);

  localparam int unsigned TagWidth = 26 - IndexWidth;

  logic [IndexWidth-1:0] index;
  logic [TagWidth-1:0]   tag, kept_tag;
  logic [2:0]            word;
  assign {tag, index, word} = word_addr_i;

  typedef enum logic [1:0] {
    Ready,
    Ask,
    Wait
  } state_e;

  state_e                     state_q;
  logic [2**IndexWidth-1:0]   valid_q;
  logic                       present, fill;
  assign present      = valid_q[index] && kept_tag == tag;
  assign fill         = state_q == Wait && rsp_valid_i;
  assign word_ready_o = state_q == Ready && present;
  assign rd_valid_o   = state_q == Ask;
  assign rd_addr_o    = {tag, index, 6'b0};

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q <= Ready;
      valid_q <= '0;
    end else if (clear_i) begin
      state_q <= Ready;
      valid_q <= '0;
    end else begin
      unique case (state_q)
        Ready:   if (word_valid_i && !present) state_q <= Ask;
        Ask:     if (rd_ready_i) state_q <= Wait;
        default: if (rsp_valid_i) state_q <= Ready;
      endcase
      if (fill) valid_q[index] <= 1'b1;
    end
  end

  xy_ram #(
      .Width    (TagWidth),
      .AddrWidth(IndexWidth),
      .Block    (1'b0)
  ) u_tags (
      .clk_i,
      .write_i     (fill),
      .write_addr_i(index),
      .write_data_i(tag),
      .read_addr_i (index),
      .read_data_o (kept_tag)
  );

  // The word follows a register either way: behind block memory, the word's number; behind
  // distributed memory, the word. A line is not read at the edge that writes it, as nothing is taken.
  logic [511:0] line;
  xy_ram #(
      .Width    (512),
      .AddrWidth(IndexWidth),
      .Block    (Block)
  ) u_lines (
      .clk_i,
      .write_i     (fill),
      .write_addr_i(index),
      .write_data_i(rsp_data_i),
      .read_addr_i (index),
      .read_data_o (line)
  );

  logic taken;
  assign taken = word_valid_i && word_ready_o;

  if (Block) begin : gen_block
    // Block memory reads in every cycle: what was taken is held behind it.
    logic        fresh_q;
    logic [2:0]  word_q;
    logic [63:0] held_q, fresh;
    assign fresh = line[{word_q, 6'b0}+:64];
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) fresh_q <= 1'b0;
      else fresh_q <= taken;
    end
    always_ff @(posedge clk_i) begin
      word_q <= word;
      if (fresh_q) held_q <= fresh;
    end
    assign data_o = fresh_q ? fresh : held_q;
  end else begin : gen_distributed
    logic [63:0] data_q;
    always_ff @(posedge clk_i) begin
      if (taken) data_q <= line[{word, 6'b0}+:64];
    end
    assign data_o = data_q;
  end

`ifndef SYNTHESIS
  // Nothing but a read that was asked for is answered; the answer would be lost.
  a_answers_are_asked_for :
  assert property (@(posedge clk_i) disable iff (!rst_ni) rsp_valid_i |-> state_q == Wait);
  // The address stays until the word is taken, as the line's place is taken from it.
  a_address_stays :
  assert property (@(posedge clk_i) disable iff (!rst_ni || clear_i)
      word_valid_i && !word_ready_o |=> word_valid_i && $stable(word_addr_i));
`endif

endmodule
