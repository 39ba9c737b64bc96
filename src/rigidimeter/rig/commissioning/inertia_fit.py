"""The torque that answers a motion: inertia, damping, stiffness and delay, from the measured angle.

What is fastened beyond the torque sensor (cuff, handle, a weight) has inertia J > 0, and the torque
that the drive applies to it, positive toward positive angles, is

    M(t) = J θ''(t − δ) + B θ'(t − δ) + K θ(t − δ) + M₀.

So the slope of M on θ'' has the sign of the torque against the angle, its size is J times the gain
of the sensor, and δ is how much later than the angle the torque arrives at the loop. B, K and M₀
take up friction, gravity, a spring and the bias; none of the signs is assumed.

The angle is never differentiated as it was read. With a Gaussian g of width σ both sides are
smoothed alike, and the derivatives are put on the Gaussian:

    g * M = J (g'' * θ) + B (g' * θ) + K (g * θ) + M₀.

The motion is a sum of four sinusoids of 1 to 5 Hz in the velocity. With one alone J and K would be
the same, and so would a delay of half a period and the opposite sign.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.commissioning.response import least_squares, minimum_at
from rigidimeter.rig.commissioning.trials import Array, Readings, new_samples

FREQUENCIES_HZ = (1.0, 2.0, 3.5, 5.0)
WEIGHTS = (0.10, 0.15, 0.30, 0.45)
"""Of the velocity; the acceleration is mostly of the quick ones, the travel of the slow ones."""

PERIOD_S = 2.0
"""After which all four are where they began."""

GRID_HZ = 500.0
NARROWEST_S = 0.01
EARLIEST_S, LATEST_S = -0.05, 0.25
"""Of the torque behind the angle; an angle that is stamped late lies behind the torque."""

DELAY_STEP_S, COARSE_S = 0.002, 0.005
BLOCKS = 12
EDGE = 4
"""Widths of the Gaussian at either end at which it would look beyond the readings."""


class TorqueAnswer(NamedTuple):
    """J, B, K as the torque shows them, and how well.

    `inertia_se_kg_m2` is the standard error of J, `delay_s` the torque's behind the angle's,
    `explained` the share of the torque's variance.
    """

    inertia_kg_m2: float
    inertia_se_kg_m2: float
    damping_nm_s_rad: float
    stiffness_nm_rad: float
    delay_s: float
    explained: float


def quick_motion(rate_hz: float, duration_s: float, speed_deg_s: float) -> Array:
    """Return velocities in rad/s, one a tick, that end where they began.

    Parameters
    ----------
    rate_hz : float
        Ticks a second.
    duration_s : float
        Rounded up to whole periods of 2 s.
    speed_deg_s : float
        Never exceeded.
    """
    periods = max(1, math.ceil(duration_s / PERIOD_S - 1e-9))
    time_s = np.arange(round(periods * PERIOD_S * rate_hz)) / rate_hz
    waves = [
        w * np.sin(2 * np.pi * f * time_s) for w, f in zip(WEIGHTS, FREQUENCIES_HZ, strict=True)
    ]
    return np.asarray(rad_from_deg(speed_deg_s) * np.sum(waves, axis=0))


def torque_answer(readings: Readings, rate_hz: float) -> TorqueAnswer:
    """Fit the torque, as it arrived at the loop, to the motion that the encoder showed.

    The standard error counts that the delay was fitted too (an error of it times B is one of J),
    and is from blocks of half a second: the smoothed residuals of neighbouring ticks are alike,
    those of blocks are not.
    """
    fresh = new_samples(readings.motion_time_s) & np.isfinite(readings.angle_rad)
    there = np.isfinite(readings.torque_nm)
    at_s, angle_rad = readings.motion_time_s[fresh], readings.angle_rad[fresh]
    seen_s, torque_nm = readings.time_s[there], readings.torque_nm[there]
    nothing = TorqueAnswer(0.0, math.inf, 0.0, 0.0, math.nan, 0.0)
    if len(at_s) < 30 or len(seen_s) < 30:
        return nothing
    grid = np.arange(max(at_s[0], seen_s[0]), min(at_s[-1], seen_s[-1]), 1.0 / GRID_HZ)
    width = GRID_HZ * max(NARROWEST_S, 1.0 / rate_hz)
    edge = round(EDGE * width)
    first = edge + round((LATEST_S + 2 * DELAY_STEP_S) * GRID_HZ)
    end = len(grid) - edge + round((EARLIEST_S - 2 * DELAY_STEP_S) * GRID_HZ)
    if end < 2 * first:
        return nothing

    angle = np.interp(grid, at_s, angle_rad)
    motion = [GRID_HZ**n * gaussian_filter1d(angle, width, order=n) for n in (2, 1, 0)]
    torque = gaussian_filter1d(np.interp(grid, seen_s, torque_nm), width)[first:end]
    columns = np.stack([*motion, np.ones_like(grid)], axis=1)
    places = np.arange(first, end)

    def table(delay_s: float) -> Array:
        """Return the motion this much earlier, between the points of the grid."""
        ticks, part = divmod(delay_s * GRID_HZ, 1.0)
        at = places - int(ticks)
        return np.asarray((1.0 - part) * columns[at] + part * columns[at - 1])

    delay_s = minimum_at(
        lambda d: least_squares(table(d), torque)[1], EARLIEST_S, LATEST_S, COARSE_S
    )
    chosen = table(delay_s)
    found, left = least_squares(chosen, torque)
    total = float(np.sum((torque - torque.mean()) ** 2))
    later = (table(delay_s + DELAY_STEP_S) - table(delay_s - DELAY_STEP_S)) @ found
    unknowns = np.column_stack([chosen, later / (2.0 * DELAY_STEP_S)])
    influence = np.linalg.pinv(unknowns)[0] * (torque - chosen @ found)
    blocks = np.array([block.sum() for block in np.array_split(influence, BLOCKS)])
    error = math.sqrt(BLOCKS / (BLOCKS - 1) * float(blocks @ blocks))
    J, B, K = (float(value) for value in found[:3])
    return TorqueAnswer(J, error, B, K, delay_s, 1.0 - left / total if total > 0 else 0.0)
