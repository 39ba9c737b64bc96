"""The drive against its closed form, and everything that is made of its coefficients."""

import math

import numpy as np
import pytest

from rigidimeter.model import DriveState, drive, drive_coefficients, drive_matrices, drive_step


def stepped(commands, bandwidth_hz=40.0, ratio=0.8, interval_s=1e-3):
    """Return the state at each tick by the steps of the virtual rig."""
    one, state, states = drive(bandwidth_hz, ratio, interval_s), DriveState(), []
    for command in commands:
        states.append(state)
        state = drive_step(one, state, command)
    return np.array(states)


@pytest.mark.parametrize("interval_s", [1e-5, 0.001, 0.02])
def test_the_drive_under_a_step_is_exact_for_any_interval(interval_s):
    omega, zeta = 2 * math.pi * 50.0, 0.7071
    one = drive(50.0, zeta, interval_s)
    state = DriveState()
    n = round(0.02 / interval_s)
    for _ in range(n):
        state = drive_step(one, state, 1.0)
    t, wd = n * interval_s, omega * math.sqrt(1 - zeta**2)
    decay = math.exp(-zeta * omega * t)
    velocity = 1 - decay * (math.cos(wd * t) + zeta * omega / wd * math.sin(wd * t))
    assert state.velocity_rad_s == pytest.approx(velocity, rel=1e-9)
    assert state.acceleration_rad_s2 == pytest.approx(
        decay * omega**2 / wd * math.sin(wd * t), rel=1e-8
    )


def test_the_drive_ends_where_the_commands_add_up_to():
    # The drive has unit gain at rest, so the angle is the integral of the command.
    one = drive(50.0, 0.7071, 0.001)
    state = DriveState()
    for k in range(2000):
        state = drive_step(one, state, 0.3 if k < 1000 else 0.0)
    assert state.angle_rad == pytest.approx(0.3, rel=1e-9)


def test_an_overdamped_drive_is_refused():
    with pytest.raises(ValueError, match="damping ratio"):
        drive(50.0, 1.0, 0.001)


def test_many_intervals_at_once_are_the_steps_of_each() -> None:
    intervals_s = np.array([0.0, 1e-7, 3e-4, 0.001, 0.02])
    together = np.array(drive_coefficients(50.0, 0.7071, intervals_s))
    for column, interval_s in enumerate(intervals_s.tolist()):
        one = drive_coefficients(50.0, 0.7071, interval_s)
        np.testing.assert_allclose(together[:, column], one, rtol=1e-12, atol=1e-18)


def test_the_matrices_are_the_step() -> None:
    state, command = DriveState(0.1, -0.7, 20.0), 0.4
    step, push = drive_matrices(50.0, 0.7071, 1e-3)
    expected = drive_step(drive(50.0, 0.7071, 1e-3), state, command)
    found = step @ np.array(state[::-1]) + push * command
    np.testing.assert_allclose(found, expected[::-1], rtol=1e-12)
