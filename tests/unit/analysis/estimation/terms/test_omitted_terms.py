"""Terms that are found, and how often one is found that is not there."""

from dataclasses import replace

import numpy as np

from rigidimeter.analysis.estimation import Signals
from rigidimeter.analysis.estimation.terms.beyond_linear import beyond_linear
from rigidimeter.analysis.estimation.terms.omitted_terms import omitted_terms

RATE_HZ = 200.0
BAND_HZ = (0.3, 20.0)


def noise(rng, n, low_hz, high_hz):
    frequency_hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz)
    lines = np.where(inside, 1.0, 0.0) * np.exp(2j * np.pi * rng.uniform(size=inside.size))
    values = np.fft.irfft(lines * rng.rayleigh(size=inside.size), n)
    return values / values.std()


def moved(seed, more=lambda x, v: 0.0 * v):
    """J, B and K moved by noise and by a push of their own, which comes back 50 ms late."""
    rng = np.random.default_rng(seed)
    n = round(20 * RATE_HZ)
    push = 0.3 * noise(rng, n, 0.3, 4.0)
    omega = 2j * np.pi * np.fft.rfftfreq(n, 1 / RATE_HZ)
    velocity = np.fft.rfft(0.2 * noise(rng, n, 0.3, 8.0) + 0.4 * np.roll(push, 10))
    a, v = np.fft.irfft(velocity * omega, n), np.fft.irfft(velocity, n)
    x = np.fft.irfft(np.divide(velocity, omega, out=0 * velocity, where=omega != 0), n)
    torque = 0.01 * a + 0.2 * v + 3 * x - push + more(x, v) + 0.005 * rng.standard_normal(n)
    motion = Signals(np.arange(n) / RATE_HZ, torque, a, v, x, RATE_HZ, (0.0, RATE_HZ / 2))
    return beyond_linear(motion, BAND_HZ)


TORQUES = {
    "coulomb": lambda x, v: 0.05 * np.sign(v),
    "cubic": lambda x, v: 400.0 * x**3,
    "quadratic": lambda x, v: -30.0 * x**2,
    "damping+": lambda x, v: 0.1 * np.maximum(v, 0),
    "reflex+": lambda x, v: 0.1 * np.maximum(np.roll(v, 10), 0),
    "reflex-": lambda x, v: 0.1 * np.minimum(np.roll(v, 10), 0),
}


def test_nothing_is_found_where_nothing_is_though_the_push_comes_back():
    assert [seed for seed in range(60) if omitted_terms(moved(seed))] == []


def test_a_friction_that_pushes_is_not_named():
    names = [term.name for term in omitted_terms(moved(3, lambda x, v: -0.05 * np.sign(v)))]
    assert "coulomb" not in names


def test_a_direction_is_that_of_the_motion_and_not_of_the_name():
    """Turned about, what resisted motion to one side resists motion to the other."""
    beyond = moved(5, TORQUES["reflex+"])
    motion = beyond.motion
    turned = replace(
        motion,
        torque_nm=-motion.torque_nm,
        acceleration_rad_s2=-motion.acceleration_rad_s2,
        velocity_rad_s=-motion.velocity_rad_s,
        angle_rad=-motion.angle_rad,
    )
    (found,) = omitted_terms(beyond_linear(turned, BAND_HZ))
    assert found.name == "reflex-"
