"""A whole session on an exact rig: its order, what is ordered, and what the guard makes of it."""

import math
from itertools import pairwise

import pytest
from tests.unit.rig.acquisition.exact_rig import Desk
from tests.unit.rig.acquisition.whole_session import (
    EPOCH,
    LOOK,
    RATE_HZ,
    REST,
    RETURN,
    STOP,
    VALUES,
    session,
)

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import NO_DOSE, Dose, prbs_nm
from rigidimeter.rig.acquisition import REMEDIES, Command, Order, SessionResult, State
from rigidimeter.rig.guard import Cause, Limited

# As planned


def test_a_session_runs_what_was_planned_tells_it_and_takes_the_power_away():
    ran = session(before_epoch=lambda planned: {"note": planned.number})
    assert ran.result == SessionResult("success", "", 2, 2, Cause.NONE)
    assert [event["event"] for event in ran.sink.events] == [
        "session_started",
        *2 * ("epoch_started", "epoch_ended", "return_started"),
    ]
    assert ran.sink.events[0]["time_s"] == 0.0
    first, second = ran.sink.of("epoch_started")
    assert (first["time_s"], first["note"], first["label"]) == (0.0, 1, "1")
    assert (second["time_s"], second["note"], second["label"]) == (
        (EPOCH + STOP + RETURN + REST) / RATE_HZ,
        2,
        "2",
    )
    assert (first["planned_s"], first["task"], first["epoch"]) == (1.0, "prbs", 1)
    ended = ran.sink.of("epoch_ended")[0]
    assert ended == {
        **{"event": "epoch_ended", "epoch": 1, "time_s": 1.0, "outcome": "success", "reason": ""},
        **{"limited_ticks": ended["limited_ticks"], "late_ticks": 0, "missed_ticks": 0},
        "counts": {"lost": 3, "torque_wild": 0},
        "dose": {"epochs": 1, "motion_s": 1.0, "arrivals": 0},
    }
    assert ran.rig.calls[0] == ("enable",)
    assert ran.rig.until_off[-2:] == [("write", 0.0), ("disable",)]
    assert ran.rig.of("disable") == [None]
    assert [run.state for run in ran.states] == [State.RUNNING, State.STOPPING]
    epochs = [s.epoch for s in ran.sink.samples][: 2 * (EPOCH + STOP + RETURN + REST)]
    between = [-1] * (STOP + RETURN + REST)
    assert epochs == [1] * EPOCH + between + [2] * EPOCH + between
    planned_nm = prbs_nm(parse_settings(VALUES).prbs, RATE_HZ).tolist()
    assert [s.perturbation_nm for s in ran.sink.samples[:EPOCH]] == planned_nm
    (time_s, outcome, reason) = ran.sink.closed[0]
    assert (outcome, reason, len(ran.sink.closed)) == ("success", "", 1)
    assert time_s == len(ran.sink.samples) / RATE_HZ


def test_who_watches_is_given_the_loop_before_its_first_tick():
    seen = []
    ran = session(watch=lambda loop: seen.append((loop, loop.tick, len(loop.rig.calls))))
    ((loop, tick, calls),) = seen
    assert (tick, calls) == (0, 0)
    assert loop.tick == len(ran.sink.samples) > 0


def test_a_sinusoid_is_imposed_where_one_is_planned():
    values = {"protocol": {**VALUES["protocol"], "blocks": [{"task": "sinusoid", "epochs": 1}]}}
    ran = session(values=values)
    assert ran.epochs == [(1, "success")]
    assert not any(s.perturbation_nm for s in ran.sink.samples)
    angles = [s.angle_rad for s in ran.sink.samples[:EPOCH]]
    assert max(map(abs, angles)) > math.radians(0.5)


def test_the_ticks_that_enabling_took_are_left_out():
    ran = session(late={0: 0.512})
    assert ran.sink.samples[0].tick == 25
    assert ran.rig.of("read")[:2] == [25, 1]
    assert ran.sink.of("epoch_started")[0]["time_s"] == 0.5


def repeated_as(ran):
    """Return of each epoch the number of its repetition, as it is told at the epoch's end."""
    return [ended.get("again_as") for ended in ran.sink.of("epoch_ended")]


def test_an_epoch_in_which_a_limit_held_is_a_fail_and_repeated_last_if_wanted():
    # One arrival in each, three of them in more than 10 s.
    protocol = {**VALUES["protocol"], "repeat_limited": True, "rests_s": [5.0]}
    values = {"guard": {**VALUES["guard"], "position_limit_deg": 6.5}, "protocol": protocol}
    ran = session(values=values)
    assert ran.labels == ["1", "2", "1r", "2r"]
    assert [number for number, _ in ran.epochs] == [1, 2, 3, 4]
    assert {outcome for _, outcome in ran.epochs} == {"fail"}
    assert "position limit of ±6.5 deg" in ran.sink.of("epoch_ended")[0]["reason"]
    assert (ran.result.outcome, ran.result.epochs_run, ran.result.epochs_good) == ("success", 4, 0)
    assert repeated_as(ran) == [3, 4, None, None]


def test_an_epoch_that_went_well_is_not_repeated():
    ran = session(values={"protocol": {**VALUES["protocol"], "repeat_limited": True}})
    assert (ran.labels, ran.result.epochs_good) == (["1", "2"], 2)


def test_a_sinusoid_is_what_the_settings_describe():
    """θ = A sin(2π t) with ends of 0.1 s, and its derivative."""
    protocol = {**VALUES["protocol"], "blocks": [{"task": "sinusoid", "epochs": 1}]}
    ran = session(values={"protocol": protocol})
    samples = [s for s in ran.sink.samples if s.epoch == 1]
    amplitude_rad = math.radians(1.0)
    for k in range(10, 40):  # between the ends
        expected = amplitude_rad * math.sin(2 * math.pi * k / RATE_HZ)
        assert samples[k].target_angle_rad == pytest.approx(expected, abs=1e-12)
        led = 2 * math.pi * amplitude_rad * math.cos(2 * math.pi * k / RATE_HZ)
        error = samples[k].target_angle_rad - samples[k].angle_rad
        assert samples[k].velocity_request_rad_s == pytest.approx(led + error, abs=1e-12)


# Orders


def test_an_epoch_in_which_a_limit_held_is_a_fail_also_if_an_operator_ends_it():
    values = {"guard": {**VALUES["guard"], "position_limit_deg": 2.5}}
    ran = session(Desk(orders={48: Command.PAUSE_NOW, 100: Command.STOP}), values=values)
    assert ran.epochs[0] == (1, "fail")
    assert "position limit of ±2.5 deg" in ran.sink.of("epoch_ended")[0]["reason"]


def test_a_pause_waits_for_the_epoch_and_goes_back_once_it_is_resumed():
    ran = session(Desk(orders={10: Command.PAUSE, 200: Command.RESUME}))
    assert ran.result.outcome == "success"
    assert ran.labels == ["1", "2"]
    # Looks of 0.1 s, in the last of which it is resumed, then the way back.
    second = ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ
    assert second == pytest.approx(200 + LOOK + RETURN)
    led = [math.isfinite(s.target_angle_rad) for s in ran.sink.samples[EPOCH : round(second)]]
    assert led == [False] * (len(led) - RETURN) + [True] * RETURN
    assert [r.state for r in ran.states] == [
        *(State.RUNNING, State.RUNNING, State.PAUSED, State.RUNNING, State.STOPPING)
    ]


BRAKED_RAD_S = math.radians(parse_settings(VALUES).guard.acceleration_limit_deg_s2) / RATE_HZ


@pytest.mark.parametrize("order", [Command.PAUSE_NOW, Command.PAUSE, None])
def test_a_pause_holds_the_arm_still_until_it_is_resumed(order):
    """Ordered, or by the guard: zero within the ramp, and no motion before the order to go on."""
    orders = {300: Command.RESUME} if order is None else {30: order, 300: Command.RESUME}
    causes = {30: Cause.TORQUE_HIGH} if order is None else {}
    ran = session(Desk(causes, orders))
    ended = round(ran.sink.of("epoch_ended")[0]["time_s"] * RATE_HZ)
    sent = [s.velocity_command_rad_s for s in ran.sink.samples]
    before = sent[ended - 2]
    assert before != 0.0
    ramp = math.ceil(abs(before) / BRAKED_RAD_S)
    assert not any(sent[ended + ramp : 301])
    assert len({s.angle_rad for s in ran.sink.samples[ended + ramp + 1 : 301]}) == 1
    assert abs(ran.sink.samples[300].angle_rad) > math.radians(0.02)
    assert any(sent[301:])


@pytest.mark.parametrize(("speed_deg_s", "lasts_s"), [(100.0, 0.5), (8.0, None)])
def test_a_return_is_no_faster_than_its_limit(speed_deg_s, lasts_s):
    """T = max(return_s, 15/8 θ₀ / v), whose peak is 15/8 θ₀ / T; here from about 6 deg."""
    protocol = {**VALUES["protocol"], "return_speed_deg_s": speed_deg_s}
    desk = Desk(orders={25: Command.PAUSE_NOW, 90: Command.RESUME})
    ran = session(desk, values={"protocol": protocol})
    told = ran.sink.of("return_started")[0]
    from_rad = told["from_rad"]
    lasts_s = lasts_s or 15.0 / 8.0 * abs(from_rad) / math.radians(speed_deg_s)
    assert told["duration_s"] == pytest.approx(lasts_s)
    begun = round(told["time_s"] * RATE_HZ)
    assert ran.sink.samples[begun].angle_rad == pytest.approx(from_rad)
    second = round(ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ)
    way = ran.sink.samples[begun:second]
    assert len(way) == math.ceil(lasts_s * RATE_HZ - 1e-9)
    peak_rad_s = 15.0 / 8.0 * abs(from_rad) / (len(way) / RATE_HZ)
    fastest = max(abs(s.velocity_command_rad_s) for s in way)
    assert fastest <= math.radians(speed_deg_s)
    assert fastest == pytest.approx(peak_rad_s, rel=0.02)
    assert abs(way[-1].angle_rad) < math.radians(0.1)


def test_a_return_takes_the_time_that_the_guard_leaves_it():
    """Where the speed limit is below the return's own, the arm must still be back for the epoch."""
    values = {
        "protocol": {**VALUES["protocol"], "return_speed_deg_s": 40.0},
        "guard": {**VALUES.get("guard", {}), "speed_limit_deg_s": 4.0},
    }
    desk = Desk(orders={60: Command.PAUSE_NOW, 90: Command.RESUME})
    ran = session(desk, values=values)
    told = ran.sink.of("return_started")[0]
    lasts_s = 15.0 / 8.0 * abs(told["from_rad"]) / math.radians(4.0)
    assert told["duration_s"] == pytest.approx(lasts_s)
    assert lasts_s > VALUES["protocol"]["return_s"]
    second = round(ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ)
    assert abs(ran.sink.samples[second].angle_rad) < math.radians(0.1)


def test_a_pause_on_the_way_back_holds_there_and_the_next_way_back_begins_there():
    pause = EPOCH + STOP + RETURN // 2
    ran = session(Desk(orders={pause: Command.PAUSE_NOW, 200: Command.RESUME}))
    assert ran.sink.samples[pause].velocity_command_rad_s != 0.0
    assert not any(s.velocity_command_rad_s for s in ran.sink.samples[pause + 3 : 201])
    first, second = ran.sink.of("return_started")[:2]
    assert second["time_s"] > 200 / RATE_HZ
    assert 0.0 < abs(second["from_rad"]) < abs(first["from_rad"])
    assert (ran.result.outcome, ran.labels) == ("success", ["1", "2"])


def test_a_stop_while_the_arm_comes_to_rest_leaves_return_and_rest_out():
    ran = session(Desk(orders={EPOCH + 2: Command.STOP}))
    assert ran.sink.of("return_started") == []
    assert (ran.result.outcome, ran.labels) == ("success", ["1"])
    assert len(ran.sink.samples) <= EPOCH + 2 * STOP


def test_a_paused_run_looks_every_tenth_of_a_second_whether_it_may_go_on():
    """At 1 kHz: 11 ticks, looks of 100 in the fifth of which it is resumed, the way back."""
    desk = Desk(orders={10: Command.PAUSE_NOW, 500: Command.RESUME})
    ran = session(desk, values={"rig": {}})
    assert ran.sink.of("epoch_started")[1]["time_s"] == pytest.approx(0.011 + 0.5 + 0.5)


def test_a_pause_now_ends_the_epoch_which_comes_again_first_and_once():
    ran = session(
        Desk(
            orders={
                10: Command.PAUSE_NOW,
                60: Command.RESUME,
                110: Command.PAUSE_NOW,
                170: Command.RESUME,
            }
        )
    )
    assert ran.labels == ["1", "1r", "2"]
    assert ran.epochs == [(1, "abort"), (3, "abort"), (2, "success")]
    assert ran.sink.of("epoch_ended")[0]["reason"] == "ended by the operator"
    assert (ran.result.epochs_run, ran.result.epochs_good) == (3, 1)
    assert repeated_as(ran) == [3, None, None]


@pytest.mark.parametrize(
    ("orders", "ended", "outcome", "reason"),
    [
        ({10: Command.STOP}, ["success"], "success", "stopped by the operator with 1 epochs left"),
        ({60: Command.STOP}, ["success"], "success", "stopped by the operator with 1 epochs left"),
        ({10: Command.ABORT}, ["abort"], "abort", "aborted by the operator with 2 epochs left"),
        ({60: Command.ABORT}, ["success"], "abort", "aborted by the operator with 1 epochs left"),
        (
            {10: Command.PAUSE, 90: Command.STOP},
            *(["success"], "success", "stopped by the operator with 1 epochs left"),
        ),
        (
            {10: Command.STOP, 20: Command.PAUSE_NOW, 90: Command.RESUME},
            *(["abort"], "success", "stopped by the operator with 2 epochs left"),
        ),
    ],
)
def test_a_stop_and_an_abort(orders, ended, outcome, reason):
    ran = session(Desk(orders=orders))
    assert [how for _, how in ran.epochs] == ended
    assert (ran.result.outcome, ran.result.reason) == (outcome, reason)
    assert ran.sink.closed[0][1:] == (outcome, reason)
    assert ran.rig.until_off[-1] == ("disable",)
    assert ran.states[-1].state is State.STOPPING


def test_an_abort_on_the_way_back_of_a_pause_only_ramps():
    orders = {10: Command.PAUSE, 98: Command.RESUME, 112: Command.ABORT}
    ran = session(Desk(orders=orders))
    assert ran.sink.samples[112].velocity_command_rad_s != 0.0
    assert len(ran.sink.samples) <= 113 + 2
    assert ran.result.outcome == "abort"


def test_a_stop_in_a_rest_does_not_wait_for_its_end():
    ran = session(Desk(orders={EPOCH + STOP + RETURN + 5: Command.STOP}))
    assert len(ran.sink.samples) < EPOCH + STOP + RETURN + 10


def test_a_halt_takes_the_power_away_in_its_tick():
    ran = session(Desk(orders={10: Command.HALT}))
    last_read = [k for k, call in enumerate(ran.rig.calls) if call[0] == "read"][10]
    assert [call[0] for call in ran.rig.calls[last_read : last_read + 3]] == [
        *("read", "write", "disable")
    ]
    assert ran.result.outcome == "fail"
    assert ran.result.cause is Cause.OPERATOR_HALT
    assert ran.result.reason.startswith(f"{Cause.OPERATOR_HALT.sentence}; see to the subject")
    assert ran.epochs[0] == (1, "abort")
    assert ran.states[-1].state is State.FAULTED


@pytest.mark.parametrize("hold", [{20: Cause.TORQUE_HIGH}, {59: Cause.TORQUE_HIGH}])
def test_a_halt_while_the_guard_holds_is_the_end_too(hold):
    """Nothing resumes it; 20 is in the first epoch, 59 just before the order."""
    ran = session(Desk(hold, {60: Command.HALT, 90: Command.RESUME}))
    assert (ran.result.outcome, ran.result.cause) == ("fail", Cause.OPERATOR_HALT)
    assert len(ran.epochs) == 1
    assert ran.states[-1].state is State.FAULTED
    assert len(ran.sink.samples) < 90
    assert not any(s.velocity_command_rad_s for s in ran.sink.samples[60:])


def test_an_order_is_told_with_its_state_and_what_it_changed():
    change = Order(Command.CHANGE, "perturbation_scale", 0.5)
    ran = session(Desk(orders={10: change, 20: Command.PAUSE}))
    told = ran.sink.of("order")
    facts = {"name": "perturbation_scale", "value": 0.5, "before": 1.0}
    assert told[0] == {
        "event": "order",
        "time_s": 0.22,
        "command": "change",
        "state": "running",
        **facts,
    }
    assert (told[1]["command"], told[1]["state"], "name" in told[1]) == ("pause", "running", False)


@pytest.mark.parametrize(
    ("causes", "orders", "state"),
    [
        ({}, {10: Command.ABORT}, State.STOPPING),
        ({20: Cause.DRIVE_FAULT}, {}, State.FAULTED),
        ({}, {}, State.STOPPING),
    ],
)
def test_that_no_more_ticks_are_due_is_said_once_the_arm_is_at_rest(causes, orders, state):
    loops, said = [], []
    session(
        Desk(causes, orders),
        values={"guard": {**VALUES["guard"], "acceleration_limit_deg_s2": 100.0}},
        watch=loops.append,
        state_changed=lambda run: said.append((run.state, loops[0].at_rest)),
    )
    assert said[-1] == (state, True)


# Causes


def test_a_stop_of_the_guard_ends_the_session_with_its_cause():
    ran = session(Desk({20: Cause.DRIVE_FAULT}))
    account = f"{Cause.DRIVE_FAULT.sentence}; {REMEDIES[Cause.DRIVE_FAULT]}"
    why = f"the guard stopped the rig: {account}"
    assert ran.result == SessionResult("fail", why, 1, 0, Cause.DRIVE_FAULT)
    assert ran.epochs == [(1, "fail")]
    of_epoch = f"the guard stopped the rig: {Cause.DRIVE_FAULT.sentence}"
    assert ran.sink.of("epoch_ended")[0]["reason"] == of_epoch
    latched = ran.sink.of("guard_latched")
    assert [(e["cause"], e["reaction"], e["epoch"]) for e in latched] == [
        ("drive_fault", "ramp", 1)
    ]
    assert latched[0]["sentence"] == account
    first = next(sample for sample in ran.sink.samples if sample.cause)
    assert latched[0]["time_s"] == first.time_s
    assert latched[0]["time_s"] == pytest.approx(20 / RATE_HZ)
    assert ran.states[-1].state is State.FAULTED
    assert ran.rig.until_off[-1] == ("disable",)
    assert ran.rig.of("stop") == []


@pytest.mark.parametrize("tick", [60, 90])
def test_a_stop_in_a_rest_or_a_pause_ends_it_too(tick):
    ran = session(Desk({tick: Cause.DRIVE_FAULT}, {10: Command.PAUSE} if tick == 90 else {}))
    assert (ran.result.cause, ran.labels) == (Cause.DRIVE_FAULT, ["1"])
    assert ran.result.outcome == "fail"


def test_a_hold_is_a_pause_that_the_operator_ends():
    ran = session(Desk({20: Cause.TORQUE_HIGH}, {90: Command.RESUME}))
    assert ran.epochs == [(1, "fail"), (2, "success")]
    assert (ran.result.outcome, ran.result.cause) == ("success", Cause.NONE)
    assert len(ran.sink.of("guard_latched")) == 1
    held = ran.sink.samples[40:90]
    assert not any(s.velocity_command_rad_s for s in held)
    assert {s.cause for s in held} == {int(Cause.TORQUE_HIGH)}
    second = ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ
    way_back = ran.sink.of("return_started")[0]["duration_s"] * RATE_HZ
    assert second == pytest.approx(91 + math.ceil(way_back))
    epoch = [s for s in ran.sink.samples if s.epoch == 2]
    assert {s.cause for s in epoch} == {0}
    assert any(s.velocity_command_rad_s for s in epoch)


@pytest.mark.parametrize(("resume", "hold"), [(20, 25), (51, 52)])
def test_a_hold_that_comes_after_the_order_to_go_on_is_not_ended_by_it(resume, hold):
    """While the arm comes to rest, looking every 5 ticks from 11 on."""
    orders = {10: Command.PAUSE_NOW, resume: Command.RESUME, 200: Command.RESUME}
    ran = session(Desk({hold: Cause.TORQUE_HIGH}, orders))
    assert ran.epochs[0] == (1, "abort")
    assert {s.cause for s in ran.sink.samples[hold:201]} == {int(Cause.TORQUE_HIGH)}
    assert ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ == pytest.approx(201 + RETURN, abs=4)
    states = [run.state for run in ran.states]
    resumed = [State.RUNNING, State.PAUSED]
    assert states == [*resumed, State.PAUSED, *resumed, State.RUNNING, State.STOPPING]


def test_a_hold_without_an_operator_is_the_end():
    ran = session(Desk({20: Cause.TORQUE_HIGH}, attended=False))
    assert ran.labels == ["1"]
    assert ran.result.cause is Cause.TORQUE_HIGH
    assert ran.result.reason.startswith(
        "the guard held the rig and no operator was there to continue: "
        f"{Cause.TORQUE_HIGH.sentence}: "
    )


@pytest.mark.parametrize("hold", [23, 40])  # while the arm comes to rest, and on the way back
def test_without_an_operator_no_epoch_begins_after_a_hold_on_the_way_back(hold):
    orders = {10: Command.PAUSE_NOW, 20: Command.RESUME}
    ran = session(Desk({hold: Cause.TORQUE_HIGH}, orders, attended=False))
    assert (ran.labels, ran.result.cause) == (["1"], Cause.TORQUE_HIGH)


def test_a_session_in_one_process_has_no_operator_who_could_continue():
    def high(tick, reading):
        return reading._replace(cause=int(Cause.TORQUE_HIGH)) if tick == 20 else reading

    ran = session(None, change=high)
    assert ran.labels == ["1"]
    assert "no operator was there to continue" in ran.result.reason


def test_an_ordered_stop_outlives_a_hold_and_a_resume():
    ran = session(Desk({20: Cause.TORQUE_HIGH}, {10: Command.STOP, 90: Command.RESUME}))
    assert ran.labels == ["1"]
    assert ran.result.reason == "stopped by the operator with 1 epochs left"


def test_resumed_while_the_arm_still_moves_it_waits_for_rest():
    """The ramp from the limit takes 0.2 s at 30 deg/s², the order to go on comes within it."""
    guard = {**VALUES["guard"], "acceleration_limit_deg_s2": 30.0}
    ran = session(Desk({45: Cause.TORQUE_HIGH}, {47: Command.RESUME}), values={"guard": guard})
    assert ran.error is None
    assert ran.epochs[0] == (1, "fail")
    steps = [
        abs(after.velocity_command_rad_s - before.velocity_command_rad_s)
        for before, after in pairwise(ran.sink.samples)
    ]
    assert max(steps) <= math.radians(30.0) / RATE_HZ * (1 + 1e-9)
    released = next(s for s in ran.sink.samples[46:] if s.cause == 0)
    assert ran.sink.samples[released.tick - 1].velocity_command_rad_s == 0.0


@pytest.mark.parametrize(
    ("causes", "orders", "outcome"),
    [({}, {52: Command.ABORT}, "abort"), ({52: Cause.DRIVE_FAULT}, {}, "fail")],
)
def test_ended_while_the_arm_still_comes_to_rest_no_epoch_begins(causes, orders, outcome):
    guard = {**VALUES["guard"], "acceleration_limit_deg_s2": 30.0}
    desk = Desk({45: Cause.TORQUE_HIGH, **causes}, {47: Command.RESUME, **orders})
    ran = session(desk, values={"guard": guard})
    assert ran.sink.samples[52].velocity_command_rad_s != 0.0
    assert (ran.result.outcome, ran.labels) == (outcome, ["1"])


# The dose


def test_what_was_done_is_counted_with_each_epoch():
    ran = session(dose_before=Dose(5, 30.0, 1))
    first, second = (event["dose"] for event in ran.sink.of("epoch_ended"))
    assert first == {"epochs": 6, "motion_s": pytest.approx(31.0), "arrivals": 1}
    # An epoch of 1 s and a return of 0.5 s; neither the stop before it nor the rest counts.
    assert second == {"epochs": 7, "motion_s": pytest.approx(32.5), "arrivals": 1}


@pytest.mark.parametrize(
    ("dose", "before", "words"),
    [
        ({"epochs": 1}, NO_DOSE, "1 epochs were run, the most of one session (dose.epochs)"),
        ({"epochs": 4}, Dose(3, 0.0, 0), "4 epochs were run"),
        ({"motion_min": 0.1}, Dose(0, 3.6, 0), "longer than"),
    ],
)
def test_a_session_ends_after_the_epoch_with_which_its_dose_is_reached(dose, before, words):
    words = words if words != "longer than" else "with another epoch for more than 0.1 min"
    ran = session(values={"dose": dose}, dose_before=before)
    assert (ran.result.outcome, ran.epochs) == ("success", [(1, "success")])
    assert words in ran.result.reason
    assert ran.result.reason.endswith("1 epochs are left")
    assert ran.sink.of("return_started") == []
    assert ran.rig.until_off[-1] == ("disable",)


def test_a_dose_that_is_just_enough_for_the_protocol_changes_nothing():
    ran = session(values={"dose": {"epochs": 2}})
    assert (ran.result.outcome, ran.result.reason, len(ran.epochs)) == ("success", "", 2)


def test_a_session_that_has_had_its_dose_runs_no_epoch():
    ran = session(values={"dose": {"epochs": 2}}, dose_before=Dose(2, 0.0, 0))
    assert (ran.labels, ran.result.outcome) == ([], "success")
    assert "2 epochs were run" in ran.result.reason


@pytest.mark.parametrize("before", [0, 2])
def test_a_session_ends_at_once_when_the_arm_came_to_its_limit_too_often(before):
    guard = {**VALUES["guard"], "position_limit_deg": 1.5}
    values = {"guard": guard, "dose": {"arrivals": before + 1}}
    ran = session(values=values, dose_before=Dose(0, 0.0, before))
    at_limit = next(s for s in ran.sink.samples if s.limited == Limited.POSITION)
    epoch = [s.tick for s in ran.sink.samples if s.epoch == 1]
    assert epoch[-1] == at_limit.tick < EPOCH - 1
    assert (ran.result.outcome, ran.epochs) == ("fail", [(1, "fail")])
    assert f"came to its position limit {before + 1} times" in ran.result.reason
    assert ran.sink.of("epoch_ended")[0]["dose"]["arrivals"] == before + 1
    assert ran.rig.until_off[-1] == ("disable",)


def test_the_guard_remembers_arrivals_at_the_limit_from_one_epoch_to_the_next():
    """One in each epoch, the third within 10 s: a return without a hold releases nothing."""
    protocol = {**VALUES["protocol"], "blocks": [{"epochs": 3}]}
    values = {"guard": {**VALUES["guard"], "position_limit_deg": 6.5}, "protocol": protocol}
    ran = session(Desk(attended=False), values=values)
    assert (ran.labels, ran.result.cause) == (["1", "2", "3"], Cause.HELD_AT_LIMIT)
