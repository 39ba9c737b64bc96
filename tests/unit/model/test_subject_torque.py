import numpy as np
import pytest
from scipy import signal

from rigidimeter.core.settings import SubjectSettings
from rigidimeter.model import SubjectTorque, draw_joint, subject_density

RATE_HZ = 1000.0


def test_voluntary_torque_has_the_wanted_size_and_band():
    subject = SubjectSettings(voluntary_sd_nm=0.2)
    source = SubjectTorque(subject, 1000.0, np.random.default_rng(5))
    torque = np.concatenate([source.block(5000) for _ in range(400)])
    assert torque.std() == pytest.approx(0.2, rel=0.03)
    frequency, power = signal.welch(torque, 1000.0, nperseg=2**15)
    middle = np.interp([0.8, 1.0, 1.2], frequency, power).mean()
    # Half the power at the edges of the band, little an octave beyond.
    assert np.interp(0.3, frequency, power) / middle == pytest.approx(0.5, abs=0.15)
    assert np.interp(4.0, frequency, power) / middle == pytest.approx(0.5, abs=0.15)
    assert np.interp(8.0, frequency, power) / middle < 0.12


def test_blocks_join_without_a_seam():
    subject = SubjectSettings(voluntary_sd_nm=0.2, tremor_amplitude_nm=0.0)
    whole = SubjectTorque(subject, 1000.0, np.random.default_rng(5)).block(2000)
    source = SubjectTorque(subject, 1000.0, np.random.default_rng(5))
    np.testing.assert_array_equal(np.concatenate([source.block(700), source.block(1300)]), whole)


def test_tremor_has_its_amplitude_and_frequency():
    subject = SubjectSettings(tremor_amplitude_nm=0.3, tremor_frequency_hz=5.0)
    torque = SubjectTorque(subject, 1000.0, np.random.default_rng(5)).block(60_000)
    assert np.abs(torque).max() == pytest.approx(0.3, rel=1e-3)
    frequency, power = signal.welch(torque, 1000.0, nperseg=8192)
    assert frequency[power.argmax()] == pytest.approx(5.0, abs=0.2)


def test_a_subject_that_does_nothing_gives_zero():
    source = SubjectTorque(SubjectSettings(), 1000.0, np.random.default_rng(5))
    assert not source.block(1000).any()


def test_joints_scatter_about_the_median():
    subject = SubjectSettings(stiffness_cv_percent=20.0)
    rng = np.random.default_rng(2)
    drawn = np.array([draw_joint(subject, rng).stiffness_nm_rad for _ in range(4000)])
    assert np.median(drawn) == pytest.approx(1.751, rel=0.02)
    assert drawn.std() / drawn.mean() == pytest.approx(0.2, rel=0.05)
    assert draw_joint(subject, rng).inertia_kg_m2 == 0.0045


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
    frequency, measured = signal.welch(torque, RATE_HZ, nperseg=20_000)
    found = 2 * subject_density(own, frequency, RATE_HZ)
    for low, high in ((0.3, 1.0), (1.0, 4.0), (4.0, 8.0)):
        band = (frequency >= low) & (frequency < high)
        if np.sum(found[band]) > 0.01 * np.sum(found):
            assert np.sum(measured[band]) == pytest.approx(np.sum(found[band]), rel=0.1)
