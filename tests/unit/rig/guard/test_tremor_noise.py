"""A tremor that the perturbation does not cause is seldom taken for an answer to it."""

import math

import numpy as np
import pytest
import scipy

from rigidimeter.rig.guard import (
    BEFORE,
    INSTRUMENTS,
    NOISE_ORDERS,
    PASSES,
    ROWS,
    AnswerLimits,
    answer_state,
    answer_step,
    difference_columns,
    explained_answer,
    whitened,
)

STEP_S, STEPS_A_ROW = 0.008, 2
WINDOWS = 60
HALF = ROWS[-1] + BEFORE


def windows(hz, harmonic, seed):
    """Return windows of rows that have no answer, of the most rows there are.

    The perturbation is +1 or −1 for 32 ms each. The tremor has an amplitude of 3 N·m, and a first
    harmonic; its phase wanders by 1 rad²/s. The sensor adds noise of 3 mN·m.
    """
    rng, n = np.random.default_rng(seed), WINDOWS * HALF * STEPS_A_ROW
    pushed = np.repeat(rng.choice([-1.0, 1.0], n // 4 + 1), 4)
    wandered = np.cumsum(math.sqrt(STEP_S) * rng.standard_normal(n))
    phase = 2.0 * math.pi * hz * STEP_S * np.arange(n) + wandered
    torque = 3.0 * np.sin(phase) + harmonic * np.sin(2.0 * phase) + 0.003 * rng.standard_normal(n)
    state, rows = answer_state(), []
    for k in range(n):
        state, _ = answer_step(AnswerLimits(20.0), state, pushed[k], torque[k], 0.0, STEP_S)
        if (k + 1) % STEPS_A_ROW == 0:
            rows.append(state.window[(k + 1) // STEPS_A_ROW % HALF].copy())
    return np.array(rows).reshape(WINDOWS, HALF, -1)


def parts(rows, order, found):
    """Return, for each window, the part of all looks in which white noise seems as much."""
    free = rows - INSTRUMENTS - 2 * order
    seen = []
    for window in found:
        columns, weights, most = (
            difference_columns(window[-rows - BEFORE :]),
            np.zeros(INSTRUMENTS),
            0.0,
        )
        for _ in range(PASSES):
            noise, answer, weights = explained_answer(whitened(columns, weights, order))
            most = max(most, noise / (noise + answer[-1, -1]))
        seen.append(scipy.special.betainc(0.5 * free, 2.0, most))
    return np.array(seen)


@pytest.mark.parametrize("hz", [4.0, 5.0, 8.0, 12.0])
def test_the_noise_of_the_longer_windows_makes_a_tremor_white(hz):
    found = windows(hz, 0.0, seed=11)
    for rows, order in zip(ROWS[1:], NOISE_ORDERS[1:], strict=True):
        seen = parts(rows, order, found)
        assert (seen < 0.01).sum() <= 4, (rows, seen)
        assert seen.min() > 1e-6, rows


def test_the_longest_window_makes_a_tremor_with_its_harmonic_white():
    seen = parts(ROWS[-1], NOISE_ORDERS[-1], windows(5.0, 1.0, seed=12))
    assert (seen < 0.01).sum() <= 4
    assert seen.min() > 1e-6


def test_a_noise_of_the_first_order_would_not():
    seen = parts(ROWS[-1], 1, windows(5.0, 0.0, seed=11))
    assert (seen < 0.01).sum() > 8
    assert seen.min() < 1e-8
