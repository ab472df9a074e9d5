xy_pkg.sv
xy_ram.sv
xy_unpack.sv
xy_reader.sv
