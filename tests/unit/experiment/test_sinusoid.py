"""The position perturbation against its closed form."""

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from rigidimeter.experiment import sinusoid
from rigidimeter.settings import SinusoidSettings

AMPLITUDE_RAD = math.radians(20.0)
RATE_HZ = 1000.0


def test_the_middle_eight_cycles_are_a_pure_sinusoid() -> None:
    angle, velocity = sinusoid(SinusoidSettings(), RATE_HZ)
    time_s = np.arange(angle.size) / RATE_HZ
    middle = (time_s >= 1.0) & (time_s <= 9.0)
    omega = 2 * np.pi
    np.testing.assert_allclose(
        angle[middle], AMPLITUDE_RAD * np.sin(omega * time_s[middle]), atol=1e-15
    )
    np.testing.assert_allclose(
        velocity[middle], AMPLITUDE_RAD * omega * np.cos(omega * time_s[middle]), atol=1e-13
    )
    assert np.max(np.abs(velocity)) == pytest.approx(omega * AMPLITUDE_RAD)
    assert np.max(np.abs(angle)) == pytest.approx(AMPLITUDE_RAD)


def test_it_starts_and_ends_at_rest_and_then_holds() -> None:
    angle, velocity = sinusoid(SinusoidSettings(), RATE_HZ)
    assert angle.shape == velocity.shape == (20_000,)
    assert angle[0] == velocity[0] == 0.0
    np.testing.assert_array_equal(angle[10_000:], 0.0)
    np.testing.assert_array_equal(velocity[10_000:], 0.0)
    # the last moving tick is 1 ms from rest: no step in either
    assert abs(angle[9_999]) < 1e-6
    assert abs(velocity[9_999]) < 1e-4


@pytest.mark.parametrize(
    ("frequency_hz", "taper_s"), [(1.0, 1.0), (1.0, 0.3), (0.37, 2.5), (2.6, 5.0), (3.0, 0.0)]
)
def test_the_velocity_integrates_to_the_angle(frequency_hz: float, taper_s: float) -> None:
    settings = SinusoidSettings(frequency_hz=frequency_hz, taper_s=taper_s)
    angle, velocity = sinusoid(settings, 5000.0)
    moving = slice(0, 50_000)
    integral = cumulative_simpson(velocity[moving], dx=1 / 5000.0, initial=0.0)
    np.testing.assert_allclose(integral, angle[moving], atol=2e-8)


def test_the_rising_taper_is_half_way_at_half_its_length() -> None:
    settings = SinusoidSettings(frequency_hz=0.5, taper_s=1.0)  # the sine is 1 at 0.5 s
    angle, velocity = sinusoid(settings, 100.0)
    assert angle[50] == pytest.approx(AMPLITUDE_RAD / 2)
    assert velocity[50] == pytest.approx(AMPLITUDE_RAD * np.pi / 2)  # all of it from the taper


def test_a_motion_that_fills_the_epoch() -> None:
    angle, _ = sinusoid(SinusoidSettings(motion_s=20.0, duration_s=20.0), 100.0)
    assert angle.shape == (2000,)
    assert abs(angle[-1]) < 1e-4


def test_a_rate_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="rate_hz"):
        sinusoid(SinusoidSettings(), 0.0)
