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

  // --- Memory ---

  // A line is what moves over a memory port at once. Byte i is in bits 8i+7:8i.
  localparam int unsigned LineBytes = 64;
  localparam int unsigned LineBits  = 8 * LineBytes;

  // A record in memory: six coordinates, each sign-extended to 32 bits, the primitive, a zero word.
  localparam int unsigned RecordBytes = 32;
  localparam int unsigned RecordBits  = 8 * RecordBytes;

  // --- Heap ---

  // What a heap is asked to do.
  typedef enum logic [1:0] {
    HeapInsert  = 2'd0,  // add an entry
    HeapReplace = 2'd1,  // take the top away and add an entry
    HeapRemove  = 2'd2,  // take the top away
    HeapClear   = 2'd3   // forget every entry
  } heap_op_e;

endpackage
