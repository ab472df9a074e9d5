xy_pkg.sv
xy_ram.sv
xy_fifo.sv
xy_guard.sv
xy_axi_read.sv
xy_axi_write.sv
xy_port.sv
