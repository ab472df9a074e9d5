// Custom function unit: the inner steps of building, tracing and compressing as instructions of a RISC-V core
// (VexRiscv's CFU port, opcode custom-0, R type). Operands that do not fit two words are loaded by
// instructions before and stay.
//
// function_i is {funct7, funct3}; a and b are the inputs, what is not said to answer answers 0.
//
//   funct3 0  merge heap: keys of 64 bits, the lower word first
//     funct7  0      key := {b, a}
//             1      key meets {b, a}: the lesser stays as key, the greater is the rest; answers the rest's lower word
//             2      answers the rest's upper word
//             3, 4   answers the key's lower, upper word
//   funct3 1  ray against box: the core's Slabs::new and Slabs::entry
//     funct7  0-2    axis x, y, z of the ray: origin a, reciprocal b (xy_trace_pkg::reciprocal_t)
//             4, 5   t_min, t_max := {b, a}; before the box' last axis
//             8-10   axis x, y, z of the box: from plane a to plane b; x first, z last
//             16     answers whether the box is hit (bit 0) and whether it is off the grid (bit 1); waits for the test
//             17, 18 answers the lower, upper word of the time of entry, if hit
//   funct3 2  a child's box on its parent's grid: the core's Placement::encode and Placement::child
//     funct7  0-2    axis x, y, z of the parent: lower bound a, {cells, 5 bits of scale} b
//             3      coordinates are modulo (1) or relative (0): a
//             8-10   axis x, y, z of the child: from a to b
//             16     answers bits 31:0 of its code
//             17     answers bits 35:32 of its code, and in bit 31 whether it is inside its parent
//             20-22  answers the child's lower bound on x, y, z
//             24-26  answers {cells, 5 bits of scale} of the child's own grid on x, y, z
//
// Codes have 6 bits a coordinate, and no grid is finer than a unit.
//
// Handshake   command and response, each valid/ready. A command whose result is under way is not taken before.
// Latency     1 cycle from command to response. A verdict's command is taken 5 cycles after the box' last axis at
//             the earliest, what is said of a child 3 cycles after what it is computed from.
// Throughput  a command a cycle.
// Cut paths   all, but from rsp_ready_i and the command's function to cmd_ready_o.
module xy_cfu (
    input  logic        clk_i,
    input  logic        rst_ni,

    input  logic        cmd_valid_i,
    output logic        cmd_ready_o,
    input  logic [9:0]  cmd_function_i,
    input  logic [31:0] cmd_a_i,
    input  logic [31:0] cmd_b_i,

    output logic        rsp_valid_o,
    input  logic        rsp_ready_i,
    output logic [31:0] rsp_output_o
);

  localparam int unsigned C = xy_pkg::CoordWidth;
  localparam int unsigned T = xy_trace_pkg::TimeWidth;

  localparam logic [2:0] Heap   = 3'd0;
  localparam logic [2:0] Boxes  = 3'd1;
  localparam logic [2:0] Encode = 3'd2;

  localparam logic [6:0] KeyLoad  = 7'd0;
  localparam logic [6:0] KeyMeet  = 7'd1;
  localparam logic [6:0] RestHigh = 7'd2;
  localparam logic [6:0] KeyLow   = 7'd3;
  localparam logic [6:0] KeyHigh  = 7'd4;

  localparam logic [6:0] TimeMin   = 7'd4;
  localparam logic [6:0] TimeMax   = 7'd5;
  localparam logic [6:0] Verdict   = 7'd16;
  localparam logic [6:0] EntryLow  = 7'd17;
  localparam logic [6:0] EntryHigh = 7'd18;

  localparam logic [6:0] Modulo   = 7'd3;
  localparam logic [6:0] CodeLow  = 7'd16;
  localparam logic [6:0] CodeHigh = 7'd17;

  // Operations on an axis have its number in the lowest bits.
  localparam logic [4:0] OuterAxis = 5'd0;  // of the ray, or of the parent
  localparam logic [4:0] InnerAxis = 5'd2;  // of the box, or of the child
  localparam logic [4:0] LowerAxis = 5'd5;
  localparam logic [4:0] ShapeAxis = 5'd6;

  // --- Command ---

  logic [2:0] unit;
  logic [6:0] op;
  logic [4:0] axis_op;
  logic [1:0] axis;
  assign {op, unit} = cmd_function_i;
  assign axis_op    = op[6:2];
  assign axis       = on_axis ? op[1:0] : 2'd0;

  logic heap, boxes, encode, on_axis;
  assign heap    = unit == Heap;
  assign boxes   = unit == Boxes;
  assign encode  = unit == Encode;
  assign on_axis = op[1:0] != 2'd3;

  logic       testing_q;
  logic [1:0] settling_q;
  logic       under_way, taken;
  assign under_way   = (boxes && op == Verdict && testing_q && !verdict_valid)
      || (encode && op[4] && settling_q != '0);
  assign cmd_ready_o = (!rsp_valid_o || rsp_ready_i) && !under_way;
  assign taken       = cmd_valid_i && cmd_ready_o;

  // Whether an operand is a coordinate of the grid.
  logic a_off, b_off;
  assign a_off = cmd_a_i[31:C-1] != {33 - C{cmd_a_i[C-1]}};
  assign b_off = cmd_b_i[31:C-1] != {33 - C{cmd_b_i[C-1]}};

  // --- Heap ---

  logic [63:0] key_q, other, greater;
  logic [31:0] rest_q;
  logic        less;
  assign other   = {cmd_b_i, cmd_a_i};
  assign greater = less ? key_q : other;
  xy_less #(.Width(64)) u_less (
      .a_i   (other),
      .b_i   (key_q),
      .less_o(less)
  );

  always_ff @(posedge clk_i) begin
    if (taken && heap && op == KeyLoad) key_q <= other;
    if (taken && heap && op == KeyMeet) begin
      if (less) key_q <= other;
      rest_q <= greater[63:32];
    end
  end

  // --- Box test ---

  xy_trace_pkg::reciprocal_t [2:0]       reciprocal_q;
  logic                      [2:0][31:0] origin_q;
  logic [T-1:0] t_min_q, t_max_q, entry;
  logic         box_axis, verdict_valid, hit, off_q;
  assign box_axis = taken && boxes && axis_op == InnerAxis && on_axis;

  always_ff @(posedge clk_i) begin
    if (taken && boxes) begin
      if (axis_op == OuterAxis && on_axis) begin
        origin_q[axis]     <= cmd_a_i;
        reciprocal_q[axis] <= cmd_b_i;
      end
      if (op == TimeMin) t_min_q <= {cmd_b_i[T-33:0], cmd_a_i};
      if (op == TimeMax) t_max_q <= {cmd_b_i[T-33:0], cmd_a_i};
    end
    if (box_axis) off_q <= a_off || b_off || (off_q && axis != 2'd0);
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) testing_q <= 1'b0;
    else if (box_axis && axis == 2'd2) testing_q <= 1'b1;
    else if (verdict_valid) testing_q <= 1'b0;
  end

  xy_trace_pkg::reciprocal_t reciprocal;
  logic               [31:0] origin;
  assign reciprocal = reciprocal_q[axis];
  assign origin     = origin_q[axis];

  xy_trace_pkg::factors_t                near_factors, far_factors;
  logic [xy_trace_pkg::ProductWidth-1:0] near_product, far_product;
  xy_trace_pkg::state_t                  unused_box;
  logic                                  unused_outside;

  xy_box_test u_box_test (
      .clk_i,
      .rst_ni,
      .clear_i        (1'b0),
      .valid_i        (box_axis),
      .first_i        (axis == 2'd0),
      .last_i         (axis == 2'd2),
      .step_i         (1'b0),
      .reciprocal_i   (reciprocal),
      .origin_i       (origin),
      .low_plane_i    (cmd_a_i[24:0]),
      .high_plane_i   (cmd_b_i[24:0]),
      .modulo_i       (1'b0),
      .low_code_i     ('0),
      .high_code_i    ('0),
      .node_i         ('0),
      .t_min_i        (t_min_q),
      .t_max_i        (t_max_q),
      .near_factors_o (near_factors),
      .far_factors_o  (far_factors),
      .near_product_i (near_product),
      .far_product_i  (far_product),
      .box_o          (unused_box),
      .verdict_valid_o(verdict_valid),
      .outside_o      (unused_outside),
      .hit_o          (hit),
      .entry_o        (entry)
  );
  xy_multiplier u_near (
      .clk_i,
      .factors_i(near_factors),
      .product_o(near_product)
  );
  xy_multiplier u_far (
      .clk_i,
      .factors_i(far_factors),
      .product_o(far_product)
  );

  // --- Encoder ---

  xy_pkg::place_t parent_q, child;
  xy_pkg::box_t   box;
  logic [2:0][C-1:0] lo_q, hi_q;
  logic [2:0]        off_axis_q;
  logic              modulo_q, contained, write;
  logic [35:0]       code;
  assign box   = {hi_q, lo_q};
  assign write = taken && encode && !op[4];

  always_ff @(posedge clk_i) begin
    if (write) begin
      if (axis_op == OuterAxis && on_axis) begin
        parent_q.lower[axis] <= cmd_a_i[C-1:0];
        parent_q.cells[axis] <= cmd_b_i[13:5];
        parent_q.scale[axis] <= cmd_b_i[4:0];
      end
      if (axis_op == InnerAxis && on_axis) begin
        lo_q[axis]       <= cmd_a_i[C-1:0];
        hi_q[axis]       <= cmd_b_i[C-1:0];
        off_axis_q[axis] <= a_off || b_off;
      end
      if (op == Modulo) modulo_q <= cmd_a_i[0];
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) settling_q <= '0;
    else if (write) settling_q <= 2'd2;
    else if (settling_q != '0) settling_q <= settling_q - 2'd1;
  end

  xy_pkg::place_t unused_old;
  logic           unused_needed;
  xy_encoder #(.Bits(6)) u_encoder (
      .clk_i,
      .rst_ni,
      .enable_i(1'b1),
      .modulo_i(modulo_q),
      .place_i (parent_q),
      .box_i   (box),
      .old_i   ('0),
      .code_o  (code),
      .old_o   (unused_old),
      .new_o   (child),
      .needed_o(unused_needed),
      .ok_o    (contained)
  );

  // --- Response ---

  logic [31:0] answer;
  always_comb begin
    answer = '0;
    unique case (unit)
      Heap: begin
        unique case (op)
          KeyMeet:  answer = greater[31:0];
          RestHigh: answer = rest_q;
          KeyLow:   answer = key_q[31:0];
          KeyHigh:  answer = key_q[63:32];
          default:  ;
        endcase
      end
      Boxes: begin
        unique case (op)
          Verdict:   answer = {30'b0, off_q, hit};
          EntryLow:  answer = entry[31:0];
          EntryHigh: answer = 32'(signed'(entry[T-1:32]));
          default:   ;
        endcase
      end
      Encode: begin
        if (op == CodeLow) answer = code[31:0];
        if (op == CodeHigh) answer = {contained && off_axis_q == '0, 27'b0, code[35:32]};
        if (axis_op == LowerAxis && on_axis) answer = 32'(signed'(child.lower[axis]));
        if (axis_op == ShapeAxis && on_axis) answer = {18'b0, child.cells[axis], child.scale[axis]};
      end
      default: ;
    endcase
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) rsp_valid_o <= 1'b0;
    else if (taken) rsp_valid_o <= 1'b1;
    else if (rsp_ready_i) rsp_valid_o <= 1'b0;
  end

  always_ff @(posedge clk_i) begin
    if (taken) rsp_output_o <= answer;
  end

  logic unused_bits;
  assign unused_bits = ^{unused_box, unused_outside, unused_old, unused_needed};

`ifndef SYNTHESIS
  // A response stays until it is taken: the core may be stuck behind a load.
  a_response_stays :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      rsp_valid_o && !rsp_ready_i |=> rsp_valid_o && $stable(rsp_output_o));

  // No command waits for ever: a test ends.
  logic [2:0] tested_q;
  always_ff @(posedge clk_i) tested_q <= testing_q && !box_axis ? tested_q + 3'd1 : '0;
  a_test_ends :
  assert property (@(posedge clk_i) disable iff (!rst_ni) tested_q < 3'd6);
`endif

endmodule
