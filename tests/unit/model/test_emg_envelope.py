"""The envelope of EMG as it comes, and the band that it is of."""

import numpy as np
import pytest

from rigidimeter.model import LiveEnvelope

RATE_HZ = 2000.0
TIME_S = np.arange(0.0, 4.0, 1.0 / RATE_HZ)


def envelope(emg, cuts=()):
    """Return the envelope of blocks that are cut there."""
    live = LiveEnvelope(RATE_HZ, emg.shape[1])
    parts = zip(np.split(TIME_S, cuts), np.split(emg, cuts), strict=True)
    return np.vstack([live.block(time_s, one) for time_s, one in parts])


@pytest.mark.parametrize(
    ("frequency_hz", "passes"), [(2.0, 0.0), (50.0, 1.0), (200.0, 1.0), (950.0, 0.0)]
)
def test_it_is_the_mean_of_the_rectified_band(frequency_hz, passes):
    emg = 100.0 * np.sin(2 * np.pi * frequency_hz * TIME_S)[:, None]
    found = envelope(emg)
    settled = found[found[:, 0] > 2.0, 1]
    assert np.mean(settled) == pytest.approx(passes * 100.0 * 2 / np.pi, rel=0.05, abs=2.0)


def test_blocks_may_be_cut_anywhere_and_muscles_do_not_mix():
    emg = np.random.default_rng(1).standard_normal((TIME_S.size, 2))
    once = envelope(emg)
    np.testing.assert_allclose(envelope(emg, (1, 40, 41, 41, 333, 5000)), once, atol=1e-12)
    np.testing.assert_allclose(envelope(emg[:, 1:])[:, 1], once[:, 2], atol=1e-12)
    np.testing.assert_allclose(np.diff(once[:, 0]), 0.02, atol=1e-9)


def test_it_rises_and_falls_within_two_tenths_of_a_second():
    on = (TIME_S >= 1.0) & (TIME_S < 2.0)
    emg = np.where(on, 50.0 * np.sin(2 * np.pi * 100.0 * TIME_S), 0.0)
    emg[-1] = np.nan  # no number spoils nothing after it
    time_s, found = envelope(emg[:, None]).T
    full = 50.0 * 2 / np.pi
    assert np.all(found[(time_s > 1.2) & (time_s < 2.0)] > 0.8 * full)
    assert np.all(found[(time_s < 1.0) | (time_s > 2.2)] < 0.2 * full)
