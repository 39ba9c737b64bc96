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


@pytest.mark.parametrize("push_nm", [0.0, 0.5])
def test_a_coupling_is_named_with_its_stiffness(push_nm):
    found = linear_term(moved(lambda s: joint(s) / (1 + joint(s) / 50.0), push_nm=push_nm))
    assert found is not None
    assert found.name == "coupling"
    assert found.value == pytest.approx(50.0, rel=0.03)
    np.testing.assert_allclose(found.joint, [J, B, K], rtol=0.05)


@pytest.mark.parametrize("push_nm", [0.0, 0.5])
def test_a_reflex_of_both_directions_is_named_with_its_gain_and_delay(push_nm):
    found = linear_term(moved(lambda s: joint(s) + 0.1 * s * np.exp(-0.06 * s), push_nm=push_nm))
    assert found is not None
    assert found.name == "reflex"
    assert found.value == pytest.approx(0.1, rel=0.03)
    assert found.delay_s == pytest.approx(0.06)
    np.testing.assert_allclose(found.joint, [J, B, K], rtol=0.05)


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


def test_its_torque_is_what_the_joint_alone_does_not_give():
    beyond = moved(lambda s: joint(s) / (1 + joint(s) / 50.0))
    found = linear_term(beyond)
    assert found is not None
    omega = 2 * np.pi * beyond.frequency_hz
    torque = beyond.linear @ np.array([J, B, K]) + found.torque(beyond.linear, omega)
    # The taper spreads each line to its neighbours, where the path is another.
    assert np.linalg.norm(torque - beyond.torque_lines) < 0.05 * np.linalg.norm(torque)
