// The life of a job: checks its parameters, lets a unit run, notes the first error, waits until memory
// is quiet, and reports.
//
//              start          checked           done, error, abort        quiet, or gave up
//   Idle ─────────────► Check ───────► Run ────────────────────────► Drain ───────► Idle
//     └── soft_reset ──────────────────────────────────────────────────┘
//
// Check       compares every two regions, a pair a cycle: a job whose regions overlap or pass the end
//             of memory is refused before anything is touched, like one with parameters that the
//             capabilities rule out (config_ok_i).
//             Then it waits until the unit is ready, which takes some cycles after a job.
// Run         start_o is high for the first cycle.
// Drain       clear_o puts all units back into their state after reset; the memory port sends what it has
//             taken and waits for its responses. Drain ends when idle_i says that nothing is under way.
// Time-out    if something is under way and nothing moves for TimeOut cycles, in Run or in Drain, the
//             job ends all the same, with bus_timeout; what is missing may come while idle, where it
//             is ignored. A start before that is refused with bus_timeout, so no response ever meets
//             a job that it does not belong to.
//             A unit that works without memory is given all the time: a ray may go through as many nodes as
//             its tree has, all in the cache. That ends by itself, as every unit counts down: records
//             and runs, and for each ray the nodes and entries that it meets. A request is taken at once while
//             nothing is under way, so no unit waits for memory unseen. abort_i ends any job.
// Errors      the first one counts; of those in one cycle: guard, memory, unit, abort.
// Latency     a job without error takes 29 cycles (8 regions) before its unit starts, if that is ready, and
//             one after the port is quiet.
module xy_control #(
    parameter int unsigned Regions = 8,
    parameter int unsigned TimeOut = 1 << 20  // cycles in which memory owes something and nothing moves
) (
    input  logic                       clk_i,
    input  logic                       rst_ni,

    // Registers.
    input  logic                       start_i,
    input  logic                       abort_i,
    input  logic                       soft_reset_i,
    input  logic                       config_ok_i,
    input  logic [Regions-1:0][25:0]   base_i,
    input  logic [Regions-1:0][25:0]   lines_i,
    output logic                       busy_o,
    output logic                       done_o,
    output logic                       failed_o,
    output logic [3:0]                 stage_o,
    output logic [3:0]                 error_code_o,
    output logic [3:0]                 error_stage_o,
    output logic                       error_region_valid_o,
    output logic [2:0]                 error_region_o,
    output logic [31:0]                error_addr_o,
    output logic                       ended_well_o,   // for one cycle
    output logic                       ended_badly_o,  // for one cycle
    output logic                       clear_counters_o,

    // Units.
    output logic                       start_o,
    output logic                       clear_o,
    output logic                       running_o,
    input  logic                       unit_ready_i,
    input  logic                       unit_done_i,
    input  logic [3:0]                 unit_stage_i,
    input  logic                       unit_error_i,
    input  logic [3:0]                 unit_code_i,
    input  logic                       unit_region_valid_i,
    input  logic [2:0]                 unit_region_i,
    input  logic [31:0]                unit_addr_i,

    // Memory.
    input  logic                       violation_i,
    input  logic [2:0]                 violation_region_i,
    input  logic [31:0]                violation_addr_i,
    input  logic                       read_error_i,
    input  logic [31:0]                read_addr_i,
    input  logic                       write_error_i,
    input  logic [31:0]                write_addr_i,
    input  logic                       moved_i,        // something was taken or came back
    input  logic                       idle_i,         // nothing is under way
    input  logic [31:0]                waiting_addr_i  // what is waited for
);

  localparam int unsigned RegionWidth = $clog2(Regions);
  localparam int unsigned TimerWidth  = $clog2(TimeOut + 1);

  typedef enum logic [1:0] {
    Idle,
    Check,
    Run,
    Drain
  } state_e;

  state_e                 state_d, state_q;
  logic                   started_q, resetting_q;
  logic                   done_q, failed_q;
  logic [3:0]             code_q, stage_q;
  logic                   region_valid_q;
  logic [2:0]             region_q;
  logic [31:0]            addr_q;
  logic [RegionWidth-1:0] one_q, other_q;
  logic [TimerWidth-1:0]  timer_q;

  // --- Regions, two at a time ---

  // They are looked up in the cycle before, as registers do not change while a job is checked.
  logic [RegionWidth-1:0] one_d, other_d;
  logic [25:0] one_base_q, one_lines_q, other_base_q, other_lines_q;
  logic [26:0] one_end, other_end;
  logic        overlap, one_past_end, other_past_end, last_pair;
  always_ff @(posedge clk_i) begin
    one_base_q    <= base_i[one_d];
    one_lines_q   <= lines_i[one_d];
    other_base_q  <= base_i[other_d];
    other_lines_q <= lines_i[other_d];
  end
  assign one_end        = {1'b0, one_base_q} + {1'b0, one_lines_q};
  assign other_end      = {1'b0, other_base_q} + {1'b0, other_lines_q};
  assign overlap        = (one_lines_q != '0) && (other_lines_q != '0)
      && ({1'b0, one_base_q} < other_end) && ({1'b0, other_base_q} < one_end);
  assign one_past_end   = one_end > 27'h400_0000;
  assign other_past_end = other_end > 27'h400_0000;
  assign last_pair      = one_q == RegionWidth'(Regions - 2);

  always_comb begin
    one_d   = '0;
    other_d = RegionWidth'(1);
    if (state_q == Check) begin
      one_d   = one_q;
      other_d = other_q;
      if (!last_pair) begin
        other_d = other_q + 1'b1;
        if (other_q == RegionWidth'(Regions - 1)) begin
          one_d   = one_q + 1'b1;
          other_d = one_q + RegionWidth'(2);
        end
      end
    end
  end

  // --- What went wrong ---

  logic        timed_out, refused, error;
  logic [3:0]  code;
  logic        region_valid;
  logic [2:0]  region;
  logic [31:0] addr;
  assign timed_out = timer_q == TimerWidth'(TimeOut);

  always_comb begin
    error        = 1'b0;
    code         = 4'(xy_regs_pkg::error_code__none);
    region_valid = 1'b0;
    region       = '0;
    addr         = '0;
    unique case (state_q)
      Idle: begin
        error = start_i && !idle_i;
        code  = 4'(xy_regs_pkg::error_code__bus_timeout);
        addr  = waiting_addr_i;
      end
      Check: begin
        error        = refused;
        code         = 4'(xy_regs_pkg::error_code__bad_config);
        region_valid = config_ok_i;
        region       = one_past_end ? 3'(one_q) : 3'(other_q);
        if (abort_i) begin
          error        = 1'b1;
          code         = 4'(xy_regs_pkg::error_code__aborted);
          region_valid = 1'b0;
        end
      end
      default: begin
        error = 1'b1;
        if (violation_i) begin
          code         = 4'(xy_regs_pkg::error_code__out_of_region);
          region_valid = 1'b1;
          region       = violation_region_i;
          addr         = violation_addr_i;
        end else if (read_error_i) begin
          code = 4'(xy_regs_pkg::error_code__bus_read);
          addr = read_addr_i;
        end else if (write_error_i) begin
          code = 4'(xy_regs_pkg::error_code__bus_write);
          addr = write_addr_i;
        end else if (timed_out) begin
          code = 4'(xy_regs_pkg::error_code__bus_timeout);
          addr = waiting_addr_i;
        end else if (unit_error_i && (state_q == Run)) begin
          code         = unit_code_i;
          region_valid = unit_region_valid_i;
          region       = unit_region_i;
          addr         = unit_addr_i;
        end else if (abort_i) begin
          code = 4'(xy_regs_pkg::error_code__aborted);
        end else begin
          error = 1'b0;
        end
      end
    endcase
  end

  assign refused = !config_ok_i || overlap || one_past_end || other_past_end;

  // --- States ---

  logic first_error, ended;
  // What the last job came to does not matter when the next one starts.
  assign first_error = error && ((state_q == Idle) || !failed_q) && !resetting_q;

  always_comb begin
    state_d = state_q;
    ended   = 1'b0;
    unique case (state_q)
      Idle: begin
        if (soft_reset_i) state_d = Drain;
        else if (start_i) state_d = idle_i ? Check : Drain;
      end
      Check: begin
        if (soft_reset_i || error) state_d = Drain;
        else if (last_pair && unit_ready_i) state_d = Run;
      end
      Run: begin
        if (soft_reset_i || error || unit_done_i) state_d = Drain;
      end
      default: begin
        ended = idle_i || timed_out || (failed_q && (code_q == 4'(xy_regs_pkg::error_code__bus_timeout))
            && !started_q);
        if (ended && !soft_reset_i) state_d = Idle;
      end
    endcase
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q        <= Idle;
      started_q      <= 1'b0;
      resetting_q    <= 1'b0;
      done_q         <= 1'b0;
      failed_q       <= 1'b0;
      code_q         <= 4'(xy_regs_pkg::error_code__none);
      stage_q        <= 4'(xy_regs_pkg::stage__idle);
      region_valid_q <= 1'b0;
      region_q       <= '0;
      addr_q         <= '0;
      one_q          <= '0;
      other_q        <= RegionWidth'(1);
      timer_q        <= '0;
    end else begin
      state_q <= state_d;

      // Started: the unit has been let run, so memory may be at work for it.
      if (state_q == Idle) started_q <= 1'b0;
      else if (start_o) started_q <= 1'b1;

      if (moved_i || idle_i || (state_d != state_q)) timer_q <= '0;
      else if (!timed_out) timer_q <= timer_q + 1'b1;

      one_q   <= one_d;
      other_q <= other_d;

      if (soft_reset_i || (start_i && (state_q == Idle))) begin
        resetting_q    <= soft_reset_i;
        done_q         <= 1'b0;
        failed_q       <= 1'b0;
        code_q         <= 4'(xy_regs_pkg::error_code__none);
        stage_q        <= 4'(xy_regs_pkg::stage__idle);
        region_valid_q <= 1'b0;
        region_q       <= '0;
        addr_q         <= '0;
      end else if (ended && (state_q == Drain)) begin
        resetting_q <= 1'b0;
        done_q      <= !resetting_q;
      end
      if (first_error && !soft_reset_i) begin
        failed_q       <= 1'b1;
        code_q         <= code;
        stage_q        <= stage_o;
        region_valid_q <= region_valid;
        region_q       <= region;
        addr_q         <= addr;
      end
    end
  end

  logic first_run_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) first_run_q <= 1'b0;
    else first_run_q <= (state_d == Run) && (state_q != Run);
  end

  assign start_o   = first_run_q && (state_q == Run);
  assign running_o = state_q == Run;
  assign clear_o   = state_q == Drain;

  assign busy_o = state_q != Idle;
  assign done_o = done_q;
  assign failed_o = failed_q;

  always_comb begin
    unique case (state_q)
      Run: stage_o = unit_stage_i;
      Drain: stage_o = 4'(xy_regs_pkg::stage__drain);
      default: stage_o = 4'(xy_regs_pkg::stage__idle);
    endcase
  end

  assign error_code_o         = code_q;
  assign error_stage_o        = stage_q;
  assign error_region_valid_o = region_valid_q;
  assign error_region_o       = region_q;
  assign error_addr_o         = addr_q;

  logic ends;
  assign ends             = ended && (state_q == Drain) && !resetting_q && !soft_reset_i;
  assign ended_well_o     = ends && !failed_q && !first_error;
  assign ended_badly_o    = ends && (failed_q || first_error);
  assign clear_counters_o = soft_reset_i;

`ifndef SYNTHESIS
  // Units are started in their state after reset, and only while they may touch memory.
  a_start_is_running :
  assert property (@(posedge clk_i) disable iff (!rst_ni) start_o |-> running_o && !clear_o);

  // A job ends once, and says how.
  a_ends_once :
  assert property (@(posedge clk_i) disable iff (!rst_ni)
      ended_well_o || ended_badly_o |=> !busy_o && done_o);
`endif

endmodule
