"""The bias of least squares in the loop, against a loop whose bias is known in closed form."""

import numpy as np
import pytest

from rigidimeter.analysis.estimation.least_squares_bias import compensated
from rigidimeter.analysis.estimation.signals import Signals
from rigidimeter.core.settings import ControllerSettings, RigSettings
from rigidimeter.model import Loop

TRUTH = (0.0045, 0.1368, 1.751)
LOOP = Loop(ControllerSettings(), RigSettings())
N, RATE_HZ = 20_000, 1000.0


def signals(own_nm, seed=0):
    """Return the loop's periodic answer to a perturbation and, on other lines, to the subject."""
    rng = np.random.default_rng(seed)
    frequency = np.fft.rfftfreq(N, 1 / RATE_HZ)
    inside = np.flatnonzero((frequency > 0.15) & (frequency < 10.0))
    phase = np.exp(2j * np.pi * rng.uniform(size=inside.size))
    perturbation = np.where(np.arange(inside.size) % 4 < 2, phase, 0)
    own = own_nm * np.where(np.arange(inside.size) % 4 < 2, 0, phase)
    opened = LOOP.at_frequency(frequency[inside])
    motion = opened.command(TRUTH) * perturbation * opened.motion
    motion = motion + opened.motion_per_torque(TRUTH) * own
    torque = np.array(TRUTH) @ motion + own
    spectra = np.zeros((4, frequency.size), dtype=np.complex128)
    spectra[:, inside] = np.vstack([motion, torque]) * N / 20
    a, v, x, m = np.fft.irfft(spectra, N, axis=1)
    return Signals(np.arange(N) / RATE_HZ, m, a, v, x, RATE_HZ, (0.15, 10.0))


def least_squares(made):
    motion = np.column_stack([made.acceleration_rad_s2, made.velocity_rad_s, made.angle_rad])
    return np.linalg.lstsq(motion, made.torque_nm)[0]


@pytest.mark.parametrize("own_nm", [0.0, 0.1, 0.3])
def test_what_least_squares_finds_less_the_bias_is_the_joint(own_nm):
    made = signals(own_nm)
    biased = np.abs(least_squares(made) / TRUTH - 1)
    assert np.max(biased) > 0.1 or own_nm < 0.3
    assert compensated(made, LOOP) == pytest.approx(TRUTH, rel=0.01 + 0.1 * np.max(biased))


def test_where_the_loop_is_another_the_bias_is_another():
    made = signals(0.3)
    other = Loop(ControllerSettings(inertia_kg_m2=0.2, damping_nm_s_rad=8.0), RigSettings())
    right, wrong = (compensated(made, loop) for loop in (LOOP, other))
    assert np.max(np.abs(wrong / TRUTH - 1)) > 3 * np.max(np.abs(right / TRUTH - 1))


def test_a_joint_that_did_not_move_has_no_bias():
    still = Signals(*np.zeros((5, 100)), 100.0, (0.15, 10.0))
    assert compensated(still, LOOP) is None
