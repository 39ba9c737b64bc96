"""Whether the torque answers the motion, and with the right sign.

Whatever is mounted on the drive, the torque M from the drive on it is

    M = J θ'' + B θ' + K (θ − θ0) − M_sub        J, B, K > 0

Both sides pass the same filter, with L = w/(s + w), H = 1 − L and w = 2π · 5 Hz, which leaves out
θ0 and slow torques and differentiates without amplifying noise:

    H L² M = J a + B v + K q − …        a = w² H³ θ        v = w H² L θ        q = H L² θ

size    A joint that is accelerated needs torque. The mean of (H L² M)², with a memory of 0.25 s, is
        at least J₀² times that of a², J₀ being less than the inertia of the lightest thing that can
        be mounted. A gain of 0, a last bit that toggles, an axis that stays constant and torques
        that come a second late (for the first second of a motion) are below it. It holds for any
        motion, perturbed or imposed, while J₀ a is above what resolution and noise explain.

sign    While the perturbation runs, what the controller would do with it alone, without any
        torque, is known: J_c θ_p'' + B_c θ_p' = M_p. It has nothing to do with the subject. So
        (a_p, v_p, q_p) are instruments z for x = (a, v, q), and from one second of ticks

            (J, B, K) = (Σ z xᵀ)⁻¹ Σ z M

        Were the sign of M wrong, J and B would be negative. By chance they are in a fifth of all
        seconds in which a subject pushes, so they count only where both sides are known: the fit
        leaves less than 3 % of the torque's mean square, and the instruments alone less than 12 %
        of that of a. A relaxed joint leaves less than 2 % and 8 %. A subject who pushes as hard as
        the perturbation leaves more of the one, a stronger one more of the other: then nothing can
        be said, and nothing is. `benchmarks.false_alarms` counts how often something was.

Windows of one second begin every half second. A step takes the mean of a few ticks: a mean leaves
out what filters of 5 Hz would only alias, and costs a fraction of a step each tick. It only adds,
multiplies, divides and compares. The window is written in place: a state is used once.
"""

from __future__ import annotations

import math
from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.guard.causes import Cause
from rigidimeter.settings import Settings
from rigidimeter.units import rad_from_deg

FILTER_RAD_S = 2.0 * math.pi * 5.0
"""w: above voluntary motion, below the bandwidth of drive and sensors."""

SHOWN_MEMORY_S = 0.25
WINDOW_S = 1.0
MEAN_OF_S = 0.008
"""A step is of the mean over so long, or over a tick where that is longer."""

LONGEST_S = 0.06
"""However late a step comes, the filters go on by no more than this: they do not overshoot."""


FIT_LEAVES, INSTRUMENTS_LEAVE = 0.03, 0.12
"""Of the mean squares of torque and a, at most, where the sign is believed to be wrong."""

UNSHOWN_NM = 0.0003
"""A torque so small may hide in the sensor's noise."""

_NO_CAUSE = int(Cause.NONE)


class AnswerLimits(NamedTuple):
    """Controller and thresholds.

    `rate_per_s` is B_c/J_c of the controller. `half_steps` go into half a window. `inertia_kg_m2`
    is J₀; at 0 the size is not looked at. `unshown_nm` is the torque below which it is not.
    """

    rate_per_s: float = 0.0
    half_steps: int = 62
    inertia_kg_m2: float = 0.0
    unshown_nm: float = math.inf


Filtered = tuple[float, float, float, float]
"""A signal and what three equal low-passes in a row make of it."""

NOTHING_YET: Filtered = (math.nan, 0.0, 0.0, 0.0)
AT_REST: Filtered = (0.0, 0.0, 0.0, 0.0)


class AnswerState(NamedTuple):
    """What is remembered.

    `window` has a row of (a_p, v_p, q_p, a, v, q, M) for each step, the oldest of which is
    overwritten; `steps` counts those since the perturbation began. `torque`, `angle` and `alone`
    are M, θ and θ_p filtered. `alone_per_s` is θ_p', `perturbation_nm` what drove it last; θ_p is
    that of J_c = 1, as only ratios are used. `shown_nm2` and `moved2` are the means of the filtered
    M² and a².
    """

    window: NDArray[np.float64]
    torque: Filtered = NOTHING_YET
    angle: Filtered = NOTHING_YET
    alone: Filtered = AT_REST
    alone_per_s: float = 0.0
    perturbation_nm: float = 0.0
    shown_nm2: float = 0.0
    moved2: float = 0.0
    steps: int = 0


def mean_of_ticks(tick_rate_hz: float) -> int:
    """Return how many ticks a step is the mean of."""
    return max(round(MEAN_OF_S * tick_rate_hz), 1)


def answer_limits(settings: Settings) -> AnswerLimits:
    """Return the limits for the loop's tick."""
    rig, controller = settings.rig, settings.controller
    step_s = mean_of_ticks(rig.tick_rate_hz) / rig.tick_rate_hz
    inertia = settings.guard.least_inertia_kg_m2
    steps_rad_s2 = 2.0 * rad_from_deg(rig.motion.angle_resolution_deg) * FILTER_RAD_S**2
    return AnswerLimits(
        rate_per_s=controller.damping_nm_s_rad / controller.inertia_kg_m2,
        half_steps=round(0.5 * WINDOW_S / step_s),
        inertia_kg_m2=inertia,
        unshown_nm=UNSHOWN_NM + rig.torque.resolution_nm + inertia * steps_rad_s2,
    )


def answer_state(limits: AnswerLimits) -> AnswerState:
    """Return the state before the first tick."""
    return AnswerState(np.zeros((2 * limits.half_steps, 7)))


def answer_step(
    limits: AnswerLimits,
    state: AnswerState,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    elapsed_s: float,
) -> tuple[AnswerState, int]:
    """Take the means of a few ticks; return the state and a `Cause`, 0 if the torque answers.

    Parameters
    ----------
    limits : AnswerLimits
    state : AnswerState
    perturbation_nm : float
        What is added to the controller's torque; 0 where nothing perturbs.
    torque_nm, angle_rad : float
        The readings.
    elapsed_s : float
        The time that the means are of.
    """
    window, torque, angle, alone, alone_per_s, pushed_nm, shown, moved, steps = state
    if elapsed_s > LONGEST_S:
        elapsed_s = LONGEST_S
    w = FILTER_RAD_S
    half = 0.5 * w * elapsed_s
    blend = half / (1.0 + half)
    torque = lowpassed(blend, torque, torque_nm)
    angle = lowpassed(blend, angle, angle_rad)
    m = torque[2] - torque[3]
    value, once, twice, thrice = angle
    a = w * w * (value - 3.0 * (once - twice) - thrice)
    weight = elapsed_s / SHOWN_MEMORY_S
    shown += (m * m - shown) * weight
    moved += (a * a - moved) * weight
    cause = _NO_CAUSE
    needed = limits.inertia_kg_m2 * limits.inertia_kg_m2 * moved
    if needed > limits.unshown_nm * limits.unshown_nm and shown < needed:
        cause = int(Cause.TORQUE_SILENT)

    if perturbation_nm == 0.0:  # nothing perturbs: the next window begins with the next epoch
        alone, alone_per_s, pushed_nm, steps = AT_REST, 0.0, 0.0, 0
    else:
        # The controller alone, trapezoidal as the filters are, so that both are late by the same.
        drag = 0.5 * limits.rate_per_s * elapsed_s
        push = 0.5 * (pushed_nm + perturbation_nm) * elapsed_s
        before, pushed_nm = alone_per_s, perturbation_nm
        alone_per_s = (alone_per_s * (1.0 - drag) + push) / (1.0 + drag)
        alone = lowpassed(blend, alone, alone[0] + 0.5 * (before + alone_per_s) * elapsed_s)
        there, first, second, third = alone
        row = window[steps % window.shape[0]]
        row[0] = w * w * (there - 3.0 * (first - second) - third)
        row[1] = w * (first - 2.0 * second + third)
        row[2] = second - third
        row[3] = a
        row[4] = w * (once - 2.0 * twice + thrice)
        row[5] = twice - thrice
        row[6] = m
        steps += 1
        ended = steps >= window.shape[0] and steps % limits.half_steps == 0
        if ended and cause == _NO_CAUSE and sign_is_wrong(window):
            cause = int(Cause.TORQUE_SIGN)
    after = AnswerState(window, torque, angle, alone, alone_per_s, pushed_nm, shown, moved, steps)
    return after, cause


def lowpassed(blend: float, before: Filtered, value: float) -> Filtered:
    """Return the next step of three low-passes; trapezoidal, so that none adds a delay."""
    value_before, once_before, twice_before, thrice_before = before
    if isnan(value_before):
        return value, value, value, value
    kept = 1.0 - 2.0 * blend
    once = kept * once_before + blend * (value + value_before)
    twice = kept * twice_before + blend * (once + once_before)
    return value, once, twice, kept * thrice_before + blend * (twice + twice_before)


def sign_is_wrong(window: NDArray[np.float64]) -> bool:
    """Return whether a window shows the wrong sign, as far as it shows a joint at all."""
    j, b, _, torque_left, motion_left = fitted(window)
    if not (j < 0.0 and b < 0.0):
        return False
    return torque_left < FIT_LEAVES and motion_left < INSTRUMENTS_LEAVE


def fitted(window: NDArray[np.float64]) -> tuple[float, float, float, float, float]:
    """Return J, B, K and what fit and instruments leave of the mean squares of torque and a.

    A row of the window is (z, x, M). Where a square is nothing, its share is NaN.
    """
    s = (window[:, :, None] * window[:, None, :]).sum(axis=0)
    power, accelerated = s[6, 6], s[3, 3]
    j, b, k = solved(
        *(s[0, 3], s[0, 4], s[0, 5], s[1, 3], s[1, 4], s[1, 5], s[2, 3], s[2, 4], s[2, 5]),
        *(s[0, 6], s[1, 6], s[2, 6]),
    )
    square = j * j * accelerated + b * b * s[4, 4] + k * k * s[5, 5]
    square += 2.0 * (j * b * s[3, 4] + j * k * s[3, 5] + b * k * s[4, 5])
    left = power - 2.0 * (j * s[3, 6] + b * s[4, 6] + k * s[5, 6]) + square
    g1, g2, g3 = solved(
        *(s[0, 0], s[0, 1], s[0, 2], s[1, 0], s[1, 1], s[1, 2], s[2, 0], s[2, 1], s[2, 2]),
        *(s[0, 3], s[1, 3], s[2, 3]),
    )
    moved = accelerated - (g1 * s[0, 3] + g2 * s[1, 3] + g3 * s[2, 3])
    return (
        float(j),
        float(b),
        float(k),
        float(left / power) if power > 0.0 else math.nan,
        float(moved / accelerated) if accelerated > 0.0 else math.nan,
    )


def solved(
    a: float,
    b: float,
    c: float,
    d: float,
    e: float,
    f: float,
    g: float,
    h: float,
    i: float,
    p: float,
    q: float,
    r: float,
) -> tuple[float, float, float]:
    """Solve [[a b c] [d e f] [g h i]] x = (p, q, r) by Cramer's rule; zeros where none is."""
    determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    if not abs(determinant) > 0.0:
        return 0.0, 0.0, 0.0
    x = p * (e * i - f * h) - b * (q * i - f * r) + c * (q * h - e * r)
    y = a * (q * i - f * r) - p * (d * i - f * g) + c * (d * r - q * g)
    z = a * (e * r - q * h) - b * (d * r - q * g) + p * (d * h - e * g)
    return x / determinant, y / determinant, z / determinant
