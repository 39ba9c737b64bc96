"""What stands in a window of the torque's answer, and what is read from it, in closed form."""

import cmath
import itertools
import math

import numpy as np
import pytest

from rigidimeter.guard import AnswerLimits, Cause, answer_limits
from rigidimeter.guard.torque_answer import (
    AT_REST,
    FILTER_RAD_S,
    FIT_LEAVES,
    INSTRUMENTS_LEAVE,
    answer_state,
    answer_step,
    fitted,
    sign_is_wrong,
    solved,
)
from rigidimeter.settings import parse_settings

STEPS = 124


# --- the signals of a row


@pytest.mark.parametrize("hz", [1.0, 4.0])
@pytest.mark.parametrize("rate_per_s", [8.0, 20.0])
def test_a_row_is_the_motion_of_the_controller_alone_that_of_the_joint_and_the_torque(
    hz, rate_per_s
):
    """At jω each filter is a factor: L = w/(jω + w), H = 1 − L, and θ_p = M_p/((jω)² + r jω)."""
    s, interval_s, w = 2j * math.pi * hz, 0.001, FILTER_RAD_S
    low = w / (s + w)
    high = 1.0 - low
    kept = np.array([w * w * high**3, w * high**2 * low, high * low**2])
    perturbation, torque, angle = 0.4, cmath.rect(1.3, 0.7), cmath.rect(0.2, -1.1)
    alone = perturbation / (s * s + rate_per_s * s)
    limits = AnswerLimits(rate_per_s, half_steps=250)
    state, n = answer_state(limits), 4000
    t = (np.arange(n) + 0.5) * interval_s

    def over_time(phasor):
        return (np.multiply.outer(np.exp(s * t), phasor)).imag

    inputs = np.column_stack([over_time(value) for value in (perturbation, torque, angle)])
    for values in inputs.tolist():
        state, _ = answer_step(limits, state, *values, interval_s)
    expected = over_time(np.array([*(kept * alone), *(kept * angle), kept[2] * torque]))
    newest = np.arange(n - 500, n)
    scale = np.abs(expected[newest]).max(axis=0)
    np.testing.assert_allclose(
        state.window[newest % 500] / scale, expected[newest] / scale, atol=2e-3
    )


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 150.0])
def test_a_window_lasts_one_second(rate_hz):
    tables = {
        "rig": {"tick_rate_hz": rate_hz, "torque": {"rate_hz": 50.0}, "motion": {"rate_hz": 50.0}},
        "controller": {"torque_cutoff_hz": 10.0},
        "guard": {"reaction_time_s": 0.1},
    }
    limits = answer_limits(parse_settings(tables))
    # At these rates a step is of one tick.
    assert 2 * limits.half_steps / rate_hz == 1.0


def test_windows_end_every_half_second_and_are_looked_at_only_then():
    """A joint that moves as the controller would alone, its torque with the wrong sign."""
    limits, interval_s, n = AnswerLimits(rate_per_s=10.0, half_steps=250), 0.002, 1300
    t = (np.arange(n) + 1.0) * interval_s
    s = 2j * math.pi * np.array([1.0, 2.0, 3.0, 5.0])
    waves = np.exp(np.multiply.outer(t, s))
    perturbation, angle = waves.sum(axis=1).imag, (waves @ (1.0 / (s * s + 10.0 * s))).imag
    impedance = 0.0045 * s * s + 0.1368 * s + 1.751
    torque = -(waves @ (impedance / (s * s + 10.0 * s))).imag
    state, found = answer_state(limits), []
    for k, values in enumerate(np.column_stack([perturbation, torque, angle]).tolist()):
        state, cause = answer_step(limits, state, *values, interval_s)
        if cause:
            found.append((k + 1, Cause(cause)))
    # The first window, to 500, holds where the controller begins; the joint moved already.
    assert found == [(steps, Cause.TORQUE_SIGN) for steps in (750, 1000, 1250)]


# --- what a window shows


def window(joint, torque_left=0.0, motion_left=0.0):
    """Return a window of a joint whose fit and whose instruments leave such shares.

    What they leave is orthogonal to the instruments, and to each other, so that it is no part of
    J, B and K.
    """
    z = np.linalg.qr(np.random.default_rng(4).standard_normal((STEPS, 5)))[0]
    motion_apart, torque_apart = z[:, 3], z[:, 4]
    x = z[:, :3].copy()
    x[:, 0] += math.sqrt(motion_left / (1.0 - motion_left)) * motion_apart
    torque = x @ joint
    size = math.sqrt(torque_left / (1.0 - torque_left) * float(torque @ torque))
    return np.column_stack([z[:, :3], x, torque + size * torque_apart])


@pytest.mark.parametrize("torque_left", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("motion_left", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("amplitude", [1.0, 0.001])
def test_the_shares_are_of_what_is_orthogonal_to_fit_and_instruments(
    torque_left, motion_left, amplitude
):
    """However small the motion is."""
    joint = (-0.3, -2.0, 5.0)
    found = fitted(amplitude * window(joint, torque_left, motion_left))
    assert found == pytest.approx((*joint, torque_left, motion_left))


def test_the_order_of_three_equations_makes_no_difference():
    """It turns the sign of the determinant."""
    matrix, right = np.random.default_rng(5).standard_normal((3, 3)), np.array([1.0, -2.0, 0.5])
    for order in itertools.permutations(range(3)):
        rows = list(order)
        found = solved(*matrix[rows].ravel(), *right[rows])
        np.testing.assert_allclose(found, np.linalg.solve(matrix, right))


@pytest.mark.parametrize("stiffness", [-1.0, 1.0])
@pytest.mark.parametrize("size", [1.0, 5e-4])
def test_a_sign_is_wrong_only_where_inertia_and_damping_are_both_negative(stiffness, size):
    """A sensor with the wrong sign turns both, of an arm or of a finger; gravity may turn K."""
    assert sign_is_wrong(window((-size, -size, stiffness)))
    for inertia, damping in ((-size, size), (size, -size), (size, size)):
        assert not sign_is_wrong(window((inertia, damping, stiffness)))


@pytest.mark.parametrize(
    ("torque_left", "motion_left", "believed"),
    [
        (0.99 * FIT_LEAVES, 0.99 * INSTRUMENTS_LEAVE, True),
        (1.01 * FIT_LEAVES, 0.99 * INSTRUMENTS_LEAVE, False),
        (0.99 * FIT_LEAVES, 1.01 * INSTRUMENTS_LEAVE, False),
    ],
)
def test_a_wrong_sign_is_believed_where_fit_and_instruments_both_leave_little(
    torque_left, motion_left, believed
):
    assert sign_is_wrong(window((-1.0, -2.0, 1.0), torque_left, motion_left)) == believed


# --- steps that come late


def test_after_a_step_however_late_no_filter_overshoots():
    """A low-pass of a step rises to it and never beyond; the mean squares do not pass it either."""
    limits = AnswerLimits()
    for elapsed_s in (0.05, 0.06, 0.07, 1.0, 100.0):
        state, _ = answer_step(limits, answer_state(limits), 0.0, 0.0, 0.0, 0.008)
        before = state.angle[1:]
        for _ in range(40):
            state, _ = answer_step(limits, state, 0.0, 2.0, 1.0, elapsed_s)
            assert all(old <= new <= 1.0 for old, new in zip(before, state.angle[1:], strict=True))
            before = state.angle[1:]
            assert state.shown_nm2 >= 0.0
            assert state.moved2 >= 0.0
        assert state.angle[3] == pytest.approx(1.0, abs=0.02)


def test_a_late_step_is_one_of_the_longest():
    """Of a step of 1 the first low-pass has h/(1 + h) then, h = 2π · 5 Hz · 0.06 s / 2."""
    limits = AnswerLimits(rate_per_s=2.0, half_steps=3)
    half = FILTER_RAD_S * 0.03
    for elapsed_s in (0.06, 0.2):
        state, _ = answer_step(limits, answer_state(limits), 0.0, 0.0, 0.0, 0.008)
        state, _ = answer_step(limits, state, 3.0, 0.0, 1.0, elapsed_s)
        assert state.angle[1] == pytest.approx(half / (1.0 + half))
        # θ_p' from rest, over 0.06 s, under half of 3: 0.09/(1 + 0.06).
        assert state.alone_per_s == pytest.approx(0.09 / 1.06)


def test_the_size_is_looked_at_with_a_memory_of_a_quarter_of_a_second():
    """The mean squares fall by h/0.25 s a step: by (1 − 0.008/0.25)^n once all is at rest."""
    limits = AnswerLimits()
    state = answer_state(limits)._replace(torque=AT_REST, angle=AT_REST, shown_nm2=3.0, moved2=5.0)
    for _ in range(40):
        state, cause = answer_step(limits, state, 0.0, 0.0, 0.0, 0.008)
        assert cause == Cause.NONE
    left = (1.0 - 0.032) ** 40
    assert (state.shown_nm2, state.moved2) == pytest.approx((3.0 * left, 5.0 * left))
