xy_pkg.sv
xy_ram.sv
xy_burst_writer.sv
