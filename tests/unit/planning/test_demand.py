"""Predicted motion against closed forms, and the guard's limits."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import (
    ControllerSettings,
    GuardSettings,
    SinusoidSettings,
    parse_settings,
)
from rigidimeter.model import JointDynamics
from rigidimeter.planning import (
    beyond_limits,
    beyond_range,
    demand,
    ideal_response,
    sinusoid,
    time_constant_s,
)
from rigidimeter.rig.guard import Limited, guard_limits, guard_state, guard_step

CONTROLLER = ControllerSettings(inertia_kg_m2=0.5, damping_nm_s_rad=2.0)
RATE_HZ = 1000.0
TIME_S = np.arange(4000) / RATE_HZ


def test_free_arm_answers_a_constant_torque_exponentially() -> None:
    angle, velocity = ideal_response(np.full(4000, 3.0), CONTROLLER, None, RATE_HZ)
    tau_s = time_constant_s(CONTROLLER)
    assert tau_s == 0.25
    np.testing.assert_allclose(velocity, 1.5 * (1 - np.exp(-TIME_S / tau_s)), atol=1e-9)
    np.testing.assert_allclose(
        angle, 1.5 * (TIME_S - tau_s * (1 - np.exp(-TIME_S / tau_s))), atol=1e-9
    )


def test_free_arm_without_damping_accelerates_evenly() -> None:
    controller = ControllerSettings(inertia_kg_m2=0.5, damping_nm_s_rad=0.0)
    angle, velocity = ideal_response(np.ones(4000), controller, None, RATE_HZ)
    np.testing.assert_allclose(velocity, 2.0 * TIME_S, atol=1e-9)
    np.testing.assert_allclose(angle, TIME_S**2, atol=1e-7)
    assert time_constant_s(controller) == math.inf


def test_the_joint_adds_to_the_controller() -> None:
    joint = JointDynamics(0.5, 0.0, 5.0)  # together s² + 2 s + 5: poles −1 ± 2j
    angle, velocity = ideal_response(np.full(4000, 5.0), CONTROLLER, joint, RATE_HZ)
    decay = np.exp(-TIME_S)
    expected = 1 - decay * (np.cos(2 * TIME_S) + 0.5 * np.sin(2 * TIME_S))
    np.testing.assert_allclose(angle, expected, atol=1e-9)
    np.testing.assert_allclose(velocity, 2.5 * decay * np.sin(2 * TIME_S), atol=1e-9)


def test_demand_of_the_sinusoid() -> None:
    guard = GuardSettings(reaction_time_s=0.0)
    needs = demand(*sinusoid(SinusoidSettings(), RATE_HZ), RATE_HZ, guard)
    amplitude = math.radians(20.0)
    assert needs.peak_angle_rad == pytest.approx(amplitude)
    assert needs.peak_speed_rad_s == pytest.approx(2 * math.pi * amplitude)
    # the full cycles need ω²A; the taper adds less than a tenth
    assert 1.0 < needs.peak_acceleration_rad_s2 / ((2 * math.pi) ** 2 * amplitude) < 1.1
    assert needs.reach_rad >= needs.peak_angle_rad


def test_reach_adds_the_room_to_stop_in_the_direction_of_motion() -> None:
    guard = GuardSettings(acceleration_limit_deg_s2=math.degrees(2.0), reaction_time_s=0.1)
    outward = demand([0.5], [1.0], RATE_HZ, guard)
    held_s = 0.1 + 0.005 + 0.001  # to react, a step that is late, the tick
    assert outward.reach_rad == pytest.approx(0.5 + held_s + 0.25)
    inward = demand([0.5], [-1.0], RATE_HZ, guard)
    assert inward.reach_rad == 0.5
    through = demand([0.0], [1.0], RATE_HZ, guard)
    assert through.reach_rad == pytest.approx(held_s + 0.25)


def test_a_slow_loop_may_be_a_tick_late() -> None:
    guard = GuardSettings(acceleration_limit_deg_s2=math.degrees(2.0), reaction_time_s=0.1)
    assert demand([0.0], [1.0], 50.0, guard).reach_rad == pytest.approx(0.1 + 0.02 + 0.02 + 0.25)


def test_each_side_is_reached_by_itself() -> None:
    guard = GuardSettings(acceleration_limit_deg_s2=math.degrees(2.0), reaction_time_s=0.1)
    needs = demand([0.5, 0.2, -0.1], [1.0, 0.0, -1.0], RATE_HZ, guard)
    room = 0.106 + 0.25
    assert needs.highest_rad == pytest.approx(0.5 + room)
    assert needs.lowest_rad == pytest.approx(-0.1 - room)
    assert needs.reach_rad == needs.highest_rad
    ends = -math.radians(30.0), math.radians(49.0)
    assert needs.lowest_rad > ends[0]
    assert beyond_range("the sinusoid", needs, ends[0], 0.9) == ()
    (sentence,) = beyond_range("the sinusoid", needs, *ends)
    assert sentence == (
        "the sinusoid reaches 49.05 deg toward positive angles (with the room to stop), and the "
        "range of motion of this person ends 49 deg from where the joint stands"
    )
    assert len(beyond_range("the sinusoid", needs, -0.4, 0.8)) == 2


def test_above_the_speed_of_arrival_the_room_is_that_of_soft_braking() -> None:
    # from 1 to 0.5 rad/s at 0.2 rad/s², from there at 2 rad/s²
    values = {"acceleration_limit_deg_s2": math.degrees(2.0), "reaction_time_s": 0.1}
    guard = GuardSettings(**values, arrival_speed_deg_s=math.degrees(0.5))
    needs = demand([0.0], [1.0], RATE_HZ, guard)
    assert needs.reach_rad == pytest.approx(0.106 + 0.75 / 0.4 + 0.25 / 4.0)
    slow = demand([0.0], [0.5], RATE_HZ, guard)
    assert slow == demand([0.0], [0.5], RATE_HZ, GuardSettings(**values))


@pytest.mark.parametrize("rate_hz", [1000.0, 60.0])
@pytest.mark.parametrize("speed_rad_s", [0.3, 2.0])
@pytest.mark.parametrize("arrival_speed_deg_s", [1000.0, 60.0])
def test_the_guard_lets_through_what_has_this_room_and_slows_what_has_not(
    rate_hz: float, speed_rad_s: float, arrival_speed_deg_s: float
) -> None:
    """The room is the guard's own: at a constant speed, one step before the place and at it."""
    sensor = {"rate_hz": rate_hz}
    settings = parse_settings(
        {
            "rig": {"tick_rate_hz": rate_hz, "torque": sensor, "motion": sensor},
            "guard": {
                "reaction_time_s": 0.05,
                "arrival_speed_deg_s": arrival_speed_deg_s,
            },
        }
    )
    limits = guard_limits(settings)
    room_rad = demand([0.0], [speed_rad_s], rate_hz, settings.guard).reach_rad
    step_rad = speed_rad_s / rate_hz
    state, angle_rad, last_rad = guard_state(limits), -0.5, math.nan
    limited = 0
    while limited < int(Limited.POSITION):
        last_rad = angle_rad
        state, sent, limited = guard_step(
            limits, state, speed_rad_s, 0.0, angle_rad, state.velocity_rad_s, 0.0
        )
        angle_rad += sent / rate_hz
    # The reading is as new as can be and the drive has done what it was told, so that the sum of
    # what is in flight counts once more what lies behind: whole ticks of the reaction time.
    assert limits.position_rad - last_rad == pytest.approx(room_rad, abs=2.0 * step_rad)


def test_a_start_at_speed_is_an_acceleration() -> None:
    assert demand([0.0, 0.0], [1.0, 1.0], 100.0, GuardSettings()).peak_acceleration_rad_s2 == 100.0


def test_what_fits_gives_no_sentence() -> None:
    guard = GuardSettings()
    needs = demand(*sinusoid(SinusoidSettings(), RATE_HZ), RATE_HZ, guard)
    assert beyond_limits("the sinusoid", needs, guard) == ()


@pytest.mark.parametrize(
    ("limit", "value", "words"),
    [
        ("position_limit_deg", 19.0, "reaches an angle"),
        ("speed_limit_deg_s", 125.0, "reaches a speed of 125.7 deg/s"),
        ("acceleration_limit_deg_s2", 780.0, "needs an acceleration of"),
    ],
)
def test_each_limit_has_its_sentence(limit: str, value: float, words: str) -> None:
    guard = GuardSettings(**{limit: value})
    needs = demand(*sinusoid(SinusoidSettings(), RATE_HZ), RATE_HZ, guard)
    (sentence,) = beyond_limits("the sinusoid", needs, guard)
    assert sentence.startswith("the sinusoid")
    assert words in sentence
    assert f"guard.{limit} = {value:g}" in sentence
