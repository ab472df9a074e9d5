xy_pkg.sv
xy_msb.sv
xy_context.sv
