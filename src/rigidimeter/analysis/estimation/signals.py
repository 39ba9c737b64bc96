"""Channels with their own clocks, brought onto one uniform grid.

Rates, phases and jitter differ between channels; the stamps say when each sample was taken. A cubic
spline through a channel's own stamps gives its value at any time between, and its derivative and
integral without a separate difference scheme.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.linear_solution import Solution, solve
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import USABLE_FRACTION_OF_RATE

Array = NDArray[np.float64]

GRID_POINTS_PER_CYCLE = 20
"""How densely the highest frequency of interest is sampled on the common grid.

At 20 points a cycle the derivative of a cubic spline is within 0.006 % of the true one.
"""


AS_SAMPLED = 1e-6
"""Stamps closer than this share of an interval are the same time."""


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

    @property
    def motion(self) -> Array:
        """Acceleration, velocity and angle, shape (n, 3)."""
        return np.column_stack([self.acceleration_rad_s2, self.velocity_rad_s, self.angle_rad])

    @cached_property
    def solution(self) -> Solution:
        """J, B and K by least squares, which the fit and the checks share."""
        return solve(self.motion, self.torque_nm)

    def part(self, rows: slice) -> Signals:
        """Return the same of some of the samples in a row."""
        columns = ("time_s", "torque_nm", "acceleration_rad_s2", "velocity_rad_s", "angle_rad")
        return replace(self, **{name: getattr(self, name)[rows] for name in columns})


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


def thinned(channel: Channel, highest_hz: float) -> Channel:
    """Return the means of a channel over stretches that keep `GRID_POINTS_PER_CYCLE`."""
    step = int(channel.rate_hz / (GRID_POINTS_PER_CYCLE * highest_hz) + 1e-6)
    if step < 2:
        return channel
    count = len(channel) // step
    time_s, values = (
        part[: count * step].reshape(count, step).mean(axis=1)
        for part in (channel.time_s, channel.values)
    )
    return Channel(channel.name, time_s, values)


def spline(channel: Channel) -> scipy.interpolate.CubicSpline:
    """Return the cubic spline through a channel's samples at its own stamps."""
    return scipy.interpolate.CubicSpline(channel.time_s, channel.values)


def sampled(channel: Channel, time_s: Array, share: float = AS_SAMPLED) -> slice | None:
    """Return which samples of a channel were taken at just these times; None where none were.

    Parameters
    ----------
    channel : Channel
    time_s : array, shape (n,)
    share : float
        Of the channel's interval: stamps that are closer are the same time.
    """
    if not time_s.size or len(channel) < time_s.size:
        return None
    close_s = share / channel.mean_rate_hz
    first = int(np.searchsorted(channel.time_s, time_s[0] - close_s))
    place = slice(first, first + time_s.size)
    stamps = channel.time_s[place]
    if stamps.size < time_s.size or np.max(np.abs(stamps - time_s)) > close_s:
        return None
    return place


def values_at(channel: Channel, time_s: Array, share: float = AS_SAMPLED) -> Array:
    """Return a channel at the times; without a spline where it was `sampled` at them."""
    place = sampled(channel, time_s, share)
    return channel.values[place] if place is not None else np.asarray(spline(channel)(time_s))


def columns_at(channel: Channel, columns: Sequence[Array], time_s: Array) -> Array:
    """Return `values_at` of several columns at the stamps of a channel, shape (k, n)."""
    place = sampled(channel, time_s)
    if place is not None:
        return np.stack([column[place] for column in columns])
    return np.asarray(
        scipy.interpolate.CubicSpline(channel.time_s, np.stack(columns), axis=1)(time_s)
    )


def values_and_slopes(channel: Channel, time_s: Array) -> tuple[Array, Array]:
    """Return a channel and its derivative at the times."""
    place = sampled(channel, time_s)
    if place is not None:
        return channel.values[place], spline_slopes(channel.time_s, channel.values)[place]
    found = spline(channel)
    return found(time_s), found.derivative()(time_s)


def spline_slopes(time_s: Array, values: Array) -> Array:
    """Return the derivative of the cubic spline through values, at their own times, shape (n,).

    As `CubicSpline` has it, without the coefficients of the pieces, which take four times as long.
    The slopes s keep the second derivative continuous; with steps h and differences d,

        h_k s_(k−1) + 2 (h_(k−1) + h_k) s_k + h_(k−1) s_(k+1) = 3 (h_k d_(k−1) + h_(k−1) d_k)

    and the third derivative is continuous at the second and the last but one ("not a knot").
    """
    n = time_s.size
    if n < 4:
        return np.asarray(scipy.interpolate.CubicSpline(time_s, values).derivative()(time_s))
    step = np.diff(time_s)
    rise = np.diff(values) / step
    banded, target = np.zeros((3, n)), np.empty(n)
    banded[0, 2:], banded[2, :-2] = step[:-1], step[1:]
    banded[1, 1:-1] = 2 * (step[:-1] + step[1:])
    target[1:-1] = 3 * (step[1:] * rise[:-1] + step[:-1] * rise[1:])
    for end, inner, near, far in ((0, (0, 1), 0, 1), (-1, (2, -2), -1, -2)):
        both = step[near] + step[far]
        banded[1, end], banded[inner] = step[far], both
        weighted = (step[near] + 2 * both) * step[far] * rise[near] + step[near] ** 2 * rise[far]
        target[end] = weighted / both
    return np.asarray(scipy.linalg.solve_banded((1, 1), banded, target, check_finite=False))


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
    if "velocity_rad_s" in epoch.channels:
        found = values_and_slopes(epoch.channels["velocity_rad_s"], time_s)
        return angle_at(epoch, time_s), *found
    angle_rad, velocity_rad_s = values_and_slopes(_angle(epoch), time_s)
    # A second spline through the velocity, since the second derivative of the first is only
    # piecewise linear and loses the upper part of the band.
    return angle_rad, velocity_rad_s, spline_slopes(time_s, velocity_rad_s)


def angle_at(epoch: Epoch, time_s: Array) -> Array:
    """Return the angle of `kinematics` alone."""
    if "angle_rad" in epoch.channels or "velocity_rad_s" not in epoch.channels:
        return values_at(_angle(epoch), time_s)
    integral = spline(epoch.channels["velocity_rad_s"]).antiderivative()(time_s)
    return np.asarray(integral - integral[:1])


def velocity_at(epoch: Epoch, time_s: Array) -> Array:
    """Return the velocity of `kinematics` alone."""
    velocity = epoch.channels.get("velocity_rad_s")
    if velocity is not None:
        return values_at(velocity, time_s)
    return values_and_slopes(_angle(epoch), time_s)[1]


def _angle(epoch: Epoch) -> Channel:
    if "angle_rad" not in epoch.channels:
        raise ValueError(f"{epoch.name} holds neither velocity_rad_s nor angle_rad")
    return epoch.channels["angle_rad"]


def motion_channels(epoch: Epoch) -> list[Channel]:
    """Return the measured motion channels of an epoch."""
    names = ("velocity_rad_s", "angle_rad")
    return [epoch.channels[name] for name in names if name in epoch.channels]


def usable_hz(epoch: Epoch) -> float:
    """Return up to which frequency torque and motion were sampled densely enough to be fitted."""
    used = [epoch.channels["torque_nm"], *motion_channels(epoch)]
    return USABLE_FRACTION_OF_RATE * min(channel.rate_hz for channel in used)
