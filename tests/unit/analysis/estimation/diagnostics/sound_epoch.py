"""An epoch that is sound and one of a subject who pushes, with their signals and fits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from rigidimeter.analysis.estimation import epoch_signals, fit_inertia_damping_stiffness
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import DiagnosticsSettings, EstimationSettings
from rigidimeter.model import JointDynamics

SETTINGS = DiagnosticsSettings()
TRUTH = np.array([0.0045, 0.1368, 1.751])
RATE_HZ, N = 200.0, 4000
T = np.arange(N) / RATE_HZ


def perturbed(seed=0, noise_nm=0.005, voluntary_nm=0.0):
    """Return the joint of the paper in its loop, driven by random binary torque, as an epoch."""
    rng = np.random.default_rng(seed)
    chips = np.repeat(rng.choice([-1.0, 1.0], N // 10), 10)
    own = np.zeros(N)
    if voluntary_nm:
        band = signal.butter(2, [0.3, 4.0], "bandpass", fs=RATE_HZ, output="sos")
        own = signal.sosfilt(band, rng.standard_normal(N + 2000))[2000:]
        own *= voluntary_nm / np.std(own)
    J, B, K = 0.0458 + TRUTH[0], 1.604 + TRUTH[1], TRUTH[2]
    drive = chips + own
    loop = signal.cont2discrete(
        (
            np.array([[0.0, 1.0], [-K / J, -B / J]]),
            np.array([[0.0], [1.0 / J]]),
            np.eye(2),
            np.zeros((2, 1)),
        ),
        1 / RATE_HZ,
    )
    state, motion = np.zeros(2), np.empty((N, 2))
    for k in range(N):
        motion[k] = state
        state = loop[0] @ state + loop[1][:, 0] * drive[k]
    x, v = motion.T
    # Between the edges of the chips the acceleration jumps; its mean over them is the fair one.
    acceleration = (drive - B * v - K * x) / J
    torque = JointDynamics(*TRUTH).torque_nm(x, v, acceleration) - own
    channels = {
        "torque_nm": torque + noise_nm * rng.standard_normal(N),
        "angle_rad": x,
        "velocity_rad_s": v + 1e-4 * rng.standard_normal(N),
        "perturbation_nm": chips,
    }
    channels["angle_rad"] = x + 1e-6 * rng.standard_normal(N)
    return Epoch("file", "1", {name: Channel(name, T, values) for name, values in channels.items()})


def fitted(epoch):
    signals = epoch_signals(epoch, "bandlimited", EstimationSettings())
    return signals, fit_inertia_damping_stiffness(signals).value


@pytest.fixture(scope="module")
def sound():
    epoch = perturbed()
    return epoch, *fitted(epoch)


@pytest.fixture(scope="module")
def pushed():
    epoch = perturbed(voluntary_nm=0.3)
    return epoch, *fitted(epoch)


def with_channel(epoch, name, values):
    return replace(epoch, channels={**epoch.channels, name: Channel(name, T, values)})


def passed(look):
    return not look.failed


def assert_failed(look, variant="", **facts):
    """Assert that a check failed, with these words and at least these facts."""
    assert look.failed
    assert look.variant == variant
    assert {name: look.facts[name] for name in facts} == facts
