// Traces a region of rays through a tree and writes a hit record for each: the core's `trace`, one ray at a time.
//
// Nodes have 64 bytes (two exact boxes) or are quantized pairs of 16 bytes, whose planes are found by steps
// (the core's Method::Incremental). Children are searched in the order in which the ray enters them, and what
// waits is on a stack of one entry a level.
//
//   xy_line_cache --> words --> xy_ray_load --> xy_reciprocal, one an axis
//                          \--> xy_box_test ------\
//                           \-> xy_triangle_test --+-- two xy_multipliers
//                                    |
//   state memory: a node's grid     best hit --> xy_hit_writer
//   and plane offsets, two nodes
//   a level, an axis a row; the
//   fourth row holds a node that waits
//
// Handshake   start_i begins a job, whose parameters must stay while busy_o. done_o is high in its last cycle.
//             error_o and error_index_o say why it ended early, if it did; they and hits_o stay until the next
//             start. Hit records before that are written. clear_i gives a job up; no access may be under way.
// Latency     in cycles, with every word in the cache; a miss adds 2 and what memory takes:
//               a ray   6 to read, the longest of its reciprocals', 11 for the root's boxes, 3 for its record, and
//                       1 more for each line of records
//               node    12 (quantized), 13 (64 bytes)
//               pop     2, and 1 to find the stack empty
//               leaf    8 an entry and the triangle test's 20, 63 or 129
// Memory      It asks only for records below the counts that it is given: whoever starts it sees to it that the
//             regions have room for them. Regions begin on a line.
// Errors      As the core's, but that a node Depth levels below the root is corrupt however few nodes wait. The
//             index is that of the ray, node, leaf table entry or triangle.
module xy_traverser #(
    parameter int unsigned Depth      = 95,   // levels of nodes, the core's MAX_DEPTH
    parameter int unsigned CacheWidth = 4,    // 2^CacheWidth lines
    parameter int unsigned CacheBlock = 0     // whether those are in block memory
) (
    input  logic                       clk_i,
    input  logic                       rst_ni,
    input  logic                       clear_i,

    input  logic                       start_i,
    output logic                       busy_o,
    output logic                       done_o,

    input  logic                       quantized_i,
    input  logic                       modulo_i,
    input  logic                       any_i,
    input  logic [31:0]                ray_count_i,
    input  logic [31:0]                node_count_i,
    input  logic [31:0]                entry_count_i,
    input  logic [31:0]                triangle_count_i,
    input  logic [31:0]                rays_base_i,
    input  logic [31:0]                nodes_base_i,
    input  logic [31:0]                entries_base_i,
    input  logic [31:0]                triangles_base_i,
    input  logic [31:0]                hits_base_i,
    input  xy_pkg::box_t               root_box_i,
    input  logic [31:0]                root_index_i,
    input  logic [7:0]                 root_count_i,  // of the root if it is a leaf, else 0

    output logic [31:0]                hits_o,
    output xy_trace_pkg::trace_error_e error_o,
    output logic [31:0]                error_index_o,
    output logic                       node_fetch_o,
    output logic                       box_test_o,
    output logic                       triangle_test_o,

    output logic                       rd_valid_o,
    input  logic                       rd_ready_i,
    output logic [31:0]                rd_addr_o,
    output xy_regs_pkg::region_id_e    rd_region_o,  // where that is to be
    input  logic                       rsp_valid_i,
    input  logic [511:0]               rsp_data_i,

    output logic                       wr_valid_o,
    input  logic                       wr_ready_i,
    output logic [31:0]                wr_addr_o,
    output logic [511:0]               wr_data_o,
    output logic [63:0]                wr_strb_o,
    output logic                       wr_last_o
);

  localparam int unsigned TimeWidth  = xy_trace_pkg::TimeWidth;
  localparam int unsigned Bits       = xy_pkg::CoordWidth;
  localparam int unsigned LevelWidth = $clog2(Depth + 1);

  typedef enum logic [4:0] {
    Idle,
    PlaceRoot,      // the root's grid, once a job
    ReadRay,        // five words
    LastRayWord,
    Prepare,        // reciprocals
    TestRoot,       // both its boxes: the exact one and, quantized, the one of its grid
    AwaitRoot,
    FetchNode,
    TestNode,
    AwaitNode,
    Pop,
    Take,
    FetchEntry,
    DecodeEntry,
    ReadTriangle,   // five words
    LastTriangleWord,
    AwaitTriangle,
    WriteHit,
    Flush
  } state_e;

  state_e     state_q;
  logic [2:0] step_q;  // within a state that takes several words or axes

  // --- Words from memory ---

  logic        word_valid, word_ready, taken;
  logic [28:0] word_addr;
  logic [63:0] data;

  logic [28:0] ray_ptr_q, triangle_ptr_q;  // in words
  logic [29:0] item_ptr_q;                 // of a node or a leaf table entry, in 4 bytes

  xy_line_cache #(
      .IndexWidth(CacheWidth),
      .Block     (CacheBlock != 0)
  ) u_cache (
      .clk_i,
      .rst_ni,
      .clear_i     (clear_i || start_i),
      .word_valid_i(word_valid),
      .word_ready_o(word_ready),
      .word_addr_i (word_addr),
      .data_o      (data),
      .rd_valid_o,
      .rd_ready_i,
      .rd_addr_o,
      .rsp_valid_i,
      .rsp_data_i
  );

  assign taken = word_valid && word_ready;

  // What was asked for in the last cycle.
  logic       ray_word_q, triangle_word_q;
  logic [2:0] word_index_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      ray_word_q      <= 1'b0;
      triangle_word_q <= 1'b0;
    end else begin
      ray_word_q      <= taken && state_q == ReadRay;
      triangle_word_q <= taken && state_q == ReadTriangle;
    end
  end
  always_ff @(posedge clk_i) word_index_q <= step_q;

  // --- The ray ---

  logic [2:0][31:0]                       origin, direction;
  logic [TimeWidth-1:0]                   t_min, ray_t_max;
  logic                                   ray_good;
  xy_ray_load u_ray (
      .clk_i,
      .word_valid_i(ray_word_q),
      .word_index_i(word_index_q),
      .word_i      (data),
      .good_o      (ray_good),
      .origin_o    (origin),
      .direction_o (direction),
      .t_min_o     (t_min),
      .t_max_o     (ray_t_max)
  );

  logic [2:0]       axis_ready;
  logic [2:0][31:0] reciprocals;  // three reciprocal_t
  for (genvar i = 0; i < 3; i++) begin : gen_axis
    xy_reciprocal u_reciprocal (
        .clk_i,
        .rst_ni,
        .start_i     (state_q == LastRayWord),
        .component_i (direction[i]),
        .done_o      (axis_ready[i]),
        .reciprocal_o(reciprocals[i])
    );
  end

  // --- The best hit ---

  logic                 hit_q;
  logic [TimeWidth-1:0] t_max_q;
  logic [31:0]          holder_q;
  logic [30:0]          u_q, v_q;

  // --- The root ---

  logic             place_done, root_inverted;
  logic [2:0][17:0] root_grid;    // three grid_t
  logic [2:0][24:0] root_low, root_high;
  xy_root_grid u_root (
      .clk_i,
      .rst_ni,
      .start_i     (start_i),
      .box_i       (root_box_i),
      .done_o      (place_done),
      .inverted_o  (root_inverted),
      .grid_o      (root_grid),
      .low_plane_o (root_low),
      .high_plane_o(root_high)
  );

  // --- Where the search is ---

  logic [31:0]           index_q;     // of the node or the entry at hand
  logic [7:0]            count_q;     // entries of the leaf from there on, 0 if up to the mark
  logic [LevelWidth-1:0] level_q;
  logic                  slot_q;
  logic [31:0]           nodes_left_q, entries_left_q;
  logic                  last_entry_q;
  logic [31:0]           prim_q;
  logic [31:0]           ray_q;
  logic [LevelWidth-1:0] waiting_q;   // how many nodes wait

  // --- Box tests ---

  // An axis a cycle: of child 0, then of child 1. The root's two boxes are like children.
  logic       issue, issue_child;
  logic [1:0] issue_axis;
  logic [2:0] issue_step;
  assign issue       = state_q == TestRoot
                    || (state_q == TestNode && (quantized_i || (step_q != 3'd0 && step_q != 3'd7)));
  assign issue_step  = state_q == TestNode && !quantized_i ? step_q - 3'd1 : step_q;
  assign issue_child = issue_step >= 3'd3;
  assign issue_axis  = issue_child ? 2'(issue_step - 3'd3) : issue_step[1:0];

  // A 64-byte node's words pass by; a corner's coordinates are in the last three.
  // An axis' coordinates: of a 64-byte node, of the root's box, and of a quantized child.
  logic [63:0]     before_q, long_before_q;
  logic [31:0]     low_corner, high_corner;
  logic [Bits-1:0] root_low_corner, root_high_corner;
  logic [5:0]      low_code, high_code;
  always_ff @(posedge clk_i) begin
    if (state_q == TestNode) begin
      before_q      <= data;
      long_before_q <= before_q;
    end
  end
  always_comb begin
    unique case (issue_axis)
      2'd0: begin
        low_corner            = before_q[31:0];
        high_corner           = data[63:32];
        root_low_corner       = root_box_i.lo.x;
        root_high_corner      = root_box_i.hi.x;
        {high_code, low_code} = data[11:0];
      end
      2'd1: begin
        low_corner            = long_before_q[63:32];
        high_corner           = data[31:0];
        root_low_corner       = root_box_i.lo.y;
        root_high_corner      = root_box_i.hi.y;
        {high_code, low_code} = data[23:12];
      end
      default: begin
        low_corner            = long_before_q[31:0];
        high_corner           = before_q[63:32];
        root_low_corner       = root_box_i.lo.z;
        root_high_corner      = root_box_i.hi.z;
        {high_code, low_code} = data[35:24];
      end
    endcase
  end

  logic corner_off_grid;
  assign corner_off_grid = low_corner[31:Bits] != {32 - Bits{low_corner[Bits-1]}}
                        || high_corner[31:Bits] != {32 - Bits{high_corner[Bits-1]}};

  logic [24:0] low_plane, high_plane;
  always_comb begin
    low_plane  = low_corner[24:0];
    high_plane = high_corner[24:0];
    if (state_q == TestRoot) begin
      if (issue_child) begin
        low_plane  = root_low[issue_axis];
        high_plane = root_high[issue_axis];
      end else begin
        low_plane  = 25'(signed'(root_low_corner));
        high_plane = 25'(signed'(root_high_corner));
      end
    end
  end

  xy_trace_pkg::state_t     state_row, issue_state, box_state;
  xy_trace_pkg::factors_t   near_factors, far_factors, factors_a, factors_b, box_a, box_b;
  logic [xy_trace_pkg::ProductWidth-1:0] product_a, product_b;
  logic                     verdict, verdict_hit, verdict_outside;
  logic [TimeWidth-1:0]     verdict_entry;
  assign issue_state = state_q == TestRoot ? {root_grid[issue_axis], 64'b0} : state_row;

  xy_box_test u_box (
      .clk_i,
      .rst_ni,
      .clear_i,
      .valid_i        (issue),
      .first_i        (issue_axis == 2'd0),
      .last_i         (issue_axis == 2'd2),
      .step_i         (state_q == TestNode && quantized_i),
      .reciprocal_i   (reciprocals[issue_axis]),
      .origin_i       (origin[issue_axis]),
      .low_plane_i    (low_plane),
      .high_plane_i   (high_plane),
      .modulo_i,
      .low_code_i     (low_code),
      .high_code_i    (high_code),
      .node_i         (issue_state),
      .t_min_i        (t_min),
      .t_max_i        (t_max_q),
      .near_factors_o (near_factors),
      .far_factors_o  (far_factors),
      .near_product_i (product_a),
      .far_product_i  (product_b),
      .box_o          (box_state),
      .verdict_valid_o(verdict),
      .outside_o      (verdict_outside),
      .hit_o          (verdict_hit),
      .entry_o        (verdict_entry)
  );

  // --- Triangle tests ---

  logic                 triangle_done, triangle_hit, off_grid;
  logic [TimeWidth-1:0] triangle_t;
  logic [30:0]          triangle_u, triangle_v;
  xy_triangle_test u_triangle (
      .clk_i,
      .rst_ni,
      .clear_i     (clear_i || state_q == Flush),
      .word_valid_i(triangle_word_q),
      .word_index_i(word_index_q),
      .word_i      (data),
      .off_grid_o  (off_grid),
      .start_i     (state_q == LastTriangleWord),
      .origin_i    (origin),
      .direction_i (direction),
      .t_min_i     (t_min),
      .t_max_i     (t_max_q),
      .tie_wins_i  (!hit_q || prim_q < holder_q),
      .factors_a_o (factors_a),
      .factors_b_o (factors_b),
      .product_a_i (product_a),
      .product_b_i (product_b),
      .done_o      (triangle_done),
      .hit_o       (triangle_hit),
      .t_o         (triangle_t),
      .u_o         (triangle_u),
      .v_o         (triangle_v)
  );

  // Never both at once.
  assign box_a = state_q == AwaitTriangle ? factors_a : near_factors;
  assign box_b = state_q == AwaitTriangle ? factors_b : far_factors;
  xy_multiplier u_multiplier_a (.clk_i, .factors_i(box_a), .product_o(product_a));
  xy_multiplier u_multiplier_b (.clk_i, .factors_i(box_b), .product_o(product_b));

  // --- What is known of child 0 while child 1 is tested ---

  xy_trace_pkg::child_t child, first_q;
  logic                 count_long, first_long_q;  // a leaf size that no builder writes
  assign child.index = quantized_i ? {5'b0, data[63:37]} : data[31:0];
  assign child.leaf  = quantized_i ? data[36] : data[63:32] != '0;
  assign child.count = quantized_i ? 8'd0 : data[39:32];
  assign count_long  = !quantized_i && data[63:40] != '0;

  logic                 second_q;   // child 1's verdict is the next
  logic                 first_hit_q, broken_q;
  logic [TimeWidth-1:0] first_entry_q;

  always_ff @(posedge clk_i) begin
    if (state_q == TestNode && step_q == (quantized_i ? 3'd0 : 3'd6)) begin
      first_q      <= child;
      first_long_q <= count_long;
    end
    if (state_q == TestRoot || state_q == FetchNode) begin
      second_q <= 1'b0;
      broken_q <= 1'b0;
    end else if (verdict) begin
      second_q      <= 1'b1;
      first_hit_q   <= verdict_hit;
      first_entry_q <= verdict_entry;
    end
    if (state_q == TestNode && issue && !quantized_i && corner_off_grid) broken_q <= 1'b1;
    if (verdict && verdict_outside) broken_q <= 1'b1;
  end

  // Both verdicts: which child is next, and which waits.
  logic both, near_second, corrupt_pair;
  assign both         = first_hit_q && verdict_hit;
  assign near_second  = verdict_hit && (!first_hit_q || $signed(first_entry_q) > $signed(verdict_entry));
  assign corrupt_pair = broken_q || verdict_outside || (first_hit_q && first_long_q)
                     || (verdict_hit && count_long);

  logic verdicts;
  assign verdicts = verdict && second_q;

  // --- States and nodes that wait ---

  logic [LevelWidth-1:0] below;      // level of the boxes that are tested
  logic [2:0][2:0]       write_q;    // child and axis of the boxes in the pipeline
  logic [2:0]            write_valid_q;
  assign below = state_q == TestRoot || state_q == AwaitRoot ? '0 : level_q + 1'b1;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) write_valid_q <= '0;
    else if (clear_i) write_valid_q <= '0;
    else write_valid_q <= {write_valid_q[1:0], issue};
  end
  always_ff @(posedge clk_i) write_q <= {write_q[1:0], {issue_child, issue_axis}};

  localparam int unsigned RowWidth  = xy_trace_pkg::StateWidth;
  localparam int unsigned WaitWidth = xy_trace_pkg::ChildWidth + TimeWidth;

  logic                push;
  logic [RowWidth-1:0] write_row, read_row;
  logic [LevelWidth:0] top;          // level and slot of the node that waits on top
  logic [LevelWidth+2:0] write_addr, read_addr;
  assign push = state_q == AwaitNode && verdicts && both && !corrupt_pair;

  logic [1:0] next_axis;
  assign next_axis  = state_q == TestNode && issue_axis != 2'd2 ? issue_axis + 2'd1 : 2'd0;
  assign read_addr  = state_q == Pop ? {top, 2'd3} : {level_q, slot_q, next_axis};
  assign write_addr = push ? {below, !near_second, 2'd3} : {below, write_q[2]};
  assign write_row  = push ? {{RowWidth - WaitWidth{1'b0}},
                              near_second ? first_entry_q : verdict_entry,
                              near_second ? first_q : child}
                           : box_state;

  xy_ram #(
      .Width    (RowWidth),
      .AddrWidth(LevelWidth + 3),
      .Block    (1'b1)
  ) u_states (
      .clk_i,
      .write_i     (push || write_valid_q[2]),
      .write_addr_i(write_addr),
      .write_data_i(write_row),
      .read_addr_i (read_addr),
      .read_data_o (read_row)
  );

  xy_trace_pkg::child_t popped;
  logic [TimeWidth-1:0] popped_entry;
  assign state_row              = read_row;
  assign {popped_entry, popped} = read_row[WaitWidth-1:0];

  xy_ram #(
      .Width    (LevelWidth + 1),
      .AddrWidth(LevelWidth),
      .Block    (1'b0)
  ) u_waiting (
      .clk_i,
      .write_i     (push),
      .write_addr_i(waiting_q),
      .write_data_i({below, !near_second}),
      .read_addr_i (waiting_q - 1'b1),
      .read_data_o (top)
  );

  // --- What is next ---

  logic                  go;         // to `next`
  xy_trace_pkg::child_t  next;
  logic [LevelWidth-1:0] next_level;
  logic                  next_slot;
  always_comb begin
    go         = 1'b0;
    next       = child;
    next_level = below;
    next_slot  = near_second;
    unique case (state_q)
      AwaitRoot: begin
        go         = verdicts && first_hit_q && !(quantized_i && root_inverted);
        next       = {root_count_i != '0, root_count_i, root_index_i};
        next_slot  = 1'b1;
      end
      AwaitNode: begin
        go = verdicts && (first_hit_q || verdict_hit) && !corrupt_pair;
        if (!near_second) next = first_q;
      end
      Take: begin
        go         = $signed(popped_entry) <= $signed(t_max_q);
        next       = popped;
        next_level = level_q;
        next_slot  = slot_q;
      end
      default: ;
    endcase
  end

  // In 4 bytes: entries have one, pairs four, nodes of 64 bytes sixteen.
  logic [29:0] next_base, next_offset;
  assign next_base = next.leaf ? entries_base_i[31:2] : nodes_base_i[31:2];
  always_comb begin
    next_offset = next.index[29:0];
    if (!next.leaf) next_offset = quantized_i ? {next.index[27:0], 2'b0} : {next.index[25:0], 4'b0};
  end

  logic node_bad, entry_bad;
  assign node_bad  = index_q >= node_count_i || nodes_left_q == '0 || level_q == LevelWidth'(Depth);
  assign entry_bad = index_q >= entry_count_i || entries_left_q == '0;

  logic [31:0] entry;
  logic        entry_names_none;
  assign entry            = item_ptr_q[0] ? data[63:32] : data[31:0];
  assign entry_names_none = {1'b0, entry[30:0]} >= triangle_count_i;

  always_comb begin
    word_valid = 1'b0;
    word_addr  = item_ptr_q[29:1];
    unique case (state_q)
      ReadRay: begin
        word_valid = 1'b1;
        word_addr  = ray_ptr_q;
      end
      FetchNode:    word_valid = !node_bad;
      TestNode:     word_valid = quantized_i ? step_q == 3'd2 : step_q != 3'd7;
      FetchEntry:   word_valid = !entry_bad;
      ReadTriangle: begin
        word_valid = 1'b1;
        word_addr  = triangle_ptr_q;
      end
      default: ;
    endcase
  end

  // The word that misses is the one asked for, as long as it does.
  always_comb begin
    unique case (state_q)
      ReadRay:      rd_region_o = xy_regs_pkg::region_id__rays;
      FetchEntry:   rd_region_o = xy_regs_pkg::region_id__leaf_table;
      ReadTriangle: rd_region_o = xy_regs_pkg::region_id__primitives;
      default: begin
        rd_region_o = quantized_i ? xy_regs_pkg::region_id__quantized : xy_regs_pkg::region_id__nodes;
      end
    endcase
  end

  // --- Records ---

  logic record_ready, records_empty;
  xy_hit_writer u_hits (
      .clk_i,
      .rst_ni,
      .clear_i,
      .start_i,
      .base_i    (hits_base_i),
      .valid_i   (state_q == WriteHit),
      .ready_o   (record_ready),
      .hit_i     (hit_q),
      .t_i       (t_max_q),
      .prim_i    (holder_q),
      .u_i       (u_q),
      .v_i       (v_q),
      .flush_i   (state_q == Flush),
      .empty_o   (records_empty),
      .wr_valid_o,
      .wr_ready_i,
      .wr_addr_o,
      .wr_data_o,
      .wr_strb_o,
      .wr_last_o
  );

  // --- Control ---

  logic leaf_ends;
  assign leaf_ends = last_entry_q || count_q == 8'd1;

  xy_trace_pkg::trace_error_e error_q;
  logic [31:0]                error_index_q, hits_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q       <= Idle;
      error_q       <= xy_trace_pkg::TraceGood;
      error_index_q <= '0;
      hits_q        <= '0;
    end else if (clear_i) begin
      state_q       <= Idle;
      error_q       <= xy_trace_pkg::TraceGood;
      error_index_q <= '0;
      hits_q        <= '0;
    end else begin
      unique case (state_q)
        Idle: begin
          if (start_i) begin
            state_q       <= PlaceRoot;
            error_q       <= xy_trace_pkg::TraceGood;
            error_index_q <= '0;
            hits_q        <= '0;
          end
        end
        PlaceRoot: if (place_done) state_q <= ray_count_i == '0 ? Flush : ReadRay;
        ReadRay: if (taken && step_q == 3'd4) state_q <= LastRayWord;
        LastRayWord: state_q <= Prepare;
        Prepare: begin
          if (!ray_good) begin
            state_q       <= Flush;
            error_q       <= xy_trace_pkg::TraceBadRay;
            error_index_q <= ray_q;
          end else if ($signed(t_min) >= $signed(t_max_q)) begin
            state_q <= WriteHit;
          end else if (&axis_ready) begin
            state_q <= TestRoot;
          end
        end
        TestRoot: if (step_q == 3'd5) state_q <= AwaitRoot;
        AwaitRoot: begin
          if (verdicts) begin
            state_q <= WriteHit;
            if (first_hit_q && quantized_i && root_inverted) begin
              state_q       <= Flush;
              error_q       <= xy_trace_pkg::TraceCorruptNode;
              error_index_q <= node_count_i == '0 ? '0 : node_count_i - 1'b1;
            end
          end
        end
        FetchNode: begin
          if (node_bad) begin
            state_q       <= Flush;
            error_q       <= xy_trace_pkg::TraceCorruptNode;
            error_index_q <= index_q;
          end else if (word_ready) begin
            state_q <= TestNode;
          end
        end
        TestNode: if (step_q == (quantized_i ? 3'd5 : 3'd7)) state_q <= AwaitNode;
        AwaitNode: begin
          if (verdicts) begin
            state_q <= Pop;
            if (corrupt_pair) begin
              state_q       <= Flush;
              error_q       <= xy_trace_pkg::TraceCorruptNode;
              error_index_q <= index_q;
            end
          end
        end
        Pop: state_q <= waiting_q == '0 ? WriteHit : Take;
        Take: state_q <= Pop;
        FetchEntry: begin
          if (entry_bad) begin
            state_q       <= Flush;
            error_q       <= xy_trace_pkg::TraceCorruptLeaf;
            error_index_q <= index_q;
          end else if (word_ready) begin
            state_q <= DecodeEntry;
          end
        end
        DecodeEntry: begin
          state_q <= ReadTriangle;
          if (entry_names_none) begin
            state_q       <= Flush;
            error_q       <= xy_trace_pkg::TraceCorruptLeaf;
            error_index_q <= index_q;
          end
        end
        ReadTriangle: if (taken && step_q == 3'd4) state_q <= LastTriangleWord;
        LastTriangleWord: state_q <= AwaitTriangle;
        AwaitTriangle: begin
          if (off_grid) begin
            state_q       <= Flush;
            error_q       <= xy_trace_pkg::TraceCorruptTriangle;
            error_index_q <= prim_q;
          end else if (triangle_done) begin
            if (triangle_hit && any_i) state_q <= WriteHit;
            else if (leaf_ends) state_q <= Pop;
            else state_q <= FetchEntry;
          end
        end
        WriteHit: begin
          if (record_ready) begin
            state_q <= ray_q + 1'b1 == ray_count_i ? Flush : ReadRay;
            if (hit_q) hits_q <= hits_q + 1'b1;
          end
        end
        default: if (records_empty) state_q <= Idle;  // Flush
      endcase
      if (go) state_q <= next.leaf ? FetchEntry : FetchNode;
    end
  end

  always_ff @(posedge clk_i) begin
    step_q <= '0;
    unique case (state_q)
      Idle: begin
        ray_ptr_q <= rays_base_i[31:3];
        ray_q     <= '0;
      end
      ReadRay, ReadTriangle: begin
        step_q <= step_q + {2'b0, taken};
        if (taken && step_q == 3'd4) step_q <= '0;
      end
      TestRoot, TestNode: step_q <= step_q + 3'd1;
      default: ;
    endcase
    if (taken && state_q == ReadRay) ray_ptr_q <= ray_ptr_q + 1'b1;
    if (taken && state_q == ReadTriangle) triangle_ptr_q <= triangle_ptr_q + 1'b1;

    // The ray's end, then the best time.
    if (ray_word_q && word_index_q == 3'd4) t_max_q <= ray_t_max;
    if (state_q == LastRayWord) begin
      hit_q          <= 1'b0;
      waiting_q      <= '0;
      nodes_left_q   <= node_count_i;
      entries_left_q <= entry_count_i;
    end
    if (state_q == AwaitTriangle && triangle_done && triangle_hit) begin
      hit_q    <= 1'b1;
      t_max_q  <= triangle_t;
      holder_q <= prim_q;
      u_q      <= triangle_u;
      v_q      <= triangle_v;
    end
    if (state_q == WriteHit && record_ready) ray_q <= ray_q + 1'b1;

    // The search.
    if (go) begin
      index_q    <= next.index;
      count_q    <= next.count;
      level_q    <= next_level;
      slot_q     <= next_slot;
      item_ptr_q <= next_base + next_offset;
    end
    if (state_q == FetchNode && taken) nodes_left_q <= nodes_left_q - 1'b1;
    if ((state_q == FetchNode || state_q == TestNode) && taken) item_ptr_q <= item_ptr_q + 30'd2;
    if (push) waiting_q <= waiting_q + 1'b1;
    if (state_q == Pop && waiting_q != '0) begin
      waiting_q         <= waiting_q - 1'b1;
      {level_q, slot_q} <= top;
    end
    if (state_q == FetchEntry && taken) entries_left_q <= entries_left_q - 1'b1;
    if (state_q == DecodeEntry) begin
      last_entry_q   <= entry[31];
      prim_q         <= {1'b0, entry[30:0]};
      triangle_ptr_q <= triangles_base_i[31:3] + {entry[26:0], 2'b0} + entry[28:0];
    end
    if (state_q == AwaitTriangle && triangle_done) begin
      index_q <= index_q + 1'b1;
      item_ptr_q <= item_ptr_q + 30'd1;
      if (count_q != '0) count_q <= count_q - 1'b1;
    end
  end

  assign busy_o          = state_q != Idle;
  assign done_o          = state_q == Flush && records_empty;
  assign hits_o          = hits_q;
  assign error_o         = error_q;
  assign error_index_o   = error_index_q;
  assign node_fetch_o    = state_q == FetchNode && taken;
  assign box_test_o      = verdict && !(state_q == AwaitRoot && second_q);
  assign triangle_test_o = state_q == AwaitTriangle && triangle_done;

  logic unused_bits;
  assign unused_bits = ^{rays_base_i[2:0], nodes_base_i[1:0], entries_base_i[1:0], triangles_base_i[2:0]};

`ifndef SYNTHESIS
  // A node's words are in one line, so that only its first can miss.
  a_node_in_line :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      state_q == TestNode && word_valid |-> word_ready);
  // Boxes of a node are written before its children are read.
  a_states_are_settled :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      state_q == FetchNode || state_q == Pop |-> write_valid_q == '0);
  // The level bounds the stack.
  a_stack_has_room :
  assert property (@(posedge clk_i) disable iff (!rst_ni) push |-> waiting_q <= level_q);
  // No pushed row collides with a box'.
  a_one_writer :
  assert property (@(posedge clk_i) disable iff (!rst_ni) !(push && write_valid_q[2]));
`endif

endmodule
