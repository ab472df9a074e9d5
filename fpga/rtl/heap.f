xy_pkg.sv
xy_less.sv
xy_ram.sv
xy_heap_flops.sv
xy_heap_ram.sv
xy_heap_stage.sv
xy_heap.sv
