"""Whether velocity, angle, torque and their stamps agree, by means of a few ticks.

velocity   The reported velocity v is the change of the angle θ between the stamps of the samples.
           Both are summed with a memory of W = 50 ms, which leaves out slow drift:

               p' = θ' − p/W        q' = v − q/W        d = p − q

           and squared with a memory of T = 0.3 s. With v reported as 0 the mean of d² is that of
           p², with its sign turned four times that, with a gain g (1 − g)² times; with v late by τ
           at ω it is 4 sin²(ωτ/2) times. It may be 0.375 of the mean of p² + q², which are alike
           where all is well: a velocity of 0 gives 1, a turned sign 2, a velocity late by 10 ms
           at 10 Hz 0.18. A gain of 2 gives 0.2, so that gains are asked for as well: that of v on
           θ, <p q>/<p²>, and that of θ on v, <p q>/<q²>, may be 1.5. A delay makes both smaller, by
           cos ωτ; a filter of v of first order makes the second 1, whatever the frequency. Neither
           ratio nor gain is looked at while d is below what resolution explains. Where the loop was
           late, v had the value before for an unknown part of the time and the value after for the
           rest: what agrees best with θ is taken. So it is where readings were old.

energy     As `watch` counts it, with the velocity from the angle, smoothed over 20 ms: a velocity
           of 0 hides nothing that goes to and fro.

freshness  The share of the time in which a reading was older than a sensor that keeps its rate
           lets it be, with a memory that one gap of `stale_s` does not fill.

answer     `torque_answer` is not asked about a mean with more old motion than that: at the torque's
           time the angle would be wrong by θ'' age²/2, and the torque would seem to answer another
           motion. The gap is filled in as one of the loop is. It cannot last: `freshness` ends it.

These laws need a tenth of a second and more to show, so `consistency` takes the mean of some ticks'
readings and stamps, and the means are looked at here: a mean of velocities over that of the stamps
is the change of the mean angle as well.
"""

from __future__ import annotations

import math
from math import isnan
from typing import NamedTuple

from rigidimeter.core.settings import MotionSensorSettings, Settings, TorqueSensorSettings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.rig.guard.causes import Cause
from rigidimeter.rig.guard.torque_answer import (
    AnswerLimits,
    AnswerState,
    answer_limits,
    answer_step,
    mean_of_ticks,
)
from rigidimeter.rig.guard.watch import energy_after

SUMMED_S = 0.05
"""W: how long a change of the angle is remembered."""

SQUARED_S = 0.3
"""T: how long the squares are."""

WRONG_SHARE = 0.375
"""Of the mean of p² + q²; p² and q² are alike where all is well."""

WRONG_GAIN = 1.5
"""Of the velocity on the change of the angle, or the other way round."""

UNSEEN_DEG = 0.1
"""Velocity and angle may disagree by so much within `SUMMED_S`, and by what resolution adds."""

SMOOTHED_S = 0.02
"""The velocity from the angle is smoothed over so long: the angle has steps."""

FEW_SAMPLES = 3.0
"""A reading older than so many sample intervals has missed some."""

MIN_OLD_S = 0.012
"""Whatever the rate: a network and an operating system delay single samples by so much."""

OLD_SHARE = 0.2
"""The most of the time in which a reading may be old."""

OLD_MEMORY_S, OLD_MEMORY_STALES = 0.5, 5.0
"""Of the share: one pause of `stale_s` then is at most 1 − e^(−1/5) = 0.18 of it."""

LATE = 1.5
"""Of the time of a mean: it holds a gap in which the velocity changed nobody knows when."""

WILD_RATE_HZ = 100.0
"""With fewer samples a second a stiff joint's torque goes and comes back between two of them."""

_SAME_STAMP_S = 1e-6


class ConsistencyLimits(NamedTuple):
    """What counts as disagreement, in SI units.

    `settle_s` is how long after the last command the joint may still move, `hold_rad` how far
    after that. The means are of `mean_of_ticks`. `unseen_rad` is how far velocity and angle may
    disagree within `SUMMED_S`; a reading that repeats itself while the joint goes farther at its
    velocity is old, and stale after `stale_s`. `torque_old_s` and `motion_old_s` are the ages above
    which a reading is old, `old_memory_s` the memory of their share. A torque sample that differs
    by `wild_nm` from those around it may be wild.
    """

    interval_s: float
    answer: AnswerLimits = AnswerLimits()
    mean_of_ticks: int = 8
    settle_s: float = 0.0
    hold_rad: float = math.inf
    stale_s: float = math.inf
    summed_s: float = SUMMED_S
    unseen_rad: float = math.inf
    energy_j: float = math.inf
    torque_old_s: float = math.inf
    motion_old_s: float = math.inf
    old_memory_s: float = OLD_MEMORY_S
    wild_nm: float = math.inf


class MeansState(NamedTuple):
    """What is remembered from one mean of a few ticks to the next.

    `angle_rad` and `velocity_rad_s` are the last means (NaN before the first), `since_s` the time
    from their stamps to the end of their ticks. `moved_rad` and `reported_rad` are p and q,
    `disagreement_rad2`, `moved_rad2` and `reported_rad2` the means of d², p² and q². `pace_rad_s`
    is the velocity from the angle, `energy_j` what goes to and fro at it. `torque_old` and
    `motion_old` are shares of time, `unanswered_s` is the time since `torque_answer` was asked.
    """

    answer: AnswerState
    angle_rad: float = math.nan
    velocity_rad_s: float = 0.0
    since_s: float = 0.0
    moved_rad: float = 0.0
    reported_rad: float = 0.0
    disagreement_rad2: float = 0.0
    moved_rad2: float = 0.0
    reported_rad2: float = 0.0
    pace_rad_s: float = 0.0
    energy_j: float = 0.0
    torque_old: float = 0.0
    motion_old: float = 0.0
    unanswered_s: float = 0.0


def consistency_limits(settings: Settings) -> ConsistencyLimits:
    """Return the limits for the loop's tick."""
    guard, rig = settings.guard, settings.rig
    interval_s = 1.0 / rig.tick_rate_hz
    summed_s = max(SUMMED_S, FEW_SAMPLES / rig.motion.rate_hz)
    unseen_deg = UNSEEN_DEG + 2.0 * rig.motion.angle_resolution_deg
    unseen_deg += summed_s * rig.motion.velocity_resolution_deg_s

    samples_hz = min(rig.torque.rate_hz, rig.tick_rate_hz)  # those that the loop has

    def old_s(sensor: TorqueSensorSettings | MotionSensorSettings) -> float:
        sample_s = 1.0 / sensor.rate_hz + sensor.jitter_s  # no sensor is faster than the loop
        return sensor.latency_s + max(FEW_SAMPLES * sample_s, MIN_OLD_S)

    return ConsistencyLimits(
        interval_s=interval_s,
        answer=answer_limits(settings),
        mean_of_ticks=mean_of_ticks(rig.tick_rate_hz),
        settle_s=2.0 * guard.reaction_time_s,
        hold_rad=rad_from_deg(guard.hold_limit_deg + rig.motion.angle_resolution_deg),
        stale_s=guard.stale_s,
        summed_s=summed_s,
        unseen_rad=rad_from_deg(unseen_deg),
        energy_j=guard.energy_limit_j,
        torque_old_s=old_s(rig.torque),
        motion_old_s=old_s(rig.motion),
        old_memory_s=max(OLD_MEMORY_S, OLD_MEMORY_STALES * guard.stale_s),
        wild_nm=0.5 * guard.torque_limit_nm if samples_hz >= WILD_RATE_HZ else math.inf,
    )


def means_step(
    limits: ConsistencyLimits,
    state: MeansState,
    perturbation_nm: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    stamp_s: float,
    torque_old_share: float,
    motion_old_share: float,
    elapsed_s: float,
    before_s: float,
) -> tuple[MeansState, int]:
    """Look at the means of the ticks since the last ones; return the state and a `Cause`.

    Parameters
    ----------
    limits : ConsistencyLimits
    state : MeansState
    perturbation_nm, torque_nm, angle_rad, velocity_rad_s : float
        The means; a perturbation of 0 where not every tick was perturbed.
    stamp_s : float
        Of angle and velocity, from the end of the last ticks on.
    torque_old_share, motion_old_share : float
        Of these ticks, those in which a reading was old.
    elapsed_s : float
        The time of the ticks.
    before_s : float
        How long before the torque the motion was taken. The joint has gone on since.
    """
    answer, before, speed_before, since_s, moved, reported = state[:6]
    disagreement, moved2, reported2, pace, energy, torque_old, motion_old, unanswered_s = state[6:]
    forgotten = min(elapsed_s / limits.old_memory_s, 1.0)
    torque_old += (torque_old_share - torque_old) * forgotten
    motion_old += (motion_old_share - motion_old) * forgotten

    passed_s = since_s + stamp_s
    if isnan(before):
        before, speed_before, since_s = angle_rad, velocity_rad_s, elapsed_s - stamp_s
    elif passed_s > _SAME_STAMP_S:
        remembered = max(1.0 - passed_s / limits.summed_s, 0.0)
        change = angle_rad - before
        moved = moved * remembered + change
        by_velocity = 0.5 * (speed_before + velocity_rad_s) * passed_s
        if elapsed_s > LATE * limits.mean_of_ticks * limits.interval_s or unanswered_s > 0.0:
            one, other = speed_before * passed_s, velocity_rad_s * passed_s
            by_velocity = min(max(change, min(one, other)), max(one, other))
        reported = reported * remembered + by_velocity
        weight = min(passed_s / SQUARED_S, 1.0)
        difference = moved - reported
        disagreement += (difference * difference - disagreement) * weight
        moved2 += (moved * moved - moved2) * weight
        reported2 += (reported * reported - reported2) * weight
        pace += (change - pace * passed_s) / max(passed_s, SMOOTHED_S)
        before, speed_before, since_s = angle_rad, velocity_rad_s, elapsed_s - stamp_s
    else:
        since_s += elapsed_s
    energy = energy_after(energy, torque_nm * pace, elapsed_s)
    unanswered_s += elapsed_s
    cause = int(Cause.NONE)
    if motion_old_share <= OLD_SHARE:
        angle_then_rad = angle_rad + velocity_rad_s * before_s
        answer, cause = answer_step(
            limits.answer, answer, perturbation_nm, torque_nm, angle_then_rad, unanswered_s
        )
        unanswered_s = 0.0

    # The first law that is broken is named; a number that is none breaks no law.
    if torque_old > OLD_SHARE or motion_old > OLD_SHARE:
        cause = int(Cause.SELDOM_FRESH)
    if energy > limits.energy_j:
        cause = int(Cause.ENERGY_HIGH)
    if disagreement > limits.unseen_rad * limits.unseen_rad:
        both = moved2 + reported2
        in_common = 0.5 * (both - disagreement)  # the mean of p q
        if disagreement > WRONG_SHARE * both or in_common > WRONG_GAIN * min(moved2, reported2):
            cause = int(Cause.VELOCITY_WRONG)
    after = MeansState(
        answer,
        before,
        speed_before,
        since_s,
        moved,
        reported,
        disagreement,
        moved2,
        reported2,
        pace,
        energy,
        torque_old,
        motion_old,
        unanswered_s,
    )
    return after, cause


def larger_gain(means: MeansState) -> float:
    """Return the gain of velocity and change of the angle, the larger on the smaller.

    Infinite where one of them is 0.
    """
    in_common = 0.5 * (means.moved_rad2 + means.reported_rad2 - means.disagreement_rad2)
    smaller = min(means.moved_rad2, means.reported_rad2)
    return in_common / smaller if smaller > 0.0 else math.inf
