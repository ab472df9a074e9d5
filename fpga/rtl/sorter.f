xy_pkg.sv
xy_ram.sv
xy_sorter.sv
