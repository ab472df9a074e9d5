// Position of the highest bit that is set.
//
// Handshake   none: combinational.
// Latency     0; a tree of ceil(log2(Width)) levels.
// Cut paths   none.
module xy_msb #(
    parameter int unsigned Width      = 63,
    parameter int unsigned IndexWidth = $clog2(Width)
) (
    input  logic [Width-1:0]      bits_i,
    output logic                  any_o,   // some bit is set
    output logic [IndexWidth-1:0] index_o  // 0 if none is
);

  localparam int unsigned Leaves = 2 ** IndexWidth;

  // A binary tree in an array: the root is 1, the halves of n are 2n and 2n+1.
  logic [Leaves-1:0]                     bits;
  logic [2*Leaves-1:0]                   any;
  logic [2*Leaves-1:0][IndexWidth-1:0]   index;

  assign bits = Leaves'(bits_i);

  always_comb begin
    any   = '0;
    index = '0;
    for (int unsigned i = 0; i < Leaves; i++) begin
      any[Leaves+i]   = bits[i];
      index[Leaves+i] = bits[i] ? IndexWidth'(i) : '0;
    end
    for (int unsigned n = Leaves - 1; n > 0; n--) begin
      any[n]   = any[2*n] || any[2*n+1];
      index[n] = any[2*n+1] ? index[2*n+1] : index[2*n];
    end
  end

  assign any_o   = any[1];
  assign index_o = index[1];

  logic unused_none;
  assign unused_none = any[0] ^ (^index[0]);

endmodule
