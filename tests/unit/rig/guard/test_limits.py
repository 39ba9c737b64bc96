"""From settings to the guard's limits, and the state it starts from."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.guard import (
    Cause,
    GuardLimits,
    Reaction,
    guard_limits,
    guard_state,
    released,
    within_range,
)

DEG = math.pi / 180.0
SETTINGS = {
    "guard": {
        "position_limit_deg": 30.0,
        "speed_limit_deg_s": 100.0,
        "acceleration_limit_deg_s2": 5000.0,
        "reaction_time_s": 0.05,
        "arrival_speed_deg_s": 45.0,
        "stale_s": 0.2,
        "following_limit_deg": 3.0,
        "drift_limit_deg_s": 0.03,
        "torque_limit_nm": 11.0,
        "torque_stop_nm": 22.0,
        "power_limit_w": 33.0,
        "energy_limit_j": 4.0,
    },
    "rig": {
        "tick_rate_hz": 500.0,
        "torque": {"rate_hz": 500.0},
        "motion": {
            "rate_hz": 500.0,
            "angle_resolution_deg": 0.25,
            "velocity_resolution_deg_s": 2.0,
        },
    },
}


def test_each_limit_is_the_settings_in_si_units():
    limits = guard_limits(parse_settings(SETTINGS))
    expected = {
        "position_rad": 30.0 * DEG,
        "speed_rad_s": 100.0 * DEG,
        "acceleration_rad_s2": 5000.0 * DEG,
        "reaction_time_s": 0.05,
        "interval_s": 0.002,
        "gap_s": 0.005,
        "tolerance_rad": 0.01,
        "overspeed_rad_s": (125.0 + 1.0) * DEG,
        "stale_s": 0.2,
        "torque_nm": 11.0,
        "torque_stop_nm": 22.0,
        "power_w": 33.0,
        "energy_j": 4.0,
        # the setting, one step of the encoder, a tenth of what full speed covers in 50 ms
        "following_rad": (3.0 + 0.25 + 0.5) * DEG,
        "drift_rad_s": 0.03 * DEG,
        "at_limit_s": 1.0,
        "at_limit_of_s": 5.0,
        "arrivals_s": 10.0,
        "apart_s": 0.2,
        "arrival_rad_s": 45.0 * DEG,
        "lowest_rad": -math.inf,
        "highest_rad": math.inf,
    }
    assert limits._asdict() == pytest.approx(expected, rel=1e-12)


def test_a_tick_longer_than_the_gap_may_be_missed_once():
    rates = {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}}
    settings = parse_settings({**SETTINGS, "rig": rates, "controller": {"torque_cutoff_hz": 20.0}})
    assert guard_limits(settings).gap_s == 0.02


def test_what_is_not_given_does_not_limit():
    limits = GuardLimits(0.7, 3.0, 100.0, 0.02, 0.001)
    assert limits[5:] == (
        *(0.0, 0.01, math.inf, 0.5),
        *(math.inf, math.inf, math.inf, math.inf, math.inf, 0.0, math.inf),
        *(0.0, 0.0, 0.0, math.inf, -math.inf, math.inf),
    )


def test_the_memory_reaches_back_to_the_oldest_command_that_may_still_move_the_joint():
    # A reading 0.5 s old, a drive 20 ms behind it: 520 ticks, the newest, and one more.
    state = guard_state(GuardLimits(0.7, 3.0, 100.0, 0.02, 0.001))
    assert state.sent_rad.shape == (522,)
    assert state.sent_rad.dtype == np.float64
    assert not state.sent_rad.any()
    assert state[2:6] == (0, 0.0, 0.0, 0.0)
    assert math.isnan(state.origin_rad)
    assert state[7:] == (0.0, Cause.NONE, Reaction.NONE)
    assert state.contact.at_limit.tolist() == [0]
    assert state.contact[1:] == (0, 0, False, *[math.inf] * 3, 0)


def test_the_position_limit_is_remembered_for_its_time():
    state = guard_state(GuardLimits(0.7, 3.0, 100.0, 0.02, 0.02, at_limit_of_s=0.05))
    assert state.contact.at_limit.tolist() == [0, 0, 0]
    assert state.contact.at_limit.dtype == np.int64


def test_a_range_is_put_into_the_limits():
    limits = within_range(guard_limits(parse_settings(SETTINGS)), -0.2, 9.0)
    assert (limits.lowest_rad, limits.highest_rad) == (-0.2, 9.0)
    assert limits.extent_rad == (-0.2, 30.0 * DEG)
    assert within_range(limits, -9.0, 0.1).extent_rad == (-30.0 * DEG, 0.1)


def test_a_memory_of_parts_of_a_tick_is_rounded_up():
    limits = GuardLimits(0.7, 3.0, 100.0, 0.0205, 0.01, stale_s=0.1)
    assert guard_state(limits).sent_rad.shape == (15,)


def held(**values):
    state = guard_state(GuardLimits(0.7, 3.0, 100.0, 0.02, 0.001))
    defaults = {"cause": int(Cause.TORQUE_HIGH), "reaction": int(Reaction.HOLD)}
    return state._replace(origin_rad=0.1, energy_j=2.0, newest=7, **{**defaults, **values})


def test_released_forgets_the_cause_alone():
    before = held()
    before.sent_rad[7] = 0.3
    after = released(before)
    assert (after.cause, after.reaction) == (Cause.NONE, Reaction.NONE)
    assert after.sent_rad is before.sent_rad
    assert after[2:8] == before[2:8]


@pytest.mark.parametrize(
    "wrong",
    [{"reaction": int(Reaction.RAMP)}, {"reaction": int(Reaction.CUT)}, {"velocity_rad_s": -1e-3}],
)
def test_what_was_stopped_or_still_moves_is_not_released(wrong):
    with pytest.raises(ValueError, match=r"^only a guard that holds the joint at rest can be"):
        released(held(**wrong))
