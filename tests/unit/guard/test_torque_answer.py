"""Whether the torque answers: filters and equations in closed form, then joints right and wrong."""

import math

import numpy as np
import pytest

from rigidimeter.control import admittance, admittance_step
from rigidimeter.experiment import prbs_nm
from rigidimeter.guard import AnswerLimits, Cause, answer_limits
from rigidimeter.guard.torque_answer import (
    FILTER_RAD_S,
    FIT_LEAVES,
    INSTRUMENTS_LEAVE,
    SHOWN_MEMORY_S,
    SUMMED_EVERY_S,
    UNSHOWN_NM,
    WINDOW_S,
    Filtered,
    answer_state,
    answer_step,
    lowpassed,
    solved,
)
from rigidimeter.settings import parse_settings

DT = 0.001
LIMITS = answer_limits(parse_settings({}))


def test_three_equations_are_solved():
    rng = np.random.default_rng(1)
    matrix, right = rng.standard_normal((3, 3)), rng.standard_normal(3)
    np.testing.assert_allclose(solved(*matrix.ravel(), *right), np.linalg.solve(matrix, right))
    assert solved(*(0.0,) * 9, 1.0, 1.0, 1.0) == (0.0, 0.0, 0.0)


def test_at_its_corner_each_low_pass_leaves_half_the_power_and_turns_by_45_degrees():
    state, found = Filtered(), []
    for k in range(3000):
        state = lowpassed(LIMITS.blend, state, math.sin(FILTER_RAD_S * k * DT))
        found.append(state[1:])
    t = FILTER_RAD_S * DT * np.arange(3000)
    for order in (1, 2, 3):
        expected = 2.0 ** (-order / 2) * np.sin(t - order * math.pi / 4)
        np.testing.assert_allclose(np.array(found)[2000:, order - 1], expected[2000:], atol=2e-3)


def test_a_signal_begins_where_it_is():
    assert lowpassed(0.1, Filtered(), 3.0) == (3.0, 3.0, 3.0, 3.0)


# --- size


def imposed(inertia, seconds=2.0, hz=2.0, amplitude=0.2, limits=LIMITS, elapsed=1):
    """Return when an imposed sinusoid of a pure inertia is found silent, and as what."""
    omega, state = 2 * math.pi * hz, answer_state()
    for k in range(round(seconds / DT / elapsed)):
        angle = amplitude * (1.0 - math.cos(omega * k * DT * elapsed))
        torque = inertia * omega * omega * (amplitude - angle) if k else 0.0
        state, cause = answer_step(limits, state, 0.0, torque, angle, elapsed)
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
    assert imposed(0.0, limits=AnswerLimits(DT))[1] == Cause.NONE


# --- sign


def perturbed(sign=1.0, seconds=4.0, push=lambda t: 0.0, joint=(0.0045, 0.1368, 1.751), from_s=0.0):
    """Return when a joint under the admittance is stopped, and why; the sign from `from_s` on."""
    settings = parse_settings({})
    step = admittance(settings.controller.inertia_kg_m2, settings.controller.damping_nm_s_rad, DT)
    inertia, damping, stiffness = joint
    angle = velocity = command = torque = 0.0
    state = answer_state()
    for k, value in enumerate(prbs_nm(settings.prbs, 1000.0)[: round(seconds / DT)].tolist()):
        t = k * DT
        command = admittance_step(step, command, value, torque)
        acceleration = (command - velocity) / 0.005  # a drive of first order
        velocity += acceleration * DT
        angle += velocity * DT
        torque = inertia * acceleration + damping * velocity + stiffness * angle - push(t)
        torque *= sign if t >= from_s else 1.0
        state, cause = answer_step(LIMITS, state, value, torque, angle)
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
    state = answer_state()
    for k in range(1400):
        value = 0.0 if k == 700 else math.sin(0.02 * k) + math.sin(0.05 * k)
        state, _ = answer_step(LIMITS, state, value, 1.0, 0.01 * math.sin(0.03 * k))
        if k in (699, 700):
            assert state.halves == (1 if k == 699 else 0)
    assert state.halves == 1


def test_what_is_no_number_is_left_out():
    state, _ = answer_step(LIMITS, answer_state(), 1.0, 0.5, 0.1)
    for values in ((math.nan, 0.5, 0.1), (1.0, math.inf, 0.1), (1.0, 0.5, math.nan)):
        assert answer_step(LIMITS, state, *values) == (state, 0)


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
    half = 0.5 * 2 * math.pi * 5.0 * 0.002
    assert limits._asdict() == pytest.approx(
        {
            "interval_s": 0.002,
            "blend": half / (1 + half),
            "decay": math.exp(-0.08),
            "gain": (1 - math.exp(-0.08)) / 2.0,
            "summed_ticks": 2,
            "half_entries": 125,
            "inertia_kg_m2": 0.002,
            "unshown_nm": 0.0003 + 0.003 + 0.002 * math.radians(0.02) * (10 * math.pi) ** 2,
        }
    )
    slow = {"tick_rate_hz": 50.0, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}}
    tables = {"controller": {"torque_cutoff_hz": 10.0, "damping_nm_s_rad": 0.0}}
    tables["guard"] = {"reaction_time_s": 0.1}
    limits = answer_limits(parse_settings({"rig": slow, **tables}))
    assert (limits.summed_ticks, limits.half_entries, limits.decay) == (1, 25, 1.0)
    assert limits.gain == pytest.approx(0.02 / parse_settings({}).controller.inertia_kg_m2)


def test_the_figures_of_the_laws_and_what_they_begin_with():
    assert (SHOWN_MEMORY_S, WINDOW_S, SUMMED_EVERY_S) == (0.25, 1.0, 0.004)
    assert (FIT_LEAVES, INSTRUMENTS_LEAVE, UNSHOWN_NM) == (0.03, 0.12, 0.0003)
    assert AnswerLimits(DT)[1:] == (0.5, 1.0, 0.0, 4, 125, 0.0, math.inf)
    state = answer_state()
    assert state.sums.shape == (3, 28)
    assert not state.sums.any()
    for signal in state[1:4]:
        assert math.isnan(signal.value)
        assert signal[1:] == (0.0, 0.0, 0.0)
    assert state[4:] == (0.0, 0.0, 0.0, 0, 0, 0)
