"""Checks on the subject: torque of their own, when they moved, and what a muscle did."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.analysis.estimation.diagnostics.sound_epoch import (
    SETTINGS,
    TRUTH,
    N,
    T,
    assert_failed,
    judged,
    pushed,
    sound,
)

from rigidimeter.analysis.estimation.diagnostics import movement_checks, reconstructed_torque_nm
from rigidimeter.analysis.estimation.diagnostics.movement_checks import (
    active_seconds,
    emg_envelope_v,
)
from rigidimeter.core.records import Channel

__all__ = ["pushed", "sound"]


active_movement = judged(movement_checks.active_movement)
emg_activity = judged(movement_checks.emg_activity)
voluntary_torque = judged(movement_checks.voluntary_torque)


def test_the_subjects_torque_comes_back_once_the_joint_is_known(pushed):
    epoch, signals, _ = pushed
    own = reconstructed_torque_nm(signals, TRUTH)
    assert np.std(own) == pytest.approx(0.3, rel=0.15)
    finding = voluntary_torque(own, signals, SETTINGS)
    assert_failed(finding, "N·m")
    sd = math.sqrt(finding.value / 100) * np.std(signals.torque_nm)
    assert sd == pytest.approx(0.3, rel=0.15)
    assert epoch.label == "1"


def test_seconds_of_movement_are_found_where_they_are(sound):
    _, signals, parameters = sound
    own = reconstructed_torque_nm(signals, parameters)
    t = signals.time_s
    own = own + 0.8 * np.sin(2 * np.pi * t) * ((t >= 6.0) & (t < 9.0))
    start_s, sd_nm = active_seconds(own, signals, SETTINGS)
    start_s = start_s.round(6)
    assert np.all(sd_nm[(start_s >= 6.0) & (start_s < 9.0)] > 0.4)
    assert np.all(sd_nm[(start_s < 4.5) | (start_s > 10.5)] < 0.1)
    little = active_movement(own, signals, SETTINGS)
    assert 10.0 < little.value < 35.0
    assert "from 6.0 s, 7.0 s, 8.0 s" in little.text
    assert (
        active_movement(reconstructed_torque_nm(signals, parameters), signals, SETTINGS).value == 0
    )


def test_what_is_much_for_an_elbow_is_little_for_an_ankle(sound):
    signals = sound[1]
    own = 0.5 * np.sin(2 * np.pi * signals.time_s)
    assert active_movement(own, signals, SETTINGS).value > 80.0
    ankle = replace(signals, torque_nm=20 * signals.torque_nm)
    assert active_movement(own, ankle, SETTINGS).value == 0.0


def test_a_muscle_that_fires_is_seen_above_its_own_baseline():
    rng = np.random.default_rng(7)
    burst = (T > 5.0) & (T < 11.0)
    emg = Channel("emg_v", T, rng.standard_normal(N) * np.where(burst, 2e-4, 1e-5) + 0.5)
    finding = emg_activity(emg, SETTINGS)
    assert_failed(finding, "baseline")
    assert finding.value == pytest.approx(30.0, abs=3.0)
    quiet = Channel("emg_v", T, 1e-5 * rng.standard_normal(N))
    assert emg_activity(quiet, SETTINGS).value == 0.0
    # The mean of |e| for Gaussian e is √(2/π) σ.
    assert np.mean(emg_envelope_v(quiet, 0.25)) == pytest.approx(
        1e-5 * math.sqrt(2 / math.pi), rel=0.05
    )
