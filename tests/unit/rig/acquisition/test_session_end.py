"""How a session ends, whatever ends it: the power goes and the record is closed."""

import math

import pytest
from tests.unit.rig.acquisition.exact_rig import Desk, ExactRig, LateClock
from tests.unit.rig.acquisition.whole_session import (
    HAND_KG_M2,
    RATE_HZ,
    VALUES,
    ListSink,
    session,
)

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import Command
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause, consistency_limits


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
    names = [name for name, *_ in ran.rig.until_off]
    assert ("stop" in names) == stops
    after = names[names.index("stop") + 1 :] if stops else ["disable"]
    assert after == ["read", "write"] * (5 if brakes else 0) + ["disable"]


def test_its_own_ramp_has_a_tenth_of_a_second():
    ran = session(Desk({20: Cause.DRIVE_STATE}), values={"rig": {}})
    names = [name for name, *_ in ran.rig.until_off]
    assert names[names.index("stop") :].count("read") == 100  # at 1 kHz


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
    assert rig.until_off[-1] == ("disable",)
    assert ran.sink.closed[0][1] == "fail"


def test_a_rig_that_is_not_enabled_ends_the_session_with_its_own_sentence():
    rig = ExactRig(interval_s=1.0 / RATE_HZ)

    def refuse():
        raise DeviceError("drive: no supply voltage")

    rig.enable = refuse
    ran = session(rig=rig)
    assert isinstance(ran.error, DeviceError)
    assert ran.sink.closed[0][1:] == ("fail", "drive: no supply voltage")
    assert rig.until_off == [("disable",)]


def test_an_interrupt_is_an_abort_with_a_ramp():
    def interrupt(tick, reading):
        if tick == 20:
            raise KeyboardInterrupt
        return reading

    ran = session(change=interrupt)
    assert (ran.result.outcome, ran.result.reason) == ("abort", "interrupted by the operator")
    assert ran.epochs == [(1, "abort")]
    assert ran.rig.until_off[-2:] == [("write", 0.0), ("disable",)]


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


class AfterPower(ExactRig):
    """Once its power is off, `path` tells angle in rad and torque of each reading, the first 1."""

    def __init__(self, path):
        super().__init__(interval_s=1.0 / RATE_HZ, inertia_kg_m2=HAND_KG_M2)
        self.path, self.readings = path, 0

    def read(self, elapsed_ticks=1):
        reading = super().read(elapsed_ticks)
        if ("disable",) not in self.calls:
            return reading
        self.readings += 1
        angle_rad, torque_nm = self.path(self.readings)
        return reading._replace(angle_rad=angle_rad, torque_nm=torque_nm)


SECOND = 50
"""In ticks: for so long the joint is watched."""

SETTLED = 8
"""From this reading on: after guard.reaction_time_s, 0.08 s, twice."""

HOLD_RAD = consistency_limits(parse_settings(VALUES)).hold_rad


def moving(deg_s, torque_nm, from_deg=0.0, after=11):
    """Return a path that stands until the reading `after`, then moves at a constant velocity."""
    return lambda k: (
        math.radians(from_deg + deg_s * max(k - after, 0) / RATE_HZ),
        torque_nm,
    )


def standing(until, angle_rad):
    """Return a path that is at 0 up to the reading `until`, and at `angle_rad` after it."""
    return lambda k: (angle_rad if k > until else 0.0, 0.1)


def back_again(k):
    """Pushed by 3.9 deg, then let go, back within the limit at the end."""
    angle_rad, torque_nm = moving(7.8, 0.1)(k)
    return (angle_rad, torque_nm) if k <= 36 else (math.radians(0.5), 0.0)


def with_gaps(k):
    """Without a number in one reading for each of the two."""
    angle_rad, torque_nm = moving(5.0, 0.1)(k)
    return math.nan if k == 20 else angle_rad, math.nan if k == 30 else torque_nm


@pytest.mark.parametrize(
    ("path", "named"),
    [
        (moving(5.0, 0.1), True),  # the drive pushes the joint along
        (moving(-5.0, -0.1), True),
        (moving(-5.0, -0.1, from_deg=10.0), True),
        (moving(5.0, 0.005), True),  # however small the work: 0.3 mJ
        (back_again, True),
        (with_gaps, True),
        (standing(SETTLED, math.radians(3.9)), True),
        (standing(SETTLED - 1, math.radians(3.9)), False),  # the drive comes to rest
        (moving(5.0, -0.1), False),  # the joint moves the drive, as an arm that is taken out does
        (moving(0.5, 0.1), False),  # within guard.hold_limit_deg, 1 deg
        (standing(20, HOLD_RAD), False),
    ],
)
def test_a_drive_that_moves_the_joint_with_its_power_off_is_named(path, named):
    """5 deg/s for 39 of the 50 ticks of a second are 3.9 deg."""
    ran = session(rig=AfterPower(path))
    assert [outcome for _, outcome in ran.epochs] == ["success", "success"]
    if named:
        assert ran.result.outcome == "fail"
        assert ran.result.reason == (
            "the drive moved the joint by 3.9 deg with its power off: keep hands off the joint, "
            "press the emergency stop, and check its wiring"
        )
    else:
        assert (ran.result.outcome, ran.result.reason) == ("success", "")
    assert ran.sink.closed[0][1:] == (ran.result.outcome, ran.result.reason)


def test_the_joint_is_watched_and_the_drive_told_to_stand_at_the_pace_of_the_ticks():
    clock = LateClock(interval_s=1.0 / RATE_HZ)
    ran = session(clock=clock)
    ticks = len(ran.sink.samples)
    assert clock.deadlines_s[-SECOND:] == [(ticks + k) / RATE_HZ for k in range(1, SECOND + 1)]
    last = [("disable",), *[("read", 1), ("write", 0.0)] * SECOND]
    assert ran.rig.calls[-len(last) :] == last


def test_a_drive_that_does_not_say_that_its_power_is_off_keeps_hands_off():
    rig = ExactRig(interval_s=1.0 / RATE_HZ, inertia_kg_m2=HAND_KG_M2)
    rig.powered = True
    ran = session(rig=rig)
    words = "the drive has not reported within 1 s that its power is off: keep hands "
    assert ran.result.outcome == "fail"
    assert ran.result.reason.startswith(words)
    rig = ExactRig(interval_s=1.0 / RATE_HZ, inertia_kg_m2=HAND_KG_M2)
    rig.powered = True
    ran = session(Desk({20: Cause.EMERGENCY_STOP}), rig=rig)  # the first reason stays first
    assert ran.result.reason.startswith("the guard stopped the rig: the emergency stop")
    assert f"; {words}" in ran.result.reason


def test_what_is_seen_with_the_power_off_does_not_change_that_it_was_aborted():
    rig = ExactRig(interval_s=1.0 / RATE_HZ, inertia_kg_m2=HAND_KG_M2)
    rig.powered = True
    ran = session(Desk(orders={10: Command.ABORT}), rig=rig)
    assert ran.result.outcome == ran.sink.closed[0][1] == "abort"
    assert ran.result.reason.startswith(
        "aborted by the operator with 2 epochs left; the drive has "
    )
