xy_pkg.sv
xy_ram.sv
xy_morton.sv
xy_sorter.sv
