// Types that Xylem's units share.
package xy_pkg;

  // What a heap is asked to do.
  typedef enum logic [1:0] {
    HeapInsert  = 2'd0,  // add an entry
    HeapReplace = 2'd1,  // take the top away and add an entry
    HeapRemove  = 2'd2,  // take the top away
    HeapClear   = 2'd3   // forget every entry
  } heap_op_e;

endpackage
