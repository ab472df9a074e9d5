// Ray against triangle, exactly: the core's Triangle::intersect and Hit::new.
//
// Moeller and Trumbore's test in integers, with two multipliers and a divider, one step a cycle. With e1 and e2
// the edges from vertex 0, d the direction and f from vertex 0 to the origin (in units of 2^-6), magnitudes are
//
//   e1, e2 2^24   d 2^30   f 2^31   p = d x e2 2^55   q = f x e1 2^56
//   det = e1.p 3·2^79   u = f.p and v = d.q 3·2^86   time's numerator n = e2.q 3·2^80
//
// A component of p or q is a difference of two products, so one a cycle; a term of a scalar product with p or q is
// two, of their lower 29 and upper 29 bits. Signs are turned so that det is positive. Then:
//
//   inside  0 <= u, 0 <= v, u + v <= 64 det, det != 0
//   t       n · 2^30 / det rounded up; a representable time is exceeded by it if and only if by the exact one
//   u, v    u · 2^24 / det and v · 2^24 / det rounded down
//
// Handshake   Words of a triangle's record come by word_valid_i and word_index_i, 0 to 4, while the unit is idle;
//             off_grid_o holds from the cycle after the last. start_i begins the test, ray, interval and tie_wins_i
//             must stay until done_o, which is high for a cycle; the results stay until the next start.
//             hit_o: inside the interval, and earlier than its end or tie_wins_i.
// Latency     from start_i to done_o: 20 cycles if the line misses the triangle, 63 if it is met outside of the
//             interval, 129 for a hit.
// Cut paths   outputs are registers, but those to the multipliers.
module xy_triangle_test (
    input  logic                                  clk_i,
    input  logic                                  rst_ni,
    input  logic                                  clear_i,

    input  logic                                  word_valid_i,
    input  logic [2:0]                            word_index_i,
    input  logic [63:0]                           word_i,
    output logic                                  off_grid_o,

    input  logic                                  start_i,
    input  logic [2:0][31:0]                      origin_i,
    input  logic [2:0][31:0]                      direction_i,
    input  logic [xy_trace_pkg::TimeWidth-1:0]    t_min_i,
    input  logic [xy_trace_pkg::TimeWidth-1:0]    t_max_i,
    input  logic                                  tie_wins_i,

    output xy_trace_pkg::factors_t                factors_a_o,
    output xy_trace_pkg::factors_t                factors_b_o,
    input  logic [xy_trace_pkg::ProductWidth-1:0] product_a_i,
    input  logic [xy_trace_pkg::ProductWidth-1:0] product_b_i,

    output logic                                  done_o,
    output logic                                  hit_o,
    output logic [xy_trace_pkg::TimeWidth-1:0]    t_o,
    output logic [30:0]                           u_o,
    output logic [30:0]                           v_o
);
  localparam int unsigned CoordBits  = xy_pkg::CoordWidth;
  localparam int unsigned EdgeWidth  = CoordBits + 1;
  localparam int unsigned CrossWidth = 58;
  localparam int unsigned HalfWidth  = 29;
  localparam int unsigned SumWidth   = 90;
  localparam int unsigned DetWidth   = 81;

  // --- The triangle ---

  logic [2:0][CoordBits-1:0] v0_q;
  logic [2:0][EdgeWidth-1:0] e1_q, e2_q;
  logic [2:0][31:0]          f_q;
  logic                      off_grid_q;

  logic [CoordBits-1:0] word_a, word_b;
  logic [EdgeWidth-1:0] wide_a, wide_b;
  logic                 off_a, off_b;
  assign word_a = word_i[CoordBits-1:0];
  assign word_b = word_i[32+CoordBits-1:32];
  assign wide_a = {word_a[CoordBits-1], word_a};
  assign wide_b = {word_b[CoordBits-1], word_b};
  assign off_a  = word_i[31:CoordBits] != {32 - CoordBits{word_a[CoordBits-1]}};
  assign off_b  = word_i[63:32+CoordBits] != {32 - CoordBits{word_b[CoordBits-1]}};

  logic [2:0][EdgeWidth-1:0] wide_v0;
  for (genvar i = 0; i < 3; i++) begin : gen_v0
    assign wide_v0[i] = {v0_q[i][CoordBits-1], v0_q[i]};
  end

  always_ff @(posedge clk_i) begin
    if (word_valid_i) begin
      off_grid_q <= off_a || (off_b && word_index_i != 3'd4) || (off_grid_q && word_index_i != 3'd0);
      unique case (word_index_i)
        3'd0: begin
          v0_q[0] <= word_a;
          v0_q[1] <= word_b;
          f_q[0]  <= origin_i[0] - {wide_a[EdgeWidth-1], wide_a, 6'b0};
          f_q[1]  <= origin_i[1] - {wide_b[EdgeWidth-1], wide_b, 6'b0};
        end
        3'd1: begin
          v0_q[2] <= word_a;
          f_q[2]  <= origin_i[2] - {wide_a[EdgeWidth-1], wide_a, 6'b0};
          e1_q[0] <= wide_b - wide_v0[0];
        end
        3'd2: begin
          e1_q[1] <= wide_a - wide_v0[1];
          e1_q[2] <= wide_b - wide_v0[2];
        end
        3'd3: begin
          e2_q[0] <= wide_a - wide_v0[0];
          e2_q[1] <= wide_b - wide_v0[1];
        end
        default: e2_q[2] <= wide_a - wide_v0[2];
      endcase
    end
  end

  assign off_grid_o = off_grid_q;

  // --- Products, in six groups of three ---

  typedef enum logic [2:0] {
    GroupP,
    GroupDet,
    GroupU,
    GroupQ,
    GroupV,
    GroupT
  } group_e;

  typedef enum logic [2:0] {
    Idle,
    Multiply,
    DivideT,
    Decide,
    DivideU,
    DivideV
  } state_e;

  state_e     state_q;
  logic [4:0] step_q;       // of Multiply
  group_e     group_q, group1_q, group2_q, group3_q;
  logic [1:0] axis_q, axis1_q, axis2_q;
  logic       last3_q;

  logic [1:0] second, third;  // the axes after this one
  assign second = axis_q == 2'd2 ? 2'd0 : axis_q + 2'd1;
  assign third  = axis_q == 2'd0 ? 2'd2 : axis_q - 2'd1;

  logic [2:0][CrossWidth-1:0] cross_q;  // p, then q

  logic [2:0][EdgeWidth-1:0] edges;
  logic [2:0][31:0]          vectors;
  logic                      is_cross;
  assign is_cross = group_q == GroupP || group_q == GroupQ;
  assign edges    = group_q == GroupP || group_q == GroupT ? e2_q : e1_q;
  assign vectors  = group_q == GroupP || group_q == GroupV ? direction_i : f_q;

  logic [31:0]           scalar;
  logic [CrossWidth-1:0] normal;
  assign scalar = group_q == GroupDet || group_q == GroupT ? 32'(signed'(edges[axis_q])) : vectors[axis_q];
  assign normal  = cross_q[axis_q];

  always_comb begin
    factors_a_o.a = scalar;
    factors_b_o.a = scalar;
    factors_a_o.b = {1'b0, normal[HalfWidth-1:0]};
    factors_b_o.b = {normal[CrossWidth-1], normal[CrossWidth-1:HalfWidth]};
    if (is_cross) begin
      factors_a_o.a = vectors[second];
      factors_b_o.a = vectors[third];
      factors_a_o.b = 30'(signed'(edges[third]));
      factors_b_o.b = 30'(signed'(edges[second]));
    end
  end

  always_ff @(posedge clk_i) begin
    group1_q <= group_q;
    group2_q <= group1_q;
    group3_q <= group2_q;
    axis1_q  <= axis_q;
    axis2_q  <= axis1_q;
    last3_q  <= axis2_q == 2'd2;
  end

  // --- Two cycles later: differences and sums ---

  logic [CrossWidth-1:0] difference;
  assign difference = product_a_i[CrossWidth-1:0] - product_b_i[CrossWidth-1:0];

  logic [SumWidth-1:0] term, sum_q;
  assign term = SumWidth'(signed'(product_a_i)) + {product_b_i[SumWidth-HalfWidth-1:0], {HalfWidth{1'b0}}};

  always_ff @(posedge clk_i) begin
    sum_q <= (axis2_q == 2'd0 ? '0 : sum_q) + term;
  end

  for (genvar i = 0; i < 3; i++) begin : gen_cross
    always_ff @(posedge clk_i) begin
      if ((group2_q == GroupP || group2_q == GroupQ) && axis2_q == 2'(i)) cross_q[i] <= difference;
    end
  end

  logic unused_product;
  assign unused_product = product_b_i[xy_trace_pkg::ProductWidth-1];

  // --- And one later: signs turned ---

  logic                flip_q, turn;
  logic [SumWidth-1:0] turned;
  assign turn   = group3_q == GroupDet ? sum_q[SumWidth-1] : flip_q;
  assign turned = (sum_q ^ {SumWidth{turn}}) + {{SumWidth - 1{1'b0}}, turn};

  logic [DetWidth-1:0] det_q;
  logic [SumWidth-1:0] u_q, v_q, n_q, room_q;

  always_ff @(posedge clk_i) begin
    if (last3_q && state_q == Multiply) begin
      unique case (group3_q)
        GroupDet: begin
          det_q  <= turned[DetWidth-1:0];
          flip_q <= turn;
        end
        GroupU:  u_q <= turned;
        GroupV:  v_q <= turned;
        GroupT:  n_q <= turned;
        default: ;
      endcase
    end
    // What is left of 64 det.
    room_q <= {{SumWidth - DetWidth - 6{1'b0}}, det_q, 6'b0} - u_q;
  end

  logic [SumWidth-1:0] rest;
  logic                in_triangle;
  assign rest   = room_q - v_q;
  assign in_triangle = det_q != '0 && !u_q[SumWidth-1] && !v_q[SumWidth-1] && !rest[SumWidth-1];

  // --- Quotients ---

  logic [SumWidth-1:0] time_magnitude;
  assign time_magnitude = (n_q ^ {SumWidth{n_q[SumWidth-1]}}) + {{SumWidth - 1{1'b0}}, n_q[SumWidth-1]};

  logic        divide, divided, inexact;
  logic [5:0]  steps;
  logic [86:0] dividend;
  logic [37:0] quotient;
  xy_divider u_divider (
      .clk_i,
      .rst_ni,
      .start_i   (divide),
      .steps_i   (steps),
      .dividend_i(dividend),
      .divisor_i (det_q),
      .done_o    (divided),
      .quotient_o(quotient),
      .inexact_o (inexact)
  );

  logic unused_magnitude;
  assign unused_magnitude = ^time_magnitude[SumWidth-1:87];

  // Rounded up: towards zero if negative.
  logic [38:0] rounded_up;
  always_comb begin
    rounded_up = {1'b0, quotient} + {38'b0, inexact};
    if (n_q[SumWidth-1]) rounded_up = -{1'b0, quotient};
  end

  // One that does not fit has its highest bit set, and is farther than any time.
  logic [38:0] t_q;
  logic        in_interval, wins;
  assign in_interval = $signed(t_q) > 39'(signed'(t_min_i)) && $signed(t_q) <= 39'(signed'(t_max_i));
  assign wins   = tie_wins_i || t_q != 39'(signed'(t_max_i));

  // --- Control ---

  localparam logic [4:0] StepInside = 5'd18;  // u and v are there
  localparam logic [4:0] StepTime   = 5'd21;  // the time's numerator is

  always_comb begin
    divide   = 1'b0;
    steps    = 6'd32;
    dividend = u_q[86:0];
    unique case (state_q)
      Multiply: begin
        divide   = step_q == StepTime;
        steps    = 6'd38;
        dividend = time_magnitude[86:0];
      end
      Decide:  divide = in_interval && wins;
      DivideU: begin
        divide   = divided;
        dividend = v_q[86:0];
      end
      default: ;
    endcase
  end

  logic done_q, hit_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q <= Idle;
      done_q  <= 1'b0;
    end else if (clear_i) begin
      state_q <= Idle;
      done_q  <= 1'b0;
    end else begin
      done_q <= 1'b0;
      unique case (state_q)
        Idle: if (start_i) state_q <= Multiply;
        Multiply: begin
          if (step_q == StepInside && !in_triangle) begin
            state_q <= Idle;
            done_q  <= 1'b1;
          end else if (step_q == StepTime) begin
            state_q <= DivideT;
          end
        end
        DivideT: if (divided) state_q <= Decide;
        Decide: begin
          state_q <= in_interval && wins ? DivideU : Idle;
          done_q  <= !(in_interval && wins);
        end
        DivideU: if (divided) state_q <= DivideV;
        DivideV: begin
          if (divided) begin
            state_q <= Idle;
            done_q  <= 1'b1;
          end
        end
        default: state_q <= Idle;
      endcase
    end
  end

  logic [30:0] u_part_q, v_part_q;

  always_ff @(posedge clk_i) begin
    if (state_q == Multiply) begin
      step_q <= step_q + 5'd1;
      axis_q <= second;
      if (axis_q == 2'd2) begin
        unique case (group_q)
          GroupP:   group_q <= GroupDet;
          GroupDet: group_q <= GroupU;
          GroupU:   group_q <= GroupQ;
          GroupQ:   group_q <= GroupV;
          default:  group_q <= GroupT;
        endcase
      end
    end
    if (start_i) begin
      step_q  <= '0;
      axis_q  <= '0;
      group_q <= GroupP;
      hit_q   <= 1'b0;
    end
    if (state_q == DivideT && divided) t_q <= rounded_up;
    if (state_q == Decide) hit_q <= in_interval && wins;
    if (state_q == DivideU && divided) u_part_q <= quotient[30:0];
    if (state_q == DivideV && divided) v_part_q <= quotient[30:0];
  end

  assign done_o = done_q;
  assign hit_o  = hit_q;
  assign t_o    = t_q[xy_trace_pkg::TimeWidth-1:0];
  assign u_o    = u_part_q;
  assign v_o    = v_part_q;

`ifndef SYNTHESIS
  // A weight is at most 1, so its quotient fits.
  a_weight_fits :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      (state_q == DivideU || state_q == DivideV) && divided |-> quotient <= 38'h4000_0000);
  // The widths in the header: what is cut off is copies of the sign.
  a_difference_fits :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      state_q == Multiply && step_q > 5'd1 && !off_grid_q && (group2_q == GroupP || group2_q == GroupQ)
      |-> $signed(product_a_i) - $signed(product_b_i) == xy_trace_pkg::ProductWidth'($signed(difference)));
  a_determinant_fits :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      state_q == Multiply && last3_q && group3_q == GroupDet && step_q > 5'd3
      |-> turned[SumWidth-1:DetWidth] == '0);
`endif

endmodule
