"""Checks on the excitation: what the motion can tell, and how much follows the perturbation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.analysis.estimation.diagnostics.sound_epoch import (
    RATE_HZ,
    SETTINGS,
    TRUTH,
    N,
    T,
    assert_failed,
    passed,
    perturbed,
    pushed,
    sound,
    with_channel,
)

from rigidimeter.analysis.estimation import Signals
from rigidimeter.analysis.estimation.bandlimited import bandlimited_signals
from rigidimeter.analysis.estimation.diagnostics.excitation_checks import (
    band_share,
    coherence,
    conditioning,
    imposed_sinusoid,
)
from rigidimeter.core.records import Channel
from rigidimeter.core.settings import EstimationSettings
from rigidimeter.model import JointDynamics

__all__ = ["pushed", "sound"]


def narrow(low_hz, high_hz):
    """Return a periodic motion of all lines between two frequencies, its derivatives by the DFT."""
    rng = np.random.default_rng(3)
    f = np.fft.rfftfreq(N, 1 / RATE_HZ)
    x = np.exp(2j * np.pi * rng.uniform(size=f.size)) * ((f >= low_hz) & (f <= high_hz))
    w = 2j * np.pi * f
    x, v, a = (np.fft.irfft(x * w**k, N) for k in range(3))
    return Signals(T, JointDynamics(*TRUTH).torque_nm(x, v, a), a, v, x, RATE_HZ, (0.15, 10.0))


def test_a_narrow_motion_cannot_tell_inertia_from_stiffness():
    finding = conditioning(narrow(1.95, 2.05), SETTINGS)
    assert_failed(finding, first="J", second="K")
    assert 1.8 < finding.facts["low_hz"] < 2.0 < finding.facts["high_hz"] < 2.2
    assert passed(conditioning(narrow(0.2, 8.0), SETTINGS))


def test_a_push_in_one_direction_cannot_tell_damping_from_stiffness():
    signals = narrow(0.2, 8.0)
    away = replace(signals, velocity_rad_s=np.exp(T / 5), angle_rad=5 * np.exp(T / 5) + 1e-3 * T)
    assert_failed(conditioning(away, SETTINGS), first="B", second="K")


def test_a_joint_that_did_not_move_is_told(sound):
    still = replace(sound[1], angle_rad=np.zeros_like(sound[1].angle_rad))
    finding = conditioning(still, SETTINGS)
    assert_failed(finding, "at_rest")
    assert math.isinf(finding.value)


def test_coherence_is_the_share_that_follows(sound, pushed):
    assert coherence(*sound[:2], SETTINGS).value > 0.9
    assert coherence(*pushed[:2], SETTINGS).value < coherence(*sound[:2], SETTINGS).value
    epoch, signals, _ = sound
    other = perturbed(seed=5).channels["perturbation_nm"].values
    finding = coherence(with_channel(epoch, "perturbation_nm", other), signals, SETTINGS)
    assert_failed(finding, percent=100.0 * finding.value)
    assert finding.value < 0.35


def test_drift_below_the_band_is_told(sound):
    epoch, signals, _ = sound
    drifting = epoch.channels["torque_nm"].values + 3.0 * np.sin(2 * np.pi * 0.05 * T)
    drifted = band_share(with_channel(epoch, "torque_nm", drifting), signals, SETTINGS)
    assert_failed(drifted, signal="torque")
    assert passed(band_share(epoch, signals, SETTINGS))


@pytest.mark.parametrize(("high_hz", "told"), [(10.0, False), (0.5, True)])
def test_motion_above_the_band_is_told_and_noise_of_the_encoder_is_none(sound, high_hz, told):
    epoch, signals, _ = sound
    signals = replace(signals, band_hz=(0.15, high_hz))
    angle = epoch.channels["angle_rad"].values
    smooth = {name: epoch.channels[name] for name in ("torque_nm", "angle_rad")}
    alone = replace(epoch, channels=smooth)
    speed = np.std(np.gradient(angle))
    noise = 2 * speed * np.random.default_rng(4).standard_normal(N)
    assert np.std(np.gradient(noise)) > speed
    noisy = with_channel(alone, "angle_rad", angle + noise)
    without, found = (band_share(one, signals, SETTINGS) for one in (alone, noisy))
    assert found.value == pytest.approx(without.value, rel=0.1)
    assert (without.failed, found.failed) == (told, told)


@pytest.mark.parametrize("hum_hz", [40.0, 60.0, 90.0])
def test_hum_of_the_mains_is_no_white_noise(sound, hum_hz):
    epoch, signals, _ = sound
    torque = epoch.channels["torque_nm"].values
    hum = np.std(torque) * np.sin(2 * np.pi * hum_hz * T)
    found = [
        band_share(with_channel(epoch, "torque_nm", torque + size * hum), signals, SETTINGS)
        for size in (1.5, 3.0)
    ]
    assert_failed(found[0], signal="torque")
    # The share falls with v + a²/2: v is 1, the variance, less what of it counts as white noise.
    assert (1 + 4.5) / (1 + 1.125) < found[0].value / found[1].value < 4.0


@pytest.mark.parametrize("duration_s", [8.0, 10.0, 12.0, 15.0, 20.0])
@pytest.mark.parametrize("phase", [0.0, 1.0, 2.0])
def test_the_slowest_line_of_a_perturbation_is_no_drift(sound, duration_s, phase):
    """A PRBS of 127 chips of 50 ms begins at 0.157 Hz, the band at 0.15 Hz."""
    t = np.arange(round(200 * duration_s)) / 200
    x = np.sin(2 * np.pi * t / 6.35 + phase) + 0.3 * np.sin(2 * np.pi * 2.0 * t)
    channels = {name: Channel(name, t, x) for name in ("torque_nm", "angle_rad")}
    epoch = replace(sound[0], channels=channels)
    signals = bandlimited_signals(epoch, EstimationSettings())
    finding = band_share(epoch, signals, SETTINGS)
    assert passed(finding)
    assert finding.value > 70.0


def test_an_imposed_sinusoid_is_no_prbs(sound):
    epoch = sound[0]
    x = 0.3 * np.sin(2 * np.pi * T)
    sine = replace(epoch, channels={"torque_nm": Channel("torque_nm", T, x),
                                    "angle_rad": Channel("angle_rad", T, x)})  # fmt: skip
    assert_failed(imposed_sinusoid(sine, SETTINGS))
    assert passed(imposed_sinusoid(epoch, SETTINGS))
