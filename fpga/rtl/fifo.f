xy_ram.sv
xy_fifo.sv
