"""How the rig answers what it was sent: delay, scale, bandwidth, and the arm in it.

What was sent is constant between two ticks, so its integral, the angle asked for, is a broken line.
A drive of bandwidth f after a delay τ turns it into

    θ(t) = θ₀ + s · h_f(t − τ) * ∫ c dt,        s = 1 where all units are right,

with h_f the second-order response of `rigidimeter.model.velocity_drive`. The torque of an arm is

    M(t) = J θ''(t − δ) + B θ'(t − δ) + K θ(t − δ) + M₀.

Where M is taken as the loop saw it at each tick, δ is the delay around the loop but for the
drive's own response: wire, drive, sensor, wire, and waiting for the tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize, nnls

from rigidimeter.model import DriveModel
from rigidimeter.rig.commissioning.trials import Array, Readings, new_samples

GRID_HZ = 4000.0
LONGEST_S = 0.4
LONGEST_DRIVE_S = 0.2
COARSE_S = 0.002


class Following(NamedTuple):
    """How the angle follows what was sent.

    `worst_rad` is the largest deviation of the angle from the model, `bandwidth_hz` infinite where
    only a delay was fitted.
    """

    scale: float
    delay_s: float
    bandwidth_hz: float
    worst_rad: float


class ArmFit(NamedTuple):
    """The arm as the torque shows it, the delay, and the share of the torque that it explains."""

    inertia_kg_m2: float
    damping_nm_s_rad: float
    stiffness_nm_rad: float
    delay_s: float
    explained: float
    strongest: str
    """Which of inertia, damping, stiffness makes the most torque."""

    @property
    def strongest_is_positive(self) -> bool:
        """Whether that one is above zero, as of a joint that resists."""
        J, B, K = self[:3]
        return {"inertia": J, "damping": B, "stiffness": K}[self.strongest] > 0


def sent_angle_rad(readings: Readings, at_s: Array) -> Array:
    """Return the integral of what was sent up to these times."""
    steps = readings.sent_rad_s[:-1] * np.diff(readings.time_s)
    angle = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(np.interp(at_s, readings.time_s, angle))


def following(
    readings: Readings, damping_ratio: float, highest_hz: float | None = None
) -> Following:
    """Fit scale and delay, and up to `highest_hz` the drive's bandwidth; without it only a delay.

    What answers quicker than half the tick rate looks like a delay at that rate.
    """
    fresh = new_samples(readings.motion_time_s) & np.isfinite(readings.angle_rad)
    at_s, angle = readings.motion_time_s[fresh], readings.angle_rad[fresh]
    if len(at_s) < 10:
        return Following(math.nan, math.nan, math.nan, math.inf)

    @lru_cache(maxsize=1)
    def model(bandwidth_hz: float) -> Callable[[Array], Array]:
        return _drive_angle(readings, bandwidth_hz, damping_ratio)

    def fitted(bandwidth_hz: float, delay_s: float) -> tuple[float, float, float]:
        return _line(model(bandwidth_hz)(at_s - delay_s), angle)

    if highest_hz is None:
        delay_s = minimum_at(lambda d: fitted(math.inf, d)[1], 0.0, LONGEST_S)
        scale, _, worst = fitted(math.inf, delay_s)
        return Following(scale, delay_s, math.inf, worst)

    # Bandwidth and delay trade against each other: the best delay of each bandwidth first, then
    # both together from the best pair.
    log_highest = math.log(highest_hz)

    def best_delay_s(bandwidth_hz: float) -> float:
        return minimum_at(lambda d: fitted(bandwidth_hz, d)[1], 0.0, LONGEST_DRIVE_S, 0.01, 1)

    pairs = [(float(f), best_delay_s(float(f))) for f in np.geomspace(1.0, highest_hz, 12)]
    start = min(pairs, key=lambda pair: fitted(*pair)[1])

    def squares(place: Array) -> float:
        return fitted(math.exp(min(float(place[0]), log_highest)), abs(float(place[1])))[1]

    found = minimize(
        squares,
        np.array([math.log(start[0]), start[1]]),
        method="Nelder-Mead",
        options={
            "xatol": 1e-5,
            "fatol": 1e-16,
            "initial_simplex": np.array(
                [
                    [math.log(start[0]), start[1]],
                    [math.log(start[0]) - 0.2, start[1]],
                    [math.log(start[0]), start[1] + 0.002],
                ]
            ),
        },
    )
    bandwidth_hz = math.exp(min(float(found.x[0]), log_highest))
    delay_s = abs(float(found.x[1]))
    scale, _, worst = fitted(bandwidth_hz, delay_s)
    return Following(scale, delay_s, bandwidth_hz, worst)


def velocity_per_angle(readings: Readings) -> float:
    """Return the velocity channel over the derivative of the angle, by the integral of the one."""
    fresh = new_samples(readings.motion_time_s)
    at_s, angle = readings.motion_time_s[fresh], readings.angle_rad[fresh]
    velocity = readings.velocity_rad_s[fresh]
    if len(at_s) < 10:
        return math.nan
    moved = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(at_s))])
    return _line(angle, moved)[0]


def fit_arm(
    readings: Readings,
    bandwidth_hz: float,
    damping_ratio: float,
    drive_scale: float,
    *,
    resists: bool = False,
) -> ArmFit:
    """Fit an arm to the torque as the loop saw it, tick by tick.

    Parameters
    ----------
    readings : Readings
    bandwidth_hz, damping_ratio : float
        Of the drive, as it was found to follow.
    drive_scale : float
        Measured angle over angle sent: the arm is seen along the measured angle.
    resists : bool
        The arm is known to resist: none of J, B and K is below zero.
    """
    good = np.isfinite(readings.torque_nm)
    at_s, torque = readings.time_s[good], readings.torque_nm[good]
    if len(at_s) < 30:
        return ArmFit(math.nan, math.nan, math.nan, math.nan, 0.0, "")
    model = _drive_angle(readings, bandwidth_hz, damping_ratio)
    grid = np.arange(at_s[0] - LONGEST_S, at_s[-1], 1.0 / GRID_HZ)
    angle = drive_scale * model(grid)
    velocity = np.gradient(angle, grid)
    acceleration = np.gradient(velocity, grid)

    def columns(delay_s: float) -> Array:
        then = at_s - delay_s
        motion = [np.interp(then, grid, x) for x in (acceleration, velocity, angle)]
        return np.stack([*motion, np.ones_like(then)], axis=1)

    solve = _solve_positive if resists else least_squares

    def left(delay_s: float) -> float:
        return solve(columns(delay_s), torque)[1]

    delay_s = minimum_at(left, 0.0, LONGEST_S)
    table = columns(delay_s)
    (J, B, K), unexplained = solve(table, torque)[0][:3], left(delay_s)
    total = float(np.sum((torque - torque.mean()) ** 2))
    shares = np.abs([J, B, K]) * np.std(table[:, :3], axis=0)
    strongest = ("inertia", "damping", "stiffness")[int(np.argmax(shares))]
    explained = 1.0 - unexplained / total if total > 0 else 0.0
    return ArmFit(float(J), float(B), float(K), delay_s, explained, strongest)


def _drive_angle(
    readings: Readings, bandwidth_hz: float, damping_ratio: float
) -> Callable[[Array], Array]:
    """Return the angle of the drive's model at any time, from rest."""
    if not math.isfinite(bandwidth_hz):
        return lambda at_s: sent_angle_rad(readings, at_s)
    grid = np.arange(readings.time_s[0], readings.time_s[-1] + 1.0 / GRID_HZ, 1.0 / GRID_HZ)
    mean_rad_s = np.diff(sent_angle_rad(readings, grid)) * GRID_HZ
    drive = DriveModel.second_order(bandwidth_hz, damping_ratio)
    followed = drive.held(mean_rad_s, 1.0 / GRID_HZ).angle_rad
    return lambda at_s: np.interp(at_s, grid[:-1], followed)


def _line(x: Array, y: Array) -> tuple[float, float, float]:
    """Return the slope of y over x, the sum of the squares left, and the largest of them."""
    x, y = x - x.mean(), y - y.mean()
    power = float(x @ x)
    slope = float(x @ y) / power if power > 0.0 else 0.0
    rest = y - slope * x
    return slope, float(rest @ rest), float(np.max(np.abs(rest)))


def least_squares(table: Array, y: Array) -> tuple[Array, float]:
    """Return least-squares coefficients and the sum of the squares left; columns are scaled."""
    size = np.linalg.norm(table, axis=0)
    size[size == 0.0] = 1.0
    found = np.linalg.lstsq(table / size, y, rcond=None)[0] / size
    return found, float(np.sum((y - table @ found) ** 2))


def _solve_positive(table: Array, y: Array) -> tuple[Array, float]:
    """Return the same with all coefficients but the last, the constant, at or above zero."""
    centred, level = table[:, :-1] - table[:, :-1].mean(axis=0), y - y.mean()
    size = np.linalg.norm(centred, axis=0)
    size[size == 0.0] = 1.0
    found, left = nnls(centred / size, level)
    return found / size, float(left) ** 2


def minimum_at(
    measure: Callable[[float], float],
    low: float,
    high: float,
    step: float = COARSE_S,
    rounds: int = 4,
) -> float:
    """Return where a function of a delay is least: looked for on a grid, then more closely."""
    grid = np.arange(low, high, step)
    best = float(grid[int(np.argmin([measure(float(d)) for d in grid]))])
    for _ in range(rounds):
        near = np.linspace(max(low, best - step), best + step, 11)
        best = float(near[int(np.argmin([measure(float(d)) for d in near]))])
        step /= 5.0
    return best
