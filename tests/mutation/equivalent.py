"""Mutants that do the same as the module, by name, each with the reason."""

SLOWER = "looks closer where it need not; what it finds there does not limit"
ONE_WAY = "it is 1 or -1"
NEAR = "step.py _fastest_toward: "
ANSWER = "torque_answer.py "
SIGN = "torque_sign.py "
STEP = "consistency.py consistency_step: "

MOMENT = "a measured value in floating point is never met to the bit"
CAN = "cia402/drive.py Cia402Drive."
LOOP = "tick.py ControlLoop.__init__: "
SET = "each tick sets it before it is read"
ANEW = "each stretch sets it; a ramp before the first has no velocity to take off"
GIVEN = "a default that is never used: every result is made with all its fields"
ANY_SIGN = "infinite or no number in a sum makes the sum so, whatever the signs"
OF_NOTHING = "divides a column of nothing, or solves for what is 0"
BOTH_SIDES = "a scale of both sides, next to which what is added is a thousand-millionth"
SQUARE = "its rows are as many as its columns"
EMPTY = "before the first step the window is empty"
RAMP = "only a ramp uses it, and its controller does not ask for the tick's number"

EQUIVALENT: dict[str, str] = {
    "agreement.py means_step: passed_s > _SAME_STAMP_S → passed_s >= _SAME_STAMP_S": MOMENT,
    "consistency.py ended: ConsistencyState(*same, 0, 0, 0, 0, 0, *sums, state.wild) → "
    "ConsistencyState(*same, 0, 0, 0, 0, *sums, 0, state.wild)": "all are 0",
    "consistency.py ConsistencyState: ticks: int = 0 → ticks: int = -1": GIVEN,
    "consistency.py ConsistencyState: 0 → 1": GIVEN,
    "consistency.py ConsistencyState: 0 → -1": GIVEN,
    STEP + "same_s > age_s → same_s >= age_s": MOMENT,
    STEP + "1 → 0": "elapsed_ticks if not given: none counts as one",
    STEP + "elapsed_ticks < 1 → elapsed_ticks <= 1": "one counts as one",
    STEP + "1 → 2 #2": "one counts as one",
    STEP + "perturbation_nm + torque_nm + angle_rad + velocity_rad_s + age_s + torque_age_s → "
    "perturbation_nm + torque_nm + angle_rad + velocity_rad_s + age_s - torque_age_s": ANY_SIGN,
    STEP + "perturbation_nm + torque_nm + angle_rad + velocity_rad_s + age_s → "
    "perturbation_nm + torque_nm + angle_rad + velocity_rad_s - age_s": ANY_SIGN,
    STEP + "perturbation_nm + torque_nm + angle_rad + velocity_rad_s → "
    "perturbation_nm + torque_nm + angle_rad - velocity_rad_s": ANY_SIGN,
    STEP + "perturbation_nm + torque_nm + angle_rad → "
    "perturbation_nm + torque_nm - angle_rad": ANY_SIGN,
    STEP + "perturbation_nm + torque_nm → perturbation_nm - torque_nm": ANY_SIGN,
    ANSWER + "one_step: elapsed_s > LONGEST_S → elapsed_s >= LONGEST_S": "it becomes what it is",
    ANSWER + "one_step: needed > limits.unshown_nm * limits.unshown_nm → "
    "needed >= limits.unshown_nm * limits.unshown_nm": MOMENT,
    ANSWER + "one_step: shown < part * needed → shown <= part * needed": MOMENT,
    ANSWER + "one_step: if steps > 0: ... → if True: ...": EMPTY,
    ANSWER + "one_step: steps > 0 → steps >= 0": EMPTY,
    ANSWER + "one_step: 0 → -1": EMPTY,
    ANSWER + "store_row: rows % half + half → rows % half - half": "a place below zero counts from "
    "the end",
    SIGN + "difference_columns: 1.0 → 1.01": OF_NOTHING,
    SIGN + "difference_columns: 1.0 → 0.9900990099009901": OF_NOTHING,
    SIGN + "whitened: 0 → -1": "a column has one dimension",
    SIGN + "whitened: 1.0 → 1.01": BOTH_SIDES,
    SIGN + "whitened: 1.0 → 0.9900990099009901": BOTH_SIDES,
    SIGN + "whitened: 0.0 → 0.001 #2": OF_NOTHING,
    SIGN + "whitened: 0.0 → -0.001 #2": OF_NOTHING,
    SIGN + "solved_for: 0 → 1": SQUARE,
    SIGN + "solved_for: 0 → -1": SQUARE,
    CAN + "_check_watchdog: now_s - min(wire.commanded_s, wire.asked_s) > self._stops_itself_s → "
    "now_s - min(wire.commanded_s, wire.asked_s) >= self._stops_itself_s": MOMENT,
    CAN + "_find_cause: now_s - wire.heard_s > settings.heartbeat_s + settings.lost_s → "
    "now_s - wire.heard_s >= settings.heartbeat_s + settings.lost_s": MOMENT,
    CAN + "_find_cause: now_s > self._settled_s → now_s >= self._settled_s": MOMENT,
    CAN + "_find_cause: now_s - wire.asked_s > settings.lost_s → "
    "now_s - wire.asked_s >= settings.lost_s": MOMENT,
    CAN + "stop: self._wire.is_open and self._control is not Control.DISABLE_VOLTAGE → "
    "self._control is not Control.DISABLE_VOLTAGE": "a bus that was closed was told to disable",
    "ascii/drive.py AsciiDrive._check_horizon: now_s - self._commanded_s > "
    "self._settings.horizon_s → now_s - self._commanded_s >= self._settings.horizon_s": MOMENT,
    "ascii/drive.py AsciiDrive._try: self._line is None or not self._speaking → "
    "not self._speaking": "nothing is spoken to without a port",
    "controller.py minimum_jerk: elapsed_s >= duration_s → elapsed_s > duration_s": "at its end "
    "the polynomial and its derivative are 0, too",
    "step.py guard_step: 1 → 0": "elapsed_ticks if not given: none counts as one",
    NEAR + "(speed * speed + (1.0 / SOFTLY - 1.0) * faster) / (2.0 * acceleration) → "
    "(speed * speed + (1.0 / SOFTLY - 1.0) * faster) * (2.0 * acceleration)": SLOWER,
    NEAR + "2.0 * acceleration → 2.0 / acceleration": SLOWER,
    NEAR + "speed * speed - arrival2 → speed * speed + arrival2": SLOWER,
    NEAR + "1.0 / SOFTLY - 1.0 → 1.0 / SOFTLY + 1.0": SLOWER,
    NEAR + "1.0 → 1.01": SLOWER,
    NEAR + "1.0 → 0.9900990099009901 #2": SLOWER,
    NEAR + "0.0 → 0.001 #2": SLOWER,
    NEAR + "0.0 → -0.001 #2": "a thousandth of 1 rad²/s²: less than a rounding of the angle",
    NEAR + "toward > 0.0 → toward >= 0.0": ONE_WAY,
    NEAR + "0.0 → 0.001": ONE_WAY,
    NEAR + "0.0 → -0.001": ONE_WAY,
    NEAR + "if left >= speed * (reach_s + limits.interval_s + held_s) + stopping: ... → "
    "if False: ...": SLOWER,
    NEAR + "left >= speed * (reach_s + limits.interval_s + held_s) + stopping → "
    "left > speed * (reach_s + limits.interval_s + held_s) + stopping": SLOWER,
    "wild_torque.py wild_step: torque_nm + torque_age_s → torque_nm - torque_age_s": ANY_SIGN,
    "contact.py contact_step: min(passed, ring.size) → passed": "goes round again: the same",
    NEAR + "1 → 0": "a whole round of the ring is where it began",
    "step.py _most_serious: reported != _NO_CAUSE and REACTIONS[reported] >= REACTIONS[found] → "
    "REACTIONS[reported] >= REACTIONS[found]": "no cause has the least reaction: both are none",
    "step.py guard_step: if found != _NO_CAUSE: ... → if True: ...": "no cause changes neither it "
    "nor the reaction",
    "step.py _farthest_in_flight: 1 → 0": "none back gives 0, which is where it starts",
    "step.py _stoppable_speed: distance_rad <= 0.0 → distance_rad < 0.0": "the root gives 0, too",
    "session_run.py run_session: 0 → 1": "the next number where no epoch is planned: none repeats",
    "session_run.py run_session: 0 → -1": "the next number where no epoch is planned: none repeats",
    "zeroing.py motion_objection: "
    "range_deg <= limit_deg + settings.rig.motion.angle_resolution_deg → "
    "range_deg < limit_deg + settings.rig.motion.angle_resolution_deg": MOMENT,
    LOOP + "self.elapsed_ticks = 1 → pass": SET,
    LOOP + "1 → 2": SET,
    LOOP + "1 → 0": SET,
    LOOP + "self.late_ticks = self.missed_ticks = 0 → pass": ANEW,
    LOOP + "0 → 1 #3": ANEW,
    LOOP + "0 → -1 #3": ANEW,
    LOOP + "self.limited_ticks = 0 → pass": ANEW,
    LOOP + "0 → 1 #4": ANEW,
    LOOP + "0 → -1 #4": ANEW,
    LOOP + "self.limit_time_s = math.nan → pass": ANEW,
    "tick.py run_tick: sent != allowed and math.isfinite(sent) → math.isfinite(sent)": "what was "
    "sent as it was allowed is the guard's velocity already",
    "tick.py _at_limit: loop.limit_time_s <= due_s → loop.limit_time_s < due_s": "a later tick is "
    "due later",
    "session_end.py _after_power: angle_rad + reading.torque_nm → "
    "angle_rad - reading.torque_nm": ANY_SIGN,
    "session_end.py _after_power: return '' → return None": "nothing is as untrue as no words",
    "stop_report.py _velocity: means.reported_rad2 > means.moved_rad2 → "
    "means.reported_rad2 >= means.moved_rad2": "of equal ones neither is 1.5 times the other",
    "stop_report.py _stalled: if math.isfinite(latched.measured): ... → if True: ...": "of a "
    "number and NaN after it the number is the larger",
    "control_modes.py ramp_to_rest: 0 → 1": RAMP,
    "control_modes.py ramp_to_rest: 0 → -1": RAMP,
    "ring_writer.py SharedSupervision.__init__: 3 → 4": "one look at both clocks more",
    "tick.py run_tick: 0 → 1": RAMP,
    "tick.py run_tick: 0 → -1": RAMP,
}
