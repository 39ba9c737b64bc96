import numpy as np
import pytest

from rigidimeter.model import minimum_jerk, tracking_step


def test_the_error_decays_with_the_gain():
    angle, dt = 0.1, 0.001
    for _ in range(1000):
        angle += dt * tracking_step(5.0, 0.0, 0.0, angle)
    assert angle == pytest.approx(0.1 * (1 - 5.0 * dt) ** 1000, rel=1e-9)


def test_minimum_jerk_arrives_at_rest():
    assert minimum_jerk(0.3, 2.0, 0.0) == (0.3, 0.0)
    assert minimum_jerk(0.3, 2.0, 2.0) == (0.0, 0.0)
    angle, velocity = minimum_jerk(0.3, 2.0, 1.0)
    assert angle == pytest.approx(0.15)
    assert velocity == pytest.approx(-1.875 * 0.3 / 2.0)


def test_the_velocity_is_the_derivative_of_the_angle():
    t = np.linspace(0.0, 2.0, 2001)
    angle, velocity = np.array([minimum_jerk(0.3, 2.0, float(time)) for time in t]).T
    np.testing.assert_allclose(np.gradient(angle, t)[1:-1], velocity[1:-1], atol=1e-6)


def test_after_its_time_the_way_back_stays_at_its_end():
    assert minimum_jerk(0.3, 2.0, 3.0) == (0.0, 0.0)
