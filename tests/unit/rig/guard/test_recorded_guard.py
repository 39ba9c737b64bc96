"""The guard over what the loop recorded on the virtual rig: every command, to the bit."""

import math

import numpy as np
import pytest
from tests.unit.rig.guard.recorded_guard import replay

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import prbs_nm, sinusoid
from rigidimeter.rig.acquisition import (
    ControlLoop,
    SimulatedClock,
    follow,
    go_back,
    perturb,
    ramp_to_rest,
)
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.rig.guard import (
    Cause,
    GuardLimits,
    Limited,
    Reaction,
    consistency_limits,
    guard_limits,
    guard_state,
    guard_step,
    released,
)

LIMITED = {
    "prbs": {"duration_s": 2.0, "amplitude_nm": 6.0},
    "sinusoid": {"duration_s": 2.0, "motion_s": 2.0, "taper_s": 0.5},
    "guard": {
        "position_limit_deg": 25.0,
        "speed_limit_deg_s": 100.0,
        "acceleration_limit_deg_s2": 2000.0,
    },
}


class LateClock(SimulatedClock):
    """Every 97th tick comes 3 ms late."""

    def __init__(self):
        self.calls = 0

    def wait_until(self, time_s):
        self.calls += 1
        return time_s + 0.0032 * (self.calls % 97 == 0)


def recorded(settings, spoil=None, clock=None):
    """Run PRBS, rest, sinusoid and the final stop in one go; return the columns."""
    rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(4))
    read, ticks = rig.read, [0]

    def reading(elapsed=1):
        ticks[0] += 1
        sample = read(elapsed)
        return sample if spoil is None else spoil(ticks[0], sample)

    rig.read = reading
    samples = []
    loop = ControlLoop(settings, rig, clock or SimulatedClock(), samples.append)
    rig.enable()
    perturb(loop, 1, prbs_nm(settings.prbs, settings.rig.tick_rate_hz).tolist())
    go_back(loop, 0.5, 0.35)
    follow(loop, 2, *(c.tolist() for c in sinusoid(settings.sinusoid, settings.rig.tick_rate_hz)))
    ramp_to_rest(loop)
    return {
        name: np.array([getattr(sample, name) for sample in samples]) for name in samples[0]._fields
    }


def assert_replayed(columns, settings):
    agreement = consistency_limits(settings)
    again = replay(guard_limits(settings), settings.rig.tick_rate_hz, columns, agreement)
    np.testing.assert_array_equal(
        again.velocity_command_rad_s.view(np.uint64),
        columns["velocity_command_rad_s"].view(np.uint64),
    )
    np.testing.assert_array_equal(again.limited, columns["limited"])
    np.testing.assert_array_equal(again.cause, columns["cause"])
    return again


@pytest.mark.parametrize("clock", [SimulatedClock, LateClock])
def test_a_session_that_reached_every_limit_is_replayed_to_the_bit(clock):
    settings = parse_settings(LIMITED)
    columns = recorded(settings, clock=clock())
    again = assert_replayed(columns, settings)
    limited = {Limited.NOT, Limited.ACCELERATION, Limited.SPEED, Limited.POSITION}
    assert set(again.limited.tolist()) == limited
    assert not again.reaction.any()


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        ({"torque_nm": math.nan}, Cause.TORQUE_NOT_FINITE),
        ({"angle_rad": 0.3}, Cause.NOT_FOLLOWING),
        ({"cause": int(Cause.DRIVE_FAULT)}, Cause.DRIVE_FAULT),
        ({"cause": int(Cause.EMERGENCY_STOP)}, Cause.EMERGENCY_STOP),
    ],
)
def test_a_session_that_was_stopped_is_replayed_to_the_bit(spoil, cause):
    settings = parse_settings(LIMITED)
    columns = recorded(settings, lambda k, s: s._replace(**spoil) if k == 1200 else s)
    again = assert_replayed(columns, settings)
    assert (again.cause[1198], again.cause[1199]) == (Cause.NONE, cause)
    assert again.reaction[-1] == cause.reaction


def test_other_limits_find_other_things():
    settings = parse_settings(LIMITED)
    columns = recorded(settings, lambda k, s: s._replace(torque_nm=11.0) if k == 1200 else s)
    assert columns["cause"][1199] == Cause.TORQUE_HIGH
    limits = guard_limits(settings)
    assert not replay(limits._replace(torque_nm=12.0), 1000.0, columns).cause.any()
    narrow = replay(limits._replace(speed_rad_s=0.1), 1000.0, columns)
    assert np.abs(narrow.velocity_command_rad_s).max() == 0.1


def by_hand(torques, releases=(), requests=None, step_of=lambda k: 1):
    """Return limits and the columns of a guard that is held and released."""
    limits = GuardLimits(0.7, 3.0, 100.0, 0.02, 0.001, torque_nm=10.0)
    state, tick, rows = guard_state(limits), 40, []
    for k, torque in enumerate(torques):
        tick += step_of(k)
        if k in releases:
            state = released(state)
        request = 0.05 if requests is None else requests[k]
        due_s = tick / 1000.0
        motion_s, torque_s = due_s - 0.002, due_s - 0.001
        state, sent, _ = guard_step(
            limits, state, request, torque, 0.0, 0.0, due_s - motion_s, due_s - torque_s,
            0, step_of(k) if k else 1,
        )  # fmt: skip
        rows.append((tick, state.cause, request, torque, 0.0, 0.0, motion_s, torque_s, 0.0, sent))
    names = (
        *("tick", "cause", "velocity_request_rad_s", "torque_nm", "angle_rad", "velocity_rad_s"),
        *("motion_time_s", "torque_time_s", "perturbation_nm", "velocity_command_rad_s"),
    )
    return limits, {n: np.array(c) for n, c in zip(names, zip(*rows, strict=True), strict=True)}


def test_a_hold_that_the_operator_ended_is_ended_again():
    limits, columns = by_hand([0.0] * 5 + [11.0] + [0.0] * 14, releases={12})
    again = replay(limits, 1000.0, columns)
    np.testing.assert_array_equal(again.velocity_command_rad_s, columns["velocity_command_rad_s"])
    np.testing.assert_array_equal(again.cause, columns["cause"])
    assert again.reaction.tolist() == [0] * 5 + [Reaction.HOLD] * 7 + [0] * 8
    assert again.velocity_command_rad_s[12] == 0.05


def test_a_guard_that_stopped_is_not_released_by_the_record():
    limits, columns = by_hand([0.0] * 5 + [11.0] + [0.0] * 14, releases={12})
    again = replay(limits._replace(torque_stop_nm=10.5), 1000.0, columns)
    assert set(again.reaction[5:].tolist()) == {Reaction.RAMP}
    assert set(again.cause[5:].tolist()) == {Cause.TORQUE_TOO_HIGH}


def test_a_guard_that_still_moves_is_not_released_by_the_record():
    limits, columns = by_hand([0.0] * 5 + [11.0] + [0.0] * 14, releases={12})
    slow = limits._replace(acceleration_rad_s2=1.0)
    again = replay(slow, 1000.0, columns)
    assert again.velocity_command_rad_s[11] == 0.0  # 5 ticks up, 5 down
    gentle = replay(
        limits._replace(acceleration_rad_s2=1.0),
        1000.0,
        {**columns, "cause": np.where(np.arange(20) == 5, Cause.TORQUE_HIGH, 0)},
    )
    assert set(gentle.cause[5:].tolist()) == {Cause.TORQUE_HIGH}


def test_missed_ticks_are_missed_again():
    limits, columns = by_hand([0.0] * 20, step_of=lambda k: 1 + k % 3)
    limits = limits._replace(energy_j=1e-4)
    columns["torque_nm"][:], columns["velocity_rad_s"][:] = 1.0, 0.01
    # 0.01 W passes 0.1 mJ after about 10 ms, which is 6 steps of 1, 2 and 3 ticks
    again = replay(limits, 1000.0, columns)
    assert again.cause.tolist() == [0] * 5 + [Cause.ENERGY_HIGH] * 15


FOUND = {
    *("TORQUE_NOT_FINITE", "MOTION_NOT_FINITE", "COMMAND_NOT_FINITE", "POSITION_LIMIT_EXCEEDED"),
    *("MOTION_STALE", "TORQUE_STALE", "STAMP_AHEAD", "OVERSPEED", "NOT_FOLLOWING"),
    *("TORQUE_TOO_HIGH", "ENERGY_HIGH", "TORQUE_HIGH", "POWER_HIGH", "HELD_AT_LIMIT"),
    *("MOVED_AT_REST", "VELOCITY_WRONG", "SELDOM_FRESH", "TORQUE_SILENT", "TORQUE_SIGN"),
}


@pytest.mark.parametrize("cause", Cause)
def test_what_the_guard_finds_itself_is_not_told_to_it(cause):
    limits, columns = by_hand([0.0] * 3)
    columns["cause"][1:] = cause
    told = cause.name not in FOUND
    assert replay(limits, 1000.0, columns).cause.tolist() == [0, cause * told, cause * told]


def test_a_cause_from_the_first_tick_on_is_told():
    limits, columns = by_hand([0.0] * 2)
    columns["cause"][:] = Cause.SOFTWARE
    assert replay(limits, 1000.0, columns).cause.tolist() == [Cause.SOFTWARE] * 2


def test_what_was_cut_stays_so_when_the_record_goes_on():
    limits, columns = by_hand([0.0] * 4)
    columns["cause"][:] = [0, Cause.OPERATOR_HALT, 0, Cause.SIGNAL]
    again = replay(limits, 1000.0, columns)
    assert again.cause.tolist() == [0, *[Cause.OPERATOR_HALT] * 3]
    assert again.reaction.tolist() == [0, *[Reaction.CUT] * 3]


@pytest.mark.parametrize(
    ("column", "cause"),
    [("motion_time_s", Cause.MOTION_STALE), ("torque_time_s", Cause.TORQUE_STALE)],
)
def test_each_sensor_has_its_own_age(column, cause):
    limits, columns = by_hand([0.0] * 3)
    columns[column][1] -= 0.6
    assert replay(limits, 1000.0, columns).cause.tolist() == [0, cause, cause]
