// An offset, signed, shifted left to a time of 36 bits; beyond those, the lowest or the highest one.
// Combinational.
module xy_time_shift (
    input  logic [31:0] offset_i,
    input  logic [4:0]  shift_i,
    output logic [35:0] time_o
);

  logic negative;
  assign negative = offset_i[31];

  // By 16, 8, 4, 2 and 1; what is shifted out, and the sign that is left, must be copies of the sign.
  logic [35:0] value;
  logic        lost;
  always_comb begin
    value = {{4{negative}}, offset_i};
    lost  = 1'b0;
    for (int unsigned i = 0; i < 5; i++) begin
      if (shift_i[4-i]) begin
        if ((value ^ {36{negative}}) >> (35 - (16 >> i)) != '0) lost = 1'b1;
        value = value << (16 >> i);
      end
    end
  end

  assign time_o = lost ? {negative, {35{!negative}}} : value;

endmodule
