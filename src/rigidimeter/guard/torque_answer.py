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

Windows of one second begin every half second. A step only adds, multiplies, compares and takes
square roots; sums are written in place: a state is used once.
"""

from __future__ import annotations

import math
from math import isfinite, isnan
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
SUMMED_EVERY_S = 0.004

FIT_LEAVES, INSTRUMENTS_LEAVE = 0.03, 0.12
"""Of the mean squares of torque and a, at most, where the sign is believed to be wrong."""

UNSHOWN_NM = 0.0003
"""A torque so small may hide in the sensor's noise."""


class AnswerLimits(NamedTuple):
    """Filter, controller and thresholds.

    `blend` is the coefficient of a low-pass step, `decay` and `gain` those of the admittance for
    the perturbation alone. `summed_ticks` go between two entries of the sums, `half_entries` in
    half a window. `inertia_kg_m2` is J₀; at 0 the size is not looked at. `unshown_nm` is the torque
    below which it is not.
    """

    interval_s: float
    blend: float = 0.5
    decay: float = 1.0
    gain: float = 0.0
    summed_ticks: int = 4
    half_entries: int = 125
    inertia_kg_m2: float = 0.0
    unshown_nm: float = math.inf


class Filtered(NamedTuple):
    """A signal and what three equal low-passes in a row make of it; NaN before the first value."""

    value: float = math.nan
    once: float = 0.0
    twice: float = 0.0
    thrice: float = 0.0


class AnswerState(NamedTuple):
    """What is remembered.

    `torque`, `angle` and `alone` are M, θ and θ_p filtered; `alone_rad_s` is θ_p'. `shown_nm2` and
    `moved2` are the means of the filtered M² and a². `sums` has three rows of 28 sums of products:
    the half window that fills, the one before it, and both. `ticks` and `entries` count what is in
    the row that fills, `halves` how many have been filled.
    """

    sums: NDArray[np.float64]
    torque: Filtered = Filtered()
    angle: Filtered = Filtered()
    alone: Filtered = Filtered()
    alone_rad_s: float = 0.0
    shown_nm2: float = 0.0
    moved2: float = 0.0
    ticks: int = 0
    entries: int = 0
    halves: int = 0


def answer_limits(settings: Settings) -> AnswerLimits:
    """Return the limits for the loop's tick."""
    rig, controller = settings.rig, settings.controller
    interval_s = 1.0 / rig.tick_rate_hz
    half = 0.5 * FILTER_RAD_S * interval_s
    rate = controller.damping_nm_s_rad / controller.inertia_kg_m2
    decay = math.exp(-rate * interval_s)
    summed_ticks = max(round(SUMMED_EVERY_S / interval_s), 1)
    inertia = settings.guard.least_inertia_kg_m2
    steps_rad_s2 = 2.0 * rad_from_deg(rig.motion.angle_resolution_deg) * FILTER_RAD_S**2
    return AnswerLimits(
        interval_s=interval_s,
        blend=half / (1.0 + half),
        decay=decay,
        gain=(1.0 - decay) / controller.damping_nm_s_rad
        if rate
        else interval_s / controller.inertia_kg_m2,
        summed_ticks=summed_ticks,
        half_entries=max(round(0.5 * WINDOW_S / (summed_ticks * interval_s)), 1),
        inertia_kg_m2=inertia,
        unshown_nm=UNSHOWN_NM + rig.torque.resolution_nm + inertia * steps_rad_s2,
    )


def answer_state() -> AnswerState:
    """Return the state before the first tick."""
    return AnswerState(np.zeros((3, 28)))


def answer_step(
    limits: AnswerLimits,
    state: AnswerState,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    elapsed_ticks: int = 1,
) -> tuple[AnswerState, int]:
    """Look at one tick; return the state after it and a `Cause`, 0 if the torque answers.

    Parameters
    ----------
    limits : AnswerLimits
    state : AnswerState
    perturbation_nm : float
        What is added to the controller's torque at this tick; 0 where nothing perturbs.
    torque_nm, angle_rad : float
        The newest readings. A tick with one that is not finite is left out.
    elapsed_ticks : int
        Ticks since the step before.
    """
    if not (isfinite(torque_nm) and isfinite(angle_rad) and isfinite(perturbation_nm)):
        return state, int(Cause.NONE)
    sums, torque, angle, alone, alone_rad_s, shown, moved, ticks, entries, halves = state
    blend = limits.blend
    torque = lowpassed(blend, torque, torque_nm)
    angle = lowpassed(blend, angle, angle_rad)
    w = FILTER_RAD_S
    answer = torque.twice - torque.thrice
    a = w * w * (angle.value - 3.0 * angle.once + 3.0 * angle.twice - angle.thrice)
    weight = min(max(elapsed_ticks, 1) * limits.interval_s / SHOWN_MEMORY_S, 1.0)
    shown += (answer * answer - shown) * weight
    moved += (a * a - moved) * weight
    cause = int(Cause.NONE)
    needed = limits.inertia_kg_m2 * limits.inertia_kg_m2 * moved
    if needed > limits.unshown_nm * limits.unshown_nm and shown < needed:
        cause = int(Cause.TORQUE_SILENT)

    if perturbation_nm == 0.0:  # nothing perturbs: the next window begins with the next epoch
        alone, alone_rad_s = Filtered(math.nan, 0.0, 0.0, 0.0), 0.0
        ticks = entries = halves = 0
    else:
        for _ in range(min(max(elapsed_ticks, 1), _LONGEST_STEP)):
            alone_rad_s = limits.decay * alone_rad_s + limits.gain * perturbation_nm
        before = 0.0 if isnan(alone.value) else alone.value
        alone = lowpassed(blend, alone, before + alone_rad_s * limits.interval_s)
        ticks += 1
        if ticks >= limits.summed_ticks:
            ticks = 0
            v = w * (angle.once - 2.0 * angle.twice + angle.thrice)
            z1 = w * w * (alone.value - 3.0 * alone.once + 3.0 * alone.twice - alone.thrice)
            z2 = w * (alone.once - 2.0 * alone.twice + alone.thrice)
            z3 = alone.twice - alone.thrice
            add_products(sums, entries == 0, z1, z2, z3, a, v, angle.twice - angle.thrice, answer)
            entries += 1
            if entries >= limits.half_entries:
                entries = 0
                halves = min(halves + 1, 2)
                if closed(sums) and halves == 2 and cause == int(Cause.NONE):
                    cause = int(Cause.TORQUE_SIGN)
    after = AnswerState(
        sums, torque, angle, alone, alone_rad_s, shown, moved, ticks, entries, halves
    )
    return after, cause


_LONGEST_STEP = 5
"""In ticks, however many were missed: as far as the controller itself steps."""


def lowpassed(blend: float, before: Filtered, value: float) -> Filtered:
    """Return the next step of three low-passes; trapezoidal, so that none adds a delay."""
    if isnan(before.value):
        return Filtered(value, value, value, value)
    kept = 1.0 - 2.0 * blend
    once = kept * before.once + blend * (value + before.value)
    twice = kept * before.twice + blend * (once + before.once)
    thrice = kept * before.thrice + blend * (twice + before.twice)
    return Filtered(value, once, twice, thrice)


def add_products(
    sums: NDArray[np.float64],
    first: bool,
    z1: float,
    z2: float,
    z3: float,
    a: float,
    v: float,
    q: float,
    m: float,
) -> None:
    """Add the products of instruments z, regressors (a, v, q) and torque m to the first row.

    The order: z xᵀ by rows, z m, the upper half of z zᵀ and of x xᵀ, x m, m². Each row of z and x
    is scaled as it is; only ratios are used.
    """
    products = (
        *(z1 * a, z1 * v, z1 * q, z2 * a, z2 * v, z2 * q, z3 * a, z3 * v, z3 * q),
        *(z1 * m, z2 * m, z3 * m),
        *(z1 * z1, z1 * z2, z1 * z3, z2 * z2, z2 * z3, z3 * z3),
        *(a * a, a * v, a * q, v * v, v * q, q * q),
        *(a * m, v * m, q * m, m * m),
    )
    for k in range(28):
        sums[0, k] = products[k] if first else sums[0, k] + products[k]


def closed(sums: NDArray[np.float64]) -> bool:
    """End a half window; return whether the window of the last two shows the wrong sign."""
    for n in range(28):
        sums[2, n] = sums[0, n] + sums[1, n]
        sums[1, n] = sums[0, n]
    s = sums[2]
    power = s[27]
    j, b, k = solved(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])
    if not (j < 0.0 and b < 0.0):
        return False
    square = j * j * s[18] + b * b * s[21] + k * k * s[23]
    square += 2.0 * (j * b * s[19] + j * k * s[20] + b * k * s[22])
    left = power - 2.0 * (j * s[24] + b * s[25] + k * s[26]) + square
    g1, g2, g3 = solved(
        s[12], s[13], s[14], s[13], s[15], s[16], s[14], s[16], s[17], s[0], s[3], s[6]
    )
    moved = s[18] - (g1 * s[0] + g2 * s[3] + g3 * s[6])
    return bool(left < FIT_LEAVES * power and moved < INSTRUMENTS_LEAVE * s[18])


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
