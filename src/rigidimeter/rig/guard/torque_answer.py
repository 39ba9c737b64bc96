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

sign    While the perturbation runs, a row of the same signals, through one low-pass more, is kept
        every 16 ms or so, and every tenth of a second `torque_sign` looks at the last ones.

A step takes the mean of a few ticks: a mean leaves out what filters of 5 Hz would only alias, and
costs a fraction of a step each tick. Where ticks are late the missing steps are filled in, on a
line to the new mean, since the drive went on at its last velocity. Rows further apart would be
larger than the others, all columns alike, and few of them look like an answer to M_p.

It only adds, multiplies, divides and compares. The window is written in place: a state is used
once.
"""

from __future__ import annotations

import math
from math import isnan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import LONGEST_STEP, Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.guard.causes import Cause
from rigidimeter.rig.guard.torque_sign import BEFORE, COLUMNS, Left, max_left, sign_is_wrong

FILTER_RAD_S = 2.0 * math.pi * 5.0
"""w: above voluntary motion, below the bandwidth of drive and sensors."""

SHOWN_MEMORY_S = 0.25
MEAN_OF_S = 0.008
"""A step is of the mean over so long, or over a tick where that is longer."""

ROW_S = 0.016
"""A row of the window is kept after so long, or after a step where that is longer."""

LONGEST_S = 0.06
"""However late a step comes, the filters go on by no more than this: they do not overshoot."""

MAX_FILLED = 64
"""Half a second and more, of which the filters know nothing afterwards."""

ROWS = (24, 48, 96)
"""Of the windows. The shortest shows a relaxed joint, the longer ones a less plain answer."""

NOISE_ORDERS = (1, 2, 4)
"""Of each window: as many as leave enough of its rows."""

ROWS_A_TEST = 6

SETTLED = 0.75 * math.pi
"""A step of the command has an acceleration of its own sense until ζ ω t = π, with ω/2π the
drive's bandwidth and ζ its damping ratio. With ticks further apart than this, torques read at them
need not show the inertia."""

HARDLY_SHOWN = 0.3
"""The part of J₀ then asked of the torque: some acceleration is left in it, and some damping."""

UNSHOWN_NM = 0.0003
"""A torque so small may hide in the sensor's noise."""

_NO_CAUSE = int(Cause.NONE)


class AnswerLimits(NamedTuple):
    """Controller and thresholds.

    `rate_per_s` is B_c/J_c of the controller. `steps_a_row` steps make a row. `left` is what a
    joint may leave of each of the windows, `shows_inertia` whether torques read at the ticks do.
    `inertia_kg_m2` is J₀; at 0 the size is not looked at. `min_part` is the part of J₀ a that the
    torque must show, `unshown_nm` the J₀ a below which the size is not looked at. `step_s` is the
    time of a step, `controlled_s` the longest that the controller makes up for after a late tick.
    """

    rate_per_s: float = 0.0
    steps_a_row: int = 2
    left: tuple[Left, Left, Left] = (Left(), Left(), Left())
    shows_inertia: bool = True
    inertia_kg_m2: float = 0.0
    min_part: float = 1.0
    unshown_nm: float = math.inf
    step_s: float = math.inf
    controlled_s: float = math.inf


Filtered = tuple[float, float, float, float, float]
"""A signal and what four equal low-passes in a row make of it."""

NOTHING_YET: Filtered = (math.nan, 0.0, 0.0, 0.0, 0.0)
AT_REST: Filtered = (0.0, 0.0, 0.0, 0.0, 0.0)


class AnswerState(NamedTuple):
    """What is remembered.

    `window` has a row of (q_p, v_p, j, a, v, q, M) for each of the last moments, twice, so that
    the last ones are always in one piece; `steps` counts those since the perturbation began.
    `torque`, `angle` and `alone` are M, θ and θ_p filtered. `alone_per_s` is θ_p',
    `perturbation_nm` what drove it last; θ_p is that of J_c = 1, as its size does not matter.
    `shown_nm2` and `moved2` are the means of the filtered M² and a².
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
    decay_per_s = rig.drive_damping_ratio * 2.0 * math.pi * rig.drive_bandwidth_hz
    shows_inertia = decay_per_s <= SETTLED * rig.tick_rate_hz
    inertia = settings.guard.min_inertia_kg_m2
    steps_rad_s2 = 2.0 * rad_from_deg(rig.motion.angle_resolution_deg) * FILTER_RAD_S**2
    short, middle, long = map(max_left, ROWS, NOISE_ORDERS)
    return AnswerLimits(
        rate_per_s=controller.damping_nm_s_rad / controller.inertia_kg_m2,
        steps_a_row=max(round(ROW_S / step_s), 1),
        left=(short, middle, long),
        shows_inertia=shows_inertia,
        inertia_kg_m2=inertia,
        min_part=1.0 if shows_inertia else HARDLY_SHOWN,
        unshown_nm=UNSHOWN_NM + rig.torque.resolution_nm + inertia * steps_rad_s2,
        step_s=step_s,
        controlled_s=LONGEST_STEP / rig.tick_rate_hz,
    )


def answer_state() -> AnswerState:
    """Return the state before the first tick."""
    return AnswerState(np.zeros((2 * (ROWS[-1] + BEFORE), COLUMNS)))


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
    steps = int(min(elapsed_s / limits.step_s + 0.5, MAX_FILLED))
    if steps < 2 or isnan(state.angle[0]):
        return one_step(limits, state, perturbation_nm, torque_nm, angle_rad, elapsed_s, 1.0)
    before_nm, before_rad = state.torque[0], state.angle[0]
    controlled = min(limits.controlled_s / elapsed_s, 1.0)
    cause = _NO_CAUSE
    for k in range(1, steps + 1):
        part = k / steps
        state, found = one_step(
            limits,
            state,
            perturbation_nm,
            before_nm + part * (torque_nm - before_nm),
            before_rad + part * (angle_rad - before_rad),
            elapsed_s / steps,
            controlled,
        )
        if cause == _NO_CAUSE:
            cause = found
    return state, cause


def one_step(
    limits: AnswerLimits,
    state: AnswerState,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    elapsed_s: float,
    controlled: float,
) -> tuple[AnswerState, int]:
    """Take one step, for a part of which the controller went on; see `answer_step`."""
    window, torque, angle, alone, alone_per_s, pushed_nm, shown, moved, steps = state
    if elapsed_s > LONGEST_S:
        elapsed_s = LONGEST_S
    w = FILTER_RAD_S
    half = 0.5 * w * elapsed_s
    blend = half / (1.0 + half)
    torque = lowpassed(blend, torque, torque_nm)
    angle = lowpassed(blend, angle, angle_rad)
    m = torque[2] - torque[3]
    value, once, twice, thrice, _ = angle
    a = w * w * (value - 3.0 * (once - twice) - thrice)
    weight = elapsed_s / SHOWN_MEMORY_S
    shown += (m * m - shown) * weight
    moved += (a * a - moved) * weight
    cause = _NO_CAUSE
    needed = limits.inertia_kg_m2 * limits.inertia_kg_m2 * moved
    part = limits.min_part * limits.min_part
    if needed > limits.unshown_nm * limits.unshown_nm and shown < part * needed:
        cause = int(Cause.TORQUE_SILENT)

    if perturbation_nm == 0.0:  # nothing perturbs: the next window begins with the next epoch
        if steps > 0:
            window[:] = 0.0
        alone, alone_per_s, pushed_nm, steps = AT_REST, 0.0, 0.0, 0
    else:
        # The controller alone, trapezoidal as the filters are, so that both are late by the same.
        controlled_s = controlled * elapsed_s
        drag = 0.5 * limits.rate_per_s * controlled_s
        push = 0.5 * (pushed_nm + perturbation_nm) * controlled_s
        before, pushed_nm = alone_per_s, perturbation_nm
        alone_per_s = (alone_per_s * (1.0 - drag) + push) / (1.0 + drag)
        alone = lowpassed(blend, alone, alone[0] + 0.5 * (before + alone_per_s) * elapsed_s)
        steps += 1
        if steps % limits.steps_a_row == 0:
            rows = steps // limits.steps_a_row
            store_row(window, rows, torque, angle, alone)
            due = rows % ROWS_A_TEST == 0 and cause == _NO_CAUSE
            if due and a_window_shows_the_wrong_sign(limits, window, rows):
                cause = int(Cause.TORQUE_SIGN)
    after = AnswerState(window, torque, angle, alone, alone_per_s, pushed_nm, shown, moved, steps)
    return after, cause


def lowpassed(blend: float, before: Filtered, value: float) -> Filtered:
    """Return the next step of four low-passes; trapezoidal, so that none adds a delay."""
    value_before, once_before, twice_before, thrice_before, last_before = before
    if isnan(value_before):
        return value, value, value, value, value
    decay = 1.0 - 2.0 * blend
    once = decay * once_before + blend * (value + value_before)
    twice = decay * twice_before + blend * (once + once_before)
    thrice = decay * thrice_before + blend * (twice + twice_before)
    return value, once, twice, thrice, decay * last_before + blend * (thrice + thrice_before)


def store_row(
    window: NDArray[np.float64], rows: int, torque: Filtered, angle: Filtered, alone: Filtered
) -> None:
    """Write row number `rows` into the window, at its place in each half."""
    w = FILTER_RAD_S
    half = window.shape[0] // 2
    row = window[rows % half]
    _, _, twice, thrice, last = alone
    row[0] = thrice - last
    row[1] = w * (twice - 2.0 * thrice + last)
    value, once, twice, thrice, last = angle
    row[2] = w * w * w * (value - 4.0 * (once + thrice) + 6.0 * twice + last)
    row[3] = w * w * (once - 3.0 * (twice - thrice) - last)
    row[4] = w * (twice - 2.0 * thrice + last)
    row[5] = thrice - last
    row[6] = torque[3] - torque[4]
    window[rows % half + half] = row


def a_window_shows_the_wrong_sign(
    limits: AnswerLimits, window: NDArray[np.float64], rows: int
) -> bool:
    """Return whether one of the windows that end with row number `rows` shows the wrong sign."""
    half = window.shape[0] // 2
    end = rows % half + half + 1
    for which in range(len(ROWS)):
        first = end - ROWS[which] - BEFORE
        if rows >= ROWS[which] and sign_is_wrong(
            window[first:end], limits.shows_inertia, limits.left[which]
        ):
            return True
    return False
