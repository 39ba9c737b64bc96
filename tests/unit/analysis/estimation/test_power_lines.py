import numpy as np
import pytest

from rigidimeter.analysis.estimation.power_lines import lines_inside, power_lines


@pytest.mark.parametrize(("n", "used"), [(1000, 1000), (1001, 1000), (1009, 1008)])
def test_the_lines_sum_to_the_variance(n, used):
    """Of a length that is quickly transformed; 1001 is 7 times 11 times 13, 1009 is prime."""
    values = np.random.default_rng(0).standard_normal(n) + 3.0
    frequency, power = power_lines(values, 100.0)
    assert np.sum(power) == pytest.approx(np.var(values[:used]), rel=1e-12)
    assert frequency[1] == pytest.approx(100.0 / used)


def test_a_sinusoid_has_half_its_amplitude_squared_on_its_line():
    t = np.arange(2000) / 100.0
    for tapered in (False, True):
        frequency, power = power_lines(0.3 * np.sin(2 * np.pi * 2.0 * t), 100.0, tapered=tapered)
        near = lines_inside(frequency, (1.85, 2.15))
        assert np.sum(power[near]) == pytest.approx(0.045, rel=2e-3)
        assert np.sum(power) == pytest.approx(0.045, rel=2e-3)
