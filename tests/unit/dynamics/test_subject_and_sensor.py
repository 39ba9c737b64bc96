import itertools

import numpy as np
import pytest
from scipy import signal

from rigidimeter.dynamics import SubjectTorque, draw_joint, quantised, sample_times_s
from rigidimeter.settings import SubjectSettings


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
