"""Channels with their own clocks, brought onto one uniform grid.

Rates, phases and jitter differ between channels; the stamps say when each sample was taken. A cubic
spline through a channel's own stamps gives its value at any time between, and its derivative and
integral without a separate difference scheme.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rigidimeter.records import Channel, Epoch

Array = NDArray[np.float64]

GRID_POINTS_PER_CYCLE = 20
"""How densely the highest frequency of interest is sampled on the common grid.

At 20 points a cycle the derivative of a cubic spline is within 0.006 % of the true one.
"""


@dataclass(frozen=True)
class Signals:
    """Torque and motion on one uniform grid, treated alike, ready for a fit.

    Attributes
    ----------
    time_s, torque_nm, acceleration_rad_s2, velocity_rad_s, angle_rad : arrays, shape (n,)
    rate_hz : float
        Of the grid.
    band_hz : (float, float)
        The band to which the signals are confined; (0, Nyquist) when they are not.
    """

    time_s: Array
    torque_nm: Array
    acceleration_rad_s2: Array
    velocity_rad_s: Array
    angle_rad: Array
    rate_hz: float
    band_hz: tuple[float, float]


def grid_rate_hz(channels: list[Channel], highest_hz: float) -> float:
    """Return the rate of the common grid: the fastest channel's, or more where that is coarse."""
    fastest = max(channel.rate_hz for channel in channels)
    needed = GRID_POINTS_PER_CYCLE * highest_hz
    # Rates come from differences of stamps; their rounding must not double a grid.
    return fastest * max(1, math.ceil(needed / fastest - 1e-6))


def uniform_grid(channels: list[Channel], rate_hz: float) -> Array:
    """Return the uniform times at which every channel has samples on both sides.

    The array is empty when the channels do not overlap.
    """
    start = max(float(channel.time_s[0]) for channel in channels)
    stop = min(float(channel.time_s[-1]) for channel in channels)
    count = int(np.floor((stop - start) * rate_hz + 1e-6)) + 1 if stop >= start else 0
    return np.minimum(start + np.arange(count) / rate_hz, stop)


def spline(channel: Channel) -> CubicSpline:
    """Return the cubic spline through a channel's samples at its own stamps."""
    return CubicSpline(channel.time_s, channel.values)


def kinematics(epoch: Epoch, time_s: Array) -> tuple[Array, Array, Array]:
    """Return angle, velocity and acceleration at the given times.

    Measured channels are used where they are recorded. A missing velocity is the derivative of the
    angle; a missing angle is the integral of the velocity, zero at the first time. The acceleration
    is the derivative of the velocity.

    Parameters
    ----------
    epoch : Epoch
        With `velocity_rad_s`, `angle_rad`, or both.
    time_s : array, shape (n,)
        Within the stamps of the channels used.

    Returns
    -------
    angle_rad, velocity_rad_s, acceleration_rad_s2 : arrays, shape (n,)
    """
    angle = epoch.channels.get("angle_rad")
    velocity = epoch.channels.get("velocity_rad_s")
    if velocity is not None:
        of_velocity = spline(velocity)
        velocity_rad_s = of_velocity(time_s)
        acceleration_rad_s2 = of_velocity.derivative()(time_s)
        if angle is not None:
            return spline(angle)(time_s), velocity_rad_s, acceleration_rad_s2
        integral = of_velocity.antiderivative()(time_s)
        return integral - integral[:1], velocity_rad_s, acceleration_rad_s2
    if angle is None:
        raise ValueError(f"{epoch.name} holds neither velocity_rad_s nor angle_rad")
    of_angle = spline(angle)
    # A second spline through the velocity, since the second derivative of the first is only
    # piecewise linear and loses the upper part of the band.
    velocity_rad_s = of_angle.derivative()(time_s)
    acceleration_rad_s2 = CubicSpline(time_s, velocity_rad_s).derivative()(time_s)
    return of_angle(time_s), velocity_rad_s, acceleration_rad_s2


def motion_channels(epoch: Epoch) -> list[Channel]:
    """Return the measured motion channels of an epoch."""
    names = ("velocity_rad_s", "angle_rad")
    return [epoch.channels[name] for name in names if name in epoch.channels]
