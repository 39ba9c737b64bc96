"""What the pages on the algebra say of the bias by the loop, by calculation from drawn lines."""

from __future__ import annotations

import numpy as np
import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.model import Loop

J_B_K = np.array([0.0045, 0.1368, 1.751])
DRAWS = 1000


@pytest.mark.parametrize("noise_nm", [3.0, 30.0])
def test_the_loop_pulls_weighted_least_squares_by_twice_the_covariance_times_the_sum_of_h(
    noise_nm: float,
) -> None:
    """However large the torque is: its lines leave the fit, and the others pull alike."""
    settings = parse_settings({})
    loop = Loop(settings.controller, settings.rig).at_frequency(np.arange(3, 300) / 10)
    per_torque = loop.motion_per_torque((0.0045, 0.1368, 1.751)).T
    rng = np.random.default_rng(5)

    def drawn(*shape: int) -> np.ndarray:
        return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)

    lines = len(per_torque)
    power = np.where(np.arange(lines) < 40, noise_nm, 0.3) ** 2
    caused = -per_torque * drawn(lines)[:, None]
    n = np.sqrt(power) * drawn(DRAWS, lines)
    motion = caused + per_torque * n[..., None]
    torque = motion @ J_B_K + n
    weighted = motion.conj().swapaxes(1, 2) / power
    gram = (weighted @ motion).real
    fitted = np.linalg.solve(gram, (weighted @ torque[..., None]).real)[..., 0]

    covariance = np.linalg.inv(gram.mean(axis=0)) / 2
    pull = 2 * covariance @ per_torque.real.sum(axis=0)
    error = fitted.mean(axis=0) - J_B_K
    chance = np.sqrt(np.diag(covariance) / DRAWS)
    assert np.all(np.abs(error - pull) < 4 * chance + 0.1 * np.abs(pull))
    assert np.abs(error[0]) > 10 * chance[0]
