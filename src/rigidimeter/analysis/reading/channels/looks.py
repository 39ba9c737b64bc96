"""What numbers look like under one reading of their units: rate, motion, power and a rough fit.

The fit is least squares of the torque on angle, velocity and acceleration in one band. It is rough:
voluntary torque and delays bias it. It is good enough to tell a sign or a factor of 57.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 200
LONGEST_S = 60.0
BAND_HZ = (0.3, 15.0)
HIGHEST_RATE_HZ = 1000.0
SPEED_OVER_S = 0.03
"""An angle is differenced over this time: noise of 0.001 rad at 10 kHz would be 10 rad/s."""
_CONDITION = 100.0
_FOLLOWS = 0.9
"""R² from which a velocity is that of the angle, whatever its unit."""


@dataclass(frozen=True)
class RoughFit:
    """J, B and K in SI with standard errors, shape (3,) each, and the share of torque explained."""

    value: Array
    error: Array
    r_squared: float

    @property
    def significant(self) -> Array:
        """The signs of J, B and K: −1 or 1 where clear (5 standard errors), else 0."""
        return np.where(np.abs(self.value) > 5 * self.error, np.sign(self.value), 0.0)


@dataclass(frozen=True)
class Look:
    """How a recording looks under one reading.

    Parameters
    ----------
    n_samples : int
    rate_hz, duration_s : float
        The rate of the faster channel.
    largest_rad, range_rad, turned_rad : float
        Largest absolute angle, its range, and by how much its end differs from its start; NaN
        without an angle.
    speed_rad_s : float
        Exceeded 1 % of the time.
    velocity_ratio : float
        Slope of a velocity beside the angle over the angle's derivative; NaN without such a
        velocity, or where the two do not follow each other.
    velocity_speed_rad_s : float
        Of a velocity beside the angle, exceeded 1 % of the time; NaN without one.
    torque_nm, power_w : float
        Largest torque; torque times speed, exceeded 1 % of the time.
    motion_hz : float
        Typical frequency of the motion: r.m.s. of velocity over angle.
    fit, swapped : RoughFit or None
        Of the torque on the motion, and of the angle on the torque.
    """

    n_samples: int
    rate_hz: float
    duration_s: float
    largest_rad: float
    range_rad: float
    turned_rad: float
    speed_rad_s: float
    velocity_ratio: float
    velocity_speed_rad_s: float
    torque_nm: float
    power_w: float
    motion_hz: float
    fit: RoughFit | None
    swapped: RoughFit | None


def look(
    torque: tuple[Array, Array],
    motion: tuple[Array, Array],
    beside: tuple[Array, Array] | None = None,
    *,
    is_angle: bool,
) -> Look:
    """Look at a recording.

    Parameters
    ----------
    torque, motion : (array, array)
        Time in s and values, each with its own clock; two samples or more.
    beside : (array, array), optional
        A velocity in rad/s beside the angle.
    is_angle : bool
        Whether the motion is an angle in rad, and not a velocity in rad/s.
    """
    with np.errstate(all="ignore"):  # of numbers that are refused elsewhere
        return _look(torque, motion, beside, is_angle=is_angle)


def _look(
    torque: tuple[Array, Array],
    motion: tuple[Array, Array],
    beside: tuple[Array, Array] | None,
    *,
    is_angle: bool,
) -> Look:
    time_s, values = motion
    step_s = float(np.median(np.diff(time_s)))
    row_s = min(step_s, float(np.median(np.diff(torque[0]))))
    duration_s = float(time_s[-1] - time_s[0])
    if is_angle:
        angle = values
        over = 1
        if SPEED_OVER_S / values.size < step_s < SPEED_OVER_S:
            over = min(round(SPEED_OVER_S / step_s), values.size - 1)
        velocity = (values[over:] - values[:-over]) / np.maximum(
            time_s[over:] - time_s[:-over], 1e-12
        )
        middle_s = time_s[over:]
    else:
        velocity, middle_s = values, time_s
        angle = np.cumsum(values - np.mean(values)) * step_s
    speed = np.abs(velocity)
    power = speed * np.abs(np.interp(middle_s, *torque))
    rms = float(np.sqrt(np.mean(velocity**2))), float(np.std(angle))
    fit = swapped = None
    grid = _grid(torque, motion, is_angle=is_angle)
    if grid is not None:
        rate_hz, torque_nm, angle_rad = grid
        fit = rough_fit(rate_hz, torque_nm, angle_rad)
        swapped = rough_fit(rate_hz, angle_rad, torque_nm) if is_angle else None
    return Look(
        int(values.size),
        1.0 / row_s if row_s > 0 else math.inf,
        duration_s,
        float(np.max(np.abs(angle))) if is_angle else math.nan,
        float(np.ptp(angle)) if is_angle else math.nan,
        float(abs(angle[-1] - angle[0])) if is_angle else math.nan,
        float(np.quantile(speed, 0.99)),
        math.nan if beside is None else _velocity_ratio(beside, motion),
        math.nan if beside is None else float(np.quantile(np.abs(beside[1]), 0.99)),
        float(np.max(np.abs(torque[1]))),
        float(np.quantile(power, 0.99)),
        rms[0] / (2 * math.pi * rms[1]) if rms[0] * rms[1] > 0 else math.nan,
        fit,
        swapped,
    )


def _velocity_ratio(velocity: tuple[Array, Array], angle: tuple[Array, Array]) -> float:
    """Return the slope of a velocity over the angle's derivative, both averaged over 30 ms.

    With ω(t) the velocity and θ(t) the angle, the slope of ∫ω dt over θ(t + T) − θ(t), T = 30 ms:
    1 of one motion in matching units, 57.3 of a velocity in deg/s beside an angle in rad. NaN where
    they do not follow each other (R² up to 0.9), such as a velocity that a filter made late.
    """
    grid = _grid(velocity, angle, is_angle=True)
    if grid is None:
        return math.nan
    rate_hz, velocity_rad_s, angle_rad = grid
    over = max(1, round(SPEED_OVER_S * rate_hz))
    travelled = np.cumsum(0.5 * (velocity_rad_s[1:] + velocity_rad_s[:-1])) / rate_hz
    travelled = np.concatenate(([0.0], travelled))
    areas, turned = (values[over:] - values[:-over] for values in (travelled, angle_rad))
    areas, turned = areas - areas.mean(), turned - turned.mean()
    together = float(areas @ turned)
    sizes = float(areas @ areas), float(turned @ turned)
    if not together**2 > _FOLLOWS * sizes[0] * sizes[1]:
        return math.nan
    return together / sizes[1]


def _grid(
    torque: tuple[Array, Array], motion: tuple[Array, Array], *, is_angle: bool
) -> tuple[float, Array, Array] | None:
    """Bring torque and angle onto one even clock: the liveliest minute of what both cover."""
    start_s, stop_s = max(torque[0][0], motion[0][0]), min(torque[0][-1], motion[0][-1])
    steps_s = [float(np.median(np.diff(stamps))) for stamps, _ in (torque, motion)]
    rate_hz = min(1.0 / max(steps_s), HIGHEST_RATE_HZ) if max(steps_s) > 0 else 0.0
    if stop_s - start_s > LONGEST_S:
        if (stop_s - start_s) / LONGEST_S > 1e4:
            return None
        minutes = start_s + LONGEST_S * np.arange((stop_s - start_s) // LONGEST_S + 2)
        edges = np.searchsorted(motion[0], minutes)
        spread = [
            float(np.std(motion[1][begin:end])) if end - begin >= FEWEST else 0.0
            for begin, end in pairwise(edges)
        ]
        start_s += LONGEST_S * int(np.argmax(spread))
        stop_s = min(stop_s, start_s + LONGEST_S)
    if not FEWEST <= (stop_s - start_s) * rate_hz <= LONGEST_S * HIGHEST_RATE_HZ + 1:
        return None
    if rate_hz < 4 * BAND_HZ[0]:
        return None
    count = int((stop_s - start_s) * rate_hz)
    clock = start_s + np.arange(count) / rate_hz
    values = np.interp(clock, *motion)
    angle = values if is_angle else np.cumsum(values - values.mean()) / rate_hz
    return rate_hz, np.interp(clock, *torque), angle


def rough_fit(rate_hz: float, torque: Array, angle: Array) -> RoughFit | None:
    """Fit J, B and K to evenly sampled torque and angle; None where they cannot be told apart."""
    high_hz = min(BAND_HZ[1], 0.2 * rate_hz)
    velocity = np.gradient(angle, 1.0 / rate_hz)
    columns = np.stack((np.gradient(velocity, 1.0 / rate_hz), velocity, angle, torque))
    edge = max(1, min(int(rate_hz), angle.size // 10))
    columns -= columns.mean(axis=1, keepdims=True)
    passed = scipy.signal.sosfiltfilt(_band(rate_hz, high_hz), columns)[:, edge:-edge]
    matrix, target = np.ascontiguousarray(passed[:3].T), passed[3]
    scale = np.linalg.norm(matrix, axis=0)
    total = float(target @ target)
    if not (np.all(np.isfinite(scale)) and np.all(scale > 0) and 0 < total < math.inf):
        return None
    if np.linalg.cond(matrix / scale) > _CONDITION:
        return None
    value, *_ = np.linalg.lstsq(matrix / scale, target, rcond=None)
    left = target - (matrix / scale) @ value
    # Of a band only so many samples are independent.
    free = max(target.size * 2 * (high_hz - BAND_HZ[0]) / rate_hz - 3, 1.0)
    spread = np.linalg.inv((matrix / scale).T @ (matrix / scale))
    error = np.sqrt(np.diag(spread) * float(left @ left) / target.size * (target.size / free))
    return RoughFit(value / scale, error / scale, 1.0 - float(left @ left) / total)


@lru_cache(maxsize=16)
def _band(rate_hz: float, high_hz: float) -> Array:
    """Return a band-pass; to design it takes as long as to filter a recording."""
    return np.asarray(
        scipy.signal.butter(2, [BAND_HZ[0], high_hz], "bandpass", fs=rate_hz, output="sos")
    )
