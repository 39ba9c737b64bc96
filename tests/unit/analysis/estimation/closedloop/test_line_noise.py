"""The covariance of a few lines: leverage, weights from the same residual, and the window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.grid import epoch_grid
from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother, Solved, with_weights
from rigidimeter.core.records import Channel, Epoch

LINES = 24


def noise(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


def solved(regressors, instruments, power, shape, spread=1.0):
    weighted = instruments / power[:, None]
    inverse = np.linalg.inv((weighted.conj().T @ regressors).real)
    return Solved(inverse, weighted, regressors, shape, spread)


def power_left(made):
    """Return E |Y − Φ p|² at each line, from the matrix that takes the noise to the residual."""
    left = np.zeros(made.shape.size)
    for k, power in enumerate(made.shape):
        for unit in (1.0, 1j):  # half the power of a line is in each
            e = np.zeros(made.shape.size, dtype=complex)
            e[k] = unit * np.sqrt(0.5 * power)
            p = made.inverse @ (made.weighted.conj().T @ e).real
            left += np.abs(e - made.regressors @ p) ** 2
    return left


@pytest.mark.parametrize("weights", ["right", "none", "other instruments"])
def test_the_power_of_the_noise_is_exact_in_expectation(weights):
    """A steep spectrum and a parameter that three lines decide, which lose most."""
    rng = np.random.default_rng(1)
    shape = np.arange(1.0, LINES + 1) ** -2.0
    regressors = noise(rng, LINES, 3)
    regressors[3:, 2] *= 1e-3
    instruments, power = regressors, shape
    if weights == "none":
        power = np.ones(LINES)
    if weights == "other instruments":
        instruments = regressors + 0.3 * noise(rng, LINES, 3)
    made = solved(regressors, instruments, power, shape)
    left = power_left(made)
    assert made.share_left() == pytest.approx(left / shape, rel=1e-9)
    assert np.ptp(made.share_left()) > 0.2
    smoother = Smoother.over(np.arange(LINES), 4, 0.1)
    assert made.density(np.sqrt(left), smoother) == pytest.approx(shape, rel=1e-9)


@pytest.mark.parametrize("epochs", [1, 4])
def test_weights_that_are_one_weight_take_nothing(epochs):
    rng = np.random.default_rng(2)
    regressors = noise(rng, LINES, 3)
    made = solved(regressors, regressors, np.ones(LINES), np.ones(LINES))
    together = replace(made, inverse=made.inverse / epochs)
    everywhere = Smoother.over(np.arange(LINES), LINES, 0.0)
    taken = together.taken_by_weights(everywhere, epochs)
    assert taken == pytest.approx(np.zeros((3, 3)), abs=1e-12 * np.max(np.linalg.inv(made.inverse)))


def test_weights_of_the_same_residual_are_in_the_variance():
    """One parameter, 400 lines, 9 of them to a weight: by 1/(1 − 1/9)² above that of fixed ones."""
    rng = np.random.default_rng(3)
    line = np.arange(400)
    smoother = Smoother.over(line, 4, 0.0)
    regressors = np.ones((line.size, 1)) * np.exp(1j * line)[:, None]
    found, stated, naive = [], [], []
    for _ in range(1000):
        target = noise(rng, line.size)
        p = np.zeros(1)
        for _ in range(12):
            power = smoother(np.abs(target - regressors @ p) ** 2)
            made = solved(regressors, regressors, power, power)
            p = made.inverse @ (made.weighted.conj().T @ target).real
        density = made.density(target - regressors @ p, smoother)
        naive.append(made.covariance(density, smoother)[0][0, 0])
        followed = replace(
            made, inverse=with_weights(made.inverse, made.taken_by_weights(smoother))
        )
        stated.append(followed.covariance(density, smoother)[0][0, 0])
        found.append(p[0])
    assert np.mean(stated) / np.mean(naive) == pytest.approx(1 / (1 - 1 / 9) ** 2, rel=0.01)
    assert np.mean(stated) == pytest.approx(np.var(found), rel=0.12)


def test_the_window_makes_neighbouring_lines_alike():
    """White noise times white noise, both through the window of a short epoch."""
    rng = np.random.default_rng(4)
    time_s = np.arange(500) / 100.0
    channels = {n: Channel(n, time_s, np.zeros(500)) for n in ("torque_nm", "angle_rad")}
    grid = epoch_grid(Epoch("made", "1", channels), (0.2, 45.0), 1.0)
    square = grid.window**2
    assert grid.spread == pytest.approx(500 * np.sum(square**2) / np.sum(square) ** 2)
    assert grid.spread == pytest.approx(1.26, abs=0.01)
    sums, powers = [], []
    for _ in range(3000):
        z, e = (grid.transform(rng.standard_normal(500)) for _ in range(2))
        sums.append(np.sum(z.conj() * e).real)
        powers.append(0.5 * np.sum(np.abs(z) ** 2) * grid.energy)
    assert np.var(sums) / np.mean(powers) == pytest.approx(grid.spread, rel=0.1)
