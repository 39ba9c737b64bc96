"""Whether the torque answers: filters and equations in closed form, then joints right and wrong."""

import math

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.model import admittance, admittance_step
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.guard import (
    AT_REST,
    BEFORE,
    FILTER_RAD_S,
    HARDLY_SHOWN,
    LONGEST_S,
    MEAN_OF_S,
    NOTHING_YET,
    ROW_S,
    ROWS,
    ROWS_A_TEST,
    SETTLED,
    SHOWN_MEMORY_S,
    UNSHOWN_NM,
    AnswerLimits,
    Cause,
    Left,
    answer_limits,
    answer_state,
    answer_step,
    lowpassed,
    max_left,
    mean_of_ticks,
)

DT = 0.001
MEAN_OF_TICKS = mean_of_ticks(1.0 / DT)
LIMITS = answer_limits(parse_settings({}))


def test_at_its_corner_each_low_pass_leaves_half_the_power_and_turns_by_45_degrees():
    state, found = NOTHING_YET, []
    half = 0.5 * FILTER_RAD_S * DT
    for k in range(3000):
        state = lowpassed(half / (1 + half), state, math.sin(FILTER_RAD_S * k * DT))
        found.append(state[1:])
    t = FILTER_RAD_S * DT * np.arange(3000)
    for order in (1, 2, 3, 4):
        expected = 2.0 ** (-order / 2) * np.sin(t - order * math.pi / 4)
        np.testing.assert_allclose(np.array(found)[2000:, order - 1], expected[2000:], atol=2e-3)


def test_a_signal_begins_where_it_is():
    assert lowpassed(0.1, NOTHING_YET, 3.0) == (3.0,) * 5


# --- size


def imposed(inertia, seconds=2.0, hz=2.0, amplitude=0.2, limits=LIMITS, elapsed=1):
    """Return when an imposed sinusoid of a pure inertia is found silent, and as what."""
    omega, state = 2 * math.pi * hz, answer_state()
    for k in range(round(seconds / DT / elapsed)):
        angle = amplitude * (1.0 - math.cos(omega * k * DT * elapsed))
        torque = inertia * omega * omega * (amplitude - angle) if k else 0.0
        state, cause = answer_step(limits, state, 0.0, torque, angle, elapsed * DT)
        if cause:
            return k * DT * elapsed, Cause(cause)
    return seconds, Cause.NONE


@pytest.mark.parametrize("inertia", [0.00053, -0.00053, 0.0045, 0.08])
def test_torque_above_that_of_the_least_inertia_answers_whatever_its_sign(inertia):
    assert imposed(inertia) == (2.0, Cause.NONE)


@pytest.mark.parametrize("inertia", [0.0, 1e-5, 0.00047])
def test_torque_below_it_does_not(inertia):
    at_s, cause = imposed(inertia)
    assert cause == Cause.TORQUE_SILENT
    assert at_s < 0.2


def test_a_motion_too_gentle_for_the_sensor_and_no_least_inertia_show_nothing():
    assert imposed(0.0, amplitude=0.001)[1] == Cause.NONE
    assert imposed(0.0, limits=LIMITS._replace(inertia_kg_m2=0.0))[1] == Cause.NONE
    assert imposed(0.0, limits=AnswerLimits())[1] == Cause.NONE


# --- sign


def settings_at(tick_rate_hz):
    """Return the settings of a rig with such ticks."""
    sensor = {"rate_hz": tick_rate_hz}
    return parse_settings(
        {
            "rig": {"tick_rate_hz": tick_rate_hz, "torque": sensor, "motion": sensor},
            "controller": {"torque_cutoff_hz": min(20.0, 0.2 * tick_rate_hz)},
            "guard": {"reaction_time_s": 0.1 if tick_rate_hz < 100.0 else 0.05},
        }
    )


def perturbed(
    sign=1.0,
    seconds=4.0,
    push=lambda t: 0.0,
    joint=(0.0045, 0.1368, 1.751),
    from_s=0.0,
    tick_rate_hz=1000.0,
):
    """Return when a joint under the admittance is stopped, and why; the sign from `from_s` on.

    The drive is of first order and comes 63 % of the way in 5 ms; a tick is some steps of it.
    """
    settings, dt = settings_at(tick_rate_hz), 1.0 / tick_rate_hz
    limits, steps = answer_limits(settings), round(dt / 0.0005)
    step = admittance(settings.controller.inertia_kg_m2, settings.controller.damping_nm_s_rad, dt)
    mean_of, n = mean_of_ticks(tick_rate_hz), round(seconds * tick_rate_hz)
    inertia, damping, stiffness = joint
    angle = velocity = command = torque = 0.0
    state, means = answer_state(), np.zeros(3)
    state, _ = answer_step(limits, state, *means.tolist(), mean_of * dt)  # at rest before
    for k, value in enumerate(prbs_nm(settings.prbs, tick_rate_hz)[:n].tolist()):
        t = k * dt
        command = admittance_step(step, command, value, torque)
        for _ in range(steps):
            acceleration = (command - velocity) / 0.005
            angle += velocity * 0.0005
            velocity += acceleration * 0.0005
        torque = inertia * acceleration + damping * velocity + stiffness * angle - push(t)
        torque *= sign if t >= from_s else 1.0
        means += np.array((value, torque, angle)) / mean_of
        if k % mean_of != mean_of - 1:
            continue
        state, cause = answer_step(limits, state, *means.tolist(), mean_of * dt)
        means[:] = 0.0
        if cause:
            return t, Cause(cause)
    return seconds, Cause.NONE


STIFFER = (0.008, 0.3, 3.0)
HANGING = (0.0045, 0.02, 0.05)


@pytest.mark.parametrize("tick_rate_hz", [50.0, 100.0, 500.0, 1000.0])
@pytest.mark.parametrize("joint", [(0.0045, 0.1368, 1.751), STIFFER, HANGING])
def test_a_joint_in_order_passes_and_one_with_the_wrong_sign_does_not(joint, tick_rate_hz):
    assert perturbed(joint=joint, tick_rate_hz=tick_rate_hz) == (4.0, Cause.NONE)
    at_s, cause = perturbed(-1.0, joint=joint, tick_rate_hz=tick_rate_hz)
    assert cause == Cause.TORQUE_SIGN
    if (joint, tick_rate_hz) == (HANGING, 50.0):  # its inertia is not seen, and all else is small
        assert at_s < 1.0
    else:
        assert at_s < (0.4 if tick_rate_hz >= 500.0 else 0.75)


@pytest.mark.parametrize("tick_rate_hz", [50.0, 100.0, 500.0, 1000.0])
@pytest.mark.parametrize("from_s", [1.0, 1.3])
def test_a_sign_that_turns_later_is_found_within_a_window_and_a_look(from_s, tick_rate_hz):
    at_s, cause = perturbed(-1.0, from_s=from_s, tick_rate_hz=tick_rate_hz)
    assert cause == Cause.TORQUE_SIGN
    row_s = 0.016 if tick_rate_hz >= 500.0 else 0.02
    assert at_s - from_s < (ROWS[0] + BEFORE + 2 * ROWS_A_TEST) * row_s


@pytest.mark.parametrize("tick_rate_hz", [50.0, 100.0, 1000.0])
@pytest.mark.parametrize("hz", [0.7, 2.0, 5.0])
def test_nothing_is_said_of_a_subject_who_pushes(hz, tick_rate_hz):
    for seed in range(3):
        phase = float(np.random.default_rng(seed).uniform(0, 6))

        def push(t, p=phase):
            return 2.0 * math.sin(2 * math.pi * hz * t + p)

        found = perturbed(push=push, tick_rate_hz=tick_rate_hz)
        assert found == (4.0, Cause.NONE)


@pytest.mark.parametrize(("gain", "within_s"), [(0.0, 0.5), (0.02, 0.5)])
def test_a_gain_of_next_to_nothing_is_found_soon(gain, within_s):
    at_s, cause = perturbed(gain)
    assert (cause, at_s < within_s) == (Cause.TORQUE_SILENT, True)


def test_the_controller_alone_is_that_of_the_perturbation():
    """J_c θ'' + B_c θ' = M with J_c = 1: θ' = (1 − e^(−rt)) M/r, and θ its integral."""
    limits, state, rate = LIMITS._replace(rate_per_s=10.0), answer_state(), 10.0
    for _ in range(125):
        state, _ = answer_step(limits, state, 2.0, 0.1, 0.0, 0.008)
    # The first step rises to M, which counts as half a step.
    t = 124.5 * 0.008
    decayed = math.exp(-rate * t)
    assert state.alone_per_s == pytest.approx(2.0 / rate * (1.0 - decayed), rel=1e-3)
    expected = 2.0 / rate * (t - (1.0 - decayed) / rate)
    assert state.alone[0] == pytest.approx(expected, rel=1e-3)


def test_a_step_that_comes_late_filters_over_the_time_that_passed():
    """Steps of 8 and 16 ms in turn leave of a slow sinusoid what steps of 8 ms leave."""
    states, ends = [], []
    for steps in ((0.008, 0.008, 0.008), (0.008, 0.016)):
        state, t = answer_state(), 0.0
        for k in range(600 // len(steps)):
            elapsed_s = steps[k % len(steps)]
            t += elapsed_s
            angle = 0.1 * math.sin(2.0 * math.pi * t)
            state, _ = answer_step(LIMITS, state, 0.0, 10.0 * angle, angle, elapsed_s)
        states.append(state)
        ends.append(t)
    np.testing.assert_allclose(states[0].torque, states[1].torque, atol=2e-3)
    state, _ = answer_step(LIMITS, states[0], 0.0, 5.0, 1.0, 100.0)
    assert 0.0 < state.torque[3] < state.torque[1] < 5.0


def test_each_limit_is_the_settings_in_si_units():
    limits = answer_limits(
        parse_settings(
            {
                "guard": {"min_inertia_kg_m2": 0.002, "reaction_time_s": 0.05},
                "controller": {"inertia_kg_m2": 0.05, "damping_nm_s_rad": 2.0},
                "rig": {
                    "tick_rate_hz": 500.0,
                    "torque": {"rate_hz": 100.0, "resolution_nm": 0.003},
                    "motion": {"rate_hz": 500.0, "angle_resolution_deg": 0.01},
                },
            }
        )
    )
    assert limits.left == (max_left(24, 1), max_left(48, 2), max_left(96, 4))
    numbers = {name: value for name, value in limits._asdict().items() if name != "left"}
    assert numbers == pytest.approx(
        {
            "rate_per_s": 40.0,
            "steps_a_row": 2,
            "shows_inertia": True,
            "inertia_kg_m2": 0.002,
            "min_part": 1.0,
            "unshown_nm": 0.0003 + 0.003 + 0.002 * math.radians(0.02) * (10 * math.pi) ** 2,
            "step_s": 0.008,
            "controlled_s": 0.01,
        }
    )
    slow = {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}}
    tables = {"controller": {"torque_cutoff_hz": 10.0, "damping_nm_s_rad": 0.0}}
    tables["guard"] = {"reaction_time_s": 0.1}
    limits = answer_limits(parse_settings({"rig": slow, **tables}))
    assert (limits.steps_a_row, limits.rate_per_s) == (1, 0.0)
    rates_hz = (50.0, 500.0, 1000.0, 4000.0)
    assert [mean_of_ticks(rate_hz) for rate_hz in rates_hz] == [1, 4, 8, 32]
    steps = [answer_limits(settings_at(rate_hz)).steps_a_row for rate_hz in (50.0, 62.5, 100.0)]
    assert steps == [1, 1, 2]
    slower = settings_at(50.0).rig.model_copy(update={"tick_rate_hz": 20.0})
    assert answer_limits(settings_at(50.0).model_copy(update={"rig": slower})).steps_a_row == 1


def test_ticks_show_the_inertia_until_the_drive_has_nearly_come_to_its_velocity():
    """ζ 2π f/rate is 3π/4 at f = 0.5303 rate with ζ = 0.7071, at half the rate with 3/4."""
    for damping, bandwidth_hz, shown in (
        *((0.7071, 53.0, True), (0.7071, 53.1, False)),
        *((0.75, 50.0, True), (0.75, 50.1, False)),
    ):
        settings = settings_at(100.0)
        drive = {"drive_damping_ratio": damping, "drive_bandwidth_hz": bandwidth_hz}
        rig = settings.rig.model_copy(update=drive)
        limits = answer_limits(settings.model_copy(update={"rig": rig}))
        assert limits.shows_inertia is shown
        assert limits.min_part == (1.0 if shown else HARDLY_SHOWN)


@pytest.mark.parametrize(("inertia", "silent"), [(0.00013, True), (0.00017, False)])
def test_only_a_part_of_the_least_inertia_is_asked_of_ticks_that_hardly_show_it(inertia, silent):
    found = imposed(inertia, limits=LIMITS._replace(min_part=0.3))[1]
    assert found == (Cause.TORQUE_SILENT if silent else Cause.NONE)


def test_the_figures_of_the_laws_and_what_they_begin_with():
    assert (SHOWN_MEMORY_S, MEAN_OF_S, ROW_S, LONGEST_S) == (0.25, 0.008, 0.016, 0.06)
    assert (ROWS, ROWS_A_TEST, UNSHOWN_NM) == ((24, 48, 96), 6, 0.0003)
    assert pytest.approx((0.75 * math.pi, 0.3)) == (SETTLED, HARDLY_SHOWN)
    assert AnswerLimits() == (0.0, 2, (Left(), Left(), Left()), True, 0.0, 1.0, *[math.inf] * 3)
    assert Left() == (1, 0.0, 0.0)
    state = answer_state()
    assert not state.window.any()
    for signal in state[1:3]:
        assert math.isnan(signal[0])
        assert signal[1:] == (0.0,) * 4
    assert state[3:] == (AT_REST, 0.0, 0.0, 0.0, 0.0, 0)
