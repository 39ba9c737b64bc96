"""What the numbers of a recording look like, measured once: rate, motion, power and a rough fit.

The fit is least squares of the torque on angle, velocity and acceleration in one band. It is rough:
voluntary torque and delays bias it. It is good enough to tell a sign or a factor of 57.

The largest angle and torque are those of all samples; quantiles and spreads are of `SAMPLES` that
are evenly spaced, so that an hour costs hardly more than a minute.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.reading_anew.columns import Array

SAMPLES = 200_000
FEWEST = 200
LONGEST_S = 60.0
BAND_HZ = (0.3, 15.0)
HIGHEST_RATE_HZ, ENOUGH_HZ = 1000.0, 250.0
"""Of the clock to which torque and motion are brought, and of what is fitted up to 15 Hz."""
SPEED_OVER_S = 0.03
"""An angle is differenced over this time: noise of 0.001 rad at 10 kHz would be 10 rad/s."""
_CONDITION = 100.0
# R² from which a velocity is that of the angle, whatever its unit.
_FOLLOWS = 0.9

Signal = tuple[Array, Array]
"""Time in s and values, both finite."""


class RoughFit(NamedTuple):
    """J, B and K in SI with standard errors, shape (3,) each, and the share of torque explained."""

    value: Array
    error: Array
    r_squared: float

    @property
    def signs(self) -> Array:
        """The signs of J, B and K: −1 or 1 where clear (5 standard errors), else 0."""
        return np.where(np.abs(self.value) > 5 * self.error, np.sign(self.value), 0.0)

    @property
    def text(self) -> str:
        """J, B and K as sentences show them."""
        inertia, damping, stiffness = self.value
        return f"J {inertia:.2g} kg·m², B {damping:.2g} N·m·s/rad, K {stiffness:.2g} N·m/rad"


class Seen(NamedTuple):
    """How a recording looks under one mapping.

    Attributes
    ----------
    n_samples : int
    rate_hz, duration_s : float
        The rate of the faster channel.
    torque_nm : float
        The largest.
    largest_rad, range_rad, turned_rad : float
        Largest absolute angle, its range, and by how much its end differs from its start; NaN
        without an angle.
    speed_rad_s, velocity_rad_s : float
        Of the angle, and of the velocity; exceeded 1 % of the time, NaN without it.
    power_w : float
        Torque times speed, exceeded 1 % of the time.
    motion_hz : float
        Typical frequency of the motion: r.m.s. of velocity over angle.
    velocity_ratio : float
        Slope of a velocity beside the angle over the angle's derivative; NaN without such a
        velocity, or where the two do not follow each other.
    fit, swapped : RoughFit or None
        Of the torque on the motion, and of the angle on the torque.
    """

    n_samples: int
    rate_hz: float
    duration_s: float
    torque_nm: float
    largest_rad: float
    range_rad: float
    turned_rad: float
    speed_rad_s: float
    velocity_rad_s: float
    power_w: float
    motion_hz: float
    velocity_ratio: float
    fit: RoughFit | None
    swapped: RoughFit | None

    @property
    def text(self) -> str:
        """Rate, duration, speed, and J, B and K on one line."""
        speed = self.velocity_rad_s if math.isnan(self.speed_rad_s) else self.speed_rad_s
        return (
            f"{self.rate_hz:.4g} samples/s for {self.duration_s:.4g} s, peak speed {speed:.3g} "
            f"rad/s, {'J, B and K are unknown' if self.fit is None else self.fit.text}"
        )


def look(torque: Signal, angle: Signal | None, velocity: Signal | None) -> Seen:
    """Look at a recording in SI.

    Parameters
    ----------
    torque : (array, array)
        Two samples or more.
    angle, velocity : (array, array) or None
        At least one of them.
    """
    with np.errstate(all="ignore"):  # of numbers that are refused elsewhere
        motion = angle if angle is not None else velocity
        assert motion is not None
        return _look(torque, motion, velocity, is_angle=angle is not None)


def _look(torque: Signal, motion: Signal, velocity: Signal | None, *, is_angle: bool) -> Seen:
    time_s, values = motion
    step_s = typical_step_s(time_s)
    row_s = step_s if torque[0] is time_s else min(step_s, typical_step_s(torque[0]))
    over = 0
    if is_angle:
        over = 1
        if SPEED_OVER_S / values.size < step_s < SPEED_OVER_S:
            over = min(round(SPEED_OVER_S / step_s), values.size - 1)
    stride = _stride(values.size)
    start, stop = slice(0, values.size - over, stride), slice(over, None, stride)
    if is_angle:
        moved_s = np.maximum(time_s[stop] - time_s[start], 1e-12)
        speeds, angle = (values[stop] - values[start]) / moved_s, values
    else:
        speeds, angle = values[start], np.cumsum(values - np.mean(values)) * step_s
    loads = torque[1][stop] if torque[0] is time_s else np.interp(time_s[stop], *torque)
    rms, spread = float(np.sqrt(np.mean(speeds**2))), float(np.std(angle[::stride]))
    low, high = (float(np.min(angle)), float(np.max(angle))) if is_angle else (math.nan, math.nan)
    fit = swapped = None
    grid = _on_one_clock(torque, motion, is_angle=is_angle)
    if grid is not None:
        rate_hz, torque_nm, angle_rad = grid
        fit = rough_fit(rate_hz, torque_nm, angle_rad)
        swapped = rough_fit(rate_hz, angle_rad, torque_nm) if is_angle else None
    speed = float(np.quantile(np.abs(speeds), 0.99))
    beside = velocity if is_angle else None
    return Seen(
        n_samples=int(values.size),
        rate_hz=1.0 / row_s if row_s > 0 else math.inf,
        duration_s=float(time_s[-1] - time_s[0]),
        torque_nm=max(float(np.max(torque[1])), -float(np.min(torque[1]))),
        largest_rad=max(high, -low),
        range_rad=high - low,
        turned_rad=float(abs(values[-1] - values[0])) if is_angle else math.nan,
        speed_rad_s=speed if is_angle else math.nan,
        velocity_rad_s=speed if not is_angle else _often(beside),
        power_w=float(np.quantile(np.abs(speeds) * np.abs(loads), 0.99)),
        motion_hz=rms / (2 * math.pi * spread) if rms * spread > 0 else math.nan,
        velocity_ratio=math.nan if beside is None else _velocity_ratio(beside, motion),
        fit=fit,
        swapped=swapped,
    )


def typical_step_s(time_s: Array) -> float:
    """Return the median interval of stamps, of some where there are many."""
    stride = _stride(time_s.size)
    return float(np.median(time_s[1::stride] - time_s[:-1:stride]))


def _stride(n_samples: int) -> int:
    return max(1, n_samples // SAMPLES)


def _often(velocity: Signal | None) -> float:
    """Return the speed that a velocity exceeds 1 % of the time."""
    if velocity is None:
        return math.nan
    return float(np.quantile(np.abs(velocity[1][:: _stride(velocity[1].size)]), 0.99))


def _velocity_ratio(velocity: Signal, angle: Signal) -> float:
    """Return the slope of a velocity over the angle's derivative, both averaged over 30 ms.

    With ω(t) the velocity and θ(t) the angle, the slope of ∫ω dt over θ(t + T) − θ(t), T = 30 ms:
    1 of one motion in matching units, 57.3 of a velocity in deg/s beside an angle in rad. NaN where
    they do not follow each other (R² up to 0.9), such as a velocity that a filter made late.
    """
    grid = _on_one_clock(velocity, angle, is_angle=True)
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


def _on_one_clock(
    torque: Signal, motion: Signal, *, is_angle: bool
) -> tuple[float, Array, Array] | None:
    """Bring torque and angle onto one even clock: the liveliest minute of what both cover."""
    start_s, stop_s = max(torque[0][0], motion[0][0]), min(torque[0][-1], motion[0][-1])
    slowest_s = typical_step_s(motion[0])
    if torque[0] is not motion[0]:
        slowest_s = max(slowest_s, typical_step_s(torque[0]))
    rate_hz = min(1.0 / slowest_s, HIGHEST_RATE_HZ) if slowest_s > 0 else 0.0
    if stop_s - start_s > LONGEST_S:
        if (stop_s - start_s) / LONGEST_S > 1e4:
            return None
        minutes = start_s + LONGEST_S * np.arange((stop_s - start_s) // LONGEST_S + 2)
        edges = np.searchsorted(motion[0], minutes)
        stride = _stride(motion[0].size)
        spreads = [
            float(np.std(motion[1][begin:end:stride])) if end - begin >= FEWEST else 0.0
            for begin, end in pairwise(edges)
        ]
        start_s += LONGEST_S * int(np.argmax(spreads))
        stop_s = min(stop_s, start_s + LONGEST_S)
    if not FEWEST <= (stop_s - start_s) * rate_hz <= LONGEST_S * HIGHEST_RATE_HZ + 1:
        return None
    if rate_hz < 4 * BAND_HZ[0]:
        return None
    over = max(1, int(rate_hz / ENOUGH_HZ))  # means of so many samples, for noise folds back
    count = int((stop_s - start_s) * rate_hz) // over * over
    clock = start_s + np.arange(count) / rate_hz
    loads, values = (_at(clock, one).reshape(-1, over).mean(axis=1) for one in (torque, motion))
    rate_hz /= over
    angle = values if is_angle else np.cumsum(values - values.mean()) / rate_hz
    return rate_hz, loads, angle


def _at(clock: Array, signal: Signal) -> Array:
    """Interpolate a signal, of which only the part around the clock is looked at."""
    time_s, values = signal
    first, last = np.searchsorted(time_s, (clock[0], clock[-1]))
    part = slice(max(int(first) - 1, 0), int(last) + 1)
    return np.asarray(np.interp(clock, time_s[part], values[part]), dtype=np.float64)


def rough_fit(rate_hz: float, torque: Array, angle: Array) -> RoughFit | None:
    """Fit J, B and K to evenly sampled torque and angle; None where they cannot be told apart."""
    high_hz = min(BAND_HZ[1], 0.2 * rate_hz)
    velocity = np.gradient(angle, 1.0 / rate_hz)
    columns = np.stack((np.gradient(velocity, 1.0 / rate_hz), velocity, angle, torque))
    edge = max(1, min(int(rate_hz), angle.size // 10))
    columns -= columns.mean(axis=1, keepdims=True)
    band: NDArray[np.float64] = scipy.signal.butter(
        2, [BAND_HZ[0], high_hz], "bandpass", fs=rate_hz, output="sos"
    )
    passed = scipy.signal.sosfiltfilt(band, columns)[:, edge:-edge]
    matrix, target = np.ascontiguousarray(passed[:3].T), passed[3]
    scale = np.linalg.norm(matrix, axis=0)
    total = float(target @ target)
    if not (np.all(np.isfinite(scale)) and np.all(scale > 0) and 0 < total < math.inf):
        return None
    scaled = matrix / scale
    if np.linalg.cond(scaled) > _CONDITION:
        return None
    value, *_ = np.linalg.lstsq(scaled, target, rcond=None)
    left = target - scaled @ value
    # Of a band only so many samples are independent.
    free = max(target.size * 2 * (high_hz - BAND_HZ[0]) / rate_hz - 3, 1.0)
    variances = np.diag(np.linalg.inv(scaled.T @ scaled))
    error = np.sqrt(variances * float(left @ left) / target.size * (target.size / free))
    return RoughFit(value / scale, error / scale, 1.0 - float(left @ left) / total)
