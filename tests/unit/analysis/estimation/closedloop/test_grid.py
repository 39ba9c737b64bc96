"""Lines of signals whose derivatives are known, and of noise."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.grid import epoch_grid
from rigidimeter.core.records import Channel, Epoch, LeftOut

RATE_HZ = 500.0


def grid_of(left_out=(), n=10_000):
    time_s = np.arange(n) / RATE_HZ
    channels = {name: Channel(name, time_s, np.sin(time_s)) for name in ("torque_nm", "angle_rad")}
    return epoch_grid(Epoch("made", "1", channels, left_out=left_out), (0.1, 30.0), 1.0)


@pytest.mark.parametrize("left_out", [(), (LeftOut(7.0, 7.5, "torque_nm", "lost"),)])
def test_lines_of_derivatives_need_no_derivative(left_out):
    grid = grid_of(left_out)
    w = 2 * np.pi * 1.37
    t = grid.time_s
    x, v, a = np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)
    through = grid.transforms(x, 2)[0]
    for found, signal in zip(through, (x, v, a), strict=True):
        truth = grid.transform(signal)
        # Means go first, and that of a derivative is not the derivative of a mean.
        assert np.max(np.abs(found - truth)) < 3e-4 * np.max(np.abs(truth))


@pytest.mark.parametrize("n", [10_000, 6_561])
def test_half_the_difference_is_that_of_even_and_odd_samples(n):
    grid = grid_of(n=n)
    assert grid.time_s.size == n
    x = np.random.default_rng(1).standard_normal(grid.time_s.size)
    x -= np.sum(grid.window**2 * x) / grid.energy
    line, apart = grid.transforms(x, 0, halves=True)[:, 0]
    even, odd = (2 * x * (np.arange(x.size) % 2 == side) for side in (0, 1))
    for half, sign in ((even, 1), (odd, -1)):
        spectrum = np.fft.rfft(grid.window * half)[grid.line]
        np.testing.assert_allclose(line + sign * apart, spectrum, atol=1e-9)
    assert np.mean(np.abs(apart) ** 2) == pytest.approx(np.mean(np.abs(line) ** 2), rel=0.2)
