"""Whether the readings agree with each other and with what was sent.

`watch` looks at one tick; what is here needs time to show. Each law has its own memory. That the
torque answers the motion is `torque_answer`'s; the others are:

rest       While zero is commanded the angle stays where it was, to `hold_rad`, from `settle_s`
           after the last command on: twice the reaction time, after which a drive of second order
           still moves by a hundredth of what it covers in that time.

velocity   The reported velocity v is the change of the angle θ between the stamps of the samples.
           Both are summed with a memory of W = 50 ms, which leaves out slow drift:

               p' = θ' − p/W        q' = v − q/W        d = p − q

           and squared with a memory of T = 0.3 s. With v reported as 0 the mean of d² is that of
           p², with its sign turned four times that, with a gain g (1 − g)² times; with v late by τ
           at ω it is 4 sin²(ωτ/2) times. It may be 0.375 of the mean of p² + q², which are alike
           where all is well: a velocity of 0 gives 1, a turned sign 2, a velocity late by 10 ms
           at 10 Hz 0.18. No ratio is looked at while d is below what resolution explains.

energy     As `watch` counts it, with the velocity from the angle, smoothed over 20 ms: a velocity
           of 0 hides nothing that goes to and fro.

freshness  The share of the time in which a reading was older than a sensor that keeps its rate
           lets it be, with a memory that one gap of `stale_s` does not fill.

Like the control steps, a step only adds, multiplies, compares and takes square roots. It knows
nothing of the controller. The compiled batch does not take it: its drive and sensors are right by
construction, so that nothing can be found.
"""

from __future__ import annotations

import math
from math import isfinite, isnan
from typing import NamedTuple

from rigidimeter.guard.causes import Cause
from rigidimeter.guard.torque_answer import (
    AnswerLimits,
    AnswerState,
    answer_limits,
    answer_state,
    answer_step,
)
from rigidimeter.guard.watch import energy_after
from rigidimeter.settings import MotionSensorSettings, Settings, TorqueSensorSettings
from rigidimeter.units import rad_from_deg

SUMMED_S = 0.05
"""W: how long a change of the angle is remembered."""

SQUARED_S = 0.3
"""T: how long the squares are."""

WRONG_SHARE = 0.375
"""Of the mean of p² + q²; p² and q² are alike where all is well."""

UNSEEN_DEG = 0.1
"""Velocity and angle may disagree by so much within `SUMMED_S`, and by what resolution adds."""

SMOOTHED_S = 0.02
"""The velocity from the angle is smoothed over so long: the angle has steps."""

FEW_SAMPLES = 3.0
"""A reading older than so many sample intervals has missed some."""

LEAST_OLD_S = 0.012
"""Whatever the rate: a network and an operating system delay single samples by so much."""

OLD_SHARE = 0.2
"""The most of the time in which a reading may be old."""

OLD_MEMORY_S, OLD_MEMORY_STALES = 0.5, 5.0
"""Of the share: one pause of `stale_s` then is at most 1 − e^(−1/5) = 0.18 of it."""

_SAME_STAMP_S = 1e-6
_NO_CAUSE = int(Cause.NONE)


class ConsistencyLimits(NamedTuple):
    """What counts as disagreement, in SI units.

    `settle_s` is how long after the last command the joint may still move, `hold_rad` how far
    after that. `unseen_rad` is how far velocity and angle may disagree within `SUMMED_S`.
    `torque_old_s` and `motion_old_s` are the ages above which a reading is old, `old_memory_s` the
    memory of their share.
    """

    interval_s: float
    answer: AnswerLimits
    settle_s: float = 0.0
    hold_rad: float = math.inf
    summed_s: float = SUMMED_S
    unseen_rad: float = math.inf
    energy_j: float = math.inf
    torque_old_s: float = math.inf
    motion_old_s: float = math.inf
    old_memory_s: float = OLD_MEMORY_S


class ConsistencyState(NamedTuple):
    """What is remembered.

    `still_s` is how long zero has been commanded, `held_rad` where the joint was when it had
    settled (NaN before). `angle_rad` and `velocity_rad_s` are the last sample (NaN before the
    first), `age_s` how old it was at the last tick. `moved_rad` and `reported_rad` are p and q,
    `apart_rad2` and `both_rad2` the means of d² and p² + q². `pace_rad_s` is the velocity from the
    angle, `energy_j` what goes to and fro at it. `torque_old` and `motion_old` are shares of time.
    """

    answer: AnswerState
    still_s: float = 0.0
    held_rad: float = math.nan
    angle_rad: float = math.nan
    velocity_rad_s: float = 0.0
    age_s: float = 0.0
    moved_rad: float = 0.0
    reported_rad: float = 0.0
    apart_rad2: float = 0.0
    both_rad2: float = 0.0
    pace_rad_s: float = 0.0
    energy_j: float = 0.0
    torque_old: float = 0.0
    motion_old: float = 0.0


def consistency_state() -> ConsistencyState:
    """Return the state before the first tick."""
    return ConsistencyState(answer_state())


def consistency_limits(settings: Settings) -> ConsistencyLimits:
    """Return the limits for the loop's tick."""
    guard, rig = settings.guard, settings.rig
    interval_s = 1.0 / rig.tick_rate_hz
    summed_s = max(SUMMED_S, FEW_SAMPLES * interval_s, FEW_SAMPLES / rig.motion.rate_hz)
    unseen_deg = UNSEEN_DEG + 2.0 * rig.motion.angle_resolution_deg
    unseen_deg += summed_s * rig.motion.velocity_resolution_deg_s

    def old_s(sensor: TorqueSensorSettings | MotionSensorSettings) -> float:
        apart_s = max(1.0 / sensor.rate_hz, interval_s) + sensor.jitter_s
        return sensor.latency_s + max(FEW_SAMPLES * apart_s, LEAST_OLD_S)

    return ConsistencyLimits(
        interval_s=interval_s,
        answer=answer_limits(settings),
        settle_s=2.0 * guard.reaction_time_s,
        hold_rad=rad_from_deg(guard.hold_limit_deg + rig.motion.angle_resolution_deg),
        summed_s=summed_s,
        unseen_rad=rad_from_deg(unseen_deg),
        energy_j=guard.energy_limit_j,
        torque_old_s=old_s(rig.torque),
        motion_old_s=old_s(rig.motion),
        old_memory_s=max(OLD_MEMORY_S, OLD_MEMORY_STALES * guard.stale_s),
    )


def consistency_step(
    limits: ConsistencyLimits,
    state: ConsistencyState,
    sent_rad_s: float,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    age_s: float,
    torque_age_s: float,
    elapsed_ticks: int = 1,
) -> tuple[ConsistencyState, int]:
    """Look at one tick; return the state after it and a `Cause`, 0 if all agrees.

    Parameters
    ----------
    limits : ConsistencyLimits
    state : ConsistencyState
    sent_rad_s : float
        The command in force since the tick before.
    perturbation_nm : float
        Of this tick; 0 where nothing perturbs.
    torque_nm, angle_rad, velocity_rad_s : float
        The newest readings. One that is not finite is left out: `watch` names it.
    age_s, torque_age_s : float
        How long ago the motion and the torque reading were taken.
    elapsed_ticks : int
        Ticks since the step before.
    """
    answer, still_s, held, before, speed_before, age_before, moved, reported = state[:8]
    apart, both, pace, energy, torque_old, motion_old = state[8:]
    elapsed_s = max(elapsed_ticks, 1) * limits.interval_s
    forgotten = min(elapsed_s / limits.old_memory_s, 1.0)
    torque_old += ((torque_age_s > limits.torque_old_s) - torque_old) * forgotten
    motion_old += ((age_s > limits.motion_old_s) - motion_old) * forgotten

    still_s = still_s + elapsed_s if sent_rad_s == 0.0 else 0.0
    age_before += elapsed_s
    if isfinite(angle_rad) and isfinite(velocity_rad_s) and isfinite(age_s):
        if still_s <= limits.settle_s + max(age_s, 0.0):
            held = math.nan
        elif isnan(held):
            held = angle_rad
        passed_s = age_before - age_s
        if isnan(before):
            before, speed_before, age_before = angle_rad, velocity_rad_s, age_s
        elif passed_s > _SAME_STAMP_S:
            kept = max(1.0 - passed_s / limits.summed_s, 0.0)
            change = angle_rad - before
            moved = moved * kept + change
            reported = reported * kept + 0.5 * (speed_before + velocity_rad_s) * passed_s
            weight = min(passed_s / SQUARED_S, 1.0)
            difference = moved - reported
            apart += (difference * difference - apart) * weight
            both += (moved * moved + reported * reported - both) * weight
            pace += (change - pace * passed_s) / max(passed_s, SMOOTHED_S)
            before, speed_before, age_before = angle_rad, velocity_rad_s, age_s
    energy = energy_after(energy, torque_nm * pace if isfinite(torque_nm) else 0.0, elapsed_s)

    answer, unanswered = answer_step(
        limits.answer, answer, perturbation_nm, torque_nm, angle_rad, elapsed_ticks
    )
    after = ConsistencyState(
        answer,
        still_s,
        held,
        before,
        speed_before,
        age_before,
        moved,
        reported,
        apart,
        both,
        pace,
        energy,
        torque_old,
        motion_old,
    )
    found = _found(limits, after)
    return after, found if found != _NO_CAUSE else unanswered


def _found(limits: ConsistencyLimits, state: ConsistencyState) -> int:
    """Return the `Cause` of the first law that is broken; a NaN breaks none."""
    if abs(state.angle_rad - state.held_rad) > limits.hold_rad:
        return int(Cause.MOVED_AT_REST)
    unseen = limits.unseen_rad * limits.unseen_rad
    if state.apart_rad2 > unseen and state.apart_rad2 > WRONG_SHARE * state.both_rad2:
        return int(Cause.VELOCITY_WRONG)
    if state.energy_j > limits.energy_j:
        return int(Cause.ENERGY_HIGH)
    if max(state.torque_old, state.motion_old) > OLD_SHARE:
        return int(Cause.SELDOM_FRESH)
    return _NO_CAUSE
