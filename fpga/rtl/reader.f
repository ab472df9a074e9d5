xy_pkg.sv
xy_less.sv
xy_ram.sv
xy_unpack.sv
xy_unpack_triangle.sv
xy_reader.sv
