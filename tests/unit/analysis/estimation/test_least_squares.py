from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.analysis.estimation import Signals, fit_inertia_damping_stiffness

TRUTH = np.array([0.0045, 0.1368, 1.751])


def signals(noise_nm=0.0, seed=0, n=2000, band=(0.0, 50.0), rate_hz=100.0):
    rng = np.random.default_rng(seed)
    a, v, x = rng.standard_normal((3, n)) * np.array([[10.0], [0.5], [0.08]])
    torque = TRUTH @ np.array([a, v, x]) + noise_nm * rng.standard_normal(n)
    return Signals(np.arange(n) / rate_hz, torque, a, v, x, rate_hz, band)


def test_without_noise_the_parameters_come_back():
    solution = fit_inertia_damping_stiffness(signals())
    np.testing.assert_allclose(solution.value, TRUTH, rtol=1e-12)
    assert solution.r_squared == pytest.approx(1.0, abs=1e-12)
    assert solution.vaf_percent == pytest.approx(100.0, abs=1e-10)


def test_with_the_inertia_held_the_others_come_back():
    solution = fit_inertia_damping_stiffness(signals(), inertia_kg_m2=TRUTH[0])
    np.testing.assert_allclose(solution.value, TRUTH, rtol=1e-12)
    assert solution.se[0] == 0.0


def test_standard_errors_are_the_scatter_over_noise():
    solutions = [fit_inertia_damping_stiffness(signals(0.02, seed)) for seed in range(300)]
    scatter = np.std([s.value for s in solutions], axis=0, ddof=1)
    claimed = np.mean([s.se for s in solutions], axis=0)
    np.testing.assert_allclose(claimed, scatter, rtol=0.15)
    covariance = np.mean([s.covariance for s in solutions], axis=0)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), scatter, rtol=0.15)


def test_textbook_errors_take_the_residual_for_white():
    found = fit_inertia_damping_stiffness(noisy := signals(0.02))
    residual = noisy.torque_nm - noisy.motion @ found.value
    variance = residual @ residual / (residual.size - 3)
    expected = variance * np.linalg.inv(noisy.motion.T @ noisy.motion)
    np.testing.assert_allclose(found.covariance, expected, rtol=1e-9)


def test_it_survives_units_that_square_to_nothing():
    # In AᵀA the smallest entry would be 1e-24 of the largest.
    s = signals()
    scaled = replace(
        s, acceleration_rad_s2=s.acceleration_rad_s2 * 1e6, angle_rad=s.angle_rad * 1e-6
    )
    solution = fit_inertia_damping_stiffness(scaled)
    np.testing.assert_allclose(solution.value, TRUTH * [1e-6, 1.0, 1e6], rtol=1e-9)
    assert solution.condition_number < 2.0


def test_a_pure_sinusoid_cannot_tell_inertia_from_stiffness():
    t = np.arange(2000) / 100.0
    w = 2 * np.pi
    s = Signals(t, np.cos(w * t), -(w**2) * np.sin(w * t), w * np.cos(w * t), np.sin(w * t),
                100.0, (0.0, 50.0))  # fmt: skip
    with pytest.raises(ValueError, match="linearly dependent"):
        fit_inertia_damping_stiffness(s)


def test_a_regressor_of_zeros_is_refused():
    s = replace(signals(), acceleration_rad_s2=np.zeros(2000))
    with pytest.raises(ValueError, match="zero throughout"):
        fit_inertia_damping_stiffness(s)
