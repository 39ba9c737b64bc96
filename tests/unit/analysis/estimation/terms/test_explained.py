"""What columns explain, against fits that leave nothing to algebra."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation.signals import Signals
from rigidimeter.analysis.estimation.terms.beyond_linear import beyond_linear
from rigidimeter.analysis.estimation.terms.explained import (
    Filtered,
    Gains,
    explained,
    one_more,
    stacked,
    strongest,
)

RNG = np.random.default_rng(5)


def lines(*shape):
    return RNG.normal(size=shape) + 1j * RNG.normal(size=shape)


@pytest.mark.parametrize("known", [0, 2])
def test_one_more_column_is_what_a_fit_with_it_gains(known):
    base, tried, target = stacked(lines(20, known)), stacked(lines(20, 3)), stacked(lines(20))
    gained, values = one_more(base, tried, target)
    before = np.linalg.norm(target - base @ np.linalg.lstsq(base, target, rcond=None)[0]) ** 2
    for k in range(3):
        fit = explained(np.column_stack([base, tried[:, k]]), target)
        assert before - fit.left == pytest.approx(gained[k], rel=1e-9)
        assert values[k] == pytest.approx(fit.values[-1], rel=1e-9)


def test_a_column_that_is_in_the_base_gains_nothing():
    base, target = stacked(lines(20, 2)), stacked(lines(20))
    gained, values = one_more(base, 3.0 * base, target)
    assert gained.tolist() == [0.0, 0.0]
    assert values.tolist() == [0.0, 0.0]


def test_the_strongest_is_that_of_the_best_fit():
    base, signal, gains, target = lines(20, 2), lines(20), lines(20, 9), lines(20)
    columns = signal[:, None] * gains
    left = [
        explained(stacked(np.column_stack([base, column])), stacked(target)).left
        for column in columns.T
    ]
    tried = Filtered(signal, Gains.of(gains))
    best = strongest(base, tried, target)
    assert best == int(np.argmin(left))
    assert tried.column(best) == pytest.approx(columns[:, best], rel=1e-14)


def test_columns_that_are_not_made_have_the_products_of_those_that_are():
    rows, signal, gains = lines(20, 2), lines(20), lines(20, 9)
    columns, tried = signal[:, None] * gains, Filtered(signal, Gains.of(gains))
    assert tried.along(rows) == pytest.approx((rows.conj().T @ columns).real, rel=1e-12)
    assert tried.sizes == pytest.approx(np.sum(np.abs(columns) ** 2, axis=0), rel=1e-12)


def test_lines_as_they_are_stand_for_white_ones():
    """What is linear in the motion is at right angles to all that is white."""
    n, rate_hz = 4000, 100.0
    torque, acceleration, velocity, angle = RNG.normal(size=(4, n))
    motion = Signals(
        time_s=np.arange(n) / rate_hz,
        torque_nm=torque,
        acceleration_rad_s2=acceleration,
        velocity_rad_s=velocity,
        angle_rad=angle,
        rate_hz=rate_hz,
        band_hz=(0.0, 50.0),
    )
    beyond = beyond_linear(motion, (0.5, 20.0))
    signal, gains = lines(beyond.torque.size), lines(beyond.torque.size, 5)
    columns = Filtered(signal, Gains.of(gains))
    white = beyond.white(signal[:, None] * gains)
    sizes = beyond.white_sizes(columns)
    assert sizes == pytest.approx(np.sum(np.abs(white) ** 2, axis=0), rel=1e-12)
    base = beyond.white(lines(beyond.torque.size, 2))
    ones = np.ones(beyond.torque.size)
    best = strongest(base, Filtered(ones, Gains.of(white)), beyond.torque)
    scaled = columns._replace(signal=signal / beyond.line_size_nm)
    assert strongest(base, scaled, beyond.torque, sizes) == best


@pytest.mark.parametrize("n", [4000, 4002, 4005, 4001])
def test_a_few_lines_are_those_of_the_whole_transform(n):
    rate_hz = 100.0
    values = RNG.normal(size=(4, n))
    motion = Signals(np.arange(n) / rate_hz, *values, rate_hz=rate_hz, band_hz=(0.0, 50.0))
    beyond = beyond_linear(motion, (0.5, 20.0))
    tapered = np.fft.rfft(beyond._window * (values[0] - np.mean(values[0])))
    place = np.round(beyond.frequency_hz * n / rate_hz).astype(int)
    assert beyond.torque_lines == pytest.approx(tapered[place], rel=1e-9, abs=1e-9)
