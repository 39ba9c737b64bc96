"""Faults made by hand in what decides what the arm does: each must fail a fast test.

Each has the exact text in the source, which occurs there once, what stands there instead, and what
it would do to the arm or to the record. The guard's small faults are made by `mutants`.
"""

from __future__ import annotations

from typing import NamedTuple

from tests.mutation.mutants import PACKAGE, Mutant

__all__ = ["HAND_MADE", "HandMade"]


class HandMade(NamedTuple):
    """A file of the package, a text in it, what stands there instead, and what comes of it."""

    file: str
    text: str
    instead: str
    effect: str

    def mutant(self) -> Mutant:
        """Return the file with the fault."""
        path = PACKAGE / self.file
        source = path.read_text(encoding="utf-8").replace(self.text, self.instead)
        where = self.text.strip().split("\n")[0]
        return Mutant(path, f"{self.file}: {where} ({self.effect})", source)


TICK = "rig/acquisition/tick.py"
DECISION = "rig/acquisition/decision.py"
MODES = "rig/acquisition/control_modes.py"
SESSION = "rig/acquisition/session_run.py"
SESSION_END = "rig/acquisition/session_end.py"
ZEROING = "rig/acquisition/zeroing.py"
RUN = "rig/acquisition/controller_run.py"
STATES = "rig/acquisition/run_states.py"
SINK = "rig/acquisition/processes/ring_writer.py"
SIGNALS, LOOP, RECORDER, RECORDS, CONSOLE = (
    f"rig/acquisition/processes/{name}.py"
    for name in (
        *("end_signals", "loop_process", "recorder", "recorder_process"),
        "supervisor",
    )
)
PAGE, SERVER_STATE = "rig/console/page/live_socket.py", "rig/console/page/server_state.py"
ACCESS, TOKEN = "rig/console/page/access.py", "rig/console/page/page_token.py"
KEYS, ALARMS = "rig/console/stop_keys.py", "rig/console/alarms.py"
STEP, WATCH, LIMITS = "rig/guard/step.py", "rig/guard/watch.py", "rig/guard/limits.py"
WILD = "rig/guard/wild_torque.py"
AGREEMENT, CONTACT = "rig/guard/agreement.py", "rig/guard/contact.py"
TORQUES = "rig/guard/drive_torque.py"
CONSISTENCY, ANSWER = "rig/guard/consistency.py", "rig/guard/torque_answer.py"
CONTROLLER, COMPOSED = "model/controller.py", "rig/devices/composed.py"

HAND_MADE = tuple(
    HandMade(*fault)
    for fault in (
        # The drive's own torque
        (TORQUES, "size <= most and slope", "slope", "an offset is never found"),
        (TORQUES, "and slope * slope <= most * most * square", "", "a gain is found later"),
        (TORQUES, "- model.friction_nm * terms.sign", "+ model.friction_nm * terms.sign", "false"),
        (TORQUES, "+ model.zero_nm\n", "", "a sensor with a zero of its own is stopped"),
        (TORQUES, "allowed = terms.unknown * model.friction_nm", "allowed = 0.0", "false at rest"),
        (
            TORQUES,
            "allowed = terms.unknown * model.friction_nm",
            "allowed = model.friction_nm",
            "the friction hides a fault also where the drive slips",
        ),
        (TORQUES, "acceleration + angle_before_s * jerk", "acceleration", "stamps are not used"),
        (TORQUES, "if direction != toward:", "if False:", "it slips at once after turning back"),
        (TORQUES, "zero_nm=model.zero_nm - bias_nm", "zero_nm=model.zero_nm", "the zeroing counts"),
        (TORQUES, "if missing > MAX_FILLED or", "if", "a long gap is filled in with a line"),
        (
            TICK,
            "        loop.elapsed_ticks,\n        apart,\n",
            "        loop.elapsed_ticks,\n",
            "torques that disagree stop nothing",
        ),
        (
            TICK,
            "    loop.torques, loop.compared = zeroed(loop.torques, loop.compared, bias_nm)\n",
            "",
            "the zeroing is a fault",
        ),
        (
            DECISION,
            "disagreement if disagreement != _NO_CAUSE else apart",
            "disagreement",
            "torques that disagree stop nothing",
        ),
        # Time
        (MODES, "        loop.rig.read(late)\n", "", "begins with readings from before enabling"),
        (TICK, "loop.rig.read(loop.elapsed_ticks)", "loop.rig.read()", "rig not told of missed"),
        (TICK, "    loop.tick += ticks\n", "", "a late tick is made up for: commands in a burst"),
        (TICK, "elapsed_ticks = ticks + 1", "elapsed_ticks = 1", "missed ticks told to nobody"),
        (
            DECISION,
            "reported,\n        elapsed_ticks,",
            "reported,\n        1,",
            "the guard counts less than was sent: position and following are wrong",
        ),
        (TICK, "k = min(k + loop.elapsed_ticks - 1, last)", "pass", "the target lags"),
        (
            DECISION,
            "if missed_ticks >= stall_ticks:",
            "if False:",
            "a stall is only a missed tick",
        ),
        (
            DECISION,
            "Cause.DEADLINES_MISSED if",
            "Cause.NONE if",
            "a loop ever late goes on",
        ),
        (TICK, "    loop.late_in_a_row += 1\n", "", "a loop ever late goes on"),
        (TICK, ", loop.late_in_a_row = 1, 0", " = 1", "rare late ticks add up to a stop"),
        (
            DECISION,
            "guard = guard._replace(velocity_rad_s=0.0)",
            "pass",
            "after a stall the old velocity sets the arm going again",
        ),
        (TICK, "if from_outside == STALLED:", "if False:", "the same after a suspension"),
        (
            MODES,
            "        loop.clock.wait_until(loop.time_s)\n        loop.rig.write(velocity)",
            "        loop.rig.write(velocity)",
            "a ramp without waiting: the arm is stopped with a blow",
        ),
        (
            MODES,
            "max(abs(velocity) - _brake_rad_s(loop), 0.0)",
            "0.0",
            "a ramp that cannot be recorded is a blow",
        ),
        (MODES, "        _ramp_unrecorded(loop)\n", "", "a fault of the program leaves it moving"),
        (MODES, "except BaseException:", "except Exception:", "an interrupt leaves it moving"),
        (
            MODES,
            "math.ceil(abs(loop.guard.velocity_rad_s) / _brake_rad_s(loop))",
            "0",
            "a long ramp ends before rest and the power is cut",
        ),
        # Causes
        (TICK, "        loop.rig.disable()\n", "        pass\n", "a cut leaves the power on"),
        (
            TICK,
            "and was_cut != CUT",
            "and was_cut == 0",
            "an emergency stop in a ramp cuts nothing",
        ),
        (TICK, "stronger(late, reading.cause)", "late", "what the devices report is dropped"),
        (
            TICK,
            "stronger(stronger(late, reading.cause), from_outside)",
            "stronger(late, reading.cause)",
            "emergency stop, console, recorder are dropped",
        ),
        (
            TICK,
            "stronger(stronger(late, reading.cause), from_outside)",
            "stronger(reading.cause, from_outside)",
            "stalls and missed deadlines are dropped",
        ),
        (
            DECISION,
            "REACTIONS[other] > REACTIONS[cause]",
            "REACTIONS[other] < REACTIONS[cause]",
            "of two causes the weaker wins",
        ),
        (TICK, "if loop.guard.reaction > known:", "if False:", "an epoch goes on after a stop"),
        (
            TICK,
            "if loop.guard.reaction > known:",
            "if loop.guard.reaction > 1:",
            "the perturbation is not switched off on a hold",
        ),
        (
            TICK,
            "order.command is not Command.NONE and loop.take_order(order)",
            "False",
            "no order is taken",
        ),
        (
            DECISION,
            "        disagreement if disagreement != _NO_CAUSE else apart,\n    )",
            "    )",
            "motion nobody commanded is not stopped",
        ),
        (
            DECISION,
            "        elapsed_ticks,\n    )\n    guard,",
            "    )\n    guard,",
            "it is seen late after missed ticks",
        ),
        (STEP, "if cause == _NO_CAUSE:", "if True:", "the first cause is overwritten"),
        (
            STEP,
            "reaction = max(reaction, REACTIONS[found])",
            "reaction = REACTIONS[found]",
            "a later, weaker cause makes a stop a hold",
        ),
        (
            LIMITS,
            "state.reaction > Reaction.HOLD or state.velocity_rad_s != 0.0",
            "state.reaction > Reaction.HOLD",
            "a hold is released while the arm moves",
        ),
        # Readings
        (TICK, "if math.isfinite(torque_nm):", "if True:", "a NaN stays in the filter for ever"),
        (TICK, "loop.filtered, smooth_nm", "_, smooth_nm", "the filter forgets: torque all but 0"),
        (TICK, "command(reading, smooth_nm, k)", "command(reading, torque_nm, k)", "no filter"),
        (
            TICK,
            "due_s - motion_s,\n        due_s - torque_s,",
            "due_s - torque_s,\n        due_s - torque_s,",
            "an old angle passes as a new one",
        ),
        (
            TICK,
            "due_s - motion_s,\n        due_s - torque_s,",
            "due_s - motion_s,\n        due_s - motion_s,",
            "an old torque passes as a new one",
        ),
        (TICK, "if math.isfinite(angle):", "if True:", "the way back begins nowhere"),
        (WATCH, "if not torque_age_s <= limits.stale_s:", "if False:", "a silent sensor passes"),
        (WATCH, "if not age_s <= limits.stale_s:", "if False:", "a silent drive passes"),
        (CONSISTENCY, "found = int(Cause.MOVED_AT_REST)", "pass", "a drive that creeps passes"),
        (
            AGREEMENT,
            "cause = int(Cause.VELOCITY_WRONG)",
            "pass",
            "a velocity with no sense passes",
        ),
        (AGREEMENT, "> WRONG_GAIN *", "> 100 *", "a velocity of twice its size passes"),
        (AGREEMENT, "cause = int(Cause.SELDOM_FRESH)", "pass", "a sensor that pauses passes"),
        # Commands
        (TICK, "loop.rig.write(allowed)", "loop.rig.write(request)", "no limit reaches the wire"),
        (
            TICK,
            "        request,\n        sent,",
            "        request,\n        request,",
            "the record shows what was asked for, not what was sent",
        ),
        (
            TICK,
            "sent = loop.rig.write(allowed)",
            "sent = allowed * (loop.rig.write(allowed) == loop.rig.write(allowed))",
            "the record shows what was allowed; the drive is told twice",
        ),
        (
            TICK,
            "if limited == POSITION_LIMITED:",
            "if limited == STALLED:",
            "an epoch at the position limit counts",
        ),
        (
            STEP,
            "left = min(limits.position_rad, end) - toward * angle",
            "left = min(limits.position_rad, end) - angle",
            "one position limit is not kept",
        ),
        (
            STEP,
            "left = min(limits.position_rad, end) - toward * angle",
            "left = limits.position_rad - toward * angle",
            "the range of the person is not kept",
        ),
        (
            STEP,
            "end = limits.highest_rad if toward > 0.0 else -limits.lowest_rad",
            "end = limits.highest_rad",
            "one end of the range is taken for both",
        ),
        (
            STEP,
            "_stoppable_speed(softly, held_s, left + before)",
            "math.inf",
            "the speed of arrival has no bound",
        ),
        (
            WATCH,
            "if not limits.lowest_rad <= angle_rad + limits.tolerance_rad:",
            "if False:",
            "below the range nothing stops it",
        ),
        (
            WATCH,
            "if not angle_rad - limits.tolerance_rad <= limits.highest_rad:",
            "if False:",
            "above the range nothing stops it",
        ),
        (
            WATCH,
            "limited_s <= limits.at_limit_s and three_arrivals_s > limits.arrivals_s",
            "limited_s <= limits.at_limit_s",
            "an arm that comes to its limit again and again is not held",
        ),
        (
            CONTACT,
            "ticks += now - int(ring[place])",
            "ticks += now",
            "what was long ago is held against the arm",
        ),
        (
            WILD,
            "cause, last_s, before_s = int(Cause.TORQUE_WILD), math.inf, math.inf",
            "last_s, before_s = 0.0, last_s",
            "single samples that are wild are counted and nothing else",
        ),
        (WILD, "torque_age_s < age_s - _SAME_STAMP_S", "True", "a wild sample is hidden by itself"),
        (
            CONSISTENCY,
            "        unlike = of_sample\n",
            "        pass\n",
            "wild samples hold nothing",
        ),
        (CONTACT, " and not touching", "", "an arm that leans on its limit arrives all the time"),
        (
            CONTACT,
            "    state.at_limit[:] = 0\n",
            "",
            "what was before a release is taken off what comes after it",
        ),
        (
            WATCH,
            "if not abs(angle_rad) <= limits.position_rad",
            "if not angle_rad <= limits.position_rad",
            "beyond one position limit nothing stops it",
        ),
        (STEP, "elif sent < sent_before - change:", "elif False:", "blows toward one side"),
        # Control
        (
            MODES,
            "min(loop.elapsed_ticks, LONGEST_STEP) - 1",
            "0",
            "after a missed tick the admittance steps over one only",
        ),
        (
            MODES,
            "admittance_step(step, velocity, value, torque_nm), value",
            "admittance_step(step, velocity, -value, torque_nm), value",
            "the perturbation pushes the other way than recorded",
        ),
        (
            MODES,
            "loop.perturbation_scale * perturbation_nm[k]",
            "perturbation_nm[k]",
            "the operator cannot make the perturbation smaller",
        ),
        (MODES, "if not low <= value <= high:", "if False:", "any parameter is taken"),
        (
            MODES,
            "    start_rad = loop.angle_rad",
            "    start_rad = 0.0",
            "the way back is a jump",
        ),
        (
            MODES,
            "return round(age_ticks) if math.isfinite(age_ticks) else 0",
            "return 0",
            "an old reading is held against the present target",
        ),
        (
            CONTROLLER,
            "(perturbation_nm - torque_nm)",
            "(perturbation_nm + torque_nm)",
            "the drive pushes back against the subject: unstable",
        ),
        (CONTROLLER, "b2 * value - a2 * output", "b2 * value", "a filter that is none"),
        (CONTROLLER, "(target_rad - angle_rad)", "(angle_rad - target_rad)", "runs away"),
        # The session
        (ZEROING, "abs(bias_nm) > limits.bias_limit_nm", "False", "zeroed under load"),
        (
            ZEROING,
            "noise_sd_nm > limits.noise_limit_nm",
            "False",
            "zeroed while the subject moves",
        ),
        (
            SESSION,
            "why or motion_objection(readings, session.settings)",
            "why",
            "zeroed while the joint moves",
        ),
        (
            SESSION,
            "ticks.cause is Cause.NONE and not ticks.interrupted",
            "True",
            "a zero from a part of the time",
        ),
        (
            SESSION,
            "if loop.reaction is Reaction.HOLD:  #",
            "if True:  #",
            "the guard forgets arrivals at the limit at every return",
        ),
        (
            TICK,
            "        if loop.dose_reached:\n",
            "        if False:\n",
            "an arm that comes to its limit again and again goes on",
        ),
        (
            SESSION,
            "    run.begin(Phase.HOLD)\n    hold(run.loop, POLL_S)",
            "    rest(run.loop, POLL_S, 0.3)",
            "a paused arm is led back",
        ),
        (
            MODES,
            "        if abs(led) > speed_rad_s:  #",
            "        if False:  #",
            "a return as fast as the correction asks for",
        ),
        (
            TICK,
            "return self.at_rest and known.still_s > ramp_s and near",
            "return True",
            "nobody is needed while the arm comes to rest",
        ),
        (
            SINK,
            "self._state is State.PAUSED and loop.still",
            "self._state is State.PAUSED",
            "nobody is needed where the state is called a pause",
        ),
        (
            SERVER_STATE,
            "(not begun or loop.still != 0)",
            "(not begun or loop.state == 2)",
            "a page may be away from an arm that moves",
        ),
        (TICK, "    loop.rig.zero(bias_nm)\n", "", "the torque keeps its bias"),
        (
            SESSION,
            "        go_back(loop, duration_s, speed_rad_s)\n",
            "",
            "an epoch begins before the way back has ended",
        ),
        (
            SESSION,
            "while run.is_in(State.RUNNING) and not loop.still:",
            "while False:",
            "a release while the arm moves is an exception",
        ),
        (
            SESSION,
            "run.loop.reaction is before or run.may_go_on()",
            "True",
            "a hold after the order to go on is released at once",
        ),
        (
            SESSION_END,
            "    try:\n        ramp_to_rest(run.loop)\n    finally:\n",
            "    ramp_to_rest(run.loop)\n    if True:\n",
            "a ramp that fails leaves the power on and the record open",
        ),
        (
            SESSION_END,
            "    finally:\n        rig.disable()",
            "    except ZeroDivisionError:\n        raise\n    else:\n        rig.disable()",
            "a drive that cannot be stopped keeps its power",
        ),
        (
            SESSION_END,
            " else run.outcome\n        finally:",
            " else run.outcome\n        except ZeroDivisionError:\n"
            "            raise\n        else:",
            "where disabling fails the record stays open",
        ),
        (
            SESSION_END,
            "    if rig.powered:",
            "    if False:",
            "a drive that is not off asks for hands",
        ),
        (
            SESSION_END,
            "moved_rad > limit_rad and work_j > 0.0",
            "False",
            "a drive that moves with its power off is a success",
        ),
        (
            SESSION_END,
            "if loop.cause in (Cause.DRIVE_LOST, Cause.DRIVE_STATE):",
            "if False:",
            "a drive that no longer obeys is not told to brake",
        ),
        (SESSION_END, "            hold(loop, BRAKE_S)\n", "            pass\n", "falls unbraked"),
        (
            SESSION,
            '        run.outcome, run.reason = "fail", reason\n',
            "",
            "a program that failed ends with success",
        ),
        (SESSION_END, "if run.open_epoch is not None:", "if False:", "an epoch stays open"),
        # Orders
        (RUN, "self._rig.disable()", "pass", "a halt leaves the power on for a tick"),
        (
            RUN,
            "if self.loop.reaction <= Reaction.HOLD:",
            "if self.loop.reaction <= Reaction.RAMP:",
            "after a stop the session goes on",
        ),
        (
            RUN,
            "if self.loop.reaction is Reaction.NONE or",
            "if self.loop.reaction is not Reaction.RAMP or",
            "after a hold the session goes on by itself",
        ),
        (RUN, "Run(State.PAUSED, stop_next=self.run.stop_next)", "Run(State.PAUSED)", "goes on"),
        (STATES, "at_once=True, stop_next=run.stop_next", "at_once=True", "a stop is forgotten"),
        (STATES, "Run(State.RUNNING, stop_next=run.stop_next)", "Run(State.RUNNING)", "the same"),
        # What other processes say
        (SINK, "if words[emergency]:", "if False:", "the emergency stop is not read"),
        (SINK, "boot_ns - now_ns > self._suspended_ns", "False", "a suspension is not seen"),
        (SINK, "if words[ended]:", "if False:", "the arm moves on though told to end"),
        (SINK, "now_ns - words[console] > self._console_ns", "False", "nobody is there"),
        (SINK, "now_ns - words[recorder] > self._recorder_ns", "False", "nothing is recorded"),
        (SINK, "self._samples.lag() > self._max_lag", "False", "samples are lost"),
        (SINK, "getppid() != self._console_pid", "False", "a killed console is missed for a while"),
        (SINK, "return self._status.take()", "return Order()", "the operator is not heard"),
        (
            SINK,
            "self._words[self._places[2]] and not self._aborted",
            "False",
            "the arm moves on though a signal asked for the end",
        ),
        (
            SINK,
            "        self._words[self._heart] = monotonic_ns()\n",
            "",
            "a loop that runs is taken for one that hangs",
        ),
        # Between the processes
        (LOOP, " or os.getppid() != console_pid:", ":", "nobody is there when it begins"),
        (LOOP, "        console_pid=console_pid,\n", "", "a killed console is missed for a while"),
        (
            LOOP,
            "    except BaseException as error:",
            "    except ZeroDivisionError as error:",
            "a loop that fails leaves the record open",
        ),
        (RECORDS, "        loop.kill()\n", "", "a loop that hangs may move the arm again"),
        (
            RECORDS,
            "os.getppid() != console_pid or ",
            "",
            "a recorder without console and loop never ends",
        ),
        (
            CONSOLE,
            "            status.raise_flag(Flag.END_ASKED)\n",
            "",
            "a console that fails kills a loop that moves the arm",
        ),
        (
            CONSOLE,
            "            self._status.raise_flag(Flag.END_ASKED)\n",
            "",
            "the arm moves on, and nobody sees it",
        ),
        (
            CONSOLE,
            "beat(Role.CONSOLE, self._operator_seen_ns())",
            "beat(Role.CONSOLE)",
            "the arm moves on for a page that is gone",
        ),
        (CONSOLE, "            loop.kill()\n", "", "a loop that hangs keeps the program for ever"),
        (
            SIGNALS,
            "    signal.signal(signal.SIGTSTP, signal.SIG_IGN)\n",
            "",
            "Ctrl-Z leaves the last command in force",
        ),
        (SIGNALS, "signal.SIGINT and first", "signal.SIGINT", "a second Ctrl-C does nothing"),
        (
            RECORDER,
            "            self._copy(event.samples_before)\n",
            "",
            "an epoch has ended in a record that lacks its samples",
        ),
        (
            RECORDER,
            "            self._over_s = None\n",
            "",
            "a disk with room again is given up at once",
        ),
        (RECORDER, "        self._recording = new\n", "", "the operator is told of another disk"),
        # The contact
        (
            COMPOSED,
            "            if self._line is not None:\n                self._line.open_contact()\n"
            "        finally:\n            self._drive.disable()",
            "            self._drive.disable()\n        finally:\n"
            "            if self._line is not None:\n                self._line.open_contact()",
            "a drive that does not answer keeps its power for as long",
        ),
        # The page
        (
            PAGE,
            "status.raise_flag(Flag.EMERGENCY_STOP)",
            "status.post(Order(Command.PAUSE_NOW))",
            "the emergency stop only pauses",
        ),
        (
            PAGE,
            "status.post(Order(Command.PAUSE_NOW))",
            "pass",
            "a page that is left pauses nothing",
        ),
        (PAGE, "if not presence.has_control(page.secret):", "if False:", "anybody may order"),
        (
            PAGE,
            'if message.kind == "emergency":',
            'if message.kind == "emergency" and presence.has_control(page.secret):',
            "a page that watches cannot stop",
        ),
        (PAGE, "            self._state.press_stop()\n", "", "a session that starts goes on"),
        (
            PAGE,
            "self._attached is not None and presence.has_control(page.secret)",
            "self._attached is not None",
            "a page that only looks keeps the arm moving",
        ),
        (PAGE, "            presence.gone(page.secret)\n", "", "a page that is gone keeps control"),
        (
            ACCESS,
            'sum(name == b"host" for name, _ in scope["headers"]) != 1',
            "False",
            "a request may have two Host headers",
        ),
        (ACCESS, 'not scope["path"].startswith("/")', "False", "an address of another server"),
        (
            ACCESS,
            'f"http://{host}".lower()',
            'f"{origin.partition(chr(58))[0]}://{host}".lower()',
            "any scheme",
        ),
        (ACCESS, "(*self._names, reached)", '("*",)', "any name is this computer's"),
        (ACCESS, "if self._token and not same_token", "if False and not same_token", "no token"),
        (TOKEN, "0o600", "0o644", "others read the token"),
        (TOKEN, "mode & 0o077", "mode & 0o007", "a group reads the token"),
        (TOKEN, "not token and not is_loopback(host)", "False", "no token on a network"),
        (KEYS, 'return " " in text or "e" in text', "return False", "no key stops"),
        (KEYS, "    with tty:\n", "    if tty.__enter__():\n", "the terminal is not given back"),
        (KEYS, "return os.tcgetpgrp(keys) == os.getpgrp()", "return True", "keys of a shell"),
        (ALARMS, "if self._halted > before:", "if False:", "no stop is heard"),
        (ALARMS, "and self._halted == GOES_ON", "and False", "no caution is heard"),
        (ALARMS, "return HELD if facts.held else STOPPED", "return HELD", "a stop after a hold"),
        (SERVER_STATE, "still=self._still", "still=True", "the arm moves on without a page"),
    )
)
