"""Spectra of an epoch as the page draws them, in unit/√Hz."""

import math

import numpy as np
import pytest

from rigidimeter.rig.console.page import amplitude_densities, as_json

RATE_HZ = 1000.0
TIME_S = 100.0 + np.arange(60_000) / RATE_HZ


def test_white_noise_lies_at_sd_times_root_of_two_over_the_rate():
    noise_nm = np.random.default_rng(1).normal(0.0, 0.3, TIME_S.size)
    frequency_hz, root = amplitude_densities(TIME_S, [noise_nm])
    assert (frequency_hz[0], frequency_hz[-1]) == pytest.approx((0.2, 500.0))
    assert math.sqrt(np.mean(np.square(root))) == pytest.approx(
        0.3 * math.sqrt(2 / RATE_HZ), rel=0.03
    )


def test_a_line_holds_its_mean_square_and_missing_samples_move_it_not():
    torque_nm = 0.4 * np.sin(2 * np.pi * 5.0 * TIME_S)
    torque_nm[30_000:30_004] = np.nan
    kept = np.arange(TIME_S.size) % 97 != 3  # ticks that the loop left out
    frequency_hz, root = amplitude_densities(TIME_S[kept], [torque_nm[kept]])
    power = np.square(np.array([value or 0.0 for value in root]))
    assert frequency_hz[int(np.argmax(power))] == pytest.approx(5.0)
    assert np.sum(power) * 0.2 == pytest.approx(0.4**2 / 2, rel=0.01)


def test_what_is_far_below_the_largest_is_not_drawn_and_nothing_has_no_spectrum():
    line, nothing = np.sin(2 * np.pi * 5.0 * TIME_S), np.zeros(TIME_S.size)
    _, root, none = amplitude_densities(TIME_S, [line, nothing])
    assert root[-1] is None
    assert set(none) == {None}
    assert amplitude_densities(TIME_S[:5], [line[:5]]) == [[], []]
    assert as_json(np.array([1234.56789, math.nan])) == [1234.56789, None]
