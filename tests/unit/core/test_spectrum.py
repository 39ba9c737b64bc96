"""The power spectral density of a signal."""

import numpy as np
import pytest

from rigidimeter.core.spectrum import density


def test_a_density_holds_the_variance_and_a_line_peaks_where_it_is() -> None:
    time_s = np.arange(5000) / 250
    frequency_hz, power = density(0.3 * np.sin(2 * np.pi * 5 * time_s), 250.0)
    assert frequency_hz[np.argmax(power)] == pytest.approx(5.0)
    assert np.sum(power) * frequency_hz[1] == pytest.approx(0.3**2 / 2, rel=0.01)
