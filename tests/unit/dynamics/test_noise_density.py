"""Densities against variances and against the virtual subject."""

import numpy as np
import pytest
from scipy.signal import welch

from rigidimeter.dynamics import SubjectTorque, sensor_density, subject_density
from rigidimeter.dynamics import subject_torque as subject
from rigidimeter.dynamics.noise_density import TREMOR_PHASE_DIFFUSION_RAD2_S
from rigidimeter.settings import SubjectSettings, TorqueSensorSettings

RATE_HZ = 1000.0


def test_the_sensor_is_white_with_its_rounding() -> None:
    sensor = TorqueSensorSettings(noise_sd_nm=0.003, resolution_nm=0.012, rate_hz=200.0)
    assert sensor_density(sensor) * 200.0 == pytest.approx(0.003**2 + 0.012**2 / 12)


@pytest.mark.parametrize(
    ("settings", "variance"),
    [
        ({"voluntary_sd_nm": 0.2}, 0.04),
        ({"tremor_amplitude_nm": 0.4}, 0.08),
        ({"voluntary_sd_nm": 0.2, "tremor_amplitude_nm": 0.4}, 0.12),
        ({}, 0.0),
    ],
)
def test_a_density_integrates_to_the_variance(settings: dict, variance: float) -> None:
    spacing = 0.005
    frequency = np.arange(0, 500.0, spacing)
    density = subject_density(SubjectSettings(**settings), frequency, RATE_HZ)
    assert 2 * np.sum(density) * spacing == pytest.approx(variance, rel=0.01)


@pytest.mark.parametrize("settings", [{"voluntary_sd_nm": 0.2}, {"tremor_amplitude_nm": 0.4}])
def test_the_density_is_that_of_the_virtual_subject(settings: dict) -> None:
    own = SubjectSettings(**settings)
    torque = SubjectTorque(own, RATE_HZ, np.random.default_rng(4)).block(1_000_000)
    frequency, measured = welch(torque, RATE_HZ, nperseg=20_000)
    found = 2 * subject_density(own, frequency, RATE_HZ)
    for low, high in ((0.3, 1.0), (1.0, 4.0), (4.0, 8.0)):
        band = (frequency >= low) & (frequency < high)
        if np.sum(found[band]) > 0.01 * np.sum(found):
            assert np.sum(measured[band]) == pytest.approx(np.sum(found[band]), rel=0.1)


def test_the_tremor_is_the_virtual_subjects() -> None:
    assert subject.TREMOR_PHASE_DIFFUSION_RAD2_S == TREMOR_PHASE_DIFFUSION_RAD2_S
