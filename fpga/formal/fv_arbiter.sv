// xy_write_arbiter gives lines through as they are, burst by burst, and lets every port have its turn.
//
// Lines carry the number of their port, so that the output tells whose they are. Ports hold what they
// offer, as every line port must.
module fv_arbiter (
    input logic                                       clk_i,
    input logic                                       clear_i,
    input logic [2:0]                                 valid_i,
    input logic [2:0]                                 last_i,
    input logic [2:0][29:0]                           addr_i,
    input logic [2:0][xy_pkg::LineBits-1:0]           data_i,
    input logic [2:0][xy_pkg::LineBytes-1:0]          strb_i,
    input logic [2:0][xy_pkg::RegionWidth-1:0]        region_i,
    input logic                                       ready_i
);

  localparam int unsigned Ports = 3;
  localparam int unsigned PayloadBits = xy_pkg::LineBits + xy_pkg::LineBytes + xy_pkg::RegionWidth + 30;

  (* anyconst *) logic [1:0] port;  // the one that is watched

  logic                            rst_ni = 1'b0;
  logic                            valid;
  logic [Ports-1:0]                ready;
  logic [31:0]                     addr;
  logic [xy_pkg::LineBits-1:0]     data;
  logic [xy_pkg::LineBytes-1:0]    strb;
  logic [xy_pkg::RegionWidth-1:0]  region;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_write_arbiter #(
      .Ports(Ports)
  ) u_arbiter (
      .clk_i,
      .rst_ni,
      .clear_i,
      .valid_i,
      .ready_o (ready),
      .last_i,
      .addr_i  ({2'd2, addr_i[2], 2'd1, addr_i[1], 2'd0, addr_i[0]}),
      .data_i,
      .strb_i,
      .region_i,
      .valid_o (valid),
      .ready_i,
      .addr_o  (addr),
      .data_o  (data),
      .strb_o  (strb),
      .region_o(region)
  );

  logic [1:0]                      from;
  logic [Ports-1:0]                taken;
  logic [PayloadBits-1:0]          payload, given;
  assign from    = addr[31:30];
  assign taken   = valid_i & ready;
  assign payload = {addr[29:0], data, strb, region};
  assign given   = {addr_i[from], data_i[from], strb_i[from], region_i[from]};

  // What was offered and not taken in the cycle before.
  logic                     held = 1'b0;
  logic [1:0]               held_from;
  logic [Ports-1:0]         waited = '0, waited_last;

  logic       inside = 1'b0;  // a burst has begun and not ended
  logic [1:0] owner;
  logic [1:0] others = '0;    // bursts of others that ended since the watched port began to wait

  always_ff @(posedge clk_i) begin
    held        <= rst_ni && valid && !ready_i && !clear_i;
    held_from   <= from;
    waited      <= valid_i & ~ready & {Ports{rst_ni && !clear_i}};
    waited_last <= last_i;
    if (!rst_ni || clear_i) begin
      inside <= 1'b0;
      others <= '0;
    end else begin
      if (valid && ready_i) begin
        inside <= !last_i[from];
        owner  <= from;
      end
      if (!watched || !valid_i[port] || taken[port]) others <= '0;
      else if (valid && ready_i && last_i[from]) others <= others + 1'b1;
    end
  end

  (* hierconn *) logic [1:0] \u_arbiter.turn_q ;
  (* hierconn *) logic       \u_arbiter.kept_q ;
  logic       kept, watched;
  logic [1:0] turn;
  logic [2:0] distance;  // in turns, from the last one's to the watched port's
  assign turn     = \u_arbiter.turn_q ;
  assign kept     = \u_arbiter.kept_q ;
  assign watched  = port < 2'(Ports);
  assign distance = 3'(port > turn ? port - turn : 3'(Ports) + port - turn);

  always_comb begin
    for (int unsigned i = 0; i < Ports; i++) begin
      if (waited[i]) begin
        assume (valid_i[i] && last_i[i] == waited_last[i]);
      end
    end
    if (rst_ni) begin
      if (valid) begin
        a_port_asked : assert (from < 2'(Ports) && valid_i[from]);
        a_line_unchanged : assert (payload == given);
      end
      a_taken_once : assert (taken == (valid && ready_i ? 3'b001 << from : 3'b000));
      // So the line stays too, as it is that of its port.
      if (held) a_offer_stays : assert (valid && from == held_from);
      if (inside && valid) a_burst_whole : assert (from == owner);
      if (valid_i != '0 && !inside) a_no_idling : assert (valid);
      a_in_turn : assert (others < 2'(Ports));

      h_turn : assert (turn < 2'(Ports) && (!kept || inside || held));
      if (held) h_held : assert (kept && turn == held_from);
      if (inside) h_inside : assert (kept && turn == owner);
      // Whoever waits has fewer bursts before it the more it has waited for.
      if (watched && !(kept && turn == port)) begin
        h_comes_nearer : assert (others + distance + 2'(kept) <= 3'(Ports));
      end
      if (!watched) h_not_watched : assert (others == '0);
      c_waits_longest : cover (others == 2'(Ports - 1));
      c_burst : cover (inside && valid && taken[from] && from == 2'd1 && valid_i[0]);
    end
  end

endmodule
