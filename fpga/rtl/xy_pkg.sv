// Types that Xylem's units share.
package xy_pkg;

  // --- Geometry ---

  // Bits of a grid coordinate, sign included. Narrow fields are plain vectors: read them with $signed.
  localparam int unsigned CoordWidth = 24;

  typedef struct packed {
    logic [CoordWidth-1:0] z;
    logic [CoordWidth-1:0] y;
    logic [CoordWidth-1:0] x;
  } vec_t;

  // A box: its lower and upper corner, both inside.
  typedef struct packed {
    vec_t hi;
    vec_t lo;
  } box_t;

  // What the sorter sorts: a box and the primitive in it.
  typedef struct packed {
    logic [31:0] prim;
    box_t        box;
  } record_t;

  localparam int unsigned RecordWidth = 32 + 6 * CoordWidth;

  // What lies between two records that follow each other in the order of their codes: whether the codes
  // differ, and the highest bit in which they do, 0 if in none. A code has 63 bits at most.
  typedef struct packed {
    logic       differs;
    logic [5:0] index;
  } split_t;

  localparam int unsigned SplitWidth = 1 + 6;

  // A finished part of a tree: its box and the pointer to it. count is the number of primitives in a
  // leaf, whose first entry in the leaf table is index; it is 0 for a node, whose number is index.
  typedef struct packed {
    logic [31:0] index;
    logic [7:0]  count;
    box_t        box;
  } subtree_t;

  localparam int unsigned SubtreeBits = 32 + 8 + 6 * CoordWidth;

  // --- Traversal contexts ---

  // The widest quantized coordinate. Narrower ones leave the upper bits of fields 0.
  localparam int unsigned MaxQuant = 8;

  // A node's decoded box and the grid on which its children are encoded (P3 §3): per axis, x lowest, the
  // grid's cell is 2^scale units wide, the box spans `cells` cells from `lower` on, which is a multiple of
  // the cell's size. What P3 calls the lower bound modulo 2^N is `lower >> scale` cut to N bits.
  typedef struct packed {
    logic [2:0][CoordWidth-1:0] lower;
    logic [2:0][MaxQuant:0]     cells;
    logic [2:0][4:0]            scale;
  } place_t;

  // A child's decoded box in cells of its parent's grid: how many cells above the parent's lower bound it
  // starts, and how many it spans.
  typedef struct packed {
    logic [2:0][MaxQuant:0]   width;
    logic [2:0][MaxQuant-1:0] low;
  } cells_t;

  // --- Memory ---

  // A line is what moves over a memory port at once. Byte i is in bits 8i+7:8i.
  localparam int unsigned LineBytes = 64;
  localparam int unsigned LineBits  = 8 * LineBytes;

  // A record in memory: six coordinates, each sign-extended to 32 bits, the primitive, a zero word.
  localparam int unsigned RecordBytes = 32;
  localparam int unsigned RecordBits  = 8 * RecordBytes;

  // A triangle in memory: nine coordinates, vertex by vertex, and an identifier.
  localparam int unsigned TriangleBytes = 40;
  localparam int unsigned TriangleBits  = 8 * TriangleBytes;

  // --- Registers, bundled ---

  localparam int unsigned RegionWidth = 3;
  localparam int unsigned Regions     = 2 ** RegionWidth;  // in the order of xy_regs_pkg::region_id_e
  localparam int unsigned Events      = 10;                // event counters, in the order of the registers

  typedef logic [RegionWidth-1:0] region_t;

  // What software asks for.
  typedef struct packed {
    logic [2:0]  kind;
    logic [31:0] primitives;
    logic [31:0] rays;
    logic [31:0] nodes;
    logic [31:0] entries;
    logic [1:0]  input_format;
    logic [1:0]  record_format;
    logic        node_format;
    logic        modulo;
    logic        any_hit;
    logic [6:0]  morton_bits;
    logic [7:0]  leaf_size;
    logic [2:0]  treelet_depth;
    subtree_t    root;
  } job_t;

  // What the control tells.
  typedef struct packed {
    logic        busy;
    logic        done;
    logic        failed;
    logic [3:0]  stage;
    logic [3:0]  error_code;
    logic [3:0]  error_stage;
    logic        error_region_valid;
    logic [2:0]  error_region;
    logic [31:0] error_addr;
  } status_t;

  // What a job leaves behind in registers, beside its root.
  typedef struct packed {
    logic [31:0] nodes;
    logic [31:0] leaves;
    logic [31:0] quantized;
    logic [31:0] hits;
  } result_t;

  // What was synthesized.
  typedef struct packed {
    logic [23:0] scratch_records;
    logic [7:0]  burst_records;
    logic [15:0] merge_width;
    logic [7:0]  leaf_size;
    logic [6:0]  morton_bits;
    logic [3:0]  plane_bits;
    logic [2:0]  treelet_depth;
    logic        build;
    logic        build_compressed;
    logic        trace;
    logic        trace_bvh2;
    logic        input_triangle;
    logic [7:0]  ray_bytes;
    logic [7:0]  hit_bytes;
    logic [7:0]  stack_entries;
  } caps_t;

  // --- Heap ---

  // What a heap is asked to do.
  typedef enum logic [1:0] {
    HeapInsert  = 2'd0,  // add an entry
    HeapReplace = 2'd1,  // take the top away and add an entry
    HeapRemove  = 2'd2,  // take the top away
    HeapClear   = 2'd3   // forget every entry
  } heap_op_e;

endpackage
