xy_pkg.sv
xy_morton.sv
