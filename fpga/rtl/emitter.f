xy_pkg.sv
xy_ram.sv
xy_msb.sv
xy_union.sv
xy_stack.sv
xy_bvh2_pack.sv
xy_emitter.sv
