"""Terms that are linear: a soft coupling, and a reflex of both directions."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation import Signals
from rigidimeter.analysis.estimation.terms.beyond_linear import beyond_linear
from rigidimeter.analysis.estimation.terms.linear_misfit import linear_term

RATE_HZ, SECONDS = 200.0, 20.0
J, B, K = 0.01, 0.2, 3.0


def moved(path, seed=1, push_nm=0.0):
    """A motion of noise to 30 Hz, and the torque that a path in s = jω gives to it.

    A push between 0.3 and 4 Hz is in the torque, and comes back as motion 50 ms later.
    """
    rng = np.random.default_rng(seed)
    n = round(RATE_HZ * SECONDS)
    frequency_hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    s = 2j * np.pi * frequency_hz
    phases = np.exp(2j * np.pi * rng.uniform(size=(2, s.size)))
    push = push_nm * phases[1] * ((frequency_hz > 0.3) & (frequency_hz < 4.0)) * 60
    velocity = 20 * phases[0] * ((frequency_hz > 0.2) & (frequency_hz < 30.0))
    velocity = velocity + np.exp(-0.05 * s) * push
    angle = np.divide(velocity, s, out=np.zeros_like(s), where=s != 0)
    torque, a, v, x = (
        np.fft.irfft(one, n) for one in (path(s) * angle - push, s * velocity, velocity, angle)
    )
    torque = torque + 0.002 * rng.standard_normal(n)
    motion = Signals(np.arange(n) / RATE_HZ, torque, a, v, x, RATE_HZ, (0.0, RATE_HZ / 2))
    return beyond_linear(motion, (0.3, 30.0))


def joint(s):
    return J * s**2 + B * s + K


@pytest.mark.parametrize("push_nm", [0.0, 0.5, 2.0])
def test_j_b_and_k_alone_leave_nothing(push_nm):
    assert [seed for seed in range(30) if linear_term(moved(joint, seed, push_nm))] == []


@pytest.mark.parametrize(
    "path",
    [
        lambda s: joint(s) * np.exp(-0.004 * s),
        lambda s: joint(s) / (1 + s / (2 * np.pi * 50)),
        lambda s: joint(s) + 0.05 * np.sqrt(np.abs(s)),
    ],
)
def test_what_looks_like_neither_is_not_named(path):
    assert linear_term(moved(path)) is None
