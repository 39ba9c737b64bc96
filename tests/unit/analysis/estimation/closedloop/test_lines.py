import numpy as np
import pytest

from rigidimeter.analysis.estimation.closedloop.epoch_motion import EpochMotion
from rigidimeter.analysis.estimation.closedloop.line_noise import Smoother, line_covariance
from rigidimeter.analysis.estimation.closedloop.spectral_lines import epoch_grid, epoch_lines
from rigidimeter.core.records import Channel, Epoch

RATE_HZ = 200.0
TRUTH = np.array([0.0045, 0.1368, 1.751])


def moving(names=("angle_rad", "velocity_rad_s"), offset=0.0, n=4001):
    """An epoch of smooth motion with the torque of Eq. 3, all in closed form."""
    t = np.arange(n) / RATE_HZ
    rng = np.random.default_rng(0)
    angle, velocity, acceleration = np.zeros((3, n))
    for f in rng.uniform(0.2, 8.0, 40):
        w, phase, size = 2 * np.pi * f, rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1) / (1 + f)
        angle += size * np.sin(w * t + phase)
        velocity += size * w * np.cos(w * t + phase)
        acceleration -= size * w * w * np.sin(w * t + phase)
    torque = TRUTH @ np.array([acceleration, velocity, angle]) + offset
    values = {"torque_nm": torque, "angle_rad": angle + 0.3, "velocity_rad_s": velocity}
    return Epoch("file", "1", {k: Channel(k, t, values[k]) for k in ("torque_nm", *names)})


def solved(epoch, band=(0.15, 20.0)):
    lines = epoch_lines(epoch, epoch_grid(epoch, band, 1.0), EpochMotion(epoch, None))
    rows = np.vstack([lines.motion.real, lines.motion.imag])
    return np.linalg.lstsq(rows, np.hstack([lines.torque_nm.real, lines.torque_nm.imag]))[0]


@pytest.mark.parametrize(
    ("names", "tolerance"),
    [(("angle_rad", "velocity_rad_s"), 1e-4), (("angle_rad",), 3e-4), (("velocity_rad_s",), 3e-4)],
)
def test_the_lines_obey_the_equation_of_motion(names, tolerance):
    # Nothing is left out but what a sum is short of an integral.
    np.testing.assert_allclose(solved(moving(names)), TRUTH, rtol=tolerance)


def test_offsets_of_the_sensors_do_not_matter():
    np.testing.assert_allclose(solved(moving(offset=5.0)), solved(moving()), rtol=1e-3)


def test_the_window_begins_and_ends_at_zero_and_its_slope_is_its_slope():
    grid = epoch_grid(moving(), (0.15, 20.0), 1.0)
    assert max(grid.window[0], grid.window[-1]) < 1e-4
    numeric = np.gradient(grid.window, 1 / RATE_HZ)
    np.testing.assert_allclose(grid.window_slope_per_s[1:-1], numeric[1:-1], atol=2e-2)


def test_an_epoch_with_too_few_lines_says_so():
    with pytest.raises(ValueError, match="at least 8 are needed"):
        epoch_grid(moving(), (1.0, 1.2), 1.0)


def test_the_adjoint_is_the_transpose():
    rng = np.random.default_rng(1)
    smoother = Smoother.over(np.arange(2, 200), 3, 0.1)
    power, weight = rng.exponential(size=198), rng.uniform(size=198)
    weights = smoother.adjoint(weight[:, None])[:, 0]
    assert weight @ smoother(power) == pytest.approx(weights @ power, rel=1e-12)


def test_the_covariance_of_white_lines_is_the_textbooks():
    rng = np.random.default_rng(2)
    m, density = 4000, 3.0
    design = rng.standard_normal((m, 2)) + 1j * rng.standard_normal((m, 2))
    noise = np.sqrt(density / 2) * (rng.standard_normal(m) + 1j * rng.standard_normal(m))
    inverse = np.linalg.inv((design.conj().T @ design).real)
    covariance, degrees = line_covariance(
        inverse, design, noise, Smoother.over(np.arange(1, m + 1), 4, 0.1), np.ones(m)
    )
    np.testing.assert_allclose(np.diag(covariance), density / 2 * np.diag(inverse), rtol=0.05)
    assert np.all(degrees > m)
