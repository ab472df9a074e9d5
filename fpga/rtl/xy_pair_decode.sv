// Decodes one axis of one child of a quantized pair (the core's Context::decode and Context::child).
//
// Coordinates have 6 bits and the minimum scale is 0. below_o and above_o count the cells between the
// child's planes and its parent's; they mean nothing unless inside_o. Combinational.
module xy_pair_decode (
    input  logic                modulo_i,
    input  logic [5:0]          low_i,
    input  logic [5:0]          high_i,
    input  xy_trace_pkg::grid_t parent_i,
    output logic                inside_o,
    output logic [6:0]          below_o,
    output logic [6:0]          above_o,
    output xy_trace_pkg::grid_t child_o
);

  // The width less one, which is what its logarithm is taken of. Modulo, a width is never 0.
  logic [5:0] below, over;
  assign below = modulo_i ? low_i - parent_i.low : low_i;
  assign over  = high_i - low_i - {5'b0, modulo_i};

  logic [6:0] width;
  logic [7:0] above;
  assign width = {1'b0, over} + 7'd1;
  assign above = {1'b0, parent_i.cells} - {2'b0, below} - {1'b0, width};

  assign inside_o = !above[7] && (modulo_i || low_i <= high_i);
  assign below_o  = {1'b0, below};
  assign above_o  = above[6:0];

  // The finest grid on which the child spans at most 64 cells, but no finer than a grid unit.
  logic [2:0] room, finer;
  always_comb begin
    room = 3'd6;
    for (int unsigned i = 0; i < 6; i++) begin
      if (over[i]) room = 3'(5 - i);
    end
  end
  assign finer = parent_i.scale < {2'b0, room} ? parent_i.scale[2:0] : room;

  assign child_o.scale = parent_i.scale - {2'b0, finer};
  assign child_o.cells = width << finer;
  assign child_o.low   = (parent_i.low + below) << finer;

endmodule
