// Simple dual-port memory: one write port, one read port.
//
// Block = 1: read data appear in the cycle after their address (block memory). A read at the very
//            edge that writes the same word is undefined; the user must not depend on it.
// Block = 0: read data follow the address in the same cycle (distributed memory, small depths).
//
// Latency     Block cycles for a read; a write is visible to addresses given from the next cycle on.
// Throughput  one write and one read a cycle.
// Cut paths   Block = 1: address to data. Block = 0: none.
module xy_ram #(
    parameter int unsigned Width     = 32,
    parameter int unsigned AddrWidth = 4,
    parameter bit          Block     = 1'b1
) (
    input  logic                 clk_i,
    input  logic                 write_i,
    input  logic [AddrWidth-1:0] write_addr_i,
    input  logic [Width-1:0]     write_data_i,
    input  logic [AddrWidth-1:0] read_addr_i,
    output logic [Width-1:0]     read_data_o
);

  if (Block) begin : gen_block
    // no_rw_check: the collision above is the user's business, so no bypass is built here.
    (* ram_style = "block", no_rw_check *)
    logic [Width-1:0] mem[2**AddrWidth];

    always_ff @(posedge clk_i) begin
      if (write_i) mem[write_addr_i] <= write_data_i;
      read_data_o <= mem[read_addr_i];
    end
  end else begin : gen_distributed
    (* ram_style = "distributed" *)
    logic [Width-1:0] mem[2**AddrWidth];

    always_ff @(posedge clk_i) begin
      if (write_i) mem[write_addr_i] <= write_data_i;
    end
    assign read_data_o = mem[read_addr_i];
  end

endmodule
