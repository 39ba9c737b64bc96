import numpy as np
import pytest
from scipy import signal

from rigidimeter.model import BiquadState, biquad_step, butterworth_lowpass


def test_the_section_is_scipys_butterworth():
    section = butterworth_lowpass(20.0, 1000.0)
    b, a = signal.butter(2, 20.0, fs=1000.0)
    np.testing.assert_allclose([section.b0, section.b1, section.b2], b, rtol=1e-12)
    np.testing.assert_allclose([section.a1, section.a2], a[1:], rtol=1e-12)


def test_steps_give_what_lfilter_gives():
    values = np.random.default_rng(3).standard_normal(500)
    section, state, out = butterworth_lowpass(20.0, 1000.0), BiquadState(), []
    for value in values.tolist():
        state, y = biquad_step(section, state, value)
        out.append(y)
    expected = signal.lfilter(*signal.butter(2, 20.0, fs=1000.0), values)
    np.testing.assert_allclose(out, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("cutoff_hz", [0.0, 500.0, 700.0, -1.0])
def test_a_cutoff_beyond_nyquist_is_refused(cutoff_hz):
    with pytest.raises(ValueError, match="cutoff must be between"):
        butterworth_lowpass(cutoff_hz, 1000.0)


def test_a_cutoff_within_is_taken_and_the_bound_is_named():
    for cutoff_hz in (0.5, 499.0):
        assert butterworth_lowpass(cutoff_hz, 1000.0).b0 > 0.0
    with pytest.raises(ValueError, match="between 0 and 500 Hz, got 700 Hz"):
        butterworth_lowpass(700.0, 1000.0)
