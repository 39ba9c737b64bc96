"""A whole session on an exact rig: its order, its end however it comes, and what is told of it."""

import math
from itertools import pairwise
from typing import NamedTuple

import pytest
from tests.unit.acquisition.exact_rig import Desk, ExactRig, LateClock

from rigidimeter.acquisition.controller_run import ControllerRun
from rigidimeter.acquisition.run_states import Command, Order, Run, State
from rigidimeter.acquisition.session_run import (
    BRAKE_S,
    FEWEST_ZEROING_SAMPLES,
    LOOK_S,
    SessionResult,
    run_session,
)
from rigidimeter.devices.base import DeviceError
from rigidimeter.experiment import plan, prbs_nm
from rigidimeter.guard import Cause
from rigidimeter.settings import parse_settings

RATE_HZ = 50.0
SENSOR = {"rate_hz": RATE_HZ}
VALUES = {
    "rig": {"tick_rate_hz": RATE_HZ, "torque": SENSOR, "motion": SENSOR},
    "guard": {"reaction_time_s": 0.08},
    "loop": {"stall_s": 1.0},
    "prbs": {"duration_s": 1.0},
    "sinusoid": {"duration_s": 1.0, "motion_s": 1.0, "amplitude_deg": 1.0, "taper_s": 0.1},
    "protocol": {"blocks": [{"epochs": 2}], "rests_s": [0.6], "return_s": 0.5},
    "zeroing": {"duration_s": 0.4},
}
EPOCH, REST, RETURN, LOOK = 50, 30, 25, round(LOOK_S * RATE_HZ)
"""In ticks."""

HAND_KG_M2 = 0.0045


class ListSink:
    """Keeps everything in order."""

    def __init__(self):
        self.samples, self.events, self.closed = [], [], []
        self.sample = self.samples.append

    def event(self, kind, **facts):
        self.events.append({"event": kind, **facts})

    def close(self, time_s, outcome, reason):
        self.closed.append((time_s, outcome, reason))

    def of(self, kind):
        return [event for event in self.events if event["event"] == kind]


class Ran(NamedTuple):
    result: SessionResult | None
    error: BaseException | None
    rig: ExactRig
    sink: ListSink
    states: list[Run]

    @property
    def epochs(self):
        """The numbers of the epochs, with how each ended."""
        return [(e["epoch"], e["outcome"]) for e in self.sink.of("epoch_ended")]

    @property
    def labels(self):
        return [e["label"] for e in self.sink.of("epoch_started")]


def session(desk=None, *, change=lambda tick, reading: reading, late=None, values=None, **options):
    settings = parse_settings({**VALUES, **(values or {})})
    rig = options.pop("rig", None) or ExactRig(change, 1.0 / RATE_HZ, HAND_KG_M2)
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    sink, states = options.pop("sink", None) or ListSink(), []
    result, error = None, None
    try:
        result = run_session(
            protocol,
            settings,
            rig,
            LateClock(late, 1.0 / RATE_HZ),
            sink,
            supervision=desk,
            state_changed=states.append,
            **options,
        )
    except Exception as caught:
        error = caught
    return Ran(result, error, rig, sink, states)


# As planned


def test_a_session_runs_what_was_planned_tells_it_and_takes_the_power_away():
    ran = session(before_epoch=lambda planned: {"note": planned.number})
    assert ran.result == SessionResult("success", "", 2, 2, Cause.NONE)
    assert [event["event"] for event in ran.sink.events] == [
        *("session_started", "epoch_started", "epoch_ended", "epoch_started", "epoch_ended")
    ]
    first, second = ran.sink.of("epoch_started")
    assert (first["time_s"], first["note"], first["label"]) == (0.0, 1, "1")
    assert (second["time_s"], second["note"], second["label"]) == (1.6, 2, "2")
    assert (first["planned_s"], first["task"], first["epoch"]) == (1.0, "prbs", 1)
    ended = ran.sink.of("epoch_ended")[0]
    assert ended == {
        **{"event": "epoch_ended", "epoch": 1, "time_s": 1.0, "outcome": "success", "reason": ""},
        **{"limited_ticks": ended["limited_ticks"], "missed_ticks": 0, "counts": {"lost": 3}},
    }
    assert ran.rig.calls[0] == ("enable",)
    assert ran.rig.calls[-2:] == [("write", 0.0), ("disable",)]
    assert ran.rig.of("disable") == [None]
    assert [run.state for run in ran.states] == [State.RUNNING, State.STOPPING]
    epochs = [s.epoch for s in ran.sink.samples][: 2 * (EPOCH + REST)]
    assert epochs == [1] * EPOCH + [-1] * REST + [2] * EPOCH + [-1] * REST
    planned_nm = prbs_nm(parse_settings(VALUES).prbs, RATE_HZ).tolist()
    assert [s.perturbation_nm for s in ran.sink.samples[:EPOCH]] == planned_nm
    (time_s, outcome, reason) = ran.sink.closed[0]
    assert (outcome, reason, len(ran.sink.closed)) == ("success", "", 1)
    assert time_s == len(ran.sink.samples) / RATE_HZ


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


def test_an_epoch_in_which_a_limit_held_is_a_fail_and_repeated_last_if_wanted():
    protocol = {**VALUES["protocol"], "repeat_limited": True}
    values = {"guard": {**VALUES["guard"], "position_limit_deg": 1.5}, "protocol": protocol}
    ran = session(values=values)
    assert ran.labels == ["1", "2", "1r", "2r"]
    assert [number for number, _ in ran.epochs] == [1, 2, 3, 4]
    assert {outcome for _, outcome in ran.epochs} == {"fail"}
    assert "position limit of ±1.5 deg" in ran.sink.of("epoch_ended")[0]["reason"]
    assert (ran.result.outcome, ran.result.epochs_run, ran.result.epochs_good) == ("success", 4, 0)


# Orders


def test_a_pause_waits_for_the_epoch_and_goes_back_before_the_next():
    ran = session(Desk(orders={10: Command.PAUSE, 200: Command.RESUME}))
    assert ran.result.outcome == "success"
    assert ran.labels == ["1", "2"]
    # Way back, looks of 0.1 s in the last of which it is resumed, the way back again.
    second = ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ
    assert second == pytest.approx(200 + LOOK + RETURN)
    assert [r.state for r in ran.states] == [
        *(State.RUNNING, State.RUNNING, State.PAUSED, State.RUNNING, State.STOPPING)
    ]


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
    assert ran.rig.calls[-1] == ("disable",)
    assert ran.states[-1].state is State.STOPPING


def test_a_stop_in_a_rest_does_not_wait_for_its_end():
    ran = session(Desk(orders={60: Command.STOP}))
    assert len(ran.sink.samples) < 70


def test_a_halt_takes_the_power_away_in_its_tick():
    ran = session(Desk(orders={10: Command.HALT}))
    last_read = [k for k, call in enumerate(ran.rig.calls) if call[0] == "read"][10]
    assert [call[0] for call in ran.rig.calls[last_read : last_read + 3]] == [
        *("read", "write", "disable")
    ]
    assert ran.result.outcome == "fail"
    assert ran.result.cause is Cause.OPERATOR_HALT
    assert ran.result.reason == Cause.OPERATOR_HALT.sentence
    assert ran.epochs[0] == (1, "abort")
    assert ran.states[-1].state is State.FAULTED


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


# Causes


def test_a_stop_of_the_guard_ends_the_session_with_its_cause():
    ran = session(Desk({20: Cause.DRIVE_FAULT}))
    why = f"the guard stopped the rig: {Cause.DRIVE_FAULT.sentence}"
    assert ran.result == SessionResult("fail", why, 1, 0, Cause.DRIVE_FAULT)
    assert ran.epochs == [(1, "fail")]
    assert ran.sink.of("epoch_ended")[0]["reason"] == why
    assert ran.states[-1].state is State.FAULTED
    assert ran.rig.calls[-1] == ("disable",)
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
    held = ran.sink.samples[40:90]
    assert not any(s.velocity_command_rad_s for s in held)
    assert {s.cause for s in held} == {int(Cause.TORQUE_HIGH)}
    second = ran.sink.of("epoch_started")[1]["time_s"] * RATE_HZ
    assert second == pytest.approx(91 + RETURN)
    epoch = [s for s in ran.sink.samples if s.epoch == 2]
    assert {s.cause for s in epoch} == {0}
    assert any(s.velocity_command_rad_s for s in epoch)


def test_a_hold_without_an_operator_is_the_end():
    ran = session(Desk({20: Cause.TORQUE_HIGH}, attended=False))
    assert ran.labels == ["1"]
    assert ran.result.cause is Cause.TORQUE_HIGH
    assert ran.result.reason == (
        "the guard held the rig and no operator was there to continue: "
        f"{Cause.TORQUE_HIGH.sentence}"
    )


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


# The end


@pytest.mark.parametrize(
    ("cause", "stops", "brakes"),
    [
        (Cause.DRIVE_LOST, True, False),
        (Cause.DRIVE_STATE, True, True),
        (Cause.DRIVE_FAULT, False, False),
    ],
)
def test_a_drive_that_no_longer_obeys_brakes_by_itself_before_its_power_goes(cause, stops, brakes):
    ran = session(Desk({20: cause}))
    names = [name for name, *_ in ran.rig.calls]
    assert ("stop" in names) == stops
    after = names[names.index("stop") + 1 :] if stops else ["disable"]
    assert after == ["read", "write"] * (round(BRAKE_S * RATE_HZ) if brakes else 0) + ["disable"]


class Failing(ExactRig):
    """From tick 20 on the named steps raise."""

    def __init__(self, *names):
        super().__init__(interval_s=1.0 / RATE_HZ, inertia_kg_m2=HAND_KG_M2)
        for name in names:
            step = getattr(self, name)

            def failing(*arguments, name=name, step=step):
                done = step(*arguments)
                if self.tick >= 20:
                    raise RuntimeError(f"{name} failed")
                return done

            setattr(self, name, failing)


@pytest.mark.parametrize(
    "names",
    [("read",), ("write",), ("read", "write"), ("read", "disable"), ("read", "write", "disable")],
)
def test_whatever_fails_the_power_goes_and_the_record_is_closed(names):
    ran = session(rig=Failing(*names))
    assert isinstance(ran.error, RuntimeError)
    assert ("disable",) in ran.rig.calls
    (closed,) = ran.sink.closed
    assert closed[1:] == ("fail", f"RuntimeError: {names[0]} failed")
    assert ran.epochs == [(1, "fail")]
    ended = ran.sink.of("epoch_ended")[0]
    assert ended["reason"] == f"RuntimeError: {names[0]} failed"
    if names == ("read",):  # ramped by writing alone
        assert ran.rig.of("write")[-1] == 0.0


def test_a_drive_that_can_not_be_stopped_loses_its_power_all_the_same():
    rig = Failing("stop")
    ran = session(Desk({20: Cause.DRIVE_LOST}), rig=rig)
    assert str(ran.error) == "stop failed"
    assert rig.calls[-1] == ("disable",)
    assert ran.sink.closed[0][1] == "fail"


def test_a_rig_that_is_not_enabled_ends_the_session_with_its_own_sentence():
    rig = ExactRig(interval_s=1.0 / RATE_HZ)

    def refuse():
        raise DeviceError("drive: no supply voltage")

    rig.enable = refuse
    ran = session(rig=rig)
    assert isinstance(ran.error, DeviceError)
    assert ran.sink.closed[0][1:] == ("fail", "drive: no supply voltage")
    assert rig.calls == [("disable",)]


def test_an_interrupt_is_an_abort_with_a_ramp():
    def interrupt(tick, reading):
        if tick == 20:
            raise KeyboardInterrupt
        return reading

    ran = session(change=interrupt)
    assert (ran.result.outcome, ran.result.reason) == ("abort", "interrupted by the operator")
    assert ran.epochs == [(1, "abort")]
    assert ran.rig.calls[-2:] == [("write", 0.0), ("disable",)]


def test_a_program_that_fails_after_a_cause_keeps_the_cause():
    sink = ListSink()
    event = sink.event

    def failing(kind, **facts):
        event(kind, **facts)
        if kind == "epoch_ended" and not sink.closed and "limited_ticks" in facts:
            raise RuntimeError("no room")

    sink.event = failing
    ran = session(sink=sink)
    assert str(ran.error) == "no room"
    assert sink.closed[0][1:] == ("fail", "RuntimeError: no room")


# Zeroing


def torque(bias_nm, ripple_nm=0.01):
    return lambda k, r: r._replace(torque_nm=r.torque_nm + bias_nm + ripple_nm * (-1) ** k)


def creep(tick, reading):
    """Move at 2.5 deg/s."""
    speed_rad_s = math.radians(2.5)
    angle_rad = speed_rad_s * tick / RATE_HZ
    return reading._replace(angle_rad=angle_rad, velocity_rad_s=speed_rad_s)


def test_the_sensor_is_zeroed_with_the_mean_of_the_whole_time():
    ran = session(Desk(), change=torque(0.5), zero_first=True)
    assert ran.rig.of("zero") == [pytest.approx(0.5)]
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert (zeroed["time_s"], zeroed["refused"]) == (0.4, "")
    assert zeroed["bias_nm"] == pytest.approx(0.5)
    assert zeroed["noise_sd_nm"] == pytest.approx(0.01 * math.sqrt(20 / 19))
    (enabled,) = ran.sink.of("rig_enabled")
    assert (enabled["time_s"], enabled["origin_rad"]) == (0.0, 0.25)
    assert ran.sink.of("epoch_started")[0]["time_s"] == 0.4


def test_without_zeroing_nothing_is_held_first():
    ran = session(Desk())
    assert ran.rig.of("zero") == []
    assert ran.sink.of("rig_enabled") == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (torque(1.01), "at rest the torque sensor reads 1.01 N·m, more than"),
        (torque(-1.01), "at rest the torque sensor reads -1.01 N·m, more than"),
        (torque(0.0, 0.11), "at rest the torque varies by 0.113 N·m (SD), more than"),
        (
            lambda k, r: r._replace(torque_time_s=(k - k % 2 if k > 3 else 0) / RATE_HZ),
            "only 9 torque samples came in 0.4 s",
        ),
        (creep, "the joint moved by"),
    ],
)
def test_a_session_does_not_begin_on_a_zero_that_is_none(change, words):
    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "fail"
    assert words in ran.result.reason
    assert ran.rig.of("zero") == []
    assert ran.labels == []
    (zeroed,) = ran.sink.of("sensor_zeroed")
    assert zeroed["refused"] == ran.result.reason
    if "only" in words:
        assert (zeroed["bias_nm"], zeroed["noise_sd_nm"]) == (None, None)


@pytest.mark.parametrize("change", [torque(0.99), torque(-0.99), torque(0.0, 0.09)])
def test_within_the_limits_it_does(change):
    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "success"


def test_ten_samples_are_enough():
    """Each is read twice."""
    assert round(VALUES["zeroing"]["duration_s"] * RATE_HZ) == 2 * FEWEST_ZEROING_SAMPLES

    def change(k, reading):
        return reading._replace(torque_time_s=(k - k % 2) / RATE_HZ)

    ran = session(Desk(), change=change, zero_first=True)
    assert ran.result.outcome == "success"


@pytest.mark.parametrize("held", [False, True])
def test_a_zero_that_was_interrupted_is_made_again(held):
    """Until then the torque is another: what was heard is thrown away."""
    orders = {50: Command.RESUME}
    desk = Desk({10: Cause.TORQUE_HIGH} if held else {}, orders)
    if not held:
        orders[10] = desk.orders[10] = Command.PAUSE_NOW
    ran = session(
        desk,
        change=lambda k, r: r._replace(torque_nm=r.torque_nm + (0.9 if k < 15 else 0.1)),
        zero_first=True,
    )
    assert ran.rig.of("zero") == [pytest.approx(0.1)]
    assert ran.result.outcome == "success"


@pytest.mark.parametrize("command", [Command.ABORT, Command.HALT])
def test_an_end_while_zeroing_leaves_no_zero(command):
    ran = session(Desk(orders={5: command}), zero_first=True)
    assert ran.rig.of("zero") == []
    assert ran.labels == []
    assert ran.result.outcome == ("abort" if command is Command.ABORT else "fail")


# How it is led


def controller_run(desk=None):
    sink, states = ListSink(), []
    settings = parse_settings(VALUES)
    rig = ExactRig(interval_s=1.0 / RATE_HZ)
    clock = LateClock(interval_s=1.0 / RATE_HZ)
    run = ControllerRun(settings, rig, clock, sink, lambda _: None, desk, states.append)
    return run, states


def test_a_run_begins_idle_and_a_state_is_told_once():
    run, states = controller_run()
    assert (run.run, run.open_epoch, run.outcome, run.reason) == (Run(), None, "success", "")
    assert run.cause is Cause.NONE
    run.change_state(Run(State.RUNNING))
    run.change_state(Run(State.RUNNING))
    assert states == [Run(State.RUNNING)]
    assert run.is_in(State.RUNNING)
    assert not run.is_in(State.PAUSED)


def test_a_reason_that_stands_is_not_overwritten_at_the_end():
    run, _ = controller_run()
    run.fail(Cause.SIGNAL, "told to end")
    run.conclude(3)
    assert (run.outcome, run.reason, run.cause) == ("fail", "told to end", Cause.SIGNAL)


@pytest.mark.parametrize(
    ("state", "left", "outcome", "reason"),
    [
        (Run(State.RUNNING), 0, "success", ""),
        (Run(State.RUNNING), 2, "fail", "ended with 2 epochs left"),
        (Run(State.STOPPING), 2, "success", "stopped by the operator with 2 epochs left"),
        (
            Run(State.STOPPING, aborted=True),
            1,
            "abort",
            "aborted by the operator with 1 epochs left",
        ),
    ],
)
def test_how_a_run_ends_that_nothing_ended(state, left, outcome, reason):
    run, _ = controller_run()
    run.change_state(state)
    run.conclude(left)
    assert (run.outcome, run.reason, run.cause) == (outcome, reason, Cause.NONE)


def test_a_hold_keeps_the_stop_that_was_ordered_before():
    run, states = controller_run(Desk())
    run.change_state(Run(State.RUNNING, stop_next=True))
    run.loop.guard = run.loop.guard._replace(cause=int(Cause.POWER_HIGH), reaction=1)
    assert run.may_go_on()
    assert states[-1] == Run(State.PAUSED, stop_next=True)


def test_a_hold_in_the_last_epoch_is_told_though_all_was_run():
    run, _ = controller_run()
    run.loop.guard = run.loop.guard._replace(cause=int(Cause.POWER_HIGH), reaction=1)
    run.conclude(0)
    assert run.outcome == "success"
    assert run.cause is Cause.POWER_HIGH
    assert run.reason == f"the guard held the rig in the last epoch: {Cause.POWER_HIGH.sentence}"
