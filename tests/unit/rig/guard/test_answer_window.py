"""What stands in a window of the torque's answer, and what is read from it, in closed form."""

import cmath
import math

import numpy as np
import pytest

from rigidimeter.rig.guard import (
    AT_REST,
    BEFORE,
    COLUMNS,
    FILTER_RAD_S,
    NOISE_ORDERS,
    ROWS,
    ROWS_A_TEST,
    AnswerLimits,
    Cause,
    answer_state,
    answer_step,
    max_left,
)

HALF = ROWS[-1] + BEFORE
LEFT = tuple(map(max_left, ROWS, NOISE_ORDERS))


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
    kept = np.array([w**3 * high**4, w * w * high**3 * low, w * high**2 * low**2, high * low**3])
    perturbation, torque, angle = 0.4, cmath.rect(1.3, 0.7), cmath.rect(0.2, -1.1)
    alone = perturbation / (s * s + rate_per_s * s)
    limits = AnswerLimits(rate_per_s, steps_a_row=1)
    state, n = answer_state(), 4000
    t = (np.arange(n) + 0.5) * interval_s

    def over_time(phasor):
        return (np.multiply.outer(np.exp(s * t), phasor)).imag

    inputs = np.column_stack([over_time(value) for value in (perturbation, torque, angle)])
    for values in inputs.tolist():
        state, _ = answer_step(limits, state, *values, interval_s)
    expected = over_time(
        np.array([kept[3] * alone, kept[2] * alone, *(kept * angle), kept[3] * torque])
    )
    newest = np.arange(n - HALF, n)
    scale = np.abs(expected).max(axis=0)
    for half in (0, HALF):  # step k gave row k + 1
        kept_rows = state.window[half + (newest + 1) % HALF]
        np.testing.assert_allclose(kept_rows / scale, expected[newest] / scale, atol=4e-3)


def sums(n, interval_s, joint, sign=-1.0):
    """Yield what a joint gives that moves as the controller would alone, with B_c/J_c = 10/s."""
    t = (np.arange(n) + 1.0) * interval_s
    s = 2j * math.pi * np.array([1.0, 2.0, 3.0, 5.0, 7.0, 9.0, 11.0])
    waves = np.exp(np.multiply.outer(t, s))
    angle = waves / (s * s + 10.0 * s)
    inertia, damping, stiffness = joint
    torque = sign * angle @ (inertia * s * s + damping * s + stiffness)
    return np.column_stack([waves.sum(axis=1), torque, angle.sum(axis=1)]).imag.tolist()


@pytest.mark.parametrize("steps_a_row", [1, 2])
def test_windows_are_looked_at_every_few_rows_once_the_shortest_is_full(steps_a_row):
    limits = AnswerLimits(10.0, steps_a_row, LEFT)
    state, found = answer_state(), []
    for k, values in enumerate(sums(120 * steps_a_row, 0.016 / steps_a_row, (0.0045, 0.14, 1.8))):
        state, cause = answer_step(limits, state, *values, 0.016 / steps_a_row)
        if cause:
            found.append((k + 1) / steps_a_row)
            assert Cause(cause) is Cause.TORQUE_SIGN
    assert found[0] in (ROWS[0], ROWS[0] + ROWS_A_TEST)  # the joint did not begin at rest
    assert found == list(range(int(found[0]), 121, ROWS_A_TEST))


@pytest.mark.parametrize("which", [0, 1, 2])
def test_each_window_is_looked_at_over_its_own_rows(which):
    """Where the others must leave nothing at all, it alone can show the sign."""
    left = tuple(LEFT[k] if k == which else AnswerLimits().left[k] for k in range(3))
    state, first = answer_state(), 0
    for k, values in enumerate(sums(150, 0.016, (0.0045, 0.14, 1.8))):
        state, cause = answer_step(AnswerLimits(10.0, 1, left), state, *values, 0.016)
        if cause and not first:
            first = k + 1
    assert ROWS[which] <= first <= ROWS[which] + 2 * ROWS_A_TEST


def test_a_torque_that_is_silent_is_named_before_its_sign():
    limits = AnswerLimits(10.0, 1, LEFT, True, 1.0, 1.0, 0.0)  # no joint is as heavy as 1 kg·m²
    state, found = answer_state(), set()
    for values in sums(120, 0.016, (0.0045, 0.14, 1.8)):
        state, cause = answer_step(limits, state, *values, 0.016)
        found.add(Cause(cause))
    assert found == {Cause.NONE, Cause.TORQUE_SILENT}


def test_a_window_begins_anew_after_a_rest():
    state = answer_state()
    for k, values in enumerate(sums(60, 0.016, (0.0045, 0.14, 1.8))):
        perturbation, torque, angle = values
        pushed = 0.0 if k == 40 else perturbation
        limits = AnswerLimits(10.0, 1)
        state, _ = answer_step(limits, state, pushed, torque, angle, 0.016)
        if k in (39, 40):
            assert state.steps == (40 if k == 39 else 0)
            assert (state.alone == AT_REST) == (k == 40)
            assert (state.alone_per_s == state.perturbation_nm == 0.0) == (k == 40)
            assert state.window.any() == (k == 39)
    assert state.steps == 19
    assert state.window.shape == (2 * HALF, COLUMNS)
    assert np.count_nonzero(state.window.any(axis=1)) == 2 * 19


def test_a_single_row_is_forgotten_too():
    limits, state = AnswerLimits(10.0, 1), answer_state()
    for pushed, rows in ((1.0, 2), (0.0, 0)):
        state, _ = answer_step(limits, state, pushed, 0.1, 0.2, 0.016)
        assert np.count_nonzero(state.window.any(axis=1)) == rows


# --- steps that come late


def test_after_a_step_however_late_no_filter_overshoots():
    """A low-pass of a step rises to it and never beyond; the mean squares do not pass it either."""
    limits = AnswerLimits()
    for elapsed_s in (0.05, 0.06, 0.07, 1.0, 100.0):
        state, _ = answer_step(limits, answer_state(), 0.0, 0.0, 0.0, 0.008)
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
    limits = AnswerLimits(rate_per_s=2.0)
    half = FILTER_RAD_S * 0.03
    for elapsed_s in (0.06, 0.2):
        state, _ = answer_step(limits, answer_state(), 0.0, 0.0, 0.0, 0.008)
        state, _ = answer_step(limits, state, 3.0, 0.0, 1.0, elapsed_s)
        assert state.angle[1] == pytest.approx(half / (1.0 + half))
        # θ_p' from rest, over 0.06 s, under half of 3: 0.09/(1 + 0.06).
        assert state.alone_per_s == pytest.approx(0.09 / 1.06)


def test_a_late_step_is_filled_in_by_steps_on_a_line():
    """It leaves what as many steps in time leave, if torque and angle changed steadily."""
    limits = AnswerLimits(10.0, 2, step_s=0.008)
    states = []
    for elapsed_s, parts in ((0.008, (0.2, 0.4, 0.6, 0.8, 1.0)), (0.04, (1.0,))):
        state = answer_state()
        for k in range(20):
            state, _ = answer_step(limits, state, 1.5, 0.01 * k, 0.02 * k, 0.008)
        for part in parts:
            torque, angle = 0.19 + part * 0.6, 0.38 - part * 0.3
            state, _ = answer_step(limits, state, 1.5, torque, angle, elapsed_s)
        states.append(state)
    in_time, late = states
    assert (in_time.steps, late.steps) == (25, 25)
    for name in ("window", "torque", "angle", "alone", "alone_per_s", "shown_nm2", "moved2"):
        np.testing.assert_allclose(getattr(late, name), getattr(in_time, name), rtol=1e-9)


@pytest.mark.parametrize(
    ("elapsed_s", "steps"),
    [(0.01197, 1), (0.01203, 2), (0.0199, 2), (0.0201, 3), (0.501, 63), (9.0, 64)],
)
def test_so_many_steps_fill_in_a_late_one(elapsed_s, steps):
    limits, state = AnswerLimits(10.0, 2, step_s=0.008), answer_state()
    first, _ = answer_step(limits, state, 1.5, 0.1, 0.2, elapsed_s)
    assert first.steps == 1  # nothing is known of before
    state, _ = answer_step(limits, first, 1.5, 0.1, 0.2, elapsed_s)
    assert state.steps == 1 + steps


def test_the_controller_alone_makes_up_for_a_part_of_a_late_step_and_keeps_its_velocity():
    """θ_p' grows by M times 5 ms, however late, and θ_p by its mean times 48 ms."""
    limits, state = AnswerLimits(0.0, 2, step_s=0.008, controlled_s=0.005), answer_state()
    for _ in range(10):
        state, _ = answer_step(limits, state, 2.0, 0.1, 0.2, 0.008)
    after, _ = answer_step(limits, state, 2.0, 0.1, 0.2, 0.048)
    assert after.alone_per_s - state.alone_per_s == pytest.approx(2.0 * 0.005)
    mean = 0.5 * (after.alone_per_s + state.alone_per_s)
    assert after.alone[0] - state.alone[0] == pytest.approx(0.048 * mean)
    # A step that is late by less is made up for.
    late = state._replace(alone_per_s=0.0)
    limits = limits._replace(controlled_s=0.1)
    after, _ = answer_step(limits, late, 2.0, 0.1, 0.2, 0.048)
    assert after.alone_per_s == pytest.approx(2.0 * 0.048)


def test_the_first_cause_of_a_late_step_is_kept():
    """The mean squares reach J₀² a² in its first steps, and fall below it in the last."""
    limits = AnswerLimits(0.0, 2, inertia_kg_m2=1.0, unshown_nm=1.0, step_s=0.008)
    state = answer_state()._replace(torque=AT_REST, angle=AT_REST, moved2=1.05)
    once, cause = answer_step(limits, state, 0.0, 0.0, 0.0, 0.008)
    assert (cause, once.moved2 > 1.0) == (Cause.TORQUE_SILENT, True)
    late, cause = answer_step(limits, state, 0.0, 0.0, 0.0, 0.032)
    assert (cause, late.moved2 < 1.0) == (Cause.TORQUE_SILENT, True)


def test_the_size_is_looked_at_with_a_memory_of_a_quarter_of_a_second():
    """The mean squares fall by h/0.25 s a step: by (1 − 0.008/0.25)^n once all is at rest."""
    limits = AnswerLimits()
    state = answer_state()._replace(torque=AT_REST, angle=AT_REST, shown_nm2=3.0, moved2=5.0)
    for _ in range(40):
        state, cause = answer_step(limits, state, 0.0, 0.0, 0.0, 0.008)
        assert cause == Cause.NONE
    left = (1.0 - 0.032) ** 40
    assert (state.shown_nm2, state.moved2) == pytest.approx((3.0 * left, 5.0 * left))
