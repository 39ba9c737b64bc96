"""The last word before the wire: limits on the command, and a latch.

The guard knows nothing of the controller. Whatever velocity is asked for, it sends one that

- is finite,
- changes by at most a·Δt a step, also when the step comes late; only a ramp to zero that has begun
  makes up for late steps, `LONGEST_BRAKING` of them at once,
- is at most the speed limit,
- lets the joint stop before the position limit: v ≤ √(2 a d), less what is covered until the next
  step, with d the distance left. That step may come late by `gap_s`.
- where the speed of arrival u is bounded, lets it be no faster than u where it begins to stop at a,
  at d = u T + u²/(2a): beyond, v T + v²/(2b) ≤ d + (1/b − 1/a) u²/2, with b a tenth of a.

The distance left is not counted from the last reading, which is old and does not show what the
drive has been told but has not done yet. It is counted from the farthest point at which the joint
could come to rest if the command became zero at once: the reading, plus the largest sum of commands
that may still be on their way, those sent since one reaction time before the reading was taken. A
drive that follows its command after any delay up to the reaction time, or after a mixture of such
delays, is covered; one that overshoots its command passes by what it overshoots. A step that comes
later than `gap_s` by T lets the joint pass by at most v T, as the last command stays in force.

The position limit wins over the acceleration limit; it only ever makes the speed toward the limit
smaller. What `watch` finds wrong, or a device or the loop reports, latches: the velocity is ramped
to zero, or cut, and stays there; a hold alone can be `released`. The first cause is kept, of two in
one step the more serious; the reaction can become stronger, never weaker.

Like the control steps, a step only adds, multiplies, compares and takes square roots.
"""

from __future__ import annotations

import math
from enum import IntEnum
from math import isfinite, isnan

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import SOFTLY
from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.guard.causes import REACTIONS, Cause, Reaction
from rigidimeter.rig.guard.contact import contact_step
from rigidimeter.rig.guard.limits import GuardLimits, GuardState
from rigidimeter.rig.guard.watch import energy_after, found_wrong, outside


class Limited(IntEnum):
    """Which limit changed the command of a tick; the most serious one is named."""

    NOT = 0
    ACCELERATION = 1
    SPEED = 2
    POSITION = 3
    LATCHED = 4


_NO_CAUSE, _NOT_LIMITED = int(Cause.NONE), int(Limited.NOT)
_AT_LIMIT, _CUT = int(Limited.POSITION), int(Reaction.CUT)


def why_ended(limits: GuardLimits, cause: Cause, limit_time_s: float) -> str:
    """Return why an epoch does not count for what the guard did in it; empty where it counts.

    `limit_time_s` is when the position limit first held the command back, NaN if it never did.
    """
    if cause is not Cause.NONE:
        return f"the guard stopped the rig: {cause.sentence}"
    if not math.isnan(limit_time_s):
        low, high = map(deg_from_rad, limits.extent_rad)
        limit = f"±{high:g} deg" if low == -high else f"{low:.4g} or {high:.4g} deg"
        return f"the arm came to the position limit of {limit} at {limit_time_s:.3f} s"
    return ""


def guard_step(
    limits: GuardLimits,
    state: GuardState,
    requested_rad_s: float,
    torque_nm: float,
    angle_rad: float,
    velocity_rad_s: float,
    age_s: float,
    torque_age_s: float = 0.0,
    reported: int = _NO_CAUSE,
    elapsed_ticks: int = 1,
    disagreement: int = _NO_CAUSE,
) -> tuple[GuardState, float, int]:
    """Limit one velocity command.

    Parameters
    ----------
    limits : GuardLimits
    state : GuardState
    requested_rad_s : float
        What the controller asks for.
    torque_nm, angle_rad, velocity_rad_s : float
        The newest readings.
    age_s, torque_age_s : float
        How long ago the motion and the torque reading were taken.
    reported : int
        A `Cause` that a device or the loop reports.
    elapsed_ticks : int
        Ticks since the step before: more than one after a missed deadline.
    disagreement : int
        A `Cause` that `consistency` found; what this tick itself shows goes before it.

    Returns
    -------
    state : GuardState
    sent_rad_s : float
        What may go to the drive.
    limited : int
        A `Limited` value.
    """
    dt, reaction_time_s = limits.interval_s, limits.reaction_time_s
    ticks_per_s = 1.0 / dt
    ring, contact, newest, sent_before, angle, age, origin, energy, cause, reaction = state
    oldest, passed = ring.size - 1, max(elapsed_ticks, 1)
    was_latched = cause != _NO_CAUSE
    elapsed_s = passed * dt
    sum_rad = ring[newest] + max(passed - oldest, 0) * sent_before * dt  # before the ring's memory
    for _ in range(min(passed, oldest)):
        newest = newest + 1 if newest < oldest else 0
        sum_rad += sent_before * dt
        ring[newest] = sum_rad
    age += elapsed_s
    motion_finite = isfinite(angle_rad) and isfinite(velocity_rad_s) and isfinite(age_s)
    speed_now, torque_now = 0.0, 0.0
    if motion_finite:
        angle, age, speed_now = angle_rad, age_s, velocity_rad_s
    if isfinite(torque_nm):
        torque_now = torque_nm
    energy = energy_after(energy, torque_now * speed_now, elapsed_s)

    # How far the angle is from the middle of where the commands can have brought it; only where
    # that is much is it looked at more closely. The origin follows a joint that goes astray, but no
    # faster than a drive whose zero is not quite zero lets it: what is faster adds up.
    old_s = max(age, 0.0)
    ago = int(min((old_s + 0.5 * reaction_time_s) * ticks_per_s, oldest))
    commanded = float(ring[newest - ago])
    if isnan(origin):
        origin = angle - commanded
    position_error = angle - origin - commanded
    if abs(position_error) > 0.5 * limits.following_rad:
        first = int(min(max(age - reaction_time_s, 0.0) * ticks_per_s, oldest))
        last = math.ceil(min((old_s + reaction_time_s) * ticks_per_s, oldest))
        position_error = outside(ring, newest, first, last, angle - origin)
        drift = limits.drift_rad_s * elapsed_s
        origin += min(max(position_error, -drift), drift)

    found = found_wrong(
        limits,
        requested_rad_s,
        torque_nm,
        motion_finite,
        angle,
        speed_now,
        age,
        torque_age_s,
        position_error,
        energy,
        contact.ticks * dt,
        contact.three_s,
    )
    found = _most_serious(found, disagreement, reported)
    if found != _NO_CAUSE:
        if cause == _NO_CAUSE:
            cause = found
        reaction = max(reaction, REACTIONS[found])

    sent, limited = requested_rad_s, _NOT_LIMITED
    change = limits.acceleration_rad_s2 * dt
    if cause != _NO_CAUSE:
        sent, limited = 0.0, int(Limited.LATCHED)
        if was_latched:  # a ramp begun goes on in real time, however late the step
            change *= min(passed, LONGEST_BRAKING)
        if reaction == _CUT:
            change = abs(sent_before)  # nothing is left to ramp
    if sent > sent_before + change:
        sent, limited = sent_before + change, max(limited, int(Limited.ACCELERATION))
    elif sent < sent_before - change:
        sent, limited = sent_before - change, max(limited, int(Limited.ACCELERATION))
    if abs(sent) > limits.speed_rad_s:
        sent, limited = math.copysign(limits.speed_rad_s, sent), max(limited, int(Limited.SPEED))

    fastest = _fastest_toward(limits, ring, newest, math.copysign(1.0, sent), angle, old_s)
    if abs(sent) > fastest:
        sent, limited = math.copysign(fastest, sent), max(limited, int(Limited.POSITION))
    contact = contact_step(contact, limited == _AT_LIMIT, passed, dt, limits.apart_s)
    after = GuardState(ring, contact, newest, sent, angle, age, origin, energy, cause, reaction)
    return after, sent, limited


LONGEST_BRAKING = 5
"""A late step brakes for at most so many ticks at once: a loop that is later has stalled."""


def _most_serious(found: int, disagreement: int, reported: int) -> int:
    """Return which of the causes is named: a device knows better why than what was found here."""
    if REACTIONS[disagreement] > REACTIONS[found]:
        found = disagreement
    if reported != _NO_CAUSE and REACTIONS[reported] >= REACTIONS[found]:  # most ticks: neither
        found = reported
    return found


def _fastest_toward(
    limits: GuardLimits,
    ring: NDArray[np.float64],
    newest: int,
    toward: float,
    angle: float,
    old_s: float,
) -> float:
    """Return how fast the joint may be told to move toward a limit, +1 or -1.

    It can then still stop in the distance left when the next step comes late.
    """
    end = limits.highest_rad if toward > 0.0 else -limits.lowest_rad
    left = min(limits.position_rad, end) - toward * angle
    reach_s = old_s + limits.reaction_time_s
    held_s = limits.interval_s + limits.gap_s
    # Far from the limit the search is spared: at full speed, after all that can be in flight and
    # one command more, the joint could still stop.
    speed = limits.speed_rad_s
    acceleration, arrival2 = limits.acceleration_rad_s2, limits.arrival_rad_s * limits.arrival_rad_s
    faster = max(speed * speed - arrival2, 0.0)
    stopping = (speed * speed + (1.0 / SOFTLY - 1.0) * faster) / (2.0 * acceleration)
    if left >= speed * (reach_s + limits.interval_s + held_s) + stopping:
        return speed
    back = math.ceil(min(reach_s * (1.0 / limits.interval_s), ring.size - 1))
    left -= _farthest_in_flight(ring, newest, back, toward)
    softly = SOFTLY * acceleration
    before = 0.5 * arrival2 * (1.0 / softly - 1.0 / acceleration)
    return min(
        _stoppable_speed(acceleration, held_s, left),
        _stoppable_speed(softly, held_s, left + before),
    )


def _farthest_in_flight(ring: NDArray[np.float64], newest: int, back: int, toward: float) -> float:
    """Return the most, toward a limit, that was sent in any stretch up to now, at most `back`."""
    now = ring[newest]
    farthest = 0.0
    for k in range(1, back + 1):  # a place below zero counts from the ring's end
        farthest = max(farthest, toward * (now - ring[newest - k]))
    return float(farthest)


def _stoppable_speed(acceleration: float, held_s: float, distance_rad: float) -> float:
    """Return the largest v with v T + v²/(2a) ≤ d; 0 when there is no distance left."""
    if distance_rad <= 0.0:
        return 0.0
    root = math.sqrt(held_s * held_s + 2.0 * distance_rad / acceleration)
    return acceleration * (root - held_s)
