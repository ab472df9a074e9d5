// Ray against box, one axis a cycle: the core's Slabs::new, Slabs::step and Slabs::entry.
//
//   T    distances to the near and the far plane, in units of 2^-6, to the multipliers
//   T+2  products with the mantissa, rounded outward: offsets; from the node's offsets if stepped
//   T+3  box_o; offsets shifted to times, which the axes have in common
//   T+4  latest entry and earliest exit over the axes
//   T+5  verdict_valid_o, hit_o, entry_o and outside_o, if T was the box' last axis
//
// step_i low   planes in grid units, counted from the origin; box_o has the grid of node_i
// step_i high  a child of a quantized pair: planes some cells inward of the node's; box_o has the child's
//              grid, and outside_o says that the child is not in its node
//
// Handshake   clear_i forgets what is on its way. valid_i gives an axis, first_i the first and last_i the last one of a box; axes of a box come in
//             consecutive cycles. Nothing waits.
// Latency     3 cycles to offsets, 5 to a verdict. Throughput: an axis a cycle.
// Cut paths   outputs are registers, but those to the multipliers.
//
// Times are cut to 36 bits, far beyond the times that a ray may have. A ray moves by more than half a unit
// along one axis, so the latest entry is not below -2^32 and a verdict's entry is not cut.
module xy_box_test (
    input  logic                                   clk_i,
    input  logic                                   rst_ni,
    input  logic                                   clear_i,

    input  logic                                   valid_i,
    input  logic                                   first_i,
    input  logic                                   last_i,
    input  logic                                   step_i,
    input  xy_trace_pkg::reciprocal_t              reciprocal_i,
    input  logic [31:0]                            origin_i,
    input  logic [24:0]                            low_plane_i,
    input  logic [24:0]                            high_plane_i,
    input  logic                                   modulo_i,
    input  logic [5:0]                             low_code_i,
    input  logic [5:0]                             high_code_i,
    input  xy_trace_pkg::state_t                   node_i,
    input  logic [xy_trace_pkg::TimeWidth-1:0]     t_min_i,
    input  logic [xy_trace_pkg::TimeWidth-1:0]     t_max_i,

    output xy_trace_pkg::factors_t                 near_factors_o,
    output xy_trace_pkg::factors_t                 far_factors_o,
    input  logic [xy_trace_pkg::ProductWidth-1:0]  near_product_i,
    input  logic [xy_trace_pkg::ProductWidth-1:0]  far_product_i,

    output xy_trace_pkg::state_t                   box_o,
    output logic                                   verdict_valid_o,
    output logic                                   outside_o,
    output logic                                   hit_o,
    output logic [xy_trace_pkg::TimeWidth-1:0]     entry_o
);
  localparam int unsigned CutWidth = xy_trace_pkg::TimeWidth + 1;
  localparam logic [CutWidth-1:0] Before = {1'b1, {CutWidth - 1{1'b0}}};
  localparam logic [CutWidth-1:0] After  = {1'b0, {CutWidth - 1{1'b1}}};

  // --- T: distances and mantissas ---

  // Along the ray: planes change places and distances sign with the direction.
  logic [31:0] near_plane, far_plane, to_near, to_far;
  logic        flip;
  assign flip        = reciprocal_i.negative;
  assign near_plane  = 32'(signed'({flip ? high_plane_i : low_plane_i, 6'b0}));
  assign far_plane   = 32'(signed'({flip ? low_plane_i : high_plane_i, 6'b0}));
  assign to_near     = near_plane - origin_i;
  assign to_far      = far_plane - origin_i;

  logic       contained;
  logic [6:0] below, above;
  xy_trace_pkg::grid_t      child_grid;
  xy_pair_decode u_decode (
      .modulo_i,
      .low_i    (low_code_i),
      .high_i   (high_code_i),
      .parent_i (node_i.grid),
      .inside_o (contained),
      .below_o  (below),
      .above_o  (above),
      .child_o  (child_grid)
  );

  logic [31:0] near_cells, far_cells, near_x, far_x;
  assign near_cells = {19'b0, flip ? above : below, 6'b0} << node_i.grid.scale;
  assign far_cells  = {19'b0, flip ? below : above, 6'b0} << node_i.grid.scale;
  assign near_x     = step_i ? near_cells : (to_near ^ {32{flip}}) + {31'b0, flip};
  assign far_x      = step_i ? far_cells : (to_far ^ {32{flip}}) + {31'b0, flip};

  // Outward: the mantissa is rounded up where the product moves outward by that. Of a direction of
  // zero it is 1.
  logic near_up, far_up;
  assign near_up = reciprocal_i.inexact && !step_i && near_x[31];
  assign far_up  = reciprocal_i.inexact && !step_i && !far_x[31];

  logic [24:0] near_mantissa, far_mantissa;
  assign near_mantissa = reciprocal_i.zero ? 25'h100_0000
                                           : {1'b0, reciprocal_i.mantissa} + {24'b0, near_up};
  assign far_mantissa  = reciprocal_i.zero ? 25'h100_0000
                                           : {1'b0, reciprocal_i.mantissa} + {24'b0, far_up};
  assign near_factors_o = {near_x, 5'b0, near_mantissa};
  assign far_factors_o  = {far_x, 5'b0, far_mantissa};

  // --- What goes along with the products ---

  typedef struct packed {
    logic        first;
    logic        last;
    logic        zero;
    logic [4:0]  shift;
    logic        outside;
    xy_trace_pkg::grid_t       grid;
  } axis_t;

  logic        [3:0]       valid_q;
  axis_t                   axis1_q, axis2_q, axis3_q;
  logic                    step1_q, step2_q;
  logic        [1:0][31:0] node1_q, node2_q;
  logic                    last4_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) valid_q <= '0;
    else if (clear_i) valid_q <= '0;
    else valid_q <= {valid_q[2:0], valid_i};
  end

  always_ff @(posedge clk_i) begin
    axis1_q.first   <= first_i;
    axis1_q.last    <= last_i;
    axis1_q.zero    <= reciprocal_i.zero;
    axis1_q.shift   <= reciprocal_i.shift;
    axis1_q.outside <= step_i && !contained;
    axis1_q.grid    <= step_i ? child_grid : node_i.grid;

    axis2_q <= axis1_q;
    axis3_q <= axis2_q;
    step1_q <= step_i;
    step2_q <= step1_q;
    node1_q <= {node_i.far_offset, node_i.near_offset};
    node2_q <= node1_q;
    last4_q <= axis3_q.last;
  end

  // --- T+2: offsets ---

  // Products are in units of 2^-30; a far one is rounded up, or a step down and subtracted.
  logic [31:0] near_floor, far_floor, near_d, far_d, near_q, far_q;
  logic        far_carry;
  assign near_floor = near_product_i[55:24];
  assign far_floor  = far_product_i[55:24];
  assign far_carry  = step2_q || far_product_i[23:0] != '0;
  assign near_d     = near_floor + (step2_q ? node2_q[0] : '0);
  assign far_d      = (far_floor ^ {32{step2_q}}) + (step2_q ? node2_q[1] : '0) + {31'b0, far_carry};

  always_ff @(posedge clk_i) begin
    near_q <= near_d;
    far_q  <= far_d;
  end

  assign box_o = {axis3_q.grid, near_q, far_q};

  logic unused_product;
  assign unused_product = ^{near_product_i[xy_trace_pkg::ProductWidth-1:56], near_product_i[23:0],
                            far_product_i[xy_trace_pkg::ProductWidth-1:56]};

  // --- T+3: times ---

  logic [CutWidth-1:0] near_time, far_time;
  xy_time_shift u_near_time (.offset_i(near_q), .shift_i(axis3_q.shift), .time_o(near_time));
  xy_time_shift u_far_time (.offset_i(far_q), .shift_i(axis3_q.shift), .time_o(far_time));

  // Where the ray does not move, the origin has to be between the planes.
  logic [CutWidth-1:0] near_edge, far_edge;
  always_comb begin
    near_edge = near_time;
    far_edge  = far_time;
    if (axis3_q.zero) begin
      near_edge = near_q[31] || near_q == '0 ? Before : After;
      far_edge  = far_q[31] ? Before : After;
    end
  end

  logic                       outside_q;
  logic signed [CutWidth-1:0] enter_q, leave_q;
  always_ff @(posedge clk_i) begin
    if (valid_q[2]) begin
      outside_q <= axis3_q.outside || (outside_q && !axis3_q.first);
      if (axis3_q.first || $signed(near_edge) > enter_q) enter_q <= near_edge;
      if (axis3_q.first || $signed(far_edge) < leave_q) leave_q <= far_edge;
    end
  end

  // --- T+4: verdict ---

  logic signed [CutWidth-1:0] t_min, t_max;
  assign t_min = CutWidth'(signed'(t_min_i));
  assign t_max = CutWidth'(signed'(t_max_i));

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) verdict_valid_o <= 1'b0;
    else if (clear_i) verdict_valid_o <= 1'b0;
    else verdict_valid_o <= valid_q[3] && last4_q;
  end

  always_ff @(posedge clk_i) begin
    outside_o <= outside_q;
    hit_o     <= enter_q <= leave_q && leave_q > t_min && enter_q <= t_max;
    entry_o   <= enter_q[xy_trace_pkg::TimeWidth-1:0];
  end

endmodule
