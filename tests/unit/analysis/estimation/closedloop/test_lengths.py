"""Epochs of one condition of different lengths: each has its own lines and counts by its length."""

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import fit_epochs
from rigidimeter.core.records import Channel

LONG_S, SHORT_S, TAPER_S = 20.0, 12.0, 1.0


def first_part(epoch, duration_s):
    channels = {}
    for name, channel in epoch.channels.items():
        kept = channel.time_s < channel.time_s[0] + duration_s
        channels[name] = Channel(name, channel.time_s[kept], channel.values[kept])
    return replace(epoch, channels=channels)


@pytest.fixture(scope="module")
def fits(simulated):
    settings, epochs = simulated(8, 0.1, seed=3)
    mixed = [first_part(e, SHORT_S) if i % 2 else e for i, e in enumerate(epochs)]

    def fitted(some, method):
        return fit_epochs(some, method, settings)

    return {
        method: [fitted(some, method) for some in (epochs, mixed, mixed[::-1])]
        for method in ("iv", "bandlimited")
    }


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_which_epoch_comes_first_does_not_matter(fits, method):
    _, (_, (one, *_)), (_, (other, *_)) = fits[method]
    assert np.all(np.abs(one.value - other.value) < 0.01 * one.se)
    np.testing.assert_allclose(one.se, other.se, rtol=1e-3)


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
def test_information_grows_with_the_length_of_what_is_in_the_window(fits, method):
    (_, (whole, *_)), (_, (mixed, *_)), _ = fits[method]
    # Of a raised cosine 3/8 of the energy of its length is left.
    used_s = np.array([LONG_S, SHORT_S]) - 2 * TAPER_S * (1 - 3 / 8)
    expected = np.sqrt(2 * used_s[0] / used_s.sum())
    np.testing.assert_allclose((mixed.bound / whole.bound)[:2], expected, rtol=0.03)
