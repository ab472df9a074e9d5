// xy_heap holds what was put into it and nothing else, and its top is the least of that.
//
// An entry is picked, any one, infinity too, and a count kept of the entries inside that are less than
// it. The top must be less than the pick exactly while there are such. As the pick is free, this makes
// the counts those of a multiset, and the top its least. Operations come in any order, also those that
// cannot be done.
//
// So that the proof has no bound, the second half says how the entries lie in the levels while up to
// two operations are on their way down; the solver shows that every cycle leaves this true.
module fv_heap (
    input logic             clk_i,
    input logic             op_valid_i,
    input xy_pkg::heap_op_e op_i,
    input logic [1:0]       op_key_i,
    input logic             op_slot_i
);

  localparam int unsigned Levels = 3;
  localparam int unsigned Places = 2 ** Levels;
  localparam int unsigned Width  = 4;            // of an entry: infinity, key, slot

  localparam logic [Width-1:0] Infinity = '1;

  (* anyconst *) logic [Width-1:0] pick;

  logic       rst_ni = 1'b0;
  logic       ready, error, top_valid, full;
  logic [2:0] top;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_heap #(
      .Levels    (Levels),
      .KeyWidth  (2),
      .SlotWidth (1),
      .BlockLevel(Levels)
  ) u_heap (
      .clk_i,
      .rst_ni,
      .op_valid_i,
      .op_ready_o (ready),
      .op_i,
      .op_key_i,
      .op_slot_i,
      .op_error_o (error),
      .top_valid_o(top_valid),
      .top_key_o  (top[2:1]),
      .top_slot_o (top[0]),
      .full_o     (full)
  );

  // --- What is inside ---

  logic [3:0] less = '0;     // entries inside that are less than the pick
  logic [3:0] inserts = '0;  // since the last clear
  logic       taken, inserted, removed, cleared, wrong;

  assign taken    = rst_ni && op_valid_i && ready;
  assign wrong    = taken && ((op_i == xy_pkg::HeapInsert && inserts == 4'(Places))
      || ((op_i == xy_pkg::HeapReplace || op_i == xy_pkg::HeapRemove) && !top_valid));
  assign inserted = taken && !wrong && (op_i == xy_pkg::HeapInsert || op_i == xy_pkg::HeapReplace);
  assign removed  = taken && !wrong && (op_i == xy_pkg::HeapRemove || op_i == xy_pkg::HeapReplace);
  assign cleared  = taken && op_i == xy_pkg::HeapClear;

  logic       was_taken = 1'b0, was_wrong = 1'b0, top_was_valid;
  logic [2:0] top_was;

  always_ff @(posedge clk_i) begin
    less <= less + 4'(inserted && {1'b0, op_key_i, op_slot_i} < pick)
        - 4'(removed && {1'b0, top} < pick);
    if (inserted && !removed) inserts <= inserts + 1'b1;
    if (!rst_ni || cleared) begin
      less    <= '0;
      inserts <= '0;
    end
    was_taken     <= taken;
    was_wrong     <= wrong;
    top_was       <= top;
    top_was_valid <= top_valid;
  end

  always_comb begin
    if (rst_ni) begin
      a_top_is_least : assert ((top_valid && {1'b0, top} < pick) == (less != '0));
      a_full_after_all_places : assert (full == (inserts == 4'(Places)));
      a_every_second_cycle : assert (ready == !was_taken);
      a_error_is_told : assert (error == was_wrong);
      if (was_wrong) begin
        a_error_changes_nothing : assert (top_valid == top_was_valid && top == top_was);
      end
      c_filled : cover (inserts == 4'(Places) && less == 4'd3);
      c_drained : cover (less == '0 && inserts == 4'd4 && was_taken && !top_valid && pick == Infinity);
      c_error : cover (was_wrong && full);
    end
  end

  // --- How it lies inside ---

  (* hierconn *) logic [Width-1:0]   \u_heap.top_q ;
  (* hierconn *) logic [3:0]         \u_heap.size_q ;
  (* hierconn *) logic [Width-1:0]   \u_heap.gen_level[0].gen_flops.u_store.entries_q ;
  (* hierconn *) logic [2*Width-1:0] \u_heap.gen_level[1].gen_flops.u_store.entries_q ;
  (* hierconn *) logic [4*Width-1:0] \u_heap.gen_level[2].gen_flops.u_store.entries_q ;
  (* hierconn *) logic             \u_heap.gen_level[0].u_stage.insert_q , \u_heap.gen_level[0].u_stage.replace_q , \u_heap.gen_level[0].u_stage.clear_q ;
  (* hierconn *) logic [2:0]       \u_heap.gen_level[0].u_stage.path_q ;
  (* hierconn *) logic [Width-1:0] \u_heap.gen_level[0].u_stage.entry_q , \u_heap.gen_level[0].u_stage.own_q ;
  (* hierconn *) logic             \u_heap.gen_level[1].u_stage.insert_q , \u_heap.gen_level[1].u_stage.replace_q , \u_heap.gen_level[1].u_stage.clear_q ;
  (* hierconn *) logic [2:0]       \u_heap.gen_level[1].u_stage.path_q ;
  (* hierconn *) logic [Width-1:0] \u_heap.gen_level[1].u_stage.entry_q , \u_heap.gen_level[1].u_stage.own_q ;
  (* hierconn *) logic             \u_heap.gen_level[2].u_stage.insert_q , \u_heap.gen_level[2].u_stage.replace_q , \u_heap.gen_level[2].u_stage.clear_q ;
  (* hierconn *) logic [2:0]       \u_heap.gen_level[2].u_stage.path_q ;
  (* hierconn *) logic [Width-1:0] \u_heap.gen_level[2].u_stage.entry_q , \u_heap.gen_level[2].u_stage.own_q ;

  // Place 0 is the top; place n is where the entry goes that comes after n others.
  logic [Places-1:0][Width-1:0] place;
  assign place = {
    \u_heap.gen_level[2].gen_flops.u_store.entries_q ,
    \u_heap.gen_level[1].gen_flops.u_store.entries_q ,
    \u_heap.gen_level[0].gen_flops.u_store.entries_q ,
    \u_heap.top_q
  };

  logic [Levels-1:0]            inserting, replacing, clearing;
  logic [Levels-1:0][2:0]       path;
  logic [Levels-1:0][Width-1:0] value, own;
  assign inserting = {
    \u_heap.gen_level[2].u_stage.insert_q ,
    \u_heap.gen_level[1].u_stage.insert_q ,
    \u_heap.gen_level[0].u_stage.insert_q 
  };
  assign replacing = {
    \u_heap.gen_level[2].u_stage.replace_q ,
    \u_heap.gen_level[1].u_stage.replace_q ,
    \u_heap.gen_level[0].u_stage.replace_q 
  };
  assign clearing = {
    \u_heap.gen_level[2].u_stage.clear_q ,
    \u_heap.gen_level[1].u_stage.clear_q ,
    \u_heap.gen_level[0].u_stage.clear_q 
  };
  assign path = {
    \u_heap.gen_level[2].u_stage.path_q ,
    \u_heap.gen_level[1].u_stage.path_q ,
    \u_heap.gen_level[0].u_stage.path_q 
  };
  assign value = {
    \u_heap.gen_level[2].u_stage.entry_q ,
    \u_heap.gen_level[1].u_stage.entry_q ,
    \u_heap.gen_level[0].u_stage.entry_q 
  };
  assign own = {
    \u_heap.gen_level[2].u_stage.own_q ,
    \u_heap.gen_level[1].u_stage.own_q ,
    \u_heap.gen_level[0].u_stage.own_q 
  };

  logic [Levels:0] active;
  assign active = {1'b0, inserting | replacing | clearing};

  // Behind a clear nothing counts that it has not reached.
  logic [Levels-1:0] gone, op_gone;
  assign gone    = {|clearing, |clearing[1:0], clearing[0]};
  assign op_gone = {|clearing[1:0], clearing[0], 1'b0};

  // What a place holds or will be given: a hole counts as the value that looks for its place from there.
  logic [Places-1:0]            hole;
  logic [Places-1:0][Width-1:0] content;
  logic [Levels-1:0][Width-1:0] waiting;

  assign hole[0]    = 1'b0;
  assign content[0] = place[0];

  for (genvar n = 1; n < Places; n++) begin : gen_place
    localparam int unsigned Level  = n >= 4 ? 2 : n >= 2 ? 1 : 0;
    localparam int unsigned Parent = n >= 4 ? 2 + n % 2 : n >= 2 ? 1 : 0;
    localparam int unsigned Above  = n >= 4 ? 1 : 0;  // the parent's parent

    assign hole[n]    = replacing[Level] && !op_gone[Level]
        && ((path[Level] & 3'(2 ** Level - 1)) == 3'(n - 2 ** Level));
    assign content[n] = gone[Level] ? Infinity : hole[n] ? value[Level] : place[n];

    always_comb begin
      if (rst_ni && !gone[Level]) begin
        if (hole[Parent]) assert (content[Above] <= content[n]);
        else assert (content[Parent] <= content[n]);
        if (4'(n) >= inserts) assert (place[n] == Infinity);
        if (hole[n]) assert (4'(n) + 4'(Level == 2 && inserting[0]) < inserts);
      end
    end
  end

  for (genvar k = 0; k < Levels; k++) begin : gen_stage
    logic [2:0] on_way, before;  // the places at this level and the one above on an insert's path
    assign on_way = 3'(2 ** k) + (path[k] & 3'(2 ** k - 1));
    if (k == 0) assign before = '0;
    else assign before = 3'(2 ** (k - 1)) + (path[k] & 3'(2 ** (k - 1) - 1));

    assign waiting[k] = inserting[k] && !op_gone[k] ? value[k] : Infinity;

    always_comb begin
      if (rst_ni) begin
        assert (2'(inserting[k]) + 2'(replacing[k]) + 2'(clearing[k]) <= 2'd1);
        if (k < 2 && active[k]) assert (ready == (k == 1));
        if (k < 2) assert (!(active[k] && active[k+1]));
        if (clearing[k]) assert (value[k] == Infinity);
        if (inserting[k] && !op_gone[k]) begin
          assert (4'(path[k]) + 4'(k == 2 && inserting[0]) == inserts - 1'b1);
          assert ((path[k] >> k) != '0);
          assert (place[path[k]] == Infinity);
          assert (own[k] == place[on_way]);
          assert (content[before] <= value[k]);
        end
      end
    end
  end

  logic [3:0] count;
  always_comb begin
    count = '0;
    for (int unsigned n = 0; n < Places; n++) count = count + 4'(content[n] < pick);
    for (int unsigned k = 0; k < Levels; k++) count = count + 4'(waiting[k] < pick);
    if (rst_ni) begin
      h_count : assert (count == less);
      if (inserts == '0) h_empty : assert (place[0] == Infinity);
      for (int unsigned n = 0; n < Places; n++) assert (content[n] < 4'd8 || content[n] == Infinity);
      for (int unsigned k = 0; k < Levels; k++) assert (waiting[k] < 4'd8 || waiting[k] == Infinity);
      h_inserts : assert (\u_heap.size_q == inserts);
      if (clearing[0] || clearing[1]) h_cleared : assert (inserts == '0);
      if (clearing[2]) h_cleared_before : assert (inserts <= 4'd1 && !inserting[0] && !replacing[0]);
    end
  end

endmodule
