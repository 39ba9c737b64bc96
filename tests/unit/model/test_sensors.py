import itertools

import numpy as np
import pytest

from rigidimeter.core.settings import TorqueSensorSettings
from rigidimeter.model import quantised, sample_times_s, sensor_density


def test_a_reading_is_rounded_to_its_resolution():
    assert quantised(0.12345, 0.001) == pytest.approx(0.123)
    assert quantised(-0.1236, 0.001) == pytest.approx(-0.124)
    assert quantised(0.12345, 0.0) == 0.12345


def test_samples_keep_their_rate_and_their_jitter():
    times = sample_times_s(50.0, 0.002, 0.005, np.random.default_rng(1))
    taken = np.array(list(itertools.islice(times, 9000)))
    late = taken - (np.arange(9000) / 50.0 - 0.002)
    assert late.min() >= -1e-12
    assert late.max() <= 0.005 + 1e-12
    assert late.max() > 0.0049


@pytest.mark.parametrize("jitter_s", [0.0, 0.005])
def test_the_first_sample_arrives_at_time_zero(jitter_s):
    times = sample_times_s(100.0, 0.002, jitter_s, np.random.default_rng(1))
    assert next(times) == -0.002
    assert 0.008 <= next(times) <= 0.008 + jitter_s + 1e-12


def test_the_sensor_is_white_with_its_rounding() -> None:
    sensor = TorqueSensorSettings(noise_sd_nm=0.003, resolution_nm=0.012, rate_hz=200.0)
    assert sensor_density(sensor) * 200.0 == pytest.approx(0.003**2 + 0.012**2 / 12)
