// Types of the traversal unit. The core's names and units: core-nostd, geom::ray and num::reciprocal.
package xy_trace_pkg;

  // A time, signed, in units of 2^-6: at most 2^33 in magnitude.
  localparam int unsigned TimeWidth = 35;

  // The reciprocal of a direction component's magnitude: a mantissa in units of 2^-24, rounded down,
  // and the left shift that turns an offset into a time. Of a zero component only `zero` counts.
  typedef struct packed {
    logic        negative;
    logic        zero;
    logic        inexact;   // the mantissa was rounded
    logic [4:0]  shift;     // 1 to 31
    logic [23:0] mantissa;
  } reciprocal_t;

  // One axis of a node's local grid.
  typedef struct packed {
    logic [4:0] scale;  // a cell is 2^scale grid units
    logic [6:0] cells;  // that the decoded box spans, 1 to 64
    logic [5:0] low;    // number of the lowest cell, modulo 64
  } grid_t;

  // One axis of a node whose children are to be tested: its grid, and the offsets of its planes.
  typedef struct packed {
    grid_t       grid;
    logic [31:0] near_offset;
    logic [31:0] far_offset;
  } state_t;

  // What a child pointer names: a node, or a leaf of `count` entries, or up to the mark if that is 0.
  typedef struct packed {
    logic        leaf;
    logic [7:0]  count;
    logic [31:0] index;
  } child_t;

  localparam int unsigned StateWidth = 82;
  localparam int unsigned ChildWidth = 41;

  // Two factors for a multiplier, both signed.
  typedef struct packed {
    logic [31:0] a;
    logic [29:0] b;
  } factors_t;

  localparam int unsigned ProductWidth = 62;

  // Why a job ended early. Each comes with an index: of the ray, node, leaf table entry or triangle.
  typedef enum logic [2:0] {
    TraceGood            = 3'd0,
    TraceBadRay          = 3'd1,  // a record that is no ray
    TraceCorruptNode     = 3'd2,  // off the tree, reached twice, too deep, or a child outside its parent
    TraceCorruptLeaf     = 3'd3,  // an entry off the table, reached twice, or naming no triangle
    TraceCorruptTriangle = 3'd4   // a vertex off the grid
  } trace_error_e;

endpackage
