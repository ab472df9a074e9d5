// xy_control lets units run only after a check, ends every job once, and never stays busy for ever.
//
// Registers stay as they are from a start until the next; everything else comes as it likes. That jobs
// come to an end is told as a bound: while something is under way at the memory port and nothing moves, the
// control is idle again after the check, a time-out in which the units say nothing, and another in which
// memory does not. Not counted is the time that it waits for a unit to be ready, and that in which one runs and nothing is
// under way; nothing but what the unit says, or who stops it, ends that. fv_port promises that no
// request waits while nothing is under way.
module fv_control (
    input logic        clk_i,
    input logic        start_i,
    input logic        abort_i,
    input logic        soft_reset_i,
    input logic        unit_ready_i,
    input logic        unit_done_i,
    input logic [3:0]  unit_stage_i,
    input logic        unit_error_i,
    input logic [3:0]  unit_code_i,
    input logic        unit_region_valid_i,
    input logic [2:0]  unit_region_i,
    input logic [31:0] unit_addr_i,
    input logic        violation_i,
    input logic [2:0]  violation_region_i,
    input logic [31:0] violation_addr_i,
    input logic        read_error_i,
    input logic [31:0] read_addr_i,
    input logic        write_error_i,
    input logic [31:0] write_addr_i,
    input logic        moved_i,
    input logic        idle_i,
    input logic [31:0] waiting_addr_i
);

  localparam int unsigned Regions     = 4;
  localparam int unsigned TimeOut     = 2;
  localparam int unsigned CheckCycles = Regions * (Regions - 1) / 2;
  localparam int unsigned Bound       = CheckCycles + 2 * (TimeOut + 1);

  (* anyconst *) logic                     config_ok;
  (* anyconst *) logic [Regions-1:0][25:0] base, lines;

  logic        rst_ni = 1'b0;
  logic        busy, done, failed, ended_well, ended_badly, start, clear, running;
  logic        clear_counters, region_valid;
  logic [3:0]  stage, code, error_stage;
  logic [2:0]  region;
  logic [31:0] addr;

  always_ff @(posedge clk_i) rst_ni <= 1'b1;

  xy_control #(
      .Regions(Regions),
      .TimeOut(TimeOut)
  ) u_control (
      .clk_i,
      .rst_ni,
      .start_i,
      .abort_i,
      .soft_reset_i,
      .config_ok_i         (config_ok),
      .base_i              (base),
      .lines_i             (lines),
      .busy_o              (busy),
      .done_o              (done),
      .failed_o            (failed),
      .stage_o             (stage),
      .error_code_o        (code),
      .error_stage_o       (error_stage),
      .error_region_valid_o(region_valid),
      .error_region_o      (region),
      .error_addr_o        (addr),
      .ended_well_o        (ended_well),
      .ended_badly_o       (ended_badly),
      .clear_counters_o    (clear_counters),
      .start_o             (start),
      .clear_o             (clear),
      .running_o           (running),
      .unit_ready_i,
      .unit_done_i,
      .unit_stage_i,
      .unit_error_i,
      .unit_code_i,
      .unit_region_valid_i,
      .unit_region_i,
      .unit_addr_i,
      .violation_i,
      .violation_region_i,
      .violation_addr_i,
      .read_error_i,
      .read_addr_i,
      .write_error_i,
      .write_addr_i,
      .moved_i,
      .idle_i,
      .waiting_addr_i
  );

  // --- What the regions are, said apart from how the control looks at them ---

  logic [CheckCycles-1:0] pair_bad;  // in the order of the check

  for (genvar a = 0; a < Regions; a++) begin : gen_one
    for (genvar b = a + 1; b < Regions; b++) begin : gen_other
      localparam int unsigned Pair = a * (2 * Regions - a - 1) / 2 + b - a - 1;
      logic [26:0] a_end, b_end;
      assign a_end = base[a] + lines[a];
      assign b_end = base[b] + lines[b];
      assign pair_bad[Pair] = a_end > 27'h400_0000 || b_end > 27'h400_0000
          || (lines[a] != '0 && lines[b] != '0 && !(a_end <= {1'b0, base[b]} || b_end <= {1'b0, base[a]}));
    end
  end

  // --- What the control does ---

  localparam logic [1:0] Idle = 2'd0, Check = 2'd1, Run = 2'd2, Drain = 2'd3;
  (* hierconn *) logic [1:0] \u_control.state_q , \u_control.one_q , \u_control.other_q ;
  (* hierconn *) logic [25:0] \u_control.one_base_q , \u_control.one_lines_q ;
  (* hierconn *) logic [25:0] \u_control.other_base_q , \u_control.other_lines_q ;
  (* hierconn *) logic       \u_control.resetting_q , \u_control.started_q , \u_control.first_run_q ;
  (* hierconn *) logic [1:0] \u_control.timer_q ;
  logic [1:0] state, one, other;
  logic       resetting, started, first_run;
  logic [1:0] timer;
  logic [2:0] checked;
  assign state     = \u_control.state_q ;
  assign one       = \u_control.one_q ;
  assign other     = \u_control.other_q ;
  assign resetting = \u_control.resetting_q ;
  assign started   = \u_control.started_q ;
  assign first_run = \u_control.first_run_q ;
  assign timer     = \u_control.timer_q ;
  assign checked   = 3'(one) + 3'(other) + 3'(one != '0) - 3'd1;  // pairs before this one

  // --- What happens ---

  logic       fresh, job = 1'b0;  // a job has started and not ended
  logic       ran = 1'b0;         // its unit has been started
  logic       fault;              // of the running job, or of one before it
  logic [4:0] still = '0;         // cycles without movement, while busy
  logic [4:0] owed = '0, was_owed = '0;  // of these, the last in which something was under way for a running unit
  logic       was_fault = 1'b0, was_end = 1'b0, was_well, was_failed = 1'b0, was_done = 1'b0;
  logic       was_reset = 1'b0, was_running = 1'b0, was_clear = 1'b0;
  logic [43:0] error, was_error;

  assign fresh = start_i && !busy && !soft_reset_i;
  assign fault = (running && !soft_reset_i
      && (violation_i || read_error_i || write_error_i || unit_error_i || abort_i))
      || (fresh && !idle_i);
  assign error = {code, error_stage, region_valid, region, addr};

  always_ff @(posedge clk_i) begin
    if (!rst_ni) begin
      job        <= 1'b0;
      ran        <= 1'b0;
      still      <= '0;
      owed       <= '0;
      was_owed   <= '0;
      was_fault  <= 1'b0;
      was_end    <= 1'b0;
      was_failed <= 1'b0;
      was_done   <= 1'b0;
      was_reset  <= 1'b0;
      was_running <= 1'b0;
      was_clear  <= 1'b0;
    end else begin
      if (soft_reset_i || ended_well || ended_badly) job <= 1'b0;
      else if (fresh) job <= 1'b1;
      if (soft_reset_i || ended_well || ended_badly) ran <= 1'b0;
      else if (start) ran <= 1'b1;
      if (!busy || moved_i || soft_reset_i || (running && idle_i)) still <= '0;
      else if (!(state == Check && checked == 3'(CheckCycles - 1) && !unit_ready_i)) still <= still + 1'b1;
      if (!running || moved_i || idle_i) owed <= '0;
      else if (owed != '1) owed <= owed + 1'b1;
      was_owed   <= owed;
      was_fault  <= fault;
      was_end    <= ended_well || ended_badly;
      was_well   <= ended_well;
      was_failed <= failed && !fresh && !soft_reset_i;
      was_done   <= done && !fresh && !soft_reset_i;
      was_reset  <= soft_reset_i;
      was_running <= running;
      was_clear  <= clear;
      was_error  <= error;
    end
  end

  // --- What the solver needs to know ---

  always_comb begin
    if (rst_ni) begin
      h_job : assert (job == (busy && !resetting));
      h_looked_up :
      assert (\u_control.one_base_q == base[one] && \u_control.one_lines_q == lines[one]
          && \u_control.other_base_q == base[other] && \u_control.other_lines_q == lines[other]);
      if (resetting) h_resetting : assert (state == Drain && !failed && !done);
      if (state == Check) begin
        h_pair : assert (one < other && still <= 5'(checked));
        h_checked : assert (checked == '0 || config_ok);
        for (int unsigned i = 0; i < CheckCycles; i++) assert (32'(checked) <= i || !pair_bad[i]);
      end
      if (state == Run) begin
        h_all_checked : assert (config_ok && pair_bad == '0);
        h_first : assert (ran != first_run);
        h_run_time : assert (still <= 5'(CheckCycles) + 5'(timer));
        h_owed : assert (5'(timer) <= owed);
      end else begin
        h_not_first : assert (!first_run);
      end
      if (state == Drain) h_drain_time : assert (still <= 5'(CheckCycles + TimeOut + 1) + 5'(timer));
      h_timer : assert (timer <= 2'(TimeOut));
      if (ran) h_ran : assert (job && state >= Run);
      if (job) h_started : assert (started == ran);
      if (job && failed) h_failed : assert (state == Drain);
      if (job && state == Drain && !failed) h_drains_well : assert (ran);
    end
  end

  always_comb begin
    if (rst_ni) begin
      // Units.
      a_runs_when_busy : assert (!running || (busy && !clear));
      if (was_running && !running) a_out_of_work : assert (clear && busy);
      if (was_clear && busy && !was_reset) a_cleared_to_the_end : assert (clear);
      a_checked_before_start : assert (!start || (config_ok && !failed && pair_bad == '0));
      a_started_once : assert (!start || (running && !ran));
      a_runs_after_start : assert (!running || start || ran);

      // Jobs.
      a_one_end : assert (!(ended_well && ended_badly));
      a_end_of_a_job : assert (!(ended_well || ended_badly) || job);
      a_busy_with_job : assert (!job || busy);
      if (was_end) a_end_is_told : assert (!busy && done && failed == !was_well);
      if (was_done) a_done_stays : assert (done);
      a_done_or_job : assert (!(done && job));
      if (was_reset) a_reset_forgets : assert (busy && !job && !done && !failed);

      // Errors.
      if (was_fault) a_fault_is_told : assert (failed && !running);
      if (was_failed) a_first_error_stays : assert (failed && error == was_error);
      if (ended_well) a_well_means_no_error : assert (ran && !failed);

      // Time.
      a_comes_to_an_end : assert (still <= 5'(Bound));
      // Nothing else went wrong.
      if (was_running && failed && !was_failed && !was_fault) begin
        a_given_up_for_memory : assert (code == 4'd6 && was_owed >= 5'(TimeOut));
      end

      c_well : cover (was_end && was_well);
      c_overlap : cover (was_end && !was_well && region_valid);
      c_out_of_time : cover (was_end && !was_well && code == 4'd6 && error_stage == 4'd6);
    end
  end

endmodule
