xy_pkg.sv
xy_ram.sv
xy_unpack.sv
xy_unpack_triangle.sv
xy_reader.sv
