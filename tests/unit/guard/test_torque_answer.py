"""Whether the torque answers: filters and equations in closed form, then joints right and wrong."""

import math

import numpy as np
import pytest

from rigidimeter.control import admittance, admittance_step
from rigidimeter.experiment import prbs_nm
from rigidimeter.guard import AnswerLimits, Cause, answer_limits
from rigidimeter.guard.torque_answer import (
    AT_REST,
    FILTER_RAD_S,
    FIT_LEAVES,
    INSTRUMENTS_LEAVE,
    LONGEST_S,
    MEAN_OF_S,
    NOTHING_YET,
    SHOWN_MEMORY_S,
    UNSHOWN_NM,
    WINDOW_S,
    answer_state,
    answer_step,
    fitted,
    lowpassed,
    mean_of_ticks,
    solved,
)
from rigidimeter.settings import parse_settings

DT = 0.001
MEAN_OF_TICKS = mean_of_ticks(1.0 / DT)
LIMITS = answer_limits(parse_settings({}))


def test_three_equations_are_solved():
    rng = np.random.default_rng(1)
    matrix, right = rng.standard_normal((3, 3)), rng.standard_normal(3)
    np.testing.assert_allclose(solved(*matrix.ravel(), *right), np.linalg.solve(matrix, right))
    assert solved(*(0.0,) * 9, 1.0, 1.0, 1.0) == (0.0, 0.0, 0.0)


def test_a_window_is_fitted_by_its_instruments():
    rng = np.random.default_rng(2)
    z, x, m = rng.standard_normal((124, 3)), rng.standard_normal((124, 3)), np.zeros(124)
    x += z @ rng.standard_normal((3, 3))
    m = x @ [0.3, 2.0, 5.0] + 0.5 * rng.standard_normal(124)
    joint = np.linalg.solve(z.T @ x, z.T @ m)
    left = np.sum((m - x @ joint) ** 2) / np.sum(m * m)
    a = x[:, 0]
    alone = np.sum((a - z @ np.linalg.lstsq(z, a, rcond=None)[0]) ** 2) / np.sum(a * a)
    np.testing.assert_allclose(fitted(np.column_stack([z, x, m])), (*joint, left, alone))


def test_a_window_of_nothing_shows_nothing():
    joint, shares = fitted(np.zeros((124, 7)))[:3], fitted(np.zeros((124, 7)))[3:]
    assert joint == (0.0, 0.0, 0.0)
    assert all(math.isnan(share) for share in shares)


def test_at_its_corner_each_low_pass_leaves_half_the_power_and_turns_by_45_degrees():
    state, found = NOTHING_YET, []
    half = 0.5 * FILTER_RAD_S * DT
    for k in range(3000):
        state = lowpassed(half / (1 + half), state, math.sin(FILTER_RAD_S * k * DT))
        found.append(state[1:])
    t = FILTER_RAD_S * DT * np.arange(3000)
    for order in (1, 2, 3):
        expected = 2.0 ** (-order / 2) * np.sin(t - order * math.pi / 4)
        np.testing.assert_allclose(np.array(found)[2000:, order - 1], expected[2000:], atol=2e-3)


def test_a_signal_begins_where_it_is():
    assert lowpassed(0.1, NOTHING_YET, 3.0) == (3.0, 3.0, 3.0, 3.0)


# --- size


def imposed(inertia, seconds=2.0, hz=2.0, amplitude=0.2, limits=LIMITS, elapsed=1):
    """Return when an imposed sinusoid of a pure inertia is found silent, and as what."""
    omega, state = 2 * math.pi * hz, answer_state(limits)
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


def perturbed(sign=1.0, seconds=4.0, push=lambda t: 0.0, joint=(0.0045, 0.1368, 1.751), from_s=0.0):
    """Return when a joint under the admittance is stopped, and why; the sign from `from_s` on."""
    settings = parse_settings({})
    step = admittance(settings.controller.inertia_kg_m2, settings.controller.damping_nm_s_rad, DT)
    inertia, damping, stiffness = joint
    angle = velocity = command = torque = 0.0
    state, means = answer_state(LIMITS), np.zeros(3)
    state, _ = answer_step(LIMITS, state, *means.tolist(), MEAN_OF_TICKS * DT)  # at rest before
    for k, value in enumerate(prbs_nm(settings.prbs, 1000.0)[: round(seconds / DT)].tolist()):
        t = k * DT
        command = admittance_step(step, command, value, torque)
        acceleration = (command - velocity) / 0.005  # a drive of first order
        velocity += acceleration * DT
        angle += velocity * DT
        torque = inertia * acceleration + damping * velocity + stiffness * angle - push(t)
        torque *= sign if t >= from_s else 1.0
        means += np.array((value, torque, angle)) / MEAN_OF_TICKS
        if k % MEAN_OF_TICKS != MEAN_OF_TICKS - 1:
            continue
        state, cause = answer_step(LIMITS, state, *means.tolist(), MEAN_OF_TICKS * DT)
        means[:] = 0.0
        if cause:
            return t, Cause(cause)
    return seconds, Cause.NONE


STIFFER = (0.008, 0.3, 3.0)
HANGING = (0.0045, 0.02, 0.05)


@pytest.mark.parametrize("joint", [(0.0045, 0.1368, 1.751), STIFFER, HANGING])
def test_a_joint_in_order_passes_and_one_with_the_wrong_sign_does_not(joint):
    assert perturbed(joint=joint) == (4.0, Cause.NONE)
    at_s, cause = perturbed(-1.0, joint=joint)
    assert cause == Cause.TORQUE_SIGN
    assert at_s == pytest.approx(1.0, abs=0.01)


def test_a_sign_that_turns_later_is_found_within_a_window_and_a_half():
    at_s, cause = perturbed(-1.0, from_s=1.3)
    assert cause == Cause.TORQUE_SIGN
    assert 2.3 < at_s < 2.81


@pytest.mark.parametrize("hz", [0.7, 2.0, 5.0])
def test_nothing_is_said_of_a_subject_who_pushes(hz):
    for seed in range(3):
        phase = float(np.random.default_rng(seed).uniform(0, 6))
        found = perturbed(push=lambda t, p=phase: 2.0 * math.sin(2 * math.pi * hz * t + p))
        assert found == (4.0, Cause.NONE)


@pytest.mark.parametrize(("gain", "within_s"), [(0.0, 0.5), (0.02, 0.5)])
def test_a_gain_of_next_to_nothing_is_found_soon(gain, within_s):
    at_s, cause = perturbed(gain)
    assert (cause, at_s < within_s) == (Cause.TORQUE_SILENT, True)


def test_a_window_begins_anew_after_a_rest():
    """Half a second before a rest and half a second after it are no second."""
    state = answer_state(LIMITS)
    for k in range(175):
        value = 0.0 if k == 87 else math.sin(0.16 * k) + math.sin(0.4 * k) + 3.0
        state, _ = answer_step(LIMITS, state, value, 1.0, 0.01 * math.sin(0.24 * k), 0.008)
        if k in (86, 87):
            assert state.steps == (87 if k == 86 else 0)
            assert (state.alone == AT_REST) == (k == 87)
            assert (state.alone_per_s == state.perturbation_nm == 0.0) == (k == 87)
    assert state.steps == 87


def test_the_window_is_that_of_the_last_second_and_is_looked_at_every_half():
    limits, state = LIMITS._replace(half_steps=3), None
    state = answer_state(limits)
    rows = []
    for k in range(8):
        state, _ = answer_step(limits, state, 1.0, 0.1 * k, 0.01 * k * k, 0.008)
        rows.append(state.window[k % 6].copy())
    for k in range(2, 8):
        np.testing.assert_array_equal(state.window[k % 6], rows[k])


def test_the_controller_alone_is_that_of_the_perturbation():
    """J_c θ'' + B_c θ' = M with J_c = 1: θ' = (1 − e^(−rt)) M/r, and θ its integral."""
    limits, state, rate = LIMITS._replace(rate_per_s=10.0), answer_state(LIMITS), 10.0
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
        state, t = answer_state(LIMITS), 0.0
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
                "guard": {"least_inertia_kg_m2": 0.002, "reaction_time_s": 0.05},
                "controller": {"inertia_kg_m2": 0.05, "damping_nm_s_rad": 2.0},
                "rig": {
                    "tick_rate_hz": 500.0,
                    "torque": {"rate_hz": 100.0, "resolution_nm": 0.003},
                    "motion": {"rate_hz": 500.0, "angle_resolution_deg": 0.01},
                },
            }
        )
    )
    assert limits._asdict() == pytest.approx(
        {
            "rate_per_s": 40.0,
            "half_steps": 62,
            "inertia_kg_m2": 0.002,
            "unshown_nm": 0.0003 + 0.003 + 0.002 * math.radians(0.02) * (10 * math.pi) ** 2,
        }
    )
    slow = {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}}
    tables = {"controller": {"torque_cutoff_hz": 10.0, "damping_nm_s_rad": 0.0}}
    tables["guard"] = {"reaction_time_s": 0.1}
    limits = answer_limits(parse_settings({"rig": slow, **tables}))
    assert (limits.half_steps, limits.rate_per_s) == (25, 0.0)
    assert [mean_of_ticks(rate_hz) for rate_hz in (50.0, 500.0, 1000.0, 4000.0)] == [1, 4, 8, 32]


def test_the_figures_of_the_laws_and_what_they_begin_with():
    assert (SHOWN_MEMORY_S, WINDOW_S, MEAN_OF_S, LONGEST_S) == (0.25, 1.0, 0.008, 0.06)
    assert (FIT_LEAVES, INSTRUMENTS_LEAVE, UNSHOWN_NM) == (0.03, 0.12, 0.0003)
    assert AnswerLimits() == (0.0, 62, 0.0, math.inf)
    state = answer_state(AnswerLimits())
    assert state.window.shape == (124, 7)
    assert not state.window.any()
    for signal in state[1:3]:
        assert math.isnan(signal[0])
        assert signal[1:] == (0.0, 0.0, 0.0)
    assert state[3:] == (AT_REST, 0.0, 0.0, 0.0, 0.0, 0)
