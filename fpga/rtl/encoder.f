xy_pkg.sv
xy_msb.sv
xy_encode.sv
xy_child.sv
xy_decoded.sv
xy_mismatch.sv
xy_encoder.sv
