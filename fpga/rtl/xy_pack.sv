// A record as the 32 bytes that it is in memory: the other direction of xy_unpack.
//
// Latency     none. Throughput  one record a cycle. Cut paths  none: wires.
module xy_pack (
    input  xy_pkg::record_t               record_i,
    output logic [xy_pkg::RecordBits-1:0] bytes_o
);

  localparam int unsigned W = xy_pkg::CoordWidth;

  logic [5:0][W-1:0]  coords;
  logic [5:0][31:0]   words;
  assign coords = record_i.box;

  for (genvar i = 0; i < 6; i++) begin : gen_word
    assign words[i] = {{(32 - W) {coords[i][W-1]}}, coords[i]};
  end

  assign bytes_o = {32'd0, record_i.prim, words};

endmodule
