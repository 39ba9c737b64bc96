"""Whether the readings agree with each other and with what was sent.

`watch` looks at one tick; what is here needs time to show. Each law has its own memory. That the
torque answers the motion is `torque_answer`'s, that velocity and stamps are right `agreement`'s.
Both take the mean of a few ticks, which are added up here. The law of every tick is

rest       While zero is commanded the angle stays where it was, to `hold_rad`, from `settle_s`
           after the last command on: twice the reaction time, after which a drive of second order
           still moves by a hundredth of what it covers in that time.

repeated   An angle that stays the same while the velocity beside it stays the same and is not 0 is
           impossible: after the time t the joint is v t farther on. Where that is more than the
           two may disagree, the reading is as old as its first repetition, whatever its stamp.
           Where zero is commanded the angle may be right: `agreement` then names the velocity.

wild       Single torque samples are far from those around them: `wild_torque`.

Like the control steps, a step only adds, multiplies, divides and compares. It knows nothing of the
controller. The compiled batch does not take it: its drive and sensors are right by construction,
so that nothing can be found.
"""

from __future__ import annotations

import math
from math import isnan
from typing import NamedTuple

from rigidimeter.rig.guard.agreement import ConsistencyLimits, MeansState, means_step
from rigidimeter.rig.guard.causes import Cause
from rigidimeter.rig.guard.torque_answer import answer_state
from rigidimeter.rig.guard.wild_torque import WildState, wild_step

_NO_CAUSE = int(Cause.NONE)


class ConsistencyState(NamedTuple):
    """What is remembered from tick to tick.

    `still_s` is how long zero has been commanded, `held_rad` where the joint was when it had
    settled (NaN before), `same_s` how long angle and velocity have been `read_rad` and
    `read_rad_s`. The others are of the ticks since the last mean: how many passed, in how many of
    them the readings were old, how many were read and perturbed; sums of what was read, the stamps
    from the last mean on, and by how much the motion was taken before the torque. `wild` is of the
    single torque samples.
    """

    means: MeansState
    still_s: float = 0.0
    held_rad: float = math.nan
    read_rad: float = math.nan
    read_rad_s: float = math.nan
    same_s: float = 0.0
    ticks: int = 0
    torque_old_ticks: int = 0
    motion_old_ticks: int = 0
    readings: int = 0
    perturbed: int = 0
    perturbation_nm: float = 0.0
    torque_nm: float = 0.0
    angle_rad: float = 0.0
    velocity_rad_s: float = 0.0
    stamp_s: float = 0.0
    before_s: float = 0.0
    wild: WildState = WildState()


def consistency_state(limits: ConsistencyLimits) -> ConsistencyState:
    """Return the state before the first tick, which is a mean of its own: the filters begin there.

    A joint that moves at once would else be taken for one that was at rest where it then is.
    """
    means = MeansState(answer_state())
    return ConsistencyState(means, ticks=limits.mean_of_ticks - 1)


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
    unlike = _NO_CAUSE
    if elapsed_ticks > limits.mean_of_ticks and state.readings > 0:
        state, unlike = ended(limits, state)  # the gap is no part of a mean with what was before
    means, still_s, held, read_rad, read_rad_s, same_s = state[:6]
    ticks, torque_old, motion_old, readings, perturbed = state[6:11]
    perturbation, torque, angle, velocity, stamp_s, before_s = state[11:17]
    if elapsed_ticks < 1:
        elapsed_ticks = 1
    elapsed_s = elapsed_ticks * limits.interval_s
    wild, of_sample = wild_step(state.wild, limits.wild_nm, torque_nm, torque_age_s, elapsed_s)
    found = _NO_CAUSE
    if angle_rad != read_rad or velocity_rad_s != read_rad_s:
        read_rad, read_rad_s, same_s = angle_rad, velocity_rad_s, 0.0
    else:
        same_s += elapsed_ticks * limits.interval_s
        far = abs(velocity_rad_s) * same_s > limits.unseen_rad
        if far and sent_rad_s != 0.0 and same_s > age_s:
            age_s = same_s
            if same_s > limits.stale_s:
                found = int(Cause.MOTION_STALE)
    ticks += elapsed_ticks
    if torque_age_s > limits.torque_old_s:
        torque_old += elapsed_ticks
    if age_s > limits.motion_old_s:
        motion_old += elapsed_ticks
    still_s = still_s + elapsed_ticks * limits.interval_s if sent_rad_s == 0.0 else 0.0
    one_sum = perturbation_nm + torque_nm + angle_rad + velocity_rad_s + age_s + torque_age_s
    if one_sum - one_sum == 0.0:  # not so where one of them is infinite or no number
        if still_s <= limits.settle_s + max(age_s, 0.0):
            held = math.nan
        elif isnan(held):
            held = angle_rad
        elif abs(angle_rad - held) > limits.hold_rad:
            found = int(Cause.MOVED_AT_REST)
        readings += 1
        if perturbation_nm != 0.0:
            perturbed += 1
            perturbation += perturbation_nm
        torque += torque_nm
        angle += angle_rad
        velocity += velocity_rad_s
        stamp_s += ticks * limits.interval_s - age_s
        before_s += age_s - torque_age_s
    after = ConsistencyState(
        means,
        still_s,
        held,
        read_rad,
        read_rad_s,
        same_s,
        ticks,
        torque_old,
        motion_old,
        readings,
        perturbed,
        perturbation,
        torque,
        angle,
        velocity,
        stamp_s,
        before_s,
        wild,
    )
    if ticks >= limits.mean_of_ticks and readings > 0:
        after, of_this = ended(limits, after)
        if unlike == _NO_CAUSE:
            unlike = of_this
    if unlike == _NO_CAUSE:
        unlike = of_sample
    return after, found if found != _NO_CAUSE else unlike


def ended(limits: ConsistencyLimits, state: ConsistencyState) -> tuple[ConsistencyState, int]:
    """Look at the mean of the ticks since the last one; return the state and a `Cause`."""
    means, still_s, held, read_rad, read_rad_s, same_s = state[:6]
    ticks, torque_old, motion_old, readings, perturbed = state[6:11]
    share = 1.0 / readings
    means, cause = means_step(
        limits,
        means,
        state.perturbation_nm * share if perturbed == readings else 0.0,
        state.torque_nm * share,
        state.angle_rad * share,
        state.velocity_rad_s * share,
        state.stamp_s * share,
        torque_old / ticks,
        motion_old / ticks,
        ticks * limits.interval_s,
        state.before_s * share,
    )
    same = means, still_s, held, read_rad, read_rad_s, same_s
    # Every field: the compiler of `benchmarks.false_alarms` knows no defaults.
    sums = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return ConsistencyState(*same, 0, 0, 0, 0, 0, *sums, state.wild), cause
